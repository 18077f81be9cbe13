"""``levelhead fuse LOG``: the main job, its files, its summary, its hints."""

import importlib
import math
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead import filters, sources
from levelhead.calibration import Calibration
from levelhead.cli.options import guard_names
from levelhead.engine import fuse
from levelhead.guard import Guard

COLUMNS = "t [s],qw,qx,qy,qz,roll [deg],pitch [deg],yaw [deg]"
BIAS = "bias_x [rad/s],bias_y [rad/s],bias_z [rad/s]"
SIGMA = "sigma_east [rad],sigma_north [rad],sigma_up [rad]"


def table(path: Path) -> tuple[str, np.ndarray]:
    head = path.read_text().partition("\n")[0]
    return head, np.loadtxt(path, delimiter=",", skiprows=1)


@pytest.mark.slow
def test_track_picture_and_summary(levelhead, logs, tmp_path):
    said = levelhead("fuse", logs / "hand.csv", "-o", tmp_path / "new" / "folder")
    assert (said.code, said.err) == (0, "")
    folder = tmp_path / "new" / "folder"
    names = ["hand-calibration.png", "hand-track.csv", "hand-track.png"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert (folder / "hand-track.png").read_bytes().startswith(b"\x89PNG")
    head, rows = table(folder / "hand-track.csv")
    assert head == f"{COLUMNS},{BIAS},{SIGMA},health"
    recording = sources.read(logs / "hand.csv")
    track = fuse(recording, filters.default())
    np.testing.assert_array_equal(rows[:, 0], recording.t)
    np.testing.assert_array_equal(rows[:, 1:5], track.quat)
    np.testing.assert_allclose(rows[:, 5:8], track.euler(), atol=1e-6)
    lines = said.out.splitlines()
    assert len(lines) <= 20 and "800 samples" in lines[0]
    for words in (
        "filter",
        "errors of the sensor known",
        "roll",
        "°/s at the end",
        "tilt",
        "against truth",
        "written:",
    ):
        assert words in said.out


def test_parquet(levelhead, logs, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert levelhead("fuse", logs / "hand.csv", "--format", "parquet", "--no-plot", "-o", tmp_path).code == 0
    written = parquet.read_table(tmp_path / "hand-track.parquet")
    assert ",".join(written.column_names) == f"{COLUMNS},{BIAS},{SIGMA},health"
    assert [path.name for path in tmp_path.iterdir()] == ["hand-track.parquet"]


@pytest.mark.parametrize("log, magnetometer", [("hand.npz", False), ("nine.npz", True)])
def test_without_a_name_the_best_filter(levelhead, logs, tmp_path, log, magnetometer):
    facts = levelhead("fuse", logs / log, "--no-plot", "--json", "-o", tmp_path).json
    best = filters.default()
    assert facts["magnetometer"] is magnetometer
    assert facts["filter"] == filters.of(best).name and facts["params"] == best._asdict()


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda flt: flt.name)
def test_every_filter_by_name_as_json(levelhead, logs, tmp_path, flt):
    said = levelhead("fuse", logs / "nine.npz", "--filter", flt.name.lower(), "--no-plot", "--json", "-o", tmp_path)
    assert (said.code, said.err) == (0, "")
    facts = said.json
    assert facts["filter"] == flt.name and facts["params"] == flt.params()._asdict()
    assert facts["samples"] == 800 and facts["score"]["samples"] == 800
    assert facts["written"] == [str(tmp_path / "nine-track.csv")]
    _, rows = table(tmp_path / "nine-track.csv")
    np.testing.assert_allclose(np.linalg.norm(rows[:, 1:5], axis=1), 1.0, atol=1e-12)
    assert np.isfinite(rows).all()


def test_parameters_are_set(levelhead, logs, tmp_path):
    words = ["fuse", logs / "nine.npz", "--no-plot", "--json", "-o", tmp_path]
    facts = levelhead(*words, "--filter", "kalman", "--set", "r_measure=0.5", "--set", "q_per_sample=true").json
    assert facts["params"]["r_measure"] == 0.5 and facts["params"]["q_per_sample"] is True
    facts = levelhead(*words, "--filter", "Complementary", "--set", "alpha=0.98").json
    assert facts["params"]["tau"] == pytest.approx(0.49)
    best = levelhead(*words, "--set", "velocity_density=3").json["params"]
    assert best == filters.default()._asdict() | {"velocity_density": 3.0}


def test_the_guard_is_set_and_taken_away(levelhead, logs, tmp_path):
    words = ["fuse", logs / "nine.npz", "--no-plot", "-o", tmp_path]
    recording = sources.read(logs / "nine.npz")
    plain = levelhead(*words)
    assert "\nguard " not in plain.out and "\nat rest " in plain.out  # it stands for the first three seconds
    set_ = levelhead(*words, "--guard", "rest_time=1", "--guard", "acc_range=156.9", "--json").json
    guard = Guard(rest_time=1.0, acc_range=156.9)
    assert set_["guard"] == guard._asdict()
    np.testing.assert_array_equal(
        table(tmp_path / "nine-track.csv")[1][:, 1:5], fuse(recording, guard=guard).to_north().quat
    )
    off = levelhead(*words, "--guard", "off")
    assert "off: every reading reached the filter" in off.out and "at rest" not in off.out
    np.testing.assert_array_equal(
        table(tmp_path / "nine-track.csv")[1][:, 1:5], fuse(recording, guard=None).to_north().quat
    )
    assert levelhead(*words, "--guard", "OFF", "--json").json["guard"] is None


def test_the_shell_completes_thresholds():
    names = guard_names(None)
    assert next(iter(names)) == "off" and list(names)[1:] == [f"{name}=" for name in Guard._fields]
    assert all(names.values())


def test_health_in_words_and_rest_apart(levelhead, tmp_path):
    """Rest for 6 s of 8, then a shake with a reading missing."""
    t = np.arange(800) * 0.01
    gyr = np.random.default_rng(1).normal(0.0, 1e-3, (800, 3))
    gyr[600:] += 2.0
    acc = np.random.default_rng(2).normal(0.0, 1e-2, (800, 3)) + [0.0, 0.0, 9.81]
    acc[700] = np.nan
    lines = ["t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"]
    lines += [",".join("" if np.isnan(x) else f"{x:.6f}" for x in row) for row in np.column_stack([t, gyr, acc])]
    (tmp_path / "shake.csv").write_text("\n".join(lines), encoding="utf-8")
    words = ["fuse", tmp_path / "shake.csv", "--units", "gyr=rad/s", "--no-plot", "-o", tmp_path]
    said = levelhead(*words).out
    assert "of the time, where the bias was measured" in said
    assert "1 sample (0.12 %): accelerometer missing, tilt not corrected" in said
    facts = levelhead(*words, "--json").json
    assert facts["at_rest"] == pytest.approx(0.71, abs=0.03)
    assert facts["health"].pop("accelerometer missing, tilt not corrected") == 1
    doubts = {"accelerating, accelerometer not used", "a turn was not measured, tilt is being corrected"}
    assert set(facts["health"]) <= doubts, "it turns, says one; the other sees no turn"


@pytest.mark.parametrize("declination, side", [("3.5", "east"), ("-12", "west")])
def test_declination_turns_the_track_to_true_north(levelhead, logs, tmp_path, declination, side):
    words = ["fuse", logs / "nine.npz", "--no-plot", "-o", tmp_path]
    before = levelhead(*words, "--json").json
    old = table(tmp_path / "nine-track.csv")[1]
    said = levelhead(*words, "--declination", declination)
    assert f"true; magnetic north lies {declination.lstrip('-')}° {side} of it" in said.out
    new = table(tmp_path / "nine-track.csv")[1]
    turned = (new[:, 7] - old[:, 7] + float(declination) + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(turned, 0.0, atol=3e-6)
    facts = levelhead(*words, "--declination", declination, "--json").json
    assert facts["declination_deg"] == pytest.approx(float(declination)) and before["declination_deg"] is None
    assert facts["score"] == before["score"]  # the filter's errors, in the frame of the reference


def test_heading_points_to_the_north_that_was_found(levelhead, tmp_path):
    """The magnetometer of a drone as it comes: heading begins up to half a turn off."""
    recording = lh.simulate.recording("ICM-20948", "drone", duration=60.0, seed=2)
    np.savez(tmp_path / "log.npz", t=recording.t, gyr=recording.gyr, acc=recording.acc, mag=recording.mag)
    words = ["fuse", tmp_path / "log.npz", "--no-plot", "-o", tmp_path]
    found, track = levelhead(*words, "--json").json, fuse(recording)
    np.testing.assert_array_equal(table(tmp_path / "log-track.csv")[1][:, 1:5], track.to_north().quat)
    assert found["north"]["heading_relative_to"] == "magnetic north" and found["north"]["azimuth_deg"] == 0.0
    assert "magnetic, where yaw is 90°, σ 4" in levelhead(*words).out
    relative = levelhead(*words, "--no-north")
    np.testing.assert_array_equal(table(tmp_path / "log-track.csv")[1][:, 1:5], track.quat)
    assert re.search(r"north +magnetic, where yaw is −58\.\d°, σ 4.*: heading is relative to the start", relative.out)
    sigma = math.degrees(track.to_north().sigma_heading[-1])
    assert found["sigma_east_north_up_rad"][2] == pytest.approx(math.radians(sigma)) and sigma > 3.0
    true = levelhead(*words, "--declination", "4", "--json").json  # from magnetic north, and not from the start
    assert math.remainder(true["end"]["yaw_deg"] - found["end"]["yaw_deg"] + 4.0, 360.0) == pytest.approx(0.0, abs=1e-9)
    assert true["north"] == {"azimuth_deg": pytest.approx(4.0), "sigma_deg": found["north"]["sigma_deg"]} | {
        "heading_relative_to": "true north"
    }


def test_iron_of_four_times_the_field_is_learned_and_not_left_out(levelhead, tmp_path):
    """The raw readings do not turn with the body; without their offset they do, and ESKF learns it."""
    assert levelhead("simulate", "hand", "--sensor", "ICM-20948", "--seed", "1", "-o", tmp_path / "log.csv").code == 0
    facts = levelhead("fuse", tmp_path / "log.csv", "--no-plot", "--json", "-o", tmp_path).json
    assert facts["magnetometer"] and facts["north"]["heading_relative_to"] == "magnetic north"
    assert facts["score"]["heading"] < 1.5 and not any("left out" in note for note in facts["notes"])


def test_a_sensor_that_did_not_turn_has_no_north(levelhead, refused, tmp_path):
    recording = lh.simulate.recording("ICM-20948", "still", duration=5.0, seed=1)
    np.savez(tmp_path / "log.npz", t=recording.t, gyr=recording.gyr, acc=recording.acc, mag=recording.mag)
    words = ["fuse", tmp_path / "log.npz", "--no-plot", "-o", tmp_path]
    assert "heading is relative to the start; turn the sensor all the way round, and over" in levelhead(*words).out
    assert "turn it all the way round once" in refused(*words, "--declination", "4")


def test_a_log_without_truth_has_no_score_and_json_says_null(levelhead, logs, tmp_path):
    facts = levelhead("fuse", logs / "plain.csv", "--filter", "AccelTilt", "--json", "-o", tmp_path).json
    assert facts["score"] is None and facts["bias_rad_s"] is None and facts["declination_deg"] is None
    assert facts["written"] == [str(tmp_path / f"plain-track.{kind}") for kind in ("csv", "png")]


def test_missing_samples_never_become_nan(levelhead, logs, tmp_path):
    lines = (logs / "plain.csv").read_text(encoding="utf-8").splitlines()
    for row in range(300, 320):
        lines[row] = lines[row].split(",")[0] + ",,,,,,"
    (tmp_path / "holes.csv").write_text("\n".join(lines), encoding="utf-8")
    said = levelhead("fuse", tmp_path / "holes.csv", "--no-plot", "--json", "-o", tmp_path)
    assert said.json["incomplete_samples"] == 20 and sum(said.json["health"].values()) >= 20
    assert np.isfinite(table(tmp_path / "holes-track.csv")[1]).all()


def test_hints(levelhead, tmp_path):
    """Raw counts in columns with names that say nothing, and no time stamps."""
    t = np.arange(300) * 0.01
    counts = np.stack([131 * 30 * np.cos(3 * t), 0 * t, 0 * t, 0 * t, 0 * t, 16384 + 0 * t], axis=1).round()
    np.savetxt(tmp_path / "raw.csv", counts, "%d", ",", header="u,v,w,a,b,c", comments="")
    words = ["--map", "gyr=u,v,w", "--map", "acc=a,b,c", "--counts", "gyr=131/deg/s", "--counts", "acc=16384/g"]
    said = levelhead(
        "fuse", tmp_path / "raw.csv", *words, "--rate", "100", "--filter", "GyroIntegration", "--json", "--no-plot",
        "-o", tmp_path,
    )  # fmt: skip
    assert said.json["rate_hz"] == pytest.approx(100.0)
    roll = table(tmp_path / "raw-track.csv")[1][:, 5]
    np.testing.assert_allclose(roll, 10.0 * np.sin(3 * t), atol=0.4)  # ∫ 30 °/s cos 3t


def test_units_that_the_header_does_not_say_and_a_hint_against_it(levelhead, logs, tmp_path):
    text = (logs / "plain.csv").read_text(encoding="utf-8")
    head, _, rows = text.partition("\n")
    degrees = tmp_path / "bare.csv"
    degrees.write_text("t,gx,gy,gz,ax,ay,az\n" + rows)
    said = levelhead("fuse", degrees, "--units", "gyr=rad/s", "--no-plot", "--json", "-o", tmp_path)
    assert not any("gyroscope: taken" in note for note in said.json["notes"])
    wrong = tmp_path / "wrong.csv"
    wrong.write_text(head.replace("rad/s", "mdeg/s") + "\n" + rows, encoding="utf-8")
    said = levelhead("fuse", wrong, "--units", "gyr=rad/s", "--no-plot", "-o", tmp_path)
    assert re.search(r"^note +gyroscope: the hint gives rad/s where the file has mdeg/s", said.out, re.MULTILINE)


def test_the_magnetometer_can_be_left_out(levelhead, tmp_path):
    lines = ["t_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g,mx_uT,my_uT,mz_uT"]
    lines += [f"{i / 100},0,0,0,0,0,1,0,20,-40" for i in range(100)]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    words = ["fuse", tmp_path / "log.csv", "--no-plot", "--json", "-o", tmp_path]
    assert levelhead(*words).json["magnetometer"] is True
    assert levelhead(*words, "--map", "mag=").json["magnetometer"] is False


def test_without_matplotlib_the_track_is_written_all_the_same(levelhead, logs, tmp_path, monkeypatch):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == "matplotlib" else find(name, *a))
    said = levelhead("fuse", logs / "hand.csv", "-o", tmp_path)
    assert said.code == 0 and "no picture: it needs matplotlib" in said.out
    assert [path.name for path in tmp_path.iterdir()] == ["hand-track.csv"]


@pytest.mark.slow
@pytest.mark.parametrize("samples", [1, 2, 9, 10])
def test_a_log_of_a_few_samples_is_refused(levelhead, logs, tmp_path, samples):
    lines = (logs / "plain.csv").read_text("utf-8").splitlines()[: samples + 1]
    (tmp_path / "short.csv").write_text("\n".join(lines), "utf-8")
    said = levelhead("fuse", tmp_path / "short.csv", "-o", tmp_path)
    if samples < 10:
        assert said.code == 2 and f"too short: {samples} sample" in said.err and "expected 10 or more" in said.err
    else:
        assert (said.code, said.err) == (0, "") and "10 samples," in said.out and "−0.00" not in said.out


@pytest.mark.slow
def test_what_a_run_learned_is_said_drawn_saved_and_taken_up(levelhead, logs, tmp_path):
    file = tmp_path / "sensor.json"
    words = ["fuse", logs / "nine.npz", "--filter", "ESKF", "-o", tmp_path]
    said = levelhead(*words, "--save-calibration", file, "--verbose")
    assert (said.code, said.err) == (0, "")
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "nine-calibration.png", "nine-track.csv", "nine-track.png", "sensor.json",
    ]  # fmt: skip
    assert "\nlearned (± 1σ)  gyroscope bias x " in said.out and "could not be learned from this motion:" in said.out
    found = Calibration.read(file)
    recording = sources.read(logs / "nine.npz")
    assert found.to_dict() == fuse(recording, filters.ESKF()).to_north().calibration.to_dict()
    second = levelhead(*words, "--prior", file, "--no-plot", "--json").json
    assert second["calibration"] == fuse(recording, filters.ESKF(), prior=found).to_north().calibration.to_dict()
    assert second["calibration"] != found.to_dict()
    other = levelhead("fuse", logs / "nine.npz", "--no-plot", "--json", "--filter", "EKF", "-o", tmp_path).json
    assert other["calibration"] is None


