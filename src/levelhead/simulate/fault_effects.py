"""The effect of each fault on the readings of a recording, in SI units."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array
from levelhead.rotations import conjugate, rotate
from levelhead.simulate.disturbance import Bumps, Vibration, bumps, vibration

MIN_STEP = 1e-6  # s between two stamps that a fault moves together
BURST_STEP = 1e-4  # s between the samples of a burst, as a serial port at 1 Mbaud hands them over
SPIKES = 2.0  # a second
SHOCKS_PER_MINUTE, SHOCK_TIME = 60.0, 0.01  # a tool that falls on a bench
VIBRATION_RATE = 0.31  # of the sample rate: between its harmonics and half of it
SKEW = np.array([0.6, -0.64, 0.48])  # a direction in the sensor frame that no axis and no symmetry prefers
RATTLE, RATTLE_RATE = 0.3, 5.0  # of the angle of a loose mount, and Hz


@dataclass
class Readings:
    """The columns of a recording, which an effect changes in place.

    Attributes:
        t: (n,) stamps in s.
        gyr, acc, mag: (n, 3) rad/s, m/s², µT; mag None: there is none.
        rows: (n,) the row of the recording that each sample is.
    """

    t: Array
    gyr: Array
    acc: Array
    mag: Array | None
    rows: NDArray[np.intp]

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Leave out the other samples."""
        for name in ("t", "gyr", "acc", "rows"):
            setattr(self, name, getattr(self, name)[kept])
        self.mag = None if self.mag is None else self.mag[kept]

    def field(self) -> Array:
        """The magnetometer's readings, (n, 3); only for faults of a recording that has one."""
        assert self.mag is not None
        return self.mag


@dataclass(frozen=True)
class Window:
    """Rows ``first`` to before ``last``, in which a fault lasts."""

    first: int
    last: int

    @property
    def inside(self) -> slice:
        """The rows in it."""
        return slice(self.first, self.last)

    def progress(self, t: Array) -> Array:
        """(n,) 0 before it, 1 after it, and the share of its time in between."""
        start, end = t[self.first], t[min(self.last, len(t) - 1)]
        share: Array = np.clip((t - start) / max(end - start, MIN_STEP), 0.0, 1.0)
        return share


Effect = Callable[[Readings, Window, float, np.random.Generator], None]  # size in SI units


