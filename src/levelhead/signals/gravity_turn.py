"""The turn of gravity compared with the gyroscope.

While a body turns, gravity turns the other way in its frame, du/dt = −ω × u: how far u turned, compared with the
integral of the right side, gives the unit of ω.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median

SMOOTH = 0.2  # s; takes vibration out of the direction of gravity
_MAX_DEVIATION = 0.2  # of the specific force, as a share of its usual length
_MAX_QUIET_DEVIATION = 0.06  # the same in quiet spans
_QUIET_SAMPLE, _QUIET_SPAN = 0.12, 0.3  # share of the usual length, at every sample; s
_QUIET_SHARE = 0.05  # of the rows, at least, must be quiet
SPAN = 0.5  # s; over which the turn of gravity is compared
MIN_CORRELATION = 0.7  # correlation from which the comparison counts
MIN_TURN = 0.05  # rms turn of gravity per span, as a fraction of its length (3 degrees), that counts as motion
_SAMPLES = 50_000  # rows that are looked at


class GravityTurn(NamedTuple):
    """The comparison of the gyroscope with the turn of gravity.

    Attributes:
        scale: k in Δu = k · Σ −(ω × u) Δt: one unit of the gyroscope in rad/s.
        correlation: of the two sides, 0 to 1.
        turned: rms of Δu over the spans.
    """

    scale: float
    correlation: float
    turned: float

    @property
    def clear(self) -> bool:
        """Whether there was enough motion, and it fits."""
        return self.correlation > MIN_CORRELATION and self.turned > MIN_TURN and self.scale > 0.0


def median_norm(values: Array) -> float:
    """The median length of (n, 3) vectors in their unit, rows with NaN left out; NaN if there are none."""
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt(np.einsum("ij,ij->i", values, values))
    norm = norm[~np.isnan(norm)]
    return median(norm) if len(norm) else math.nan


def excerpt(n: int) -> slice | NDArray[np.intp]:
    """Rows that stand for a long recording: twenty stretches spread over it; all rows of a short one."""
    if n <= _SAMPLES:
        return slice(None)
    length = _SAMPLES // 20
    starts = np.linspace(0, n - length, 20).astype(np.intp)
    return (starts[:, None] + np.arange(length)).ravel()


def turn_of_gravity(
    t: Array, gyr: Array, acc: Array, near: float = _MAX_DEVIATION, span: float = SPAN
) -> GravityTurn | None:
    """Compares (n, 3) ``gyr`` in an unknown unit with the turn of (n, 3) ``acc``; None without a comparable span.

    ``t`` (n,) s. Spans across gaps and missing values are left out, and those at whose ends the specific force is
    further than ``near`` (a share) from its usual length; ``span`` and ``SMOOTH`` are times in s: any rate will do.
    """
    length = np.sqrt((acc * acc).sum(axis=1))
    x, y, z = (np.abs(gyr) < 1e100).T  # not where it is NaN
    usable = x & y & z & (length > 0.0) & (length < 1e100)
    if usable.sum() < 8:
        return None
    if not usable.all():
        t, gyr, acc, length = t[usable], gyr[usable], acc[usable], length[usable]
    up = acc / length[:, None]
    step = median(np.diff(t))
    if not step > 0.0:
        return None
    box, size = max(1, round(SMOOTH / step)), max(1, round(span / step))
    if len(t) <= box + size:
        return None
    rate = np.cross(up, gyr)  # −(ω × u)
    turned = np.zeros_like(rate)
    np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)[:, None], axis=0, out=turned[1:])
    real = _spans(up, box, size)
    said = _spans(turned, box, size)
    whole = (t[box + size - 1 :] - t[: 1 - box - size or None]) < 1.5 * (box + size) * step
    steady = _steady(length, box, size, near)
    comparable = whole & steady
    return _regress(np.compress(comparable, real, axis=0), np.compress(comparable, said, axis=0))


def quiet_turn(t: Array, gyr: Array, acc: Array) -> GravityTurn | None:
    """``turn_of_gravity`` over short spans in which the specific force keeps its usual length at every sample.

    On a swinging leg or arm gravity seems to turn against the gyroscope, because the limb is a pendulum; there the
    force is never quiet, and nothing is compared.
    """
    length = np.sqrt((acc * acc).sum(axis=1))
    finite = length[np.isfinite(length)]
    if len(finite) < 8:
        return None
    still = np.abs(length / median(finite) - 1.0) < _QUIET_SAMPLE
    step = median(np.diff(t)) if len(t) > 1 else 1.0
    size = max(1, min(round(_QUIET_SPAN / step), (len(t) - 1) // 2)) if step > 0 else 1
    around = np.convolve(~still, np.ones(2 * size + 1), "same") < 0.05 * size
    if still.sum() < 8 or around.sum() < max(30, _QUIET_SHARE * len(t)):
        return None
    return turn_of_gravity(t, np.where(around[:, None], gyr, np.nan), acc, near=_MAX_QUIET_DEVIATION, span=_QUIET_SPAN)


def _spans(values: Array, box: int, span: int) -> Array:
    """How (n, 3) values, averaged over ``box`` rows, change over ``span`` rows: (n − box − span + 1, 3)."""
    total = np.zeros((len(values) + 1, values.shape[1]))
    np.cumsum(values, axis=0, out=total[1:])
    mean: Array = (total[box:] - total[:-box]) / box
    return mean[span:] - mean[:-span]


def _steady(length: Array, box: int, span: int, share: float) -> NDArray[np.bool_]:
    """Spans at whose ends the accelerometer sees gravity and not much else: (n − box − span + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(length)])
    mean = (total[box:] - total[:-box]) / box
    typical = median(length)
    near: NDArray[np.bool_] = np.abs(mean - typical) < share * typical
    steady: NDArray[np.bool_] = near[span:] & near[:-span]
    return steady


def _regress(real: Array, said: Array) -> GravityTurn | None:
    if len(real) == 0:
        return None
    both, own, other = float((real * said).sum()), float((said * said).sum()), float((real * real).sum())
    if not (own > 0.0 and other > 0.0 and math.isfinite(own)):
        return GravityTurn(0.0, 0.0, math.sqrt(other / len(real)))
    return GravityTurn(both / own, both / math.sqrt(own * other), math.sqrt(other / len(real)))
