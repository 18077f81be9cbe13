"""Motion in three dimensions with closed-form truth: attitude, body rate, position, velocity and acceleration agree.

Everything is a sum of sinusoids of one smooth inner clock u(t), which stops in the rest phase and then speeds up
to run with t. Derivatives follow from the chain rule, so nothing is integrated and nothing drifts.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError, nearest
from levelhead.recording import Array, real_array, time_array
from levelhead.rotations import conjugate, rotate
from levelhead.simulate.disturbance import require_number
from levelhead.simulate.noise import generator
from levelhead.simulate.triad_errors import PerAxis
from levelhead.units import GRAVITY

Band = tuple[float, float]

SINUSOIDS = 5  # per axis: enough that the motion does not visibly repeat within minutes
START_UP = 2.0  # s from rest to full motion


@dataclass(frozen=True, eq=False)
class Motion:
    """The truth about a moving body, sampled evenly; all values are those at the instant t, not means over a sample.

    Attributes:
        t: (n,) s, evenly spaced, at least two.
        quat: (n, 4) wxyz, unit, body frame to earth frame (x east, y north, z up).
        gyr: (n, 3) true angular rate in rad/s, body frame.
        position: (n, 3) m, earth frame.
        velocity: (n, 3) m/s, earth frame.
        acceleration: (n, 3) m/s², earth frame, without gravity.

    Raises:
        LevelheadError: a shape does not fit, or t is not even.
    """

    t: Array
    quat: Array
    gyr: Array
    position: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", time_array(self.t))
        n = len(self.t)
        steps = np.diff(self.t)
        if n < 2 or np.ptp(steps) > 1e-3 * steps.mean():
            raise LevelheadError(f"the motion has {n} uneven samples; expected at least 2, evenly spaced in time")
        units = {"gyr": "rad/s", "position": "m", "velocity": "m/s", "acceleration": "m/s²"}
        object.__setattr__(self, "quat", real_array("quat", self.quat, (n, 4), "unit quaternions wxyz"))
        for name, unit in units.items():
            object.__setattr__(self, name, real_array(name, getattr(self, name), (n, 3), unit))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def rate(self) -> float:
        """Samples a second."""
        return float((len(self.t) - 1) / (self.t[-1] - self.t[0]))

    @property
    def specific_force(self) -> Array:
        """(n, 3) reading of an ideal accelerometer, m/s², body frame: f = Rᵀ(a + g·up)."""
        return self.to_body(self.acceleration + np.array([0.0, 0.0, GRAVITY]))

    def to_body(self, vectors: Array) -> Array:
        """Earth-frame vectors, (n, 3) or one (3,) for all samples, seen in the body frame: Rᵀ·v, (n, 3)."""
        return rotate(conjugate(self.quat), vectors)


class Style(NamedTuple):
    """A style of motion: root mean square per axis, and the band of its frequencies.

    Attributes:
        rotation: (3,) rms rates of roll, pitch and yaw, °/s.
        rotation_band: lowest and highest frequency, Hz.
        translation: (3,) rms acceleration to the east, north and up, m/s².
        translation_band: lowest and highest frequency, Hz.
    """

    rotation: tuple[float, float, float]
    rotation_band: Band
    translation: tuple[float, float, float]
    translation_band: Band


# Round figures of the right order, not fitted to any data set. Low frequencies at a high rate make large angles: a hand
# reaches every attitude, a drone leans by some 20°, a robot stays level and turns.
STYLES = {
    "still": Style((0.0, 0.0, 0.0), (0.1, 1.0), (0.0, 0.0, 0.0), (0.1, 1.0)),
    "hand": Style((60.0, 45.0, 60.0), (0.05, 1.0), (1.5, 1.5, 1.5), (0.3, 3.0)),
    "walking": Style((25.0, 20.0, 30.0), (0.1, 2.0), (1.0, 1.0, 2.5), (0.9, 4.0)),
    "drone": Style((60.0, 60.0, 40.0), (0.2, 2.0), (2.0, 2.0, 1.5), (0.1, 1.0)),
    "robot": Style((1.0, 1.0, 25.0), (0.05, 0.5), (0.4, 0.4, 0.05), (0.05, 0.5)),
}


def motion(
    seed: int = 0,
    duration: float = 60.0,
    rate: float = 100.0,
    *,
    style: str = "hand",
    rotation: PerAxis | None = None,
    rotation_band: Band | None = None,
    translation: PerAxis | None = None,
    translation_band: Band | None = None,
    still: float = 3.0,
) -> Motion:
    """A random, smooth and exactly consistent motion that begins level, at rest and heading north.

    After ``still`` seconds the body sets off within 2 s, smoothly: attitude, body rate and velocity are C² there.
    The same seed gives the same motion at every sample rate.

    Args:
        seed: zero or more.
        duration: s.
        rate: samples a second, Hz.
        style: "hand", "walking", "drone", "robot" or "still" (which never sets off); later arguments change parts of
            it.
        rotation: rms rates of roll, pitch and yaw in °/s, one number or three.
        rotation_band: lowest and highest frequency of the rotation in Hz.
        translation: rms acceleration to the east, north and up in m/s², one number or three.
        translation_band: lowest and highest frequency of the translation in Hz.
        still: rest at the beginning in s; there the specific force is exactly (0, 0, 9.80665) m/s².

    Raises:
        LevelheadError: an unknown style (the nearest is named), or a value out of range.
    """
    require_number("still", still, "s")
    base = _style(style)
    turn_band, move_band = rotation_band or base.rotation_band, translation_band or base.translation_band
    rotation = base.rotation if rotation is None else rotation
    translation = base.translation if translation is None else translation
    t = _times(duration, rate)
    clock = _clock(t - still)
    angle, angle_rate, _ = _waves(generator(seed, 0, 0), clock, "rotation", rotation, turn_band, 1)
    place = _waves(generator(seed, 0, 1), clock, "translation", translation, move_band, 2)
    quat, gyr = attitude(np.radians(angle), np.radians(angle_rate))
    return Motion(t, quat, gyr, *place)


def _style(name: str) -> Style:
    if name.lower() not in STYLES:
        raise LevelheadError(f"'{name}' is not a motion of levelhead; {nearest(name, STYLES)}")
    return STYLES[name.lower()]


def _times(duration: float, rate: float) -> Array:
    require_number("duration", duration, "s", positive=True)
    require_number("rate", rate, "Hz", positive=True)
    n = round(duration * rate)
    if n < 2:
        raise LevelheadError(f"{duration} s at {rate} Hz are {n} samples; expected at least 2")
    return np.arange(n) / rate


class _Clock(NamedTuple):
    """The inner clock u(t) in s, and its first and second derivative."""

    u: Array
    speed: Array
    acceleration: Array


def _clock(since: Array) -> _Clock:
    """A clock that is 0 before t = 0 and runs with t from ``START_UP`` on.

    Between them its speed is the quintic smoothstep 10x³ − 15x⁴ + 6x⁵, whose first and second derivatives vanish at
    both ends (Perlin 2002, Improving noise): u is C³, so attitude and position are C³, their rates C².
    """
    x = np.clip(since / START_UP, 0.0, 1.0)
    speed = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    u = START_UP * x**4 * (2.5 - 3.0 * x + x * x) + np.maximum(since - START_UP, 0.0)
    return _Clock(u, speed, 30.0 * x * x * (1.0 - x) ** 2 / START_UP)


def _waves(
    random: np.random.Generator, clock: _Clock, name: str, rms: PerAxis, band: Band, order: int
) -> tuple[Array, Array, Array]:
    """Three sums of sinusoids that begin at zero, with their first and second time derivatives, (n, 3) each.

    ``rms`` is that of the derivative of this ``order`` once the clock runs: rates for rotations, accelerations for
    translations, because sensors measure these.
    """
    levels = np.broadcast_to(np.asarray(rms, dtype=float), (3,)) if np.size(rms) in (1, 3) else None
    if levels is None or not (np.isfinite(levels).all() and (levels >= 0.0).all()):
        raise LevelheadError(f"{name} is {rms}; expected one or three numbers, zero or more")
    low, high = band if len(band) == 2 else (0.0, 0.0)
    if not 0.0 < low < high < math.inf:
        raise LevelheadError(f"the band of the {name} is {band}; expected 0 < lowest < highest frequency in Hz")
    value, first, second = (np.zeros((len(clock.u), 3)) for _ in range(3))
    # One frequency from each of five equal parts of the band (on a logarithmic scale), so that none is left empty.
    parts = (np.arange(SINUSOIDS) + random.uniform(size=(3, SINUSOIDS))) / SINUSOIDS
    omega = 2.0 * math.pi * low * (high / low) ** parts
    share = random.uniform(0.5, 1.5, (3, SINUSOIDS))
    share *= np.sqrt(2.0) / np.linalg.norm(share, axis=1, keepdims=True)  # Σ share²/2 = 1: an rms of one
    phase = random.uniform(0.0, 2.0 * math.pi, (3, SINUSOIDS))
    for axis, part in np.ndindex(3, SINUSOIDS):
        w, p = omega[axis, part], phase[axis, part]
        a = levels[axis] * share[axis, part] / w**order
        sine, cosine = np.sin(w * clock.u + p), np.cos(w * clock.u + p)
        value[:, axis] += a * (sine - math.sin(p))
        first[:, axis] += a * w * cosine * clock.speed
        second[:, axis] += a * w * (cosine * clock.acceleration - w * sine * clock.speed**2)
    return value, first, second


def attitude(angle: Array, rate: Array) -> tuple[Array, Array]:
    """Quaternions and body rates of roll, pitch, yaw angles (rad) and their rates (rad/s).

    The angles may take any value: the way from angles and their rates to the body rate has no singularity; gimbal lock
    lies on the way back only (Diebel 2006, Representing Attitude, the sequence 1-2-3).
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(angle / 2.0).T, np.sin(angle / 2.0).T
    quat = np.stack(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ],
        axis=1,
    )
    (roll, pitch, _), (roll_rate, pitch_rate, yaw_rate) = angle.T, rate.T
    gyr = np.stack(
        [
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + yaw_rate * np.cos(pitch) * np.sin(roll),
            -pitch_rate * np.sin(roll) + yaw_rate * np.cos(pitch) * np.cos(roll),
        ],
        axis=1,
    )
    return quat, gyr
