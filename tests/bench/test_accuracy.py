"""The table of errors: right figures, groups as BROAD has them, and failures that are shown and not hidden."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead import LevelheadError, evaluate, filters
from levelhead.bench import Method, accuracy, contenders, methods
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.error_figures import drift, measure_errors
from levelhead.bench.groups import Group, group_of
from levelhead.bench.processes import run_parallel
from levelhead.bench.reference import align_sensor
from levelhead.engine import fuse
from levelhead.evaluate.attitude_error import split_error
from levelhead.publish.bench_tables import markdown
from levelhead.recording import Recording, Truth
from levelhead.rotations import turn_heading
from levelhead.sources import read
from levelhead.sources.formats import npz

from .conftest import headed

OURS = [Method("default"), Method("AccelTilt", filters.find("AccelTilt").params())]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of BROAD's by name, and one whose reference knows no north."""
    made = tmp_path_factory.mktemp("recordings")
    npz.write_npz(headed(30.0, 1, 12.0), made / "01_undisturbed_slow_rotation_A.npz")
    npz.write_npz(headed(130.0, 2, 12.0), made / "24_disturbed_tapping_A.npz")
    tstick = headed(230.0, 3, 12.0)
    truth = Truth(turn_heading(tstick.truth.quat, 1.0), north=False)
    npz.write_npz(Recording(tstick.t, tstick.gyr, tstick.acc, tstick.mag, truth), made / "TStick_Test02.npz")
    return made


def with_contender(monkeypatch, name, run):
    monkeypatch.setitem(contenders.BY_NAME, name, contenders.Contender(name, run))
    return [*OURS, Method(name)]


@pytest.mark.parametrize(
    "name, group",
    [
        ("03_undisturbed_slow_rotation_C", Group("BROAD", "rotation slow")),
        ("21_undisturbed_fast_combined", Group("BROAD", "combined fast")),
        ("18_undisturbed_fast_translation_with_breaks_B", Group("BROAD", "translation fast")),
        ("26_disturbed_phone_vibration_A", Group("BROAD", "vibration")),
        ("28_disturbed_stationary_magnet_A", Group("BROAD", "magnet nearby")),
        ("32_disturbed_attached_magnet_1cm", Group("BROAD", "magnet attached")),
        ("37_disturbed_office_A", Group("BROAD", "office")),
        ("39_disturbed_mixed", Group("BROAD", "mixed")),
        ("TStick_Test05_Trial1", Group("RepoIMU", "RepoIMU TStick")),
        ("flight", Group("here", "here")),
    ],
)
def test_groups_by_name(name, group):
    assert group_of(Path("here") / f"{name}.mat") == group


@pytest.mark.parametrize("share, least, most", [(1.0, 0.0, 0.01), (0.1, 0.3, 1.0)])
def test_a_heading_that_drifts_is_held_against_its_own_start(share, least, most):
    """Random walks whose σ is right are right everywhere; if it is told ten times too small they are not."""
    count, step = 20000, np.radians(0.1)
    t, zero = np.arange(count) / 100.0, np.zeros(count)
    still = np.stack([zero + 1.0, zero, zero, zero], axis=1)
    truth = Truth(still, north=False)
    recording = Recording(t, np.zeros((count, 3)), np.tile([0.0, 0.0, 9.8], (count, 1)), None, truth)
    sigma = np.tile(share * step * np.sqrt(np.arange(count))[:, None], (1, 3)) + 1e-4
    beyond = []
    for seed in range(8):
        half = 0.5 * np.cumsum(np.random.default_rng(seed).normal(0.0, step, count))
        found = measure_errors(recording, np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1), False, sigma)
        beyond.append(found.beyond_heading)
    assert least <= np.mean(beyond) <= most


def test_groups_by_trials_json(tmp_path):
    trials = {"trials": {"x": {"groups": ["all_trials", "undisturbed", "translation", "slow", "no_breaks"]}}}
    (tmp_path / "trials.json").write_text(json.dumps(trials))
    assert group_of(tmp_path / "x.mat") == Group("BROAD", "translation slow")
    (tmp_path / "trials.json").write_text('{"trials": [1]}')
    with pytest.raises(LevelheadError, match=r"trials\.json is not BROAD's list"):
        group_of(tmp_path / "x.mat")


def test_names_and_trials_json_agree_on_all_of_broad(data_dir):
    broad = data_dir / "broad"
    for name in json.loads((broad / "trials.json").read_text())["trials"]:
        assert group_of(broad / f"{name}.mat") == group_of(Path(f"{name}.mat")), name


