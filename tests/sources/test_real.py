"""Every real recording reads right without hints, and physics agrees."""

from pathlib import Path

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.signals.gravity_turn import turn_of_gravity
from levelhead.sources import read
from levelhead.sources.interpret.gyroscope import contradicts_deg_s, contradicts_rad_s, gyr_unit

BROAD = ["01", "03", "05", "07", "09", "11", "14", "16", "21", "24", "26", "28", "30", "32", "34", "36"]
GRAVITY_TELLS = {"01", "03", "05", "24", "26", "32", "34", "36"}  # the others are shaken too hard for the scale


def norm(values: np.ndarray) -> float:
    return float(np.nanmedian(np.linalg.norm(values, axis=1)))


def level(recording: Recording) -> np.ndarray:
    """The mean specific force in the earth frame of the reference."""
    assert recording.truth is not None
    w, v = recording.truth.quat[:, :1], recording.truth.quat[:, 1:]
    twice = 2.0 * np.cross(v, recording.acc)
    return np.asarray(np.nanmean(recording.acc + w * twice + np.cross(v, twice), axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("number", BROAD)
def test_broad(data_dir: Path, number: str) -> None:
    recording = read(next((data_dir / "broad").glob(f"{number}_*.mat")))
    assert recording.meta["units"] == {"t": "s", "acc": "m/s²", "gyr": "rad/s", "mag": "µT"}
    assert recording.rate == pytest.approx(285.714286)
    assert 9.5 < norm(recording.acc) < 10.2 and recording.mag is not None and 40.0 < norm(recording.mag) < 50.0
    truth = recording.truth
    assert truth is not None and truth.north and truth.moving is not None and 0.3 < truth.moving.mean() < 1.0
    np.testing.assert_allclose(level(recording), [0.0, 0.0, 9.83], atol=0.1)
    turn = turn_of_gravity(recording.t, recording.gyr, recording.acc)
    assert turn is not None
    if number in GRAVITY_TELLS:
        assert turn.clear and 0.7 < turn.scale < 1.1
    degrees = np.degrees(recording.gyr)
    assert gyr_unit(recording.t, recording.gyr, recording.acc).unit == "rad/s"
    assert gyr_unit(recording.t, degrees, recording.acc).unit == "deg/s"
    assert contradicts_rad_s(recording.t, degrees, recording.acc) is not None
    assert contradicts_deg_s(recording.t, degrees, recording.acc) is None


@pytest.mark.parametrize("name", ["Test02_Trial1", "Test05_Trial1", "Test07_Trial1"])
def test_repoimu(data_dir: Path, name: str) -> None:
    recording = read(data_dir / "repoimu" / f"TStick_{name}.csv")
    assert recording.meta["units"] == {"t": "s", "acc": "m/s²", "gyr": "rad/s", "mag": "relative"}
    assert recording.meta["mag_unit"] == "relative" and recording.meta["ignored"] == []
    assert 9.5 < norm(recording.acc) < 10.2 and recording.rate == pytest.approx(100.0)
    assert recording.truth is not None and not recording.truth.north
    np.testing.assert_allclose(level(recording), [0.0, 0.0, 9.8], atol=0.3)


def test_repoimu_without_reference(data_dir: Path) -> None:
    recording = read(data_dir / "repoimu" / "TStick_Test01_Static.csv")
    assert recording.truth is None and len(recording) == 18154
    assert recording.meta["units"]["gyr"] == "rad/s"
    assert any("all zero in 18154 rows" in note for note in recording.meta["notes"])


def test_vqf_sample(data_dir: Path) -> None:
    recording = read(data_dir / "samples" / "vqf_imu_data.npz")
    assert recording.meta["units"] == {"t": "s", "acc": "m/s²", "gyr": "rad/s", "mag": "µT"}
    assert recording.rate == pytest.approx(285.714286) and len(recording) == 13500


def test_xio_sample(data_dir: Path) -> None:
    recording = read(data_dir / "samples" / "xio_sensor_data.csv")
    assert recording.meta["units"] == {"t": "s", "acc": "g", "gyr": "deg/s", "mag": "uT"}
    assert 9.5 < norm(recording.acc) < 10.2
    turn = turn_of_gravity(recording.t, recording.gyr, recording.acc)
    assert turn is not None and turn.scale == pytest.approx(1.0, abs=0.05)


def test_a_list_of_trials_is_no_recording(data_dir: Path) -> None:
    with pytest.raises(LevelheadError, match="holds no samples|no gyroscope"):
        read(data_dir / "broad" / "trials.json")
