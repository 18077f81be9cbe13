"""How still gravity holds over a window when the gyroscope turns the specific force back into one frame."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median
from levelhead.units import GRAVITY

WINDOW = 1.0  # s; in which gravity must hold still
_WINDOWS = 200  # that are looked at, at most
_SMOOTH = 0.25  # s; over which noise of the rates cancels and motion does not
STRIDES = 4.0  # s; over which the accelerations of a runner cancel
_LEFT = (0.55, 1.2)  # the rest, in g: 0.6 to 1.0 on runners, the least where full scale cuts steps off
MIN_WINDOWS = 3  # windows of STRIDES


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
    """Compares rad/s with deg/s for (n, 3) ``gyr`` by its rotation of (n, 3) ``acc`` in m/s²; ``t`` (n,) s.

    Over windows of one second the specific force, turned into the frame of the first sample, adds up to gravity: the
    accelerations of a hand or a drone cancel. With the wrong unit gravity smears instead. Windows in which the sensor
    is further than ``away`` (rms, in g) from 1 g (on a wheel, in free fall) are left out.
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
    radians, degrees = (_held(_rotations(factor * turn[:-1]), acc[rows]) for factor in (1.0, math.pi / 180.0))
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


def _held(rotation: Array, acc: Array) -> Array:
    """Length of the sum of (size, m, 3) ``acc`` in the first frame over the sum of lengths: (m,)."""
    total = _turned_sum(rotation, acc)
    held: Array = np.sqrt((total * total).sum(axis=1)) / np.sqrt((acc * acc).sum(axis=-1)).sum(axis=0)
    return held


def _rotations(turn: Array) -> Array:
    """(…, 3, 3) rotation matrices of (…, 3) rotation vectors (O. Rodrigues, 1840)."""
    x, y, z = np.moveaxis(turn, -1, 0)
    angle = np.sqrt(x * x + y * y + z * z)
    a, b = np.sinc(angle / math.pi), 0.5 * np.sinc(angle / (2 * math.pi)) ** 2
    ax, ay, az, bx, by, bz = a * x, a * y, a * z, b * x, b * y, b * z
    made = np.empty((*turn.shape, 3))
    made[..., 0, 0], made[..., 1, 1], made[..., 2, 2] = 1 - by * y - bz * z, 1 - bx * x - bz * z, 1 - bx * x - by * y
    made[..., 0, 1], made[..., 1, 0] = bx * y - az, bx * y + az
    made[..., 0, 2], made[..., 2, 0] = bx * z + ay, bx * z - ay
    made[..., 1, 2], made[..., 2, 1] = by * z - ax, by * z + ax
    return made


def _turned_sum(rotation: Array, acc: Array) -> Array:
    """The sum of (size, m, 3) ``acc`` in the first frame, (m, 3); (size − 1, m, 3, 3) ``rotation`` lie between."""
    total: Array = acc[-1][..., None]
    for i in reversed(range(len(rotation))):
        total = acc[i][..., None] + rotation[i] @ total
    return total[..., 0]


class MeanForce(NamedTuple):
    """The mean specific force of windows, turned back into the frame of the middle of each: the rest is gravity.

    Attributes:
        length: m/s², of the mean over a window, (m,).
        apart: m/s², how far the means of its halves are apart, (m,).
        shaking: m/s², rms by which the force differs from its mean in the sensor's frame, whatever it turns, (m,).
        tilt: rad rms by which a direction that is fixed in the sensor, the mean force's, tilts by the rates, (m,).
        turned: rad by which gravity turned in the sensor's frame, there and back, if the rates are right, (m,).
        seen: rad by which the force did, whatever it is, (m,).
    """

    length: Array
    apart: Array
    shaking: Array
    tilt: Array
    turned: Array
    seen: Array


def mean_forces(t: Array, gyr: Array, acc: Array, window: float) -> MeanForce:
    """``MeanForce`` over windows of ``window`` s; ``t`` (n,) s, ``gyr`` (n, 3) rad/s, ``acc`` (n, 3) m/s².

    The accelerations of a limb or a drone cancel in the means, centripetal acceleration too; gravity stays, up
    to Δv / ``window``. Windows with gaps or missing values are left out.
    """
    step = median(np.diff(t)) if len(t) > 1 else 0.0
    size = max(2, round(window / step)) if step > 0.0 else 0
    count = len(t) // size if size else 0
    starts = np.arange(count, dtype=np.intp) * size
    if count:
        starts = starts[_near_gravity(t, gyr, acc, starts, size, step, np.inf)][:: max(1, count // _WINDOWS)]
    if len(starts) == 0:
        return MeanForce(*np.zeros((6, 0)))
    rows = np.arange(size)[:, None] + starts
    turn, force = gyr[rows] * np.minimum(np.diff(t, append=t[-1] + step), 2.0 * step)[rows][..., None], acc[rows]
    middle = size // 2
    rotation = _rotations(turn[:-1])
    before = _turned_sum(rotation[:middle][::-1].swapaxes(-1, -2), force[: middle + 1][::-1])
    after = _turned_sum(rotation[middle:], force[middle:])
    apart = before / (middle + 1) - after / (size - middle)
    return MeanForce(
        np.sqrt(((before + after - force[middle]) ** 2).sum(axis=1)) / size,
        np.sqrt((apart**2).sum(axis=1)),
        np.sqrt(force.var(axis=0).sum(axis=1)),
        np.sqrt(2.0 * (1.0 - _held(rotation, np.broadcast_to(force.mean(axis=0), force.shape))).clip(0.0)),
        *_ways(turn, force, max(1, round(_SMOOTH / step))),
    )


def _ways(turn: Array, force: Array, box: int) -> tuple[Array, Array]:
    """The ways of gravity by (size, m, 3) ``turn`` rad and of ``force`` itself, means of ``box`` rows: (m,) rad."""
    edges = np.arange(0, len(turn), box)
    turns, forces = np.add.reduceat(turn, edges, axis=0), np.add.reduceat(force, edges, axis=0)
    up = forces / np.sqrt((forces * forces).sum(axis=-1, keepdims=True)).clip(1e-9)
    turned: Array = np.sqrt((np.cross(turns, up) ** 2).sum(axis=-1)).sum(axis=0)
    seen: Array = np.sqrt((np.diff(up, axis=0) ** 2).sum(axis=-1)).sum(axis=0)
    return turned, seen


def usual_force(t: Array, rate: Array, acc: Array) -> float | None:
    """The usual length in g of the mean of (n, 3) ``acc`` in m/s² over strides, turned back by ``rate`` in rad/s.

    However a body runs, its accelerations cancel and gravity is left. None: too little motion.
    """
    lengths = mean_forces(t, rate, acc, STRIDES).length
    return None if len(lengths) < MIN_WINDOWS else median(lengths) / GRAVITY


def is_gravity_left(force: float) -> bool:
    """Whether ``usual_force`` is gravity: neither linear acceleration nor counts of another size."""
    return _LEFT[0] < force < _LEFT[1]