@pytest.mark.slow
def test_figures_are_those_of_evaluate(folder):
    result = accuracy([folder], OURS)
    assert [entry.name for entry in result.entries][-1] == "TStick_Test02"
    for (i, j), outcome in result.outcomes.items():
        recording = read(result.entries[i].path)
        score = evaluate.evaluate(recording, fuse(recording, OURS[j].params))
        if j == 0 or i == 2:  # AccelTilt gives no heading: evaluate would remove an offset, here all are treated alike
            assert outcome.figures[:3] == pytest.approx((score.total, score.heading, score.tilt))
        assert outcome.figures.aligned <= outcome.figures.total + 1e-9
    totals = [result.outcomes[i, 0].figures.total for i in range(2)]
    assert result.table[0]["all: total"] == pytest.approx(np.mean(totals))  # TStick knows no north, so it is not in
    assert result.table[0]["all: worst total"] == max(totals)
    assert "over all 2 of BROAD" in result.notes[0]


def test_without_magnetometers_all_recordings_count_and_heading_is_relative(folder):
    result = accuracy([folder], OURS, with_mag=False)
    assert result.main == [0, 1, 2] and result.figure == "tilt"
    for outcome in result.outcomes.values():
        assert outcome.figures.total == outcome.figures.aligned


@pytest.mark.slow
def test_several_processes_find_the_same(folder):
    alone, together = (accuracy([folder], OURS, jobs=jobs) for jobs in (1, 2))
    assert alone.long == together.long


@pytest.mark.slow
def test_a_process_that_dies_is_one_sentence():
    with pytest.raises(LevelheadError, match="a process that ran a method died; --jobs 1 shows which"):
        list(run_parallel(os._exit, [3, 3], 2))


def test_a_crash_is_shown_and_stops_nothing(folder, monkeypatch):
    def crash(recording):
        raise RuntimeError("no convergence\nat all")

    result = accuracy([folder], with_contender(monkeypatch, "vqf.Crash", crash))
    assert result.cell(2, result.columns[1]) == "–" and result.table[2]["all: total"] is None
    assert any("vqf.Crash failed: RuntimeError (no convergence) on 01_" in note for note in result.notes)
    assert result.table[0]["all: total"] < 10.0
    json.dumps(result.to_dict(), allow_nan=False)


def test_nan_is_shown_as_nan_and_a_mean_without_it_carries_a_star(folder, monkeypatch):
    def lost(recording):
        quat = fuse(recording, "Kalman").quat.copy()
        quat[200:] = np.nan if len(recording) and recording.meta["source"].count("tapping") else quat[200:]
        return quat

    result = accuracy([folder], with_contender(monkeypatch, "vqf.Lost", lost))
    cells = {column.key: result.cell(2, column) for column in result.columns}
    assert cells["tapping"] == "NaN" and not cells["rotation slow"].endswith("*")
    assert cells["all: total"].endswith("*")
    assert any("NaN at 1,000 samples, the first at 2 s, on 24_disturbed_tapping_A" in note for note in result.notes)


@pytest.mark.parametrize("wrong", [np.ones((5, 4)), np.ones((1200, 4))])
def test_what_is_no_orientation_is_a_failure(folder, monkeypatch, wrong):
    result = accuracy([folder], with_contender(monkeypatch, "vqf.Wrong", lambda recording: wrong))
    assert any("vqf.Wrong failed: gave" in note for note in result.notes)


def test_missing_readings_leave_contenders_out_and_say_so(tmp_path, monkeypatch):
    whole = headed(10.0, 1, 10.0)
    gyr = whole.gyr.copy()
    gyr[300:310] = np.nan
    npz.write_npz(Recording(whole.t, gyr, whole.acc, whole.mag, whole.truth), tmp_path / "holes.npz")
    result = accuracy([tmp_path], with_contender(monkeypatch, "vqf.VQF", lambda recording: pytest.fail("was run")))
    assert result.outcomes[0, 0].figures.tilt < 5.0
    assert any(
        "vqf.VQF left out, knowing no missing reading (10 readings are missing), on holes" in n for n in result.notes
    )


def test_a_package_that_is_not_there_is_one_line(monkeypatch):
    monkeypatch.setattr(contenders, "find_spec", lambda name: None if name == "ahrs" else object())
    there, absent = methods.all_methods()
    assert absent == ["ahrs is not installed: pip install 'levelhead[bench]'"]
    assert not [method for method in there if method.package == "ahrs"]
    with pytest.raises(LevelheadError, match=r"ahrs\.EKF cannot run, because ahrs is not installed: pip install"):
        methods.find_method("ahrs.EKF")


