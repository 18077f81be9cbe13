"""A verb over a corpus, in this process: rows, resumption, refusals."""

import json
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
from tests.reference.corpus import GOOD

import levelhead as lh
from levelhead.corpora import runner, work
from levelhead.corpora.results import list_parts
from levelhead.errors import LevelheadError
from levelhead.rotations import product

TIMES = ["read_s", "run_s"]
pytestmark = pytest.mark.slow


def corpus(*arguments, **options):
    return lh.corpus(*arguments, workers=0, **options)


def test_a_row_is_what_fuse_and_evaluate_give(recordings, tmp_path):
    table = corpus(recordings, "fuse", "ESKF", lh.EKF(acc_tau=3.0), out=tmp_path / "out", tracks=True)
    assert table.num_rows == 2 * GOOD + 1
    row = next(
        row for row in table.to_pylist() if row["recording"] == "walk/unit1_day3.csv" and row["method"] == "ESKF"
    )
    recording = lh.read(recordings / "walk" / "unit1_day3.csv")
    track = lh.fuse(recording)
    error = lh.evaluate.evaluate(recording, track)
    assert row["tilt_deg"] == pytest.approx(error.tilt, rel=1e-9)
    assert row["sigma_tilt_end_deg"] == np.degrees(np.hypot(*track.sigma[-1, :2]))
    assert row["samples"] == 400 and row["group"] == "walk" and row["version"] == lh.__version__
    assert json.loads(row["calibration"]) == track.calibration.to_dict()
    assert row["error"] is None and not row["transient"]
    written = pq.read_table(tmp_path / "out" / "tracks" / "walk" / "unit1_day3.csv.ESKF.parquet")
    assert np.array_equal(written["qw"].to_numpy(), track.quat[:, 0])


def test_a_file_that_cannot_be_read_is_a_row_with_the_reason(recordings):
    (row,) = [row for row in corpus(recordings).to_pylist() if row["error"]]
    assert row["recording"] == "walk/broken.csv" and str(recordings) in row["error"] and len(row["error"]) > 20


def test_what_is_done_is_not_done_again(recordings, tmp_path, monkeypatch):
    folder = tmp_path / "copy"
    shutil.copytree(recordings, folder)
    first = corpus(folder, out=tmp_path / "out")
    ran = []
    honest = work._rows
    monkeypatch.setattr(work, "_rows", lambda job, source, *rest: ran.append(source.name) or honest(job, source, *rest))
    assert corpus(folder, out=tmp_path / "out").equals(first) and ran == []
    shutil.copy(folder / "walk" / "unit1_day1.csv", folder / "walk" / "broken.csv")
    again = corpus(folder, out=tmp_path / "out")
    assert ran == ["walk/broken.csv"] and again.num_rows == first.num_rows
    assert again.filter(again["error"].is_valid()).num_rows == 0
    (part,) = list_parts(tmp_path / "out")
    assert pq.read_metadata(part).num_rows == GOOD + 1  # without doubles, for whoever reads the folder


def test_results_of_other_places_stay(recordings, tmp_path):
    assert corpus(recordings / "hand", out=tmp_path).num_rows == 3
    assert corpus(recordings / "walk", out=tmp_path).num_rows == 4
    (part,) = list_parts(tmp_path)
    assert pq.read_table(part)["recording"].to_pylist() == sorted(pq.read_table(part)["recording"].to_pylist())
    assert pq.read_metadata(part).num_rows == 7


