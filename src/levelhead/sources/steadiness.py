"""How still gravity holds over a window when the gyroscope turns the specific force back to the window's start."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median
from levelhead.units import GRAVITY

WINDOW = 1.0  # s; in which gravity must hold still
_WINDOWS = 200  # that are looked at, at most


class Steadiness(NamedTuple):
    """How well gravity holds still when the accelerometer is turned back by the gyroscope, window by window.

    Attributes:
        windows: windows in which it makes a difference whether the numbers are rad/s or deg/s.
        gain: how much better rad/s does than deg/s in them, on average, from -1 to 1.
        best: how well the better one does, 1 for gravity that holds perfectly still.
    """

    windows: int
    gain: float
    best: float


_NOTHING = Steadiness(0, 0.0, 0.0)


def steadiness_of_gravity(t: Array, gyr: Array, acc: Array, away: float = 0.3) -> Steadiness:
    """Compares rad/s with deg/s for (n, 3) ``gyr`` by what it makes of (n, 3) ``acc`` in m/s²; ``t`` (n,) s.

    Over windows of one second the specific force, turned into the frame of the first sample, adds up to gravity: the
    accelerations of a hand or a drone cancel. With the wrong unit gravity smears instead. Windows in which the sensor
    is further than ``away`` (rms, in g) from 1 g (on a wheel, in free fall) say little and are left out.
    """
    step = median(np.diff(t)) if len(t) > 1 else 1.0
    if not step > 0.0:
        return _NOTHING
    size = max(2, round(WINDOW / step))
    count = len(t) // size
    if count == 0:
        return _NOTHING
    starts = np.arange(count, dtype=np.intp) * size
    near = _near_gravity(t, gyr, acc, starts, size, step, away)
    starts = starts[near][:: max(1, int(near.sum()) // _WINDOWS)]
    if len(starts) == 0:
        return _NOTHING
    rows = np.arange(size)[:, None] + starts
    turn = gyr[rows] * np.minimum(np.diff(t, append=t[-1] + step), 2.0 * step)[rows][..., None]
    radians, degrees = _held(turn, acc[rows]), _held(turn * (math.pi / 180.0), acc[rows])
    path = np.sqrt((turn * turn).sum(axis=-1)).sum(axis=0)
    informative = (np.abs(radians - degrees) > 0.02) & (path > 0.5)
    if not informative.any():
        return _NOTHING
    gain = float((radians - degrees)[informative].mean())
    return Steadiness(int(informative.sum()), gain, float(np.maximum(radians, degrees)[informative].mean()))


def _near_gravity(
    t: Array, gyr: Array, acc: Array, starts: NDArray[np.intp], size: int, step: float, limit: float
) -> NDArray[np.bool_]:
    """Windows without gaps and missing values whose specific force stays about 1 g: (len(starts),)."""
    length = np.sqrt((acc * acc).sum(axis=1))[: len(starts) * size].reshape(-1, size)
    usable: NDArray[np.bool_] = np.all(np.abs(gyr) < 1e6, axis=1)
    whole: NDArray[np.bool_] = (t[starts + size - 1] - t[starts]) < 1.5 * size * step
    away: NDArray[np.float64] = np.sqrt(((length / GRAVITY - 1.0) ** 2).mean(axis=1))
    near: NDArray[np.bool_] = (away < limit) & whole & usable[: len(starts) * size].reshape(-1, size).all(axis=1)
    return near


def _held(turn: Array, acc: Array) -> Array:
    """Length of the sum of (size, m, 3) ``acc`` turned back by ``turn`` rad, over the sum of lengths: (m,)."""
    angle = np.sqrt((turn * turn).sum(axis=-1))[..., None, None]
    skew = np.zeros((*turn.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        skew[..., j, i], skew[..., i, j] = turn[..., k], -turn[..., k]
    rotation = np.eye(3) + np.sinc(angle / math.pi) * skew + 0.5 * np.sinc(angle / (2 * math.pi)) ** 2 * (skew @ skew)
    total = np.zeros((acc.shape[1], 3, 1))
    for i in reversed(range(len(acc))):
        total = acc[i][..., None] + rotation[i] @ total
    held: Array = np.sqrt((total * total).sum(axis=(1, 2))) / np.sqrt((acc * acc).sum(axis=-1)).sum(axis=0)
    return held


def mean_lengths(t: Array, gyr: Array, acc: Array, window: float) -> Array:
    """Lengths of the mean specific force over windows of ``window`` s, each turned into the frame of its start: (m,).

    ``gyr`` (n, 3) rad/s, ``acc`` (n, 3) m/s². What a limb or a drone accelerates to and fro cancels in it, centripetal
    acceleration too; gravity stays, up to Δv / ``window``. Windows with gaps or missing values are left out.
    """
    step = median(np.diff(t)) if len(t) > 1 else 0.0
    size = max(2, round(window / step)) if step > 0.0 else 0
    count = len(t) // size if size else 0
    if count == 0:
        return np.zeros(0)
    starts = np.arange(count, dtype=np.intp) * size
    starts = starts[_near_gravity(t, gyr, acc, starts, size, step, np.inf)][:: max(1, count // _WINDOWS)]
    if len(starts) == 0:
        return np.zeros(0)
    rows = np.arange(size)[:, None] + starts
    turn = gyr[rows] * np.minimum(np.diff(t, append=t[-1] + step), 2.0 * step)[rows][..., None]
    lengths: Array = _held(turn, acc[rows]) * np.sqrt((acc[rows] ** 2).sum(axis=-1)).mean(axis=0)
    return lengths