def test_drift_is_what_heading_does_in_a_minute():
    t = np.arange(0.0, 200.0, 0.1)
    turning = np.radians(0.1 * t + 175.0)  # 6° a minute, over the ±180° line
    quat = np.stack([np.cos(turning / 2), 0 * t, 0 * t, np.sin(turning / 2)], axis=1)
    assert drift(t, split_error(quat), t > 5.0) == pytest.approx(6.0, abs=1e-6)
    shorter = drift(t[:800], split_error(quat[:800]), t[:800] > 5.0)  # half of the 75 s that count
    assert shorter == pytest.approx(6.0 * 37.5 / 60.0, rel=0.01)
    assert drift(t[:60], split_error(quat[:60]), t[:60] > 5.0) is None


def test_a_constant_heading_offset_is_in_total_and_not_in_aligned():
    recording = headed(0.0, 1, 10.0)
    found = measure_errors(recording, turn_heading(recording.truth.quat, np.radians(7.0)), absolute=True)
    assert found[:4] == pytest.approx((7.0, 7.0, 0.0, 0.0), abs=1e-5)
    assert measure_errors(recording, turn_heading(recording.truth.quat, 1.0), absolute=False).total == pytest.approx(
        0.0, abs=1e-5
    )


def test_markdown_has_a_cell_for_every_column(folder):
    result = accuracy([folder], OURS)
    lines = [line for line in markdown(result).splitlines() if line.startswith("|")]
    assert len(lines) == 4 and len({line.count("|") for line in lines}) == 1


@pytest.mark.full
@pytest.mark.slow
def test_vqf_on_broad_is_what_is_known_of_it(data_dir):
    if not contenders.BY_NAME["vqf.VQF"].installed:
        pytest.skip("vqf is not installed")
    names = ("vqf.VQF", "vqf.offlineVQF")
    result = accuracy([data_dir / "broad"], [Method(name) for name in names])
    one, offline = result.table
    assert one["all: total"] == pytest.approx(2.37, abs=0.01)
    assert one["all: tilt"] == pytest.approx(0.75, abs=0.01)
    assert one["all: aligned"] == pytest.approx(1.97, abs=0.01)
    assert offline["all: tilt"] == pytest.approx(0.56, abs=0.01)
    assert offline["all: aligned"] == pytest.approx(1.20, abs=0.01)


def circling() -> Recording:
    """A recording without a magnetometer whose reference's body stands aside of the sensor."""
    made = headed(0.0, 4, 60.0, rotation=60.0)
    return Recording(made.t, made.gyr, made.acc, None, made.truth)


def test_the_sensors_frame_is_found_from_the_gyroscope():
    made = circling()
    aside = Rotation.from_rotvec(np.radians([2.0, -1.5, 1.0]))
    turned = (Rotation.from_quat(made.truth.quat[:, [1, 2, 3, 0]]) * aside).as_quat()[:, [3, 0, 1, 2]]
    frame = align_sensor(Recording(made.t, made.gyr + 0.01, made.acc, None, Truth(turned, north=False)))
    assert frame is not None and frame.angle == pytest.approx(np.degrees(aside.magnitude()), abs=0.2)
    back = np.abs((frame.turn(turned) * made.truth.quat).sum(axis=1))
    assert np.degrees(2.0 * np.arccos(np.minimum(back, 1.0))).max() < 0.2  # of 2.7


def test_layout_of_euroc_and_tumvi(tmp_path):
    made = circling()
    folder = tmp_path / "V1_01"
    for name in ("imu0", "mocap0"):
        (folder / "mav0" / name).mkdir(parents=True)
    stamps = np.round(made.t * 1e9) + 1.4e18
    np.savetxt(folder / "mav0/imu0/data.csv", np.column_stack([stamps, made.gyr, made.acc]), "%.9f", ",", header="t")
    reference = np.column_stack([stamps, np.zeros((len(stamps), 3)), made.truth.quat])[::2]
    np.savetxt(folder / "mav0/mocap0/data.csv", reference, "%.9f", ",", header="t")
    assert list_logs([tmp_path]) == [folder]
    found = load_recording(folder, True)
    assert found.mag is None and not found.truth.north and len(found) == len(made)
    assert np.abs(found.t - made.t).max() < 1e-6
    known = ~np.isnan(found.truth.quat[:, 0])
    assert known.mean() > 0.99
    assert np.abs(np.abs((found.truth.quat * made.truth.quat).sum(axis=1)[known]) - 1.0).max() < 1e-4


