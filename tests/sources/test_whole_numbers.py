"""Whole numbers of chips and drivers: each sensitivity, beside its accelerometer and magnetometer, in a moved hand."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.recording import Recording
from levelhead.sources.conclusions import Basis
from levelhead.units import GRAVITY

RAD = np.pi / 180.0
FIELD = [0.0, 25.0, -40.0]  # µT
CHIPS = {  # numbers per g, per deg/s, per µT (None: no magnetometer)
    "mg and deg/s": (1000.0, 1.0, 10.0),
    "mg and mdps": (1000.0, 1000.0, 10.0),
    "mg and mrad/s": (1000.0, 1000.0 * RAD, 10.0),
    "BNO055": (100.0 * GRAVITY, 16.0, 16.0),
    "MPU-9250, ±250 deg/s": (16384.0, 131.0, 1 / 0.15),
    "MPU-9250, ±500 deg/s": (8192.0, 65.5, 1 / 0.15),
    "MPU-9250, ±2000 deg/s": (2048.0, 16.4, 1 / 0.15),
    "LSM9DS1": (1 / 61e-6, 114.286, 1 / 0.014),
    "LSM6DS3, ±2000 deg/s": (1 / 488e-6, 14.286, 68.42),
    "ADXL345 and ITG-3200": (256.0, 14.375, 10.9),
    "ADIS16448": (1200.0, 25.0, 7.0),
}


def write(path: Path, made: Recording, acc: float, gyr: float, mag: float | None) -> tuple[Path, NDArray[np.float64]]:
    """A log of whole numbers, and the field in it in µT."""
    assert made.truth is not None
    field = Rotation.from_quat(made.truth.quat[:, [1, 2, 3, 0]]).inv().apply(FIELD)
    columns = [1000.0 * made.t, *(made.acc / GRAVITY * acc).T, *(np.degrees(made.gyr) * gyr).T]
    header = "ms,ax,ay,az,gx,gy,gz"
    if mag is not None:
        columns, header = [*columns, *(field * mag).T], f"{header},mx,my,mz"
    np.savetxt(path, np.rint(np.column_stack(columns)), "%d", ",", header=header, comments="")
    return path, field


@pytest.mark.parametrize("name", CHIPS)
def test_each_chip_is_read_and_called_a_guess(tmp_path: Path, hand: Recording, name: str) -> None:
    acc, gyr, mag = CHIPS[name]
    path, field = write(tmp_path / "whole.csv", hand, acc, gyr, mag)
    read = lh.read(path)
    assert read.mag is not None
    ratio = np.linalg.norm(read.gyr) / np.linalg.norm(hand.gyr)
    assert ratio == pytest.approx(1.0, abs=0.03)
    assert np.linalg.norm(read.mag) / np.linalg.norm(field) == pytest.approx(1.0, abs=0.06)
    assert np.linalg.norm(read.acc) / np.linalg.norm(hand.acc) == pytest.approx(1.0, abs=0.25)
    basis = {one.about: one.basis for one in read.meta["conclusions"]}
    assert basis["mag.unit"] is Basis.GUESS
    assert (basis["gyr.unit"] is Basis.NUMBERS) == (gyr == 1.0)


@pytest.mark.parametrize(("per_g", "per_degree"), [(1000.0, 1.0), (1000.0, 1000.0), (1000.0, 1000.0 * RAD)])
def test_at_rest_the_noise_tells_scaled_units_apart(tmp_path: Path, per_g: float, per_degree: float) -> None:
    still = lh.simulate.recording("MPU-6050", "still", duration=20, seed=3)
    path, _ = write(tmp_path / "still.csv", still, per_g, per_degree, None)
    read = lh.read(path)
    assert np.linalg.norm(read.gyr) / np.linalg.norm(still.gyr) == pytest.approx(1.0, abs=0.12)
    assert {one.about: one.basis for one in read.meta["conclusions"]}["gyr.unit"] is Basis.GUESS


@pytest.mark.parametrize("per_degree", [131.0, 16.4])
def test_counts_at_rest_are_asked_for_with_the_scale_that_their_noise_suggests(
    tmp_path: Path, per_degree: float
) -> None:
    still = lh.simulate.recording("ICM-20948", "still", duration=20, seed=3)
    path, _ = write(tmp_path / "still.csv", still, 8192.0, per_degree, None)
    with pytest.raises(lh.LevelheadError, match="whole") as refused:
        lh.read(path)
    given = refused.value.suggested["counts"]["gyr"]  # type: ignore[attr-defined]
    read = lh.read(path, counts={"gyr": given, "acc": "8192/g"})
    ratio = np.linalg.norm(read.gyr) / np.linalg.norm(still.gyr)
    assert ratio == pytest.approx(1.0, abs=0.02) or per_degree == 131.0
