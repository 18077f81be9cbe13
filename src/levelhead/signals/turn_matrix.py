"""The 3×3 matrix between the gyroscope and the turn that gravity, or the field, shows; with its covariance.

Over segments of some seconds the specific force f is turned into the frame of the segment's start by the rates
M ω + b. With the right M the rest beside gravity is acceleration, whose integral, a velocity, stays bounded; the
velocity of a point that turns about a pivot r away is taken out. The fit by Gauss and Newton makes the rest small,
after the straight line of each segment (gravity, first velocity) is taken out:

    R' = R [M ω + b]×,  v(t) = ∫ R f dt − R ((M ω + b) × r),  cost = Σ |v − line|²          (1)
    δ(R f) = φ × R f,  φ(t) = ∫ R (δM ω + δb) dt                                            (2)
    δ(R (w × r)) = φ × R (w × r) + R (δM ω + δb) × R r,  w = M ω + b                        (3)

A field is turned back in the same way. It is constant, but for noise, for iron c that turns with the sensor, and for
a shape S, symmetric and without trace, that soft iron gives it: cost = Σ |R (m + S m − c) − mean|². In eq. 2 its f is
m + S m − c: iron may be many times the field. The covariance is
that of estimates from independent segments (H. White, Maximum likelihood estimation of misspecified models,
Econometrica 50, 1982, eq. 3.2): nothing is assumed of noise within one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array, median

SEGMENT, SHORTEST = 4.0, 2.0  # s; of a short recording at least
PARTS = 4  # of a segment: their turns are smaller, and so is the danger of a minimum that is not the least
MAX_RATE = 50.0  # Hz to which readings are averaged
MAX_SEGMENTS = 48  # segments that are looked at
BLOCKS = 16  # values of a segment that are compared
MIN_SEGMENTS = 5  # segments
STEPS = 8  # of Gauss and Newton
SETTLED = 1e-3  # share of the cost by which the last step changes it
BIAS, ARM, IRON, DELAY = 0.1, 1.0, 1.0, 0.1  # rad/s, m, of the field's length, s: 1σ of the expected sizes
SOFT = 0.2  # 1σ of each number of S that is expected
SHAPES: Array = np.array(
    [
        [[1, 0, 0], [0, -1, 0], [0, 0, 0]],
        [[-1, 0, 0], [0, -1, 0], [0, 0, 2]],
        [[0, 1, 0], [1, 0, 0], [0, 0, 0]],
        [[0, 0, 1], [0, 0, 0], [1, 0, 0]],
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
    ],
    dtype=np.float64,
)  # a basis of S
IDENTITY = np.eye(3)
WIRINGS: tuple[Array, ...] = tuple(
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
)  # the 48 signed permutations of axes, the identity first


class TurnMatrix(NamedTuple):
    """A fit.

    Attributes:
        matrix: M, (3, 3).
        bias: b, rad/s.
        free: estimates of the free numbers of M, (p,).
        covariance: theirs, (p, p).
        iron: the field that turns with the sensor, in the field's unit, (3,); of a force the arm r, m.
        delay: by which the vector comes later than the rates, s.
        shape: S of a field, (3, 3); of a force 0.
        more_covariance: of ``iron`` and ``delay``, (4, 4); of a field with the numbers of S in SHAPES, (9, 9).
        left: the rms that is left: m/s of a force, the unit of the field.
        by_segment: the same of each segment, (m,).
        own_bias: b as each segment has it by itself, rad/s, (m, 3).
        own_weight: their inverse covariances by the residual in it, (m, 3, 3).
    """

    matrix: Array
    bias: Array
    free: Array
    covariance: Array
    iron: Array
    delay: float
    shape: Array
    more_covariance: Array
    left: float
    by_segment: Array
    own_bias: Array
    own_weight: Array

    @property
    def sigma(self) -> Array:
        """1σ of the three numbers of ``iron`` and of ``delay``, (4,)."""
        made: Array = np.sqrt(np.diag(self.more_covariance)[:4])
        return made


@dataclass(frozen=True)
class Segments:
    """Readings cut into m segments of k samples.

    Attributes:
        rate: rad/s, (k, m, 3).
        coning: rad/s by which the turn of a sample differs from that of its mean rate, (k, m, 3).
        vector: specific force or field, (k, m, 3).
        step: s, (k, m).
        start: s, (m,).
        is_force: whether the vector is a force, whose velocity is bounded, or a field, which is constant.
        overlap: how many segments hold one reading, about.
    """

    rate: Array
    coning: Array
    vector: Array
    step: Array
    start: Array
    is_force: bool
    overlap: int = 1

    @cached_property
    def size(self) -> float:
        """Usual length of the vector."""
        return float(np.sqrt((self.vector**2).sum(axis=-1).mean()))

    @cached_property
    def change(self) -> Array:
        """(k, m, 3) the vector's derivative."""
        middle = (self.vector[2:] - self.vector[:-2]) / (self.step[2:] + self.step[1:-1])[..., None].clip(1e-9)
        made: Array = np.concatenate([middle[:1], middle, middle[-1:]])
        return made

    @cached_property
    def scatter(self) -> float:
        """The rms that is left where nothing is turned back: m/s of a force, the unit of the field."""
        return fit(self, np.zeros((3, 3)), NONE).left

    @cached_property
    def rate_planes(self) -> Array:
        """(6, k m) the rate and the coning, rad/s."""
        return np.concatenate([_planes(self.rate), _planes(self.coning)]).reshape(6, -1)

    @cached_property
    def vector_planes(self) -> Array:
        """(3, k, m) the vector."""
        return _planes(self.vector)

    @cached_property
    def change_planes(self) -> Array:
        """(3, k, m) the vector's derivative."""
        return _planes(self.change)

    @cached_property
    def shape_planes(self) -> Array:
        """(5, 3, k, m) the vector times each of SHAPES."""
        made: Array = (SHAPES @ self.vector_planes.reshape(3, -1)).reshape(len(SHAPES), *self.vector_planes.shape)
        return made

    def choose(self, most: int) -> "Segments":
        """At most so many segments, spread over the recording."""
        rows = np.linspace(0, len(self.start) - 1, min(most, len(self.start))).round().astype(int)
        return self._replace(lambda values: values[:, rows], self.start[rows])

    def split(self) -> "Segments":
        """``PARTS`` segments of each, where they are long enough."""
        size = len(self.step) // PARTS
        if size < 2 * BLOCKS:
            return self

        def parts(values: Array) -> Array:
            whole = values[: size * PARTS].reshape(PARTS, size, *values.shape[1:])
            made: Array = np.concatenate(list(whole), axis=1)
            return made

        start = np.concatenate([self.start + one * self.step[:size].sum(axis=0) for one in range(PARTS)])
        return self._replace(parts, start)

    def _replace(self, change: Callable[[Array], Array], start: Array) -> "Segments":
        rate, coning, vector, step = map(change, (self.rate, self.coning, self.vector, self.step))
        return replace(self, rate=rate, coning=coning, vector=vector, step=step, start=start)

    def sharpen(self, lag: float) -> "Segments":
        """Without a filter of first order whose time constant is ``lag`` s."""
        return replace(self, vector=self.vector + lag * self.change)

    def shift(self, delay: float) -> "Segments":
        """As the vector would be if it came ``delay`` s earlier; the ends of segments stand."""
        step = float(np.median(self.step))
        rows = np.arange(len(self.step))
        at = (rows + delay / step).clip(0, len(rows) - 1)
        low = np.floor(at).astype(int).clip(0, len(rows) - 2)
        part = (at - low)[:, None, None]
        return replace(self, vector=(1.0 - part) * self.vector[low] + part * self.vector[low + 1])