def test_a_calibration_needs_a_filter_that_learns_and_a_file_that_is_one(refused, logs, tmp_path):
    log, out = logs / "nine.npz", tmp_path / "out"
    words = refused("fuse", log, "--filter", "EKF", "-o", out, "--save-calibration", tmp_path / "sensor.json")
    assert words.startswith("--save-calibration needs a filter that learns its sensor") and "--filter ESKF" in words
    assert "cannot read the calibration sensor.json" in refused(
        "fuse", log, "--filter", "Kalman", "-o", out, "--prior", "sensor.json"
    )
    assert "cannot read the calibration" in refused(
        "fuse", log, "--filter", "ESKF", "-o", out, "--prior", tmp_path / "nowhere.json"
    )
    assert "is not a calibration" in refused("fuse", log, "--filter", "ESKF", "-o", out, "--prior", log)
    assert not out.exists()
    missing = tmp_path / "no" / "sensor.json"
    assert "there is no folder" in refused(
        "fuse", log, "--filter", "ESKF", "--no-plot", "-o", out, "--save-calibration", missing
    )


def test_parquet_is_proposed_where_csv_is_slow(levelhead, logs, tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.import_module("levelhead.cli.fuse"), "MIN_SLOW_ROWS", 500)
    said = levelhead("fuse", logs / "hand.csv", "--no-plot", "-o", tmp_path)
    assert "800 rows are large for CSV: --format parquet" in said.out
    said = levelhead("fuse", logs / "hand.csv", "--no-plot", "--format", "parquet", "-o", tmp_path)
    assert "large for CSV" not in said.out


