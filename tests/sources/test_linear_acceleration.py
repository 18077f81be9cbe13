"""Linear acceleration is no specific force, however long it is: the force turned back over seconds cancels."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead import LevelheadError, Recording, read, simulate
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.units import GRAVITY

T = np.arange(0.0, 40.0, 0.01)
RATE, TILT = 2.0, 1.2  # rad/s about an axis that is tilted: gravity sweeps a cone


def _gravity() -> np.ndarray:
    """(n, 3) m/s²: the closed form of gravity in a sensor that turns at RATE about its z axis, tilted by TILT."""
    across, along = np.sin(TILT), np.cos(TILT)
    return GRAVITY * np.column_stack([across * np.cos(RATE * T), -across * np.sin(RATE * T), np.full(len(T), along)])


def _motion(size: float) -> np.ndarray:
    """(n, 3) m/s²: to and fro, without a mean, in directions that change."""
    phases = np.array([0.0, 1.0, 2.0])
    return size * np.sin(2 * np.pi * 1.7 * T[:, None] + phases) + 0.3 * size * np.sin(2 * np.pi * 3.1 * T[:, None])


def _write(path: Path, acc: np.ndarray, gyr_factor: float = 1.0) -> Path:
    gyr = np.tile([0.0, 0.0, RATE], (len(T), 1)) + 0.002 * np.random.default_rng(1).standard_normal((len(T), 3))
    rows = np.column_stack([T, acc, gyr * gyr_factor])
    np.savetxt(path, rows, "%.6f", ",", header="time,ax,ay,az,gx,gy,gz", comments="")
    return path


@pytest.mark.parametrize("size", [0.3, 1.0, 5.6, 6.5, 9.0])  # median lengths of g and m/s² among them
@pytest.mark.parametrize("gyr_factor", [1.0, 180.0 / np.pi])
def test_refused_at_any_size(tmp_path: Path, size: float, gyr_factor: float) -> None:
    path = _write(tmp_path / "log.csv", _motion(size), gyr_factor)
    with pytest.raises(LevelheadError, match="the accelerometer has gravity removed") as caught:
        read(path)
    assert "--counts" not in str(caught.value) and "--units" not in str(caught.value)


@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("unit", [1.0, GRAVITY, GRAVITY / 1000.0])
def test_the_same_motion_with_gravity_is_read(tmp_path: Path, size: float, unit: float) -> None:
    acc = _gravity() + _motion(size)
    np.testing.assert_allclose(read(_write(tmp_path / "log.csv", acc / unit)).acc, acc, atol=0.02)


def test_a_turntable_with_its_unit_is_read(tmp_path: Path) -> None:
    acc = _gravity() + np.array([40.0, 0.0, 0.0])  # centripetal: it cancels, and four times gravity
    back = read(_write(tmp_path / "log.csv", acc), units={"acc": "m/s²", "gyr": "rad/s"})
    np.testing.assert_allclose(back.acc, acc, atol=1e-5)


def _phone(folder: Path, gravity: bool) -> Path:
    stamps = 1_700_000_000_000_000_000 + (T * 1e9).astype(np.int64)
    gyr = np.tile([0.0, 0.0, RATE], (len(T), 1))
    files = {"Gyroscope": gyr, "Accelerometer": _motion(5.6)} | ({"Gravity": _gravity()} if gravity else {})
    folder.mkdir()
    for name, values in files.items():
        lines = [
            f"{stamp},{elapsed:.4f},{z:.6f},{y:.6f},{x:.6f}"
            for stamp, elapsed, (x, y, z) in zip(stamps, T, values, strict=True)
        ]
        (folder / f"{name}.csv").write_text("\n".join(["time,seconds_elapsed,z,y,x", *lines]) + "\n")
    return folder


def test_a_phones_other_file_is_named_and_joined(tmp_path: Path) -> None:
    with pytest.raises(LevelheadError, match=r"TotalAcceleration\.csv, or .* Gravity\.csv"):
        read(_phone(tmp_path / "without", gravity=False))
    back = read(_phone(tmp_path / "with", gravity=True))
    np.testing.assert_allclose(back.acc, _gravity() + _motion(5.6), atol=1e-4)


def test_free_of_gravity_under_a_written_header(tmp_path: Path) -> None:
    gyr = np.tile([0.0, 0.0, RATE], (len(T), 1))
    write_csv(Recording(T, gyr, _motion(6.5)), tmp_path / "log.csv")
    with pytest.raises(LevelheadError, match="gravity removed"):
        read(tmp_path / "log.csv")


def test_part_of_a_quaternion_is_no_accelerometer(tmp_path: Path) -> None:
    half = 0.5 * RATE * T
    quat = np.column_stack([0.1 * np.sin(half), 0.1 * np.cos(half), np.full(len(T), 0.1), np.zeros(len(T))])
    quat[:, 3] = np.sqrt(1.0 - (quat[:, :3] ** 2).sum(axis=1))
    quat[::20] *= 0.99  # interpolated in between: not of length 1 in each row
    gyr = 0.01 * np.random.default_rng(2).standard_normal((len(T), 3))
    rows = np.column_stack([_motion(0.1), gyr, quat, np.zeros(len(T))])
    np.savetxt(tmp_path / "fall.txt", rows, "%.6f")
    with pytest.raises(LevelheadError, match="its numbers show no accelerometer"):
        read(tmp_path / "fall.txt", rate=100.0)


@pytest.mark.parametrize("gravity", ["g.csv", "third.csv", "acc_gravity.csv"])
def test_gravity_under_any_name_is_added_to_user_acceleration(tmp_path: Path, gravity: str) -> None:
    """By its length, which software keeps constant; by its name it might be a gyroscope or an accelerometer."""
    moved = simulate.recording("MPU-6050", "hand", duration=20.0, seed=1)
    up = Rotation.from_quat(moved.truth.quat, scalar_first=True).inv().apply([0.0, 0.0, 9.80665])
    for name, values in (("gyro.csv", moved.gyr), ("userAcc.csv", moved.acc - up), (gravity, up)):
        table = np.column_stack([moved.t, values])
        np.savetxt(tmp_path / name, table, "%.6f", ",", header="t,x,y,z", comments="")
    np.testing.assert_allclose(read(tmp_path).acc, moved.acc, atol=1e-4)
    np.testing.assert_allclose(read(tmp_path).gyr, moved.gyr, atol=1e-4)
