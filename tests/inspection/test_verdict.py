"""What a log is expected to be good for: from σ, without the reference."""

from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.inspection import examine
from levelhead.inspection.spikes import examine_spikes
from levelhead.inspection.verdict import Expectation, _drift, find_tilt_in_forces, verdict
from levelhead.recording import Recording


def test_heading_drifts_from_where_its_sigma_is_least():
    """A raw gyroscope's σ falls once its bias is known; from there it grows by √(13² − 5²) ° in two minutes."""
    t = np.linspace(0.0, 130.0, 1301)
    sigma = np.where(t < 10.0, 40.0 - 3.5 * t, np.sqrt(25.0 + 144.0 * (t - 10.0) / 120.0))
    assert _drift(t, sigma) == pytest.approx(6.0, rel=1e-6)
    assert _drift(t[100:], sigma[100:]) == pytest.approx(6.0, rel=1e-6)


def test_a_drift_that_would_be_written_as_0_is_not_said() -> None:
    recording = lh.simulate.recording("MPU-6050", "hand", duration=2.0, seed=1)
    words = verdict(recording, [], Expectation(0.4, None, 0.01))
    assert words == "good for tilt to 0.4°, heading is relative: no magnetometer"
    assert "drift about 3° a minute" in verdict(recording, [], Expectation(0.4, None, 3.0))


def test_a_tilt_that_nothing_can_be_built_on_is_not_good() -> None:
    recording = lh.simulate.recording("MPU-6050", "hand", duration=2.0, seed=1)
    words = verdict(recording, [], Expectation(45.0, None, 0.01))
    assert words == "tilt is known to 45° only, heading is relative: no magnetometer"


def test_one_file_with_two_columns_of_time_has_no_merged_clocks(tmp_path: Path) -> None:
    made = lh.simulate.recording("MPU-6050", "hand", duration=20.0, seed=1)
    late = np.sort(made.t + np.random.default_rng(1).uniform(0.0, 0.02, len(made.t)))
    head = "time_s,received_time_s," + ",".join(f"{name}_{axis}" for name in ("gyr", "acc") for axis in "xyz")
    np.savetxt(tmp_path / "log.csv", np.column_stack([made.t, late, made.gyr, made.acc]), "%.6f", ",", "\n", head,
               comments="")  # fmt: skip
    found = examine(lh.read(tmp_path / "log.csv")).findings
    clocks = [one.what for one in found if one.name == "several_clocks"]
    assert clocks == ["of several columns with time one was taken"]


def test_a_log_that_is_not_read_gets_its_message_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "field.csv"
    log.write_text("t,mag_x,mag_y,mag_z\n" + "".join(f"{i / 100},{i % 7},{i % 5},40\n" for i in range(300)))
    for verb in ("doctor", "fuse"):
        assert main([verb, str(log)]) == 2
        shown = capsys.readouterr()
        assert (shown.out + shown.err).count("there is no gyroscope") == 1


@pytest.mark.parametrize("tilt", [0.0, 3.0, 20.0])
def test_the_forces_of_a_track_show_its_tilt_beside_its_motion(tilt):
    """A track that is off by a constant tilt; steps of 3 m/s² and turns of 5 s, whose velocities stay bounded."""
    t = np.arange(0.0, 120.0, 0.01)
    force = np.stack([3.0 * np.sin(10.0 * t), 1.5 * np.sin(1.2 * t), np.full_like(t, 9.80665)], axis=1)
    half = 0.5 * np.radians(tilt)
    quat = np.tile([np.cos(half), 0.0, np.sin(half), 0.0], (len(t), 1))
    force[::50] = np.nan
    assert find_tilt_in_forces(t, quat, force) == pytest.approx(tilt, rel=0.05, abs=1.2)
    assert find_tilt_in_forces(t[:500], quat[:500], force[:500]) == 0.0


def test_a_knock_changes_the_rate_and_a_lost_bit_does_not():
    rng = np.random.default_rng(1)
    gyr, acc = rng.normal(0.0, 0.01, (600, 3)), rng.normal([0.0, 0.0, 9.8], 0.1, (600, 3))
    acc[[100, 300]] += [20.0, -20.0, 0.0]
    recording = Recording(np.arange(600) / 100.0, gyr, acc)
    (said,) = examine_spikes(recording)
    assert said.name == "spikes_acc" and said.severity == "warning" and "2 readings" in said.what
    gyr[100:] += 0.5
    (said,) = examine_spikes(recording)
    assert said.severity == "note" and "1 reading" in said.what
    gyr[300:] -= 0.5
    assert not list(examine_spikes(recording))