def test_a_dry_run_prints_the_conclusions_and_a_command_that_guesses_nothing(levelhead, logs, tmp_path):
    rows = np.genfromtxt(logs / "plain.csv", delimiter=",", skip_header=1)[:, :7]
    rows[:, 1:4] *= 180 / np.pi * 131
    rows[:, 4:7] *= 16384 / 9.80665
    bare = tmp_path / "bare.csv"
    np.savetxt(bare, rows, ["%.4f", *["%.0f"] * 6], ",", header="t,gx,gy,gz,ax,ay,az", comments="")
    said = levelhead("fuse", bare, "--dry-run", "-o", tmp_path / "out")
    assert said.code == 0 and re.search(r"^acc\.unit +guess +accelerometer: raw counts, 16384 per g", said.out, re.M)
    assert re.search(r"^gyr\.columns +header +gyroscope: gx, gy, gz, by name$", said.out, re.M)
    command = said.out.splitlines()[-1].removeprefix("command  levelhead ")
    again = levelhead(*shlex.split(command), "--dry-run", "--json")
    assert not [one for one in again.json["logs"][0]["conclusions"] if one["basis"] == "guess"]
    assert not (tmp_path / "out").exists()
    assert "command  levelhead smooth" in levelhead("smooth", bare, "--dry-run").out


