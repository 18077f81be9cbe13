"""Disturbances from outside the sensor: vibration and bumps."""

import math
from dataclasses import dataclass

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array


@dataclass(frozen=True)
class Vibration:
    """A sine, as of a motor or a propeller; above half the sample rate it aliases, as in a sensor without a filter.

    Attributes:
        amplitude: peak, in the sensor's unit (m/s² for an accelerometer).
        frequency: Hz.
        direction: (3,) axis in the sensor frame; its length does not count.
        decay: time constant in s in which it dies down to 37 %; infinite: it does not.

    Raises:
        LevelheadError: a value is out of range.
    """

    amplitude: float
    frequency: float
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    decay: float = math.inf

    def __post_init__(self) -> None:
        require_number("vibration amplitude", self.amplitude, "in the sensor's unit")
        require_number("vibration frequency", self.frequency, "Hz")
        require_number("vibration decay", self.decay, "s", positive=True, infinite=True)
        if len(self.direction) != 3 or not np.linalg.norm(self.direction) > 0.0:
            raise LevelheadError(
                f"vibration direction is {self.direction}; expected three numbers that are not all zero"
            )


@dataclass(frozen=True)
class Bumps:
    """Half-sine shocks at random times (Poisson) and in random directions.

    The half sine is the shock pulse of IEC 60068-2-27.

    Attributes:
        per_minute: how many on average.
        amplitude: peak, in the sensor's unit.
        duration: s, from the start to the end of one pulse.

    Raises:
        LevelheadError: a value is out of range.
    """

    per_minute: float
    amplitude: float
    duration: float = 0.02

    def __post_init__(self) -> None:
        require_number("bumps per minute", self.per_minute, "1/min")
        require_number("bump amplitude", self.amplitude, "in the sensor's unit")
        require_number("bump duration", self.duration, "s", positive=True)


def require_number(name: str, value: float, unit: str, *, positive: bool = False, infinite: bool = False) -> None:
    """Raise unless ``value`` is a number that is zero or more (or positive, or even infinite).

    Raises:
        LevelheadError: one sentence with the name, the value and the allowed range.
    """
    enough = value > 0.0 if positive else value >= 0.0
    if enough and (infinite or math.isfinite(value)):
        return
    wanted = "more than zero" if positive else "zero or more"
    raise LevelheadError(f"{name} is {value}; expected {wanted} {unit}")


def vibration(random: np.random.Generator, t: Array, vibration_model: Vibration) -> Array:
    """(n, 3) the sine at the times ``t`` (s), with a random phase."""
    axis = np.asarray(vibration_model.direction, dtype=float)
    phase = random.uniform(0.0, 2.0 * math.pi)
    wave = (
        vibration_model.amplitude
        * np.sin(2.0 * math.pi * vibration_model.frequency * t + phase)
        * np.exp(-(t - t[0]) / vibration_model.decay)
    )
    shaken: Array = np.outer(wave, axis / np.linalg.norm(axis))
    return shaken


def bumps(random: np.random.Generator, t: Array, shocks: Bumps) -> Array:
    """(n, 3) the shocks at the times ``t`` (s); where two overlap they add up."""
    total = np.zeros((len(t), 3))
    count = random.poisson(shocks.per_minute * (t[-1] - t[0]) / 60.0)
    for start in random.uniform(t[0], t[-1], count):
        direction = random.standard_normal(3)
        rows = slice(*np.searchsorted(t, [start, start + shocks.duration]))
        pulse = np.sin(math.pi * (t[rows] - start) / shocks.duration)
        total[rows] += shocks.amplitude * np.outer(pulse, direction / np.linalg.norm(direction))
    return total