def jitter_stamps(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """Stamps off by a normal number of σ ``size`` (s), without stepping back."""
    t = readings.t[window.inside]
    moved = np.clip(t + random.normal(0.0, size, len(t)), t[0], t[-1])
    readings.t[window.inside] = _increase(moved, t[-1])


def bunch_stamps(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """Samples of ``size`` s arrive together and are stamped as they arrive."""
    t = readings.t[window.inside]
    group = np.floor((t - t[0]) / size)
    last = np.searchsorted(group, group, side="right") - 1
    step = min(BURST_STEP, float(np.diff(t).min(initial=math.inf)) / 2.0)
    readings.t[window.inside] = t[last] - step * (last - np.arange(len(t)))


def _increase(t: Array, end: float) -> Array:
    """Stamps made to increase by at least MIN_STEP, the last at most ``end``."""
    ramp = MIN_STEP * np.arange(len(t))
    made: Array = np.minimum(np.maximum.accumulate(t - ramp), end - ramp[-1]) + ramp
    return made


def drop_samples(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The share ``size`` of the rows is not there."""
    kept = np.ones(len(readings.t), dtype=np.bool_)
    kept[window.inside] = random.random(window.last - window.first) >= size
    readings.keep(kept)


def double_samples(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The share ``size`` of the rows repeats the row before, with a stamp of its own: read before it was measured."""
    fresh = np.ones(len(readings.t), dtype=np.bool_)
    fresh[window.inside] = random.random(window.last - window.first) >= size
    fresh[window.first] = True
    source = np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))
    for values in (readings.gyr, readings.acc, readings.mag):
        if values is not None:
            values[:] = values[source]


def delay_field(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The magnetometer's readings come ``size`` s late."""
    arrived = readings.t[window.inside] - size + MIN_STEP
    source = np.maximum(np.searchsorted(readings.t, arrived, side="right") - 1, 0)
    field = readings.field()
    field[window.inside] = field[source]


def slow_field(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The magnetometer gives ``size`` readings a second, and between them none."""
    number = np.floor((readings.t[window.inside] - readings.t[window.first]) * size)
    readings.field()[window.inside][np.diff(number, prepend=-1.0) == 0.0] = np.nan


def stick_gyr(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """So many axes of the gyroscope repeat one value, those first that move most."""
    _stick(readings.gyr, window, size)


def stick_acc(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """So many axes of the accelerometer repeat one value, those first that move most."""
    _stick(readings.acc, window, size)


def _stick(values: Array, window: Window, size: float) -> None:
    part = values[window.inside]
    known = part[np.isfinite(part).all(axis=1)]
    if len(known):
        liveliest = np.argsort(-known.std(axis=0))[: round(size)]
        part[:, liveliest] = known[0, liveliest]


def spike_gyr(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """Single readings of the gyroscope are off by ``size`` on an axis."""
    _spike(readings.gyr, readings.t, window, size, random)


def spike_acc(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """Single readings of the accelerometer are off by ``size`` on an axis."""
    _spike(readings.acc, readings.t, window, size, random)


def _spike(values: Array, t: Array, window: Window, size: float, random: np.random.Generator) -> None:
    last = min(window.last, len(t) - 1)
    count = max(1, round(SPIKES * float(t[last] - t[window.first])))
    rows = random.choice(np.arange(window.first, window.last), min(count, window.last - window.first), replace=False)
    values[rows, random.integers(0, 3, len(rows))] += size * random.choice([-1.0, 1.0], len(rows))


def clip_gyr(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The gyroscope's full scale is ± ``size``."""
    np.clip(readings.gyr[window.inside], -size, size, out=readings.gyr[window.inside])


def clip_acc(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The accelerometer's full scale is ± ``size``."""
    np.clip(readings.acc[window.inside], -size, size, out=readings.acc[window.inside])


def round_gyr(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """One bit of the gyroscope is ``size``."""
    readings.gyr[window.inside] = np.rint(readings.gyr[window.inside] / size) * size


def round_acc(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """One bit of the accelerometer is ``size``."""
    readings.acc[window.inside] = np.rint(readings.acc[window.inside] / size) * size


def ramp_bias(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The gyroscope's bias changes by ``size`` while it warms up, evenly, and stays there."""
    readings.gyr += size * np.outer(window.progress(readings.t), SKEW)


def shock(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """Half-sine shocks of the peak ``size`` at random times, about one a second and at least one."""
    part = readings.t[window.inside]
    blows = Bumps(SHOCKS_PER_MINUTE, size, SHOCK_TIME)
    hit = np.zeros((len(part), 3))
    while len(part) > 1 and not hit.any():  # a short window can be without one
        hit = bumps(random, part, blows)
    readings.acc[window.inside] += hit


def vibrate(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """A motor shakes the accelerometer with the amplitude ``size``, along a skew axis."""
    part = readings.t[window.inside]
    rate = (len(readings.t) - 1) / (readings.t[-1] - readings.t[0])
    motor = Vibration(size, VIBRATION_RATE * float(rate), (float(SKEW[0]), float(SKEW[1]), float(SKEW[2])))
    readings.acc[window.inside] += vibration(random, part, motor)


def pass_magnet(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """A magnet comes near and goes: its field in the sensor frame rises to ``size`` and falls, as a squared sine."""
    share = window.progress(readings.t)
    near = np.sin(math.pi * share[window.inside]) ** 2
    readings.field()[window.inside] += size * np.outer(near, SKEW)


def place_magnet(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """A magnet of ``size`` is stuck to the sensor: hard iron that was not there before."""
    readings.field()[window.inside] += size * SKEW


def loosen(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The sensor turns on its mount by ``size`` (rad) with a rattle, and stays there; the truth is that of the body."""
    share = window.progress(readings.t)
    rattle = RATTLE * np.sin(2.0 * math.pi * RATTLE_RATE * readings.t) * np.sin(math.pi * share) ** 2
    angle = size * (share * share * (3.0 - 2.0 * share) + rattle)
    turn = np.column_stack([np.cos(0.5 * angle), np.outer(np.sin(0.5 * angle), SKEW)])
    back = conjugate(turn)
    speed = np.diff(angle, prepend=angle[0]) / np.diff(readings.t, prepend=readings.t[0] - 1.0)
    readings.gyr = rotate(back, readings.gyr) + np.outer(speed, SKEW)
    readings.acc = rotate(back, readings.acc)
    readings.mag = None if readings.mag is None else rotate(back, readings.mag)


def scale_gyr(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The gyroscope's numbers are ``size`` times too large, as degrees that are taken for radians."""
    readings.gyr[window.inside] *= size


def scale_acc(readings: Readings, window: Window, size: float, random: np.random.Generator) -> None:
    """The accelerometer's numbers are ``size`` times too large, as g read as m/s²."""
    readings.acc[window.inside] *= size