def test_frame_axes_heading_and_motion_in_the_file(levelhead, logs, tmp_path):
    words = ["--frame", "ned", "--axes", "Z:90", "--heading", "40", "--motion", "--output-rate", "10", "--no-plot"]
    said = levelhead("fuse", logs / "hand.csv", "-f", "Mahony", *words, "-o", tmp_path)
    assert (
        said.code == 0
        and "axes          of the body: the sensor's -y,x,z" in said.out
        and "NED in the file" in said.out
    )
    head, rows = table(tmp_path / "hand-track.csv")
    names = head.split(",")
    assert names[1:8] == [
        "ned_qw", "ned_qx", "ned_qy", "ned_qz", "ned_roll [deg]", "ned_pitch [deg]", "ned_yaw [deg]"
    ]  # fmt: skip
    recording = sources.read(logs / "hand.csv")
    track = fuse(recording, filters.find("Mahony").params()).mount("-y,x,z").to_frame("NED").with_heading(40.0)
    chosen = np.searchsorted(track.t, rows[:, 0])
    np.testing.assert_allclose(np.abs(np.sum(rows[:, 1:5] * track.quat[chosen], axis=1)), 1.0, atol=1e-12)
    assert rows[0, names.index("ned_yaw [deg]")] == pytest.approx(40.0, abs=1e-5)
    place = names.index("earth_acceleration_down [m/s²]")
    np.testing.assert_allclose(rows[:, place], track.earth_acceleration().value[chosen, 2], atol=1e-7)
    assert "sigma_linear_acceleration_z [m/s²]" in names and "rate_x [rad/s]" in names
    facts = levelhead("fuse", logs / "hand.csv", "--axes", "Z:90", "--no-plot", "--json", "-o", tmp_path).json
    assert facts["frame"] == "ENU" and facts["axes"] == "-y,x,z"


@pytest.mark.parametrize(
    "words, said",
    [
        (["--axes", "ZYX:1,2"], "not 3 numbers"),
        (["--heading", "400"], "within ±360"),
        (["--heading", "4", "--declination", "3"], "give one of them"),
    ],
)
def test_no_such_placement(levelhead, logs, tmp_path, words, said):
    found = levelhead("fuse", logs / "hand.csv", *words, "-o", tmp_path)
    assert found.code == 2 and said in found.err and not list(tmp_path.iterdir())


def test_a_mounting_is_drawn(levelhead, tmp_path):
    said = levelhead("axes", "--axes", "-y,x,z", "-o", tmp_path)
    assert said.out.startswith("-y,x,z\n") and (tmp_path / "mounting-axes.png").read_bytes().startswith(b"\x89PNG")
    assert levelhead("axes").code == 2
