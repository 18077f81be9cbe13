"""Whether a magnetometer shows the earth's field: it must turn against the gyroscope, dm/dt = −ω × m."""

import math
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, median

SPAN = 0.5  # s
_ROWS = 40_000
_MIN_TURN = 0.15  # rms turn of the body per span, rad
_OWN_FIELD = 0.2  # turn of the field over that of the body, below which five parts of six are the device's own
_MIN_SPANS = 12  # independent spans
_MIN_SIGMAS = 4.0  # standard errors
_CONSTANT = 1e-5  # relative spread of a length that software has normalised


class FieldTurn(NamedTuple):
    """The comparison of the field with the gyroscope over spans.

    Attributes:
        correlation: of the field's turn with the gyroscope's, as the axes are.
        scale: how far the field turns for 1 of the gyroscope's.
        offset: the same correlation when any offset is allowed.
        turned: rms turn of the body per span, rad.
        spans: how many independent ones.
        length: of the field that turns with the body, without a constant offset, in the magnetometer's unit.
        error: 1σ of that length.
    """

    correlation: float
    scale: float
    offset: float
    turned: float
    spans: int
    length: float
    error: float

    @property
    def is_informative(self) -> bool:
        """Whether the body turned enough, often enough."""
        return self.turned > _MIN_TURN and self.spans >= _MIN_SPANS

    @property
    def unusable(self) -> bool:
        """Whether the field does not turn with the body as its axes are."""
        return self.is_informative and (self.correlation < 0.3 or self.is_own_field)

    @property
    def shows_field(self) -> bool:
        """Whether a field turns with the body, whatever constant offset it has: its length is not 0."""
        return self.spans >= _MIN_SPANS and self.length > _MIN_SIGMAS * self.error

    @property
    def is_own_field(self) -> bool:
        """Whether nearly all of the length is the device's own field, which turns with it."""
        return abs(self.scale) < _OWN_FIELD


def field_turn(t: Array, gyr: Array, mag: Array) -> FieldTurn | None:
    """Compares (n, 3) ``mag`` in any unit with (n, 3) ``gyr`` in rad/s; ``t`` (n,) s; None without enough readings."""
    spans = _spans(t, gyr, mag)
    if spans is None:
        return None
    turn, middle, real, step = spans
    said = -np.cross(turn, middle)
    norms = float((real * real).sum()), float((said * said).sum())
    if min(norms) <= 0.0:
        return None
    both = float((real * said).sum())
    offset, length, error = _without_offset(turn, middle, real, step)
    return FieldTurn(
        both / np.sqrt(norms[0] * norms[1]), both / norms[1], offset,
        float(np.sqrt((turn * turn).sum(axis=1).mean())), len(turn) // step, length, error,
    )  # fmt: skip


def free_correlation(t: Array, gyr: Array, mag: Array) -> float:
    """The correlation of a FieldTurn when any offset and any 3×3 axes are allowed; 0 without enough readings."""
    spans = _spans(t, gyr, mag)
    if spans is None:
        return 0.0
    turn, middle, real, _ = spans
    columns = np.concatenate([turn[:, :, None] * middle[:, None, :], turn[:, :, None]], axis=2).reshape(len(turn), -1)
    fit, *_ = np.linalg.lstsq(columns, real, rcond=None)
    left, whole = float(((real - columns @ fit) ** 2).sum()), float((real * real).sum())
    return float(np.sqrt(max(0.0, 1.0 - left / whole))) if whole > 0.0 else 0.0


def _without_offset(turn: Array, middle: Array, real: Array, step: int) -> tuple[float, float, float]:
    """``offset``, ``length`` and ``error`` of a FieldTurn, without a constant offset b.

    Least squares of Δm = −θ × (m − b), which is linear in b. Of spans that overlap each ``step``-th counts.
    """
    x, y, z = turn.T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3)
    target = (real + np.cross(turn, middle)).reshape(-1)
    offset, *_ = np.linalg.lstsq(cross, target, rcond=None)
    left = target - cross @ offset
    weight = np.linalg.eigvalsh(cross.T @ cross)
    if not weight[0] > 1e-12 * weight[-1]:
        return 0.0, 0.0, math.inf
    field = middle - offset
    said = -np.cross(turn, field)
    norms = float((real * real).sum() * (said * said).sum())
    correlation = float((real * said).sum()) / math.sqrt(norms) if norms > 0.0 else 0.0
    variance = step * float(left @ left) / len(left) * float((1.0 / weight).mean())
    return correlation, float(np.median(np.linalg.norm(field, axis=1))), math.sqrt(variance)


def _spans(t: Array, gyr: Array, mag: Array) -> tuple[Array, Array, Array, int] | None:
    """The body's turn over spans in rad, the field amid them and its change, (m, 3) each, and readings of a span."""
    new = np.isfinite(mag).all(axis=1) & np.isfinite(gyr).all(axis=1)
    changed = np.ones(len(mag), dtype=np.bool_)
    changed[1:] = (mag[1:] != mag[:-1]).any(axis=1)
    rows = np.flatnonzero(new & changed)
    if len(rows) < 30:
        return None
    filled = np.where(np.isfinite(gyr), gyr, 0.0)
    angle = np.zeros((len(t), 3))
    np.cumsum(0.5 * (filled[1:] + filled[:-1]) * np.diff(t)[:, None], axis=0, out=angle[1:])
    rows = rows[:_ROWS]
    step = max(1, round(SPAN / max(median(np.diff(t[rows])), 1e-6)))
    if len(rows) <= 2 * step:
        return None
    a, b = rows[:-step], rows[step:]
    whole = (t[b] - t[a]) < 1.6 * SPAN
    a, b = a[whole], b[whole]
    if len(a) < 30:
        return None
    turn = angle[b] - angle[a]
    small = np.linalg.norm(turn, axis=1) < 1.0  # the first order holds
    a, b, turn = a[small], b[small], turn[small]
    if len(a) < 30:
        return None
    return turn, 0.5 * (mag[a] + mag[b]), mag[b] - mag[a], step


def is_normalised(mag: Array) -> bool:
    """Whether the length of (n, 3) readings is more constant than that of any sensor."""
    length = np.sqrt((mag * mag).sum(axis=1))
    length = length[np.isfinite(length)]
    return len(length) > 20 and float(np.ptp(length)) < _CONSTANT * float(length.mean())