def cut(
    t: Array, gyr: Array, vector: Array, is_force: bool, most: int = MAX_SEGMENTS, overlap: int = 1
) -> Segments | None:
    """Segments without gaps and missing values, spread over a recording; None with fewer than ``MIN_SEGMENTS``.

    They are ``overlap`` times SEGMENT long, less in a short recording, and one begins SEGMENT after the other.
    """
    step = median(np.diff(t)) if len(t) > 1 else 0.0
    if not step > 0.0:
        return None
    every = max(1, int(overlap / (step * MAX_RATE)))
    long = min(SEGMENT, max(SHORTEST, len(t) * step / (MIN_SEGMENTS + overlap)))
    size = round(long / (step * every)) * every
    count = len(t) // max(size, 1)
    if size < BLOCKS * every or count < MIN_SEGMENTS + overlap - 1:
        return None
    starts = np.arange(count) * size
    whole = (t[starts + size - 1] - t[starts]) < 1.2 * size * step
    fine = np.isfinite(np.hstack([gyr, vector])[: count * size]).reshape(count, -1)
    whole &= fine.all(axis=1)
    begins = np.flatnonzero(np.lib.stride_tricks.sliding_window_view(whole, overlap).all(axis=1))
    starts, size = starts[begins], overlap * size
    if len(starts) < MIN_SEGMENTS:
        return None
    starts = starts[np.linspace(0, len(starts) - 1, min(most, len(starts))).round().astype(int)]
    rows = np.arange(size)[:, None] + starts
    steps = np.diff(t, append=t[-1] + step).clip(0.0, 5.0 * step)

    def average(values: Array) -> Array:
        made: Array = values[rows].reshape(size // every, every, len(starts), *values.shape[1:]).mean(axis=1)
        return made

    coning = _coning((gyr[rows] * steps[rows][..., None]).reshape(size // every, every, len(starts), 3))
    step_of = average(steps) * every
    coning /= step_of.clip(1e-9)[..., None]
    return Segments(average(gyr), coning, average(vector), step_of, t[starts], is_force, overlap)


def _coning(angle: Array) -> Array:
    """½ Σ (θ₁ + … + θᵢ₋₁) × θᵢ over axis 1 of (k, n, m, 3) angles: the turn beyond their sum, of second order.

    J. W. Jordan, An accurate strapdown direction cosine algorithm, NASA TN D-5384, 1969.
    """
    before = np.cumsum(angle, axis=1) - angle
    made: Array = 0.5 * np.cross(before, angle).sum(axis=1)
    return made


def _planes(values: Array) -> Array:
    """(3, k, m) of (k, m, 3) values: sums over one number at a time run over contiguous memory."""
    return np.ascontiguousarray(values.transpose(2, 0, 1))


def _cofactors(matrix: Array) -> Array:
    """The matrix C with (M a) × (M b) = C (a × b)."""
    one, other = [1, 2, 0], [2, 0, 1]
    made: Array = matrix[np.ix_(one, one)] * matrix[np.ix_(other, other)]
    made -= matrix[np.ix_(one, other)] * matrix[np.ix_(other, one)]
    return made


def _skew(values: Array) -> Array:
    made = np.zeros((*values.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        made[..., j, i], made[..., i, j] = values[..., k], -values[..., k]
    return made


def integrate_rotation(rate: Array, step: Array) -> Array:
    """(3, 3, k, m) mean rotations over each sample into the frame of each segment's start.

    A sample is a mean over its step T, and so must the rotation be: with rates that change linearly over three samples
    the mean angle from the step's start is ω T/2 − (ω₊ − ω₋) T/24.
    Products of quaternions, doubled in length each time within a run of samples and then over the runs (W. D. Hillis,
    G. L. Steele, Data parallel algorithms, 1986).

    Args:
        rate: rad/s, (3, k, m).
        step: s, (k, m).
    """
    angle = rate * step
    change = np.zeros_like(angle)
    change[:, 1:-1] = angle[:, 2:] - angle[:, :-2]
    mid, each = _quaternion(0.5 * angle - change / 24.0), _quaternion(angle)
    k, m = step.shape
    runs = -(-k // RUN)
    total = np.zeros((2, runs * RUN, m), complex)
    total[0] = 1.0
    total[:, 1:k] = each[:, :-1]  # the rotation before each sample
    total = _running_product(total.reshape(2, runs, RUN, m), 2)
    before = np.zeros((2, runs, 1, m), complex)
    before[0] = 1.0
    before[:, 1:] = _running_product(total[:, :, -1:].copy(), 1)[:, :-1]
    whole = _product(before, total).reshape(2, runs * RUN, m)[:, :k]
    a, b = _product(whole, mid)
    w, x, y, z = a.real, a.imag, b.real, b.imag
    made = np.empty((3, 3, k, m))
    xx, yy, zz = 2.0 * x * x, 2.0 * y * y, 2.0 * z * z
    made[0, 0], made[1, 1], made[2, 2] = 1.0 - (yy + zz), 1.0 - (xx + zz), 1.0 - (xx + yy)
    for i, j, both, other in ((0, 1, x * y, w * z), (2, 0, x * z, w * y), (1, 2, y * z, w * x)):
        made[j, i], made[i, j] = 2.0 * (both + other), 2.0 * (both - other)
    return made


RUN = 16  # samples whose rotations are multiplied before those of runs
Pairs = NDArray[np.complex128]


def _quaternion(vector: Array) -> Pairs:
    """(2, …) quaternions of (3, …) rotation vectors, each as the pair (w + x i, y + z i) of Cayley and Dickson."""
    half = 0.5 * vector
    norm = np.sqrt((half * half).sum(axis=0))
    x, y, z = np.sin(norm) / np.maximum(norm, 1e-300) * half  # of no rotation 0, which ``half`` is too
    made = np.empty((2, *norm.shape), complex)
    made.real, made.imag = (np.cos(norm), y), (x, z)
    return made


def _product(p: Pairs, q: Pairs) -> Pairs:
    """Hamilton's product of quaternions as pairs: (a + b j)(c + d j) = a c − b d* + (a d + b c*) j."""
    (a, b), (c, d) = p, q
    made = np.empty((2, *np.broadcast_shapes(a.shape, c.shape)), complex)
    made[0], made[1] = a * c - b * d.conj(), a * d + b * c.conj()
    return made


def _running_product(each: Pairs, axis: int) -> Pairs:
    """Products of all up to each one along an axis, in place."""
    total = np.moveaxis(each, axis, 1)
    reach = 1
    while reach < total.shape[1]:
        total[:, reach:] = _product(total[:, :-reach], total[:, reach:])
        reach *= 2
    return each


def _without_trend(values: Array, line: bool) -> Array:
    """(BLOCKS, m, …) values without their mean, or their straight line."""
    made: Array = _trend_remover(line) @ values.reshape(BLOCKS, -1)
    return made.reshape(values.shape)


@cache
def _trend_remover(line: bool) -> Array:
    """The projection (BLOCKS, BLOCKS) that removes the mean, or the straight line."""
    ramp = np.arange(BLOCKS) - 0.5 * (BLOCKS - 1)
    made = np.eye(BLOCKS) - 1.0 / BLOCKS
    made -= np.outer(ramp, ramp) / (ramp @ ramp) if line else 0.0
    made.flags.writeable = False
    return made


class _State(NamedTuple):
    cost: Array
    left: Array
    rotation: Array  # (3, 3, k, m)
    turned: Array  # (3, k, m)
    lever: tuple[Array, Array] | None  # of a force R ((M ω + b) × r) and R r at the ends of blocks, (BLOCKS, m, 3)
    more: Array


def _evaluate(seg: Segments, matrix: Array, bias: Array, more: Array) -> _State:
    """The rest at M, b and r (or c)."""
    rate = (np.hstack([matrix, _cofactors(matrix)]) @ seg.rate_planes + bias[:, None]).reshape(3, *seg.step.shape)
    rotation = integrate_rotation(rate, seg.step)
    turned, late = _turn(rotation, seg.vector_planes), _turn(rotation, seg.change_planes)
    lever = None
    if seg.is_force:
        total, columns = _totals(turned * seg.step), -_totals(late * seg.step)[..., None]
        turned += more[3] * late
        last = _edges(len(seg.step))[1:] - 1
        at_end = rotation[..., last, :].transpose(2, 3, 0, 1)
        columns = np.concatenate([at_end @ _skew(rate[:, last].transpose(1, 2, 0)), columns], axis=-1)
        lever = columns[..., :3] @ more[:3], at_end @ more[:3]
    else:
        total, shaped = _blocks(turned), [_turn(rotation, one) for one in seg.shape_planes]
        columns = np.concatenate([rotation.transpose(1, 0, 2, 3), -late[None], -np.stack(shaped)])
        turned = turned - (more @ columns.reshape(len(more), -1)).reshape(turned.shape)
        columns = np.moveaxis(_blocks(columns), 2, -1)
    columns = _without_trend(columns, seg.is_force)
    left = _without_trend(total, seg.is_force) - columns @ more
    return _State((left * left).sum(axis=(0, 2)) / BLOCKS, left, rotation, turned, lever, columns)


def _turn(rotation: Array, vector: Array) -> Array:
    """(3, k, m) vectors, each by its own of (3, 3, k, m) rotations."""
    made: Array = rotation[:, 0] * vector[0]
    made += rotation[:, 1] * vector[1]
    made += rotation[:, 2] * vector[2]
    return made


@cache
def _edges(count: int) -> NDArray[np.intp]:
    made = np.linspace(0, count, BLOCKS + 1).astype(np.intp)
    made.flags.writeable = False
    return made


def _sums(values: Array) -> Array:
    """(BLOCKS, m, …) sums of blocks of (…, k, m) values."""
    made: Array = np.add.reduceat(values, _edges(values.shape[-2])[:-1], axis=-2)
    return np.moveaxis(made, (-2, -1), (0, 1))


def _totals(values: Array) -> Array:
    """(BLOCKS, m, …) sums of (…, k, m) values up to the end of each block."""
    made: Array = np.cumsum(_sums(values), axis=0)
    return made


def _blocks(values: Array) -> Array:
    """(BLOCKS, m, …) means of blocks of (…, k, m) values."""
    made: Array = _sums(values) / np.diff(_edges(values.shape[-2])).reshape(-1, *[1] * (values.ndim - 1))
    return made


def _normal(seg: Segments, state: _State, basis: Array) -> tuple[Array, Array]:
    """Gradient (m, p + 3 + q) and curvature, squared, of half the cost of each segment; q numbers are in ``more``."""
    m, p = seg.step.shape[1], len(basis)
    edges = _edges(len(seg.step))
    # One number at a time with the samples last: sums run over contiguous memory, and stays in the processor's cache
    rotation = np.ascontiguousarray(state.rotation.transpose(1, 0, 3, 2))
    step = np.ascontiguousarray(seg.step.T)
    rate = seg.rate.transpose(2, 1, 0) * step
    x, y, z = state.turned.transpose(0, 2, 1) * (step if seg.is_force else 1.0)
    change, angle, gained = np.empty((3, p + 3, 3, m, BLOCKS))
    last = edges[1:] - 1
    for i in range(p + 3):
        if i < p:
            moved = sum(basis[i, a, j] * rate[j] * rotation[a] for a, j in np.argwhere(basis[i]))
        else:
            moved = step * rotation[i - p]
        phi = np.cumsum(moved, axis=-1)
        angle[i], gained[i] = phi[..., last], moved[..., last] / step[:, last]
        a, b, c = phi
        for axis, crossed in enumerate((b * z - c * y, c * x - a * z, a * y - b * x)):
            change[i, axis] = np.add.reduceat(crossed, edges[:-1], axis=-1)
    change = np.cumsum(change, axis=-1) if seg.is_force else change / np.diff(edges)
    if state.lever is not None:
        arm, reach = (one.transpose(2, 1, 0) for one in state.lever)
        change -= _cross(angle, arm) + _cross(gained, reach)
    change = change.transpose(3, 2, 0, 1)
    change = _without_trend(change, seg.is_force)
    change = np.concatenate([change, -state.more.swapaxes(-1, -2)], axis=2)
    flat = change.transpose(1, 2, 0, 3).reshape(m, p + 3 + state.more.shape[-1], -1)
    left = state.left.transpose(1, 0, 2).reshape(m, -1)
    return (flat @ left[..., None])[..., 0] / BLOCKS, flat @ flat.swapaxes(-1, -2) / BLOCKS


def _cross(each: Array, other: Array) -> Array:
    """(p, 3, …) cross products of each of (p, 3, …) with (3, …)."""
    (x, y, z), (a, b, c) = each.swapaxes(0, 1), other
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=1)


def left_as_read(seg: Segments, fitted: TurnMatrix) -> float:
    """The rms that is left where iron, shape and delay are not taken out, but M, the bias and the arm are."""
    more = np.concatenate([fitted.iron, [0.0]]) if seg.is_force else np.zeros(4 + len(SHAPES))
    return float(np.sqrt(_evaluate(seg, fitted.matrix, fitted.bias, more).cost.mean()))


def _combine(x: Array, basis: Array) -> Array:
    """Σ xᵢ ``basis``ᵢ of matrices (p, 3, 3)."""
    made: Array = (x @ basis.reshape(-1, 9)).reshape(3, 3)
    return made


def _prior(seg: Segments, p: int, spread: float, delay: float = DELAY) -> Array:
    """The information of the numbers of a fit before it: p of M, the bias, and those in ``more``."""
    more = [ARM] * 3 + [delay] if seg.is_force else [IRON * seg.size] * 3 + [delay] + [SOFT] * len(SHAPES)
    made: Array = np.array([spread] * p + [BIAS] * 3 + more) ** -2
    return made


def predict_left(seg: Segments, matrix: Array) -> float:
    """The rms, as ``TurnMatrix.left``, after one step of Gauss and Newton for all numbers but M, by a quadratic."""
    prior = _prior(seg, 0, 1.0)
    state = _evaluate(seg, matrix, np.zeros(3), np.zeros(len(prior) - 3))
    gradient, hessian = _normal(seg, state, NONE)
    total = float(state.cost.mean())
    g, h = gradient.sum(axis=0), hessian.sum(axis=0) + np.diag(prior) * total
    return float(np.sqrt(max(total - g @ np.linalg.solve(h, g) / len(state.cost), 0.0)))


ALL_NINE: Array = np.eye(9).reshape(9, 3, 3)
NONE: Array = np.zeros((0, 3, 3))


def fit(
    seg: Segments,
    matrix: Array,
    basis: Array = ALL_NINE,
    spread: float = 1.0,
    near: TurnMatrix | None = None,
    delay: float = DELAY,
) -> TurnMatrix:
    """The M = ``matrix`` + Σ xᵢ ``basis``ᵢ that fits best; ``basis`` (p, 3, 3), ``spread`` 1σ of each x before it.

    The other numbers begin at those of ``near``, or at 0. ``delay`` s: 1σ of the delay about 0.
    """
    p, m = len(basis), seg.rate.shape[1]
    prior = _prior(seg, p, spread, delay)
    x, damping = np.zeros(len(prior)), 1e-3
    if near is not None:
        x[p : p + 7] = *near.bias, *near.iron, near.delay
        x[p + 7 :] = np.linalg.lstsq(SHAPES.reshape(len(SHAPES), 9).T, near.shape.ravel())[0][: len(x) - p - 7]
    best: tuple[float, Array, _State] | None = None
    gradient, hessian = np.zeros((m, len(prior))), np.zeros((m, len(prior), len(prior)))
    floor = (1e-4 * seg.size) ** 2
    for _ in range(STEPS):
        state = _evaluate(seg, matrix + _combine(x[:p], basis), x[p : p + 3], x[p + 3 :])
        total = float(state.cost.mean())
        if best is not None and not total < best[0]:
            damping *= 10.0
            if damping > 100.0 or total < best[0] * (1.0 + SETTLED):  # a smaller step would change as little
                break
        else:
            done = best is not None and total > best[0] * (1.0 - SETTLED)
            best, damping = (total, x, state), max(damping / 10.0, 1e-6)
            gradient, hessian = _normal(seg, state, basis)
            if done:
                break
        noise = max(best[0], floor)
        g, h = gradient.sum(axis=0) / noise + prior * best[1], hessian.sum(axis=0) / noise + np.diag(prior)
        x = best[1] - np.linalg.solve(h + damping * np.diag(np.diag(h)), g)
    assert best is not None
    total, x, state = best
    noise = max(total, floor)
    inverse = np.linalg.inv(hessian.sum(axis=0) / noise + np.diag(prior))
    scores = gradient / noise
    middle = seg.overlap * scores.T @ scores * m / max(1, m - 4) + np.diag(prior)
    covariance = inverse @ middle @ inverse
    rows = slice(p, p + 3)
    weight = hessian[:, rows, rows] / np.maximum(state.cost, floor)[:, None, None] + 1e-2 * np.eye(3)
    own = x[rows] - np.linalg.solve(hessian[:, rows, rows] + 1e-9 * np.eye(3), gradient[:, rows, None])[..., 0]
    return TurnMatrix(
        matrix + _combine(x[:p], basis), x[p : p + 3], x[:p], covariance[:p, :p], x[p + 3 : p + 6],
        float(x[p + 6]), _combine(x[p + 7 :], SHAPES[: len(x) - p - 7]), covariance[p + 3 :, p + 3 :],
        float(np.sqrt(total)), np.sqrt(state.cost), own, weight,
    )  # fmt: skip


SPAN, SMOOTH = 0.32, 0.16  # s, of the screening


def screen(seg: Segments) -> list[tuple[float, Array]]:
    """The residual of the vector's turn with each of the 48 wirings at its best scale: (share, s P), the least first.

    Over spans Δu = ∫ u × (M ω + b) dt is linear in M, so that one pass over the readings judges every M.
    """
    step = median(seg.step.ravel())
    box, span = max(1, round(SMOOTH / step)), max(1, round(SPAN / step))
    count = seg.rate.shape[0] // box
    if count <= span // box + 1:
        return [(1.0, IDENTITY)]
    cross = _skew(seg.vector)  # u × a = [u]× a
    columns = (cross[..., :, None] * seg.rate[..., None, None, :]).swapaxes(-1, -2)  # (k, m, row of u, j, i) of M_ij
    columns = columns.swapaxes(-1, -2).reshape(*seg.rate.shape[:2], 3, 9)
    columns = np.concatenate([columns, cross], axis=-1) * seg.step[..., None, None]
    total = np.cumsum(columns, axis=0)

    def means(values: Array) -> Array:
        made: Array = values[: count * box].reshape(count, box, *values.shape[1:]).mean(axis=1)
        return made

    over = max(1, span // box)
    said, seen = means(total), means(seg.vector)
    x = (said[over:] - said[:-over]).reshape(-1, 12)
    y = (seen[over:] - seen[:-over]).reshape(-1)
    normal, right, whole = x.T @ x, x.T @ y, float(y @ y)
    made = []
    inverse = np.linalg.pinv(normal[9:, 9:])
    for wiring in WIRINGS:
        w = wiring.ravel()
        # the bias is eliminated, the scale is free
        both = float(w @ right[:9] - w @ normal[:9, 9:] @ inverse @ right[9:])
        own = float(w @ normal[:9, :9] @ w - w @ normal[:9, 9:] @ inverse @ normal[9:, :9] @ w)
        scale = both / own if own > 0.0 else 0.0
        if scale > 0.0:
            made.append((1.0 - both * scale / max(whole, 1e-30), scale * wiring))
    return sorted(made, key=lambda one: one[0])
