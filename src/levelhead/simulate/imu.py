"""An inertial measurement unit on a moving body: from a Motion to the Recording that the chip would have written."""

import math
from dataclasses import dataclass, field

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording, Truth, real_array
from levelhead.simulate.motion import Motion
from levelhead.simulate.triad_errors import TriadErrors, apply_errors

Vector = tuple[float, float, float]

# Central Europe: 19 µT towards magnetic north and 45 µT down, a dip of 67° (IGRF gives 22 to 67 µT over the earth).
EARTH_FIELD: Vector = (0.0, 19.0, -45.0)
GYR, ACC, MAG = range(3)


def _finite(name: str, values: tuple[float | Vector, ...], shape: tuple[int, ...], unit: str) -> Array:
    array = real_array(name, values, shape, unit)
    if np.isnan(array).any():
        raise LevelheadError(f"{name} is {values}; expected finite numbers in {unit}")
    return array


@dataclass(frozen=True)
class Iron:
    """Effect of the board and its surroundings, which turn with the sensor, on the magnetic field: soft·B + hard.

    These are values and not deviations, because they belong to one board.

    Attributes:
        hard: (3,) hard iron in µT, sensor frame: magnets and currents.
        soft: (3, 3) soft iron by rows, without unit: iron that bends the field; the identity for none.

    Raises:
        LevelheadError: wrong shape or not finite.
    """

    hard: Vector = (0.0, 0.0, 0.0)
    soft: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        for name, shape, unit in (("hard", (3,), "µT"), ("soft", (3, 3), "no unit")):
            _finite(f"{name} iron", getattr(self, name), shape, unit)


@dataclass(frozen=True)
class Imu:
    """An inertial measurement unit: the error model of each of its sensors. ``Imu()`` is a perfect one.

    Attributes:
        gyr: gyroscope, rad/s.
        acc: accelerometer, m/s².
        mag: magnetometer, µT, or None if there is none.
        iron: hard and soft iron around the magnetometer.
        name: its name in ``Recording.meta``.
    """

    gyr: TriadErrors = field(default_factory=TriadErrors)
    acc: TriadErrors = field(default_factory=TriadErrors)
    mag: TriadErrors | None = None
    iron: Iron = field(default_factory=Iron)
    name: str = "perfect"


def observe(motion: Motion, imu: Imu, seed: int = 0, *, field: Vector = EARTH_FIELD) -> Recording:
    """The recording of ``imu`` when it is moved along ``motion``.

    The gyroscope sees the body rate, the accelerometer the specific force Rᵀ(a + g·up), the magnetometer
    soft·Rᵀ·field + hard; then each goes through its own error model in the order that ``triad.read`` states.

    Args:
        motion: the truth.
        imu: the sensors.
        seed: zero or more; the same seed gives the same bits, and it does not share any with the seed of ``motion``.
        field: (3,) the earth's magnetic field in µT, east, north, up.

    Returns:
        A Recording with truth.quat, truth.position, truth.velocity and truth.bias, the whole bias of the gyroscope in
        rad/s (turn-on bias + bias instability + random walk). ``meta["true_errors"]`` holds for "gyr", "acc" and "mag"
        the error "matrix" (3, 3) and the "turn_on_bias" (3,) of this seed, which a calibration should find.

    Raises:
        LevelheadError: the field is not three finite numbers, or the seed is negative.
    """
    earth = _finite("the magnetic field", field, (3,), "µT: east, north, up")
    readings = {
        "gyr": apply_errors(imu.gyr, motion.gyr, motion.t, seed, GYR),
        "acc": apply_errors(imu.acc, motion.specific_force, motion.t, seed, ACC),
    }
    if imu.mag is not None:
        bent = motion.to_body(earth) @ np.asarray(imu.iron.soft).T + np.asarray(imu.iron.hard)
        readings["mag"] = apply_errors(imu.mag, bent, motion.t, seed, MAG)
    return Recording(
        motion.t,
        readings["gyr"].values,
        readings["acc"].values,
        readings["mag"].values if imu.mag is not None else None,
        # y is magnetic north by convention; a field with an east component means that the user's y is another one.
        Truth(
            motion.quat,
            readings["gyr"].bias,
            None,
            math.isclose(earth[0], 0.0, abs_tol=1e-9) and earth[1] > 0.0,
            motion.position,
            motion.velocity,
        ),
        {
            "source": "simulate",
            "sensor": imu.name,
            "seed": seed,
            "true_errors": {
                name: {"matrix": one.matrix, "turn_on_bias": one.turn_on_bias} for name, one in readings.items()
            },
        },
    )
