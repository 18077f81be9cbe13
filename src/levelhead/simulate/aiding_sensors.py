"""Slower sensors beside the IMU: a barometer and a satellite receiver on the same moving body."""

import math
from dataclasses import dataclass

import numpy as np

from levelhead import atmosphere
from levelhead.errors import LevelheadError
from levelhead.recording import Array, Gnss, Pressure
from levelhead.simulate.disturbance import require_number
from levelhead.simulate.motion import Motion
from levelhead.simulate.noise import generator

BAROMETER, SATELLITES = 3, 4  # streams of random numbers; the IMU has 0 to 2


@dataclass(frozen=True)
class Barometer:
    """A barometer's errors; the defaults are a BMP280 (Bosch BST-BMP280-DS001 rev 1.14) at ultra high resolution.

    Attributes:
        rate: readings a second, Hz; table 7: 26.3 with 16-fold oversampling.
        noise: 1σ of a reading in Pa; table 12, 16-fold oversampling without filter.
        offset: 1σ of the constant error in Pa; table 2: absolute accuracy typ. ±1 hPa, read as 3σ.
        drift: random walk in Pa/√s, TYPICAL and of no data sheet: weather changes by about 1 hPa in an
            hour or two, more than 1.5 Pa/K over some kelvins (table 2) do.
        bit: resolution in Pa; table 4.

    Raises:
        LevelheadError: a value is out of range.
    """

    rate: float = 25.0
    noise: float = 1.3
    offset: float = 33.0
    drift: float = 0.3
    bit: float = 0.16

    def __post_init__(self) -> None:
        for name, unit in (("rate", "Hz"), ("noise", "Pa"), ("offset", "Pa"), ("drift", "Pa/√s"), ("bit", "Pa")):
            require_number(f"the barometer's {name}", getattr(self, name), unit, positive=name in ("rate", "noise"))


@dataclass(frozen=True)
class Receiver:
    """A satellite receiver's errors: white, as after a differential correction.

    Without one a receiver's position errors last for minutes, and a filter that is given their σ weights their mean too
    much.

    Attributes:
        rate: fixes a second, Hz.
        position: 1σ in m, every axis.
        velocity: 1σ in m/s, every axis.

    Raises:
        LevelheadError: a value is out of range.
    """

    rate: float = 1.0
    position: float = 2.0
    velocity: float = 0.1

    def __post_init__(self) -> None:
        for name, unit in (("rate", "Hz"), ("position", "m"), ("velocity", "m/s")):
            require_number(f"the receiver's {name}", getattr(self, name), unit, positive=True)


def pressure(motion: Motion, sensor: Barometer | None = None, seed: int = 0, *, ground: float = 100.0) -> Pressure:
    """Readings of a barometer along a motion.

    Args:
        motion: the truth.
        sensor: its errors; None: a BMP280.
        seed: zero or more.
        ground: height in m, in the standard atmosphere, where the motion's z is 0.

    Returns:
        Readings with stamps of their own, and the noise as their σ.

    Raises:
        LevelheadError: the seed is negative.
    """
    sensor = sensor or Barometer()
    t = _stamps(motion, sensor.rate)
    random = generator(seed, BAROMETER)
    clean = atmosphere.pressure_at(ground + np.interp(t, motion.t, motion.position[:, 2]))
    drift = np.cumsum(random.standard_normal(len(t))) * sensor.drift / math.sqrt(sensor.rate)
    read = clean + sensor.offset * random.standard_normal() + drift + sensor.noise * random.standard_normal(len(t))
    if sensor.bit > 0.0:
        read = np.round(read / sensor.bit) * sensor.bit
    return Pressure(t, read, sensor.noise)


def gnss(motion: Motion, sensor: Receiver | None = None, seed: int = 0) -> Gnss:
    """Readings of a satellite receiver along a motion: position and velocity, in the motion's earth frame.

    Args:
        motion: the truth.
        sensor: its errors; None: 2 m and 0.1 m/s, once a second.
        seed: zero or more.

    Raises:
        LevelheadError: the seed is negative.
    """
    sensor = sensor or Receiver()
    t = _stamps(motion, sensor.rate)
    random = generator(seed, SATELLITES)
    true = [np.stack([np.interp(t, motion.t, column) for column in v.T], 1) for v in (motion.position, motion.velocity)]
    noise = random.standard_normal((2, len(t), 3))
    position = true[0] + sensor.position * noise[0]
    return Gnss(t, position, true[1] + sensor.velocity * noise[1], sensor.position, sensor.velocity)


def _stamps(motion: Motion, rate: float) -> Array:
    """From half an interval after the start on: clocks of their own, which do not tick with the IMU's."""
    span = float(motion.t[-1] - motion.t[0])
    stamps: Array = motion.t[0] + (np.arange(math.floor(span * rate)) + 0.5) / rate
    if len(stamps) == 0:
        raise LevelheadError(f"{span:g} s of motion are too short for a sensor at {rate:g} Hz; expected more")
    return stamps