def test_a_file_that_was_deleted_leaves_its_rows_marked(recordings, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(recordings / "hand", folder)
    corpus(folder, out=tmp_path / "out")
    (folder / "unit1_day0.csv").unlink()
    rows = corpus(folder, out=tmp_path / "out").to_pylist()
    assert [row["recording"] for row in rows if row["gone"]] == ["unit1_day0.csv"] and len(rows) == 3
    (part,) = list_parts(tmp_path / "out")
    assert pq.read_table(part)["gone"].to_pylist() == [True, False, False]
    shutil.copytree(recordings / "hand", folder, dirs_exist_ok=True)
    assert not any(corpus(folder, out=tmp_path / "out")["gone"].to_pylist())


def test_a_truth_whose_third_axis_is_not_up_is_left_out_as_by_fuse(tmp_path):
    recording = lh.simulate.recording("MPU-6050", "hand", duration=4.0, rate=100.0, seed=0)
    quarter = np.array([0.5**0.5, -(0.5**0.5), 0.0, 0.0])  # z up to y up
    for name, quat in (("z", recording.truth.quat), ("y", product(quarter, recording.truth.quat))):
        np.savez(tmp_path / f"{name}.npz", t=recording.t, gyr=recording.gyr, acc=recording.acc, q_ref_sensor=quat,
                 ref_ok=np.ones(len(quat), bool))  # fmt: skip
    found = {row["recording"]: row for row in corpus(tmp_path).to_pylist()}
    assert found["y.npz"]["tilt_deg"] is None and found["y.npz"]["error"] is None
    assert found["z.npz"]["tilt_deg"] < 15.0  # begun in motion; y up would be off by 90°
    assert lh.read(tmp_path / "y.npz").truth is None


def test_a_run_that_was_ended_goes_on(recordings, tmp_path, monkeypatch):
    whole = corpus(recordings, out=tmp_path / "whole").drop_columns(TIMES)
    honest, ran = runner.run_batch, []

    def ends(job, batch, *rest):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(batch)
        return honest(job, batch, *rest)

    monkeypatch.setattr(runner, "run_batch", ends)
    monkeypatch.setattr("levelhead.corpora.plan.MAX_RECORDINGS", 2)
    with pytest.raises(KeyboardInterrupt):
        corpus(recordings, out=tmp_path / "out")
    assert sum(pq.read_metadata(path).num_rows for path in list_parts(tmp_path / "out")) == 4
    monkeypatch.setattr(runner, "run_batch", honest)
    assert corpus(recordings, out=tmp_path / "out").drop_columns(TIMES).equals(whole)


def test_a_folder_of_other_results_is_refused(recordings, tmp_path):
    corpus(recordings, "fuse", "Mahony", out=tmp_path / "out")
    kept = [path.read_bytes() for path in list_parts(tmp_path / "out")]
    others = {
        "fuse with methods Mahony, not of fuse with methods Madgwick;": {"methods": ("fuse", "Madgwick")},
        r"fuse with methods Mahony, not of fuse with methods Mahony\(kp=2\);": {"methods": ("fuse", lh.Mahony(kp=2.0))},
        "'fuse', not of 'doctor';": {"methods": ("doctor",)},
        "fuse with magnetometer true, not of fuse with magnetometer false;": {"magnetometer": False},
        "fuse with guard acc_gate 100.0, not of fuse with guard acc_gate 50.0;": {"guard": lh.Guard(acc_gate=50.0)},
        "fuse with hints rate none, not of fuse with hints rate 100.0;": {"hints": {"rate": 100.0}},
    }
    for words, options in others.items():
        what = {"methods": ("fuse", "Mahony")} | options
        with pytest.raises(LevelheadError, match=f"holds results of {words} .*name another folder"):
            corpus(recordings, *what.pop("methods"), out=tmp_path / "out", **what)
    assert [path.read_bytes() for path in list_parts(tmp_path / "out")] == kept


def test_a_full_disk_ends_the_run_and_loses_nothing(recordings, tmp_path, monkeypatch):
    import errno

    monkeypatch.setattr(runner, "FLUSH", 0.0)
    monkeypatch.setattr("levelhead.corpora.plan.MAX_RECORDINGS", 2)
    honest, wrote = pq.write_table, []

    def full(table, path, **options):
        if len(wrote) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        wrote.append(path)
        honest(table, path, **options)

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(LevelheadError, match="No space left on device; earlier rows stay"):
        corpus(recordings, out=tmp_path / "out")
    assert len(list_parts(tmp_path / "out")) == 2 and not list((tmp_path / "out" / "rows").glob(".*"))
    monkeypatch.setattr(pq, "write_table", honest)
    assert corpus(recordings, out=tmp_path / "out").num_rows == GOOD + 1


def test_doctor_noise_and_bench_have_rows_of_their_own(recordings, tmp_path):
    found = corpus(recordings / "hand", "doctor").to_pylist()
    assert [row["verdict"] for row in found] == [lh.inspect(row["url"]).verdict for row in found]
    assert corpus(recordings / "walk", "noise").column("error").null_count == 0  # never still: a sentence each
    both = corpus(recordings / "hand", "bench", "default", "Mahony").to_pylist()
    assert [row["method"] for row in both] == ["Mahony", "default"] * 3 and all(row["tilt_deg"] > 0.0 for row in both)


def test_a_calibration_is_the_prior_of_the_sensors_next_recording(recordings, tmp_path):
    rows = corpus(recordings, sensor="(unit1)_", order="day([0-9])", out=tmp_path / "out").to_pylist()
    rows = sorted((row for row in rows if row["sensor"]), key=lambda row: row["position"])
    assert [row["recording"][-5] for row in rows] == list("012345")
    prior = None
    for row in rows:
        track = lh.fuse(lh.read(row["url"]), prior=prior)
        assert json.loads(row["calibration"]) == track.calibration.to_dict()
        prior = track.calibration
    assert rows[0]["prior"] == "" and len({row["prior"] for row in rows}) == len(rows)


@pytest.mark.parametrize("kind", ["csv", "parquet", "metadata"])
def test_a_column_tells_sensor_and_time(tmp_path, kind):
    """In CSV, in Parquet, and in a Parquet file's metadata; the names of the files say the contrary order."""
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    for i, (serial, date) in enumerate([("A7", "2026-03-02"), ("B1", "2026-01-15"), ("A7", "2026-02-28")]):
        recording = lh.simulate.recording("MPU-6050", "hand", duration=2.0, rate=100.0, seed=i)
        names = ["t [s]", *(f"{s}_{a} [{u}]" for s, u in (("gyr", "rad/s"), ("acc", "m/s^2")) for a in "xyz")]
        columns = dict(zip(names, np.column_stack([recording.t, recording.gyr, recording.acc]).T.tolist(), strict=True))
        words = {"serial": serial, "date": date}
        if kind != "metadata":
            columns |= {name: [word] * len(recording) for name, word in words.items()}
        table = pa.table(columns)
        if kind == "csv":
            rows = [",".join(map(str, row.values())) for row in table.to_pylist()]
            (tmp_path / f"log{i}.csv").write_text("\n".join([",".join(columns), *rows]) + "\n")
        else:
            pq.write_table(table.replace_schema_metadata(words), tmp_path / f"log{i}.parquet")
    found = corpus(tmp_path, sensor="column:serial", order="column:date").to_pylist()
    assert [row["error"] for row in found] == [None] * 3
    assert [(row["recording"][:4], row["sensor"], row["position"]) for row in found] == [
        ("log0", "A7", 1), ("log1", "B1", 0), ("log2", "A7", 0),
    ]  # fmt: skip
    assert [bool(row["prior"]) for row in found] == [True, False, False]
    with pytest.raises(LevelheadError, match=r"log0\..* has no column model for its sensors or its time"):
        corpus(tmp_path, sensor="column:model")


def test_a_recording_that_comes_later_changes_those_after_it_only(recordings, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(recordings / "walk", folder)
    (folder / "broken.csv").unlink()
    kept = folder / "unit1_day3.csv"
    kept.rename(tmp_path / "kept.csv")
    options = {"sensor": "(unit1)_", "out": tmp_path / "out"}
    before = {row["recording"]: row for row in corpus(folder, **options).to_pylist()}
    (tmp_path / "kept.csv").rename(kept)
    after = {row["recording"]: row for row in corpus(folder, **options).to_pylist()}
    fresh = corpus(folder, sensor="(unit1)_").drop_columns(TIMES).to_pylist()
    assert after["unit1_day1.csv"] == before["unit1_day1.csv"]  # with its times: it was not run again
    assert after["unit1_day5.csv"]["calibration"] != before["unit1_day5.csv"]["calibration"]
    assert [{key: row[key] for key in fresh[0]} for row in after.values()] == fresh


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fly",), "a corpus has no verb 'fly'"),
        (("doctor", "EKF"), "takes no filter"),
        (("smooth", "Mahony"), "has no smoother; ESKF has"),
    ],
)
def test_wrong_wishes(recordings, arguments, words):
    with pytest.raises(LevelheadError, match=words):
        corpus(recordings, *arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sensor": "unit1"}, "has 0 groups; expected one"),
        ({"sensor": "(["}, "is not a regular expression"),
        ({"sensor": "(nobody)"}, "no name of a recording fits"),
        ({"order": "(1)"}, "name them"),
        ({"tracks": True}, "tracks need a folder"),
    ],
)
def test_wrong_options(recordings, options, words):
    with pytest.raises(LevelheadError, match=words):
        corpus(recordings, **options)


def test_filters_that_learn_nothing_take_no_prior(recordings):
    with pytest.raises(LevelheadError, match="takes one filter that learns its sensor, ESKF"):
        corpus(recordings, "fuse", "Mahony", sensor="(unit1)")


def test_a_folder_with_a_file_for_each_sensor_is_one_recording(tmp_path):
    """As phone apps write them; one folder of EuRoC's layout among them was all that the benchmark knew."""
    whole = lh.simulate.recording("MPU-6050", "hand", duration=4.0, rate=100.0, seed=1)
    place = tmp_path / "logs" / "phone"
    place.mkdir(parents=True)
    for name, values, unit in (("Gyroscope", whole.gyr, "rad/s"), ("Accelerometer", whole.acc, "m/s^2")):
        rows = [f"{t},{x},{y},{z}" for t, (x, y, z) in zip(whole.t, values, strict=True)]
        (place / f"{name}.csv").write_text("\n".join([f"Time (s),X ({unit}),Y ({unit}),Z ({unit})", *rows]) + "\n")
    (row,) = lh.corpus([tmp_path / "logs"], "fuse", out=tmp_path / "results", workers=1).to_pylist()
    assert row["error"] is None
    assert row["recording"] == "phone"