def test_arrays_with_a_reference(tmp_path):
    made = circling()
    good = np.arange(len(made)) > 100
    place = tmp_path / "fiumarg"
    place.mkdir()
    w, x, y, z = made.truth.quat.T
    half = np.sqrt(0.5)  # the reference's y is up: its frame is ours turned by -90° about x
    quat = half * np.stack([w + x, x - w, y + z, z - y], axis=1)
    np.savez(place / "a.npz", t=made.t, gyr=made.gyr, acc=made.acc, q_ref_sensor=quat, ref_ok=good)
    found = load_recording(place / "a.npz", True)
    assert np.isnan(found.truth.quat[:101]).all() and not found.truth.north
    assert np.abs(np.abs((found.truth.quat * made.truth.quat).sum(axis=1)[101:]) - 1.0).max() < 1e-9


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"ref_ok": None}, "no ref_ok"),
        ({"t": None, "acc": None}, "no t, acc"),
        ({"ref_ok": np.ones(7)}, r"\(1200, 4\) and ref_ok \(7,\)"),
        ({"q_ref_sensor": np.ones(1200)}, r"shape \(1200,\)"),
    ],
)
def test_arrays_that_are_not_all_there(tmp_path, changed, sentence):
    made = {"t": np.arange(1200) / 100, "gyr": np.ones((1200, 3)), "acc": np.ones((1200, 3))}
    made |= {"q_ref_sensor": np.ones((1200, 4)), "ref_ok": np.ones(1200)} | changed
    np.savez(tmp_path / "a.npz", **{name: array for name, array in made.items() if array is not None})
    with pytest.raises(LevelheadError, match=sentence):
        load_recording(tmp_path / "a.npz", True)


@pytest.mark.parametrize(
    ("imu", "reference", "sentence"),
    [
        ("0,1,2,3,4,5", "0,0,0,0,1,0,0,0", "imu0.data.csv has 2 rows of 6 numbers; expected 2 or more of 7"),
        ("0,1,2,3,4,5,6", "0,0,0,0,1", "mocap0.data.csv has 2 rows of 5 numbers; expected 2 or more of 8"),
        ("0,1,2,3,4,5,6", "0,0,0,x", "mocap0.data.csv is damaged"),
    ],
)
def test_folders_that_are_torn(tmp_path, imu, reference, sentence):
    for name, line in (("imu0", imu), ("mocap0", reference)):
        (tmp_path / "mav0" / name).mkdir(parents=True)
        (tmp_path / "mav0" / name / "data.csv").write_text(f"#t\n{line}\n{line}\n", "utf-8")
    with pytest.raises(LevelheadError, match=sentence):
        load_recording(tmp_path, True)


def test_ratios_to_a_peer(folder, monkeypatch):
    """Twice the tilt error of a perfect peer's is a ratio; σ is judged by the samples beyond four of it."""

    def run(recording):
        return turn_heading(fuse(recording, "Kalman").quat, 0.3)

    monkeypatch.setitem(contenders.BY_NAME, "vqf.VQF", contenders.Contender("vqf.VQF", run))
    result = accuracy([folder], [Method("default"), Method("vqf.VQF")])
    (ratios,) = result.ratios
    assert [row["data"] for row in ratios.table] == ["BROAD", "RepoIMU", "all"]
    total = ratios.table[-1]
    assert total["ratio"] == pytest.approx(np.exp(np.mean([np.log(one.value) for one in ratios.recordings])))
    for one in ratios.recordings:
        assert one.ours == one.figures.rotated < result.outcomes[0, 0].figures.total + 10.0
        assert 0.0 <= one.figures.beyond_tilt <= 1.0
    assert "default beside vqf.VQF" in markdown(result) and "| BROAD | 2 |" in markdown(result)
    json.dumps(result.to_dict(), allow_nan=False)


def test_places_that_hold_nothing(tmp_path):
    with pytest.raises(LevelheadError, match="there is no folder"):
        list_logs([tmp_path / "nowhere"])
    with pytest.raises(LevelheadError, match="holds no recordings"):
        list_logs([tmp_path])
    with pytest.raises(LevelheadError, match="no folder to look into"):
        list_logs([])
