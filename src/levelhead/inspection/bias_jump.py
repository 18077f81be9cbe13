"""A step of the gyroscope's bias, between a part of a recording and the rest.

``ESKF`` learns the bias in each window of some seconds, beside one M (``learned_turn``) of the whole recording: forces
average out over a window. Where the windows are not clear, the segments of ``turn_matrix`` show the turn of gravity and
of the field.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import log
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.filters import ESKF
from levelhead.filters.eskf.state import GYR_BIAS
from levelhead.inspection.agreement import SETTLED, Seen
from levelhead.inspection.findings import Finding
from levelhead.inspection.learned import is_near, learn_beside_forces
from levelhead.inspection.mend import Mend
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import ALL_NINE, TurnMatrix, fit
from levelhead.units import DEGREE

WINDOW, SHORTEST, PARTS = 10.0, 4.0, 6  # s; of a short recording a part, but no shorter
MOST = 48  # windows, spread over a long recording
START, SCALE = 6.0, 0.1  # deg/s and 1σ of a number of S, before a window
ALONE = ESKF(bias_start=START, bias_uncalibrated=0.0, bias_walk=1e-4, tilt_start=15.0, scale_start=SCALE)
PRIOR = np.repeat((START * DEGREE, SCALE), (3, 9))  # 1σ of the bias and of the nine numbers of S
FLOOR = 0.1 * DEGREE  # rad/s: 1σ that no model has
LIKELY, SURE = 4.0, 4.5  # σ of three numbers, the largest of many steps between windows
SURE_SEGMENTS = {1: 6.5, 2: 5.0}  # σ, by how many sensors show the bias
EDGE = 2  # windows or segments on each side of a step
JUMP, WIDEST = 0.6 * DEGREE, 20.0 * DEGREE  # rad/s; 20 deg/s is the zero-rate tolerance of the MPU-6050's data sheet
SIGMAS = 1.96  # of an interval of 95 %
REFINEMENTS = 2
CONVERGED = 0.25  # share of a step that the last refinement may add: real ones stay below 0.16, others diverge


class BiasJump(NamedTuple):
    """A step of the bias.

    Attributes:
        sure: by how many σ.
        change: of the bias, rad/s, (3,).
        sigma: 1σ of its numbers, rad/s, (3,).
        at: s, its time.
    """

    sure: float
    change: Array
    sigma: Array
    at: float

    @property
    def axis(self) -> int:
        """The axis whose change is clearest."""
        return int((np.abs(self.change) / self.sigma).argmax())

    @property
    def is_clear(self) -> bool:
        """Whether the interval excludes zero, and the size is one of a bias."""
        size = float(abs(self.change[self.axis]))
        return max(JUMP, SIGMAS * float(self.sigma[self.axis])) < size < WIDEST

    @property
    def mend(self) -> Mend:
        """The change taken off again, of the axes that show it."""
        shown = np.abs(self.change) > SIGMAS * self.sigma
        return Mend("gyr", np.eye(3), np.where(shown, self.change, 0.0), since=self.at)


class BiasWindows(NamedTuple):
    """The bias and S in windows of a recording, in the order of time.

    Attributes:
        first, last: s, begin and end of each, (m,).
        mean: rad/s and 1, (m, 12).
        weight: inverse covariances, (m, 12, 12).
    """

    first: Array
    last: Array
    mean: Array
    weight: Array


def find_jump(recording: Recording, seen: Sequence[Seen]) -> BiasJump | None:
    """A step of the bias that is likely."""
    windows = learn_windows(recording)
    learned = None if windows is None else step_between(windows)
    return learned or _step_of_segments(seen)


def examine_bias_jump(found: BiasJump | None) -> Iterator[Finding]:
    """Whether the gyroscope's bias is another one from some moment on."""
    if found is None:
        return
    axis = found.axis
    change, spread = np.degrees(found.change[axis]), float(np.degrees(SIGMAS * found.sigma[axis]))
    size, sure = float(abs(change)), found.sure > SURE
    yield Finding(
        "bias_jumps",
        "warning",
        f"the gyroscope's bias {'jumps' if sure else 'may jump'} by {change:+.1f} deg/s ({'xyz'[axis]}) "
        f"at about {found.at:.0f} s",
        f"rates that gravity or the field does not show, before and after; {found.sure:.0f} σ, ±{spread:.1f} deg/s",
        "Fuse the parts one by one.",
        value=size,
        interval=(max(0.0, size - spread), size + spread),
        unit="deg/s",
        mend=found.mend,
        sure=sure,
    )


def learn_windows(recording: Recording) -> BiasWindows | None:
    """Bias and S in windows; None where they are too few, and where there is no native engine."""
    duration = float(recording.duration)
    length = min(WINDOW, max(SHORTEST, duration / PARTS))
    count = int(duration / length)
    starts, found = recording.t[0] + length * np.unique(np.linspace(0, count - 1, min(count, MOST)).round()), []
    try:
        for start in starts if count >= 2 * EDGE else ():
            rows = slice(*np.searchsorted(recording.t, (start, start + length)))
            one = replace(recording[rows], mag=None)
            found.append(learn_beside_forces(one, ALONE, GYR_BIAS, len(PRIOR), PRIOR) if len(one) > 1 else None)
    except LevelheadError:
        return None
    learned = [(start, one) for start, one in zip(starts, found, strict=False) if one is not None]
    if len(learned) < 2 * EDGE:
        return None
    first = np.array([start for start, _ in learned])
    floor = np.diag(np.repeat((FLOOR**2, 0.0), (3, 9)))
    weight = np.array([np.linalg.inv(one.covariance + floor) for _, one in learned])
    return BiasWindows(first, first + length, np.array([one.mean for _, one in learned]), weight)


def step_between(windows: BiasWindows) -> BiasJump | None:
    """The clearest step, if it is likely and S stays within the first order."""
    splits = range(EDGE, len(windows.first) - EDGE + 1)
    best, matrix = max((_fit_step(windows, split) for split in splits), key=lambda one: one[0].sure)
    return best if best.sure > LIKELY and best.is_clear and is_near(matrix) else None


def _fit_step(windows: BiasWindows, split: int) -> tuple[BiasJump, Array]:
    """A step before window ``split``, and S of all: least squares for a bias before, a change and S.

    The scatter that is left, over the count of numbers that the windows show, widens the covariance.
    """
    design = np.zeros((len(windows.first), 12, 15))
    design[:, :3, :3], design[:, 3:, 6:] = np.eye(3), np.eye(9)
    design[split:, :3, 3:6] = np.eye(3)
    prior = np.diag(np.repeat((0.0, SCALE**-2.0), (6, 9)))  # biases have no prior, S has one
    normal = np.einsum("mia,mij,mjb->ab", design, windows.weight, design) + prior
    best = np.linalg.solve(normal, np.einsum("mia,mij,mj->a", design, windows.weight, windows.mean))
    off = windows.mean - design @ best
    rest = float(np.einsum("mi,mij,mj->", off, windows.weight, off))
    shown = float(
        np.trace(np.linalg.solve(windows.weight + np.diag(PRIOR**-2.0), windows.weight), axis1=1, axis2=2).sum()
    )
    excess = max(rest / max(shown - 6.0, 1.0), 1.0)
    covariance = excess * np.linalg.inv(normal)[3:6, 3:6]
    return _make_jump(best[3:6], covariance, 0.5 * float(windows.last[split - 1] + windows.first[split])), best[6:]


def _make_jump(change: Array, covariance: Array, at: float) -> BiasJump:
    sure = float(np.sqrt(change @ np.linalg.solve(covariance, change)))
    return BiasJump(sure, change, np.sqrt(np.diag(covariance)), at)


def _step_of_segments(seen: Sequence[Seen]) -> BiasJump | None:
    """The clearest step between segments; found, taken out, and its remainder added."""
    if not seen:
        return None
    start = seen[0].segments.start
    seen = [one for one in seen if np.array_equal(one.segments.start, start)]
    splits = range(EDGE, len(start) - EDGE)
    bias = _biases([one.fit for one in seen])
    best = max((_step(start, *bias, split) for split in splits), key=lambda one: one.sure, default=None)
    if best is None or best.sure < SURE_SEGMENTS[len(seen)] or float(np.abs(best.change).max()) < JUMP:
        return None
    fits, added = [one.fit for one in seen], best.change
    for _ in range(REFINEMENTS):
        after = (start >= best.at)[None, :, None]
        level = [replace(one.segments, rate=one.segments.rate - after * best.change) for one in seen]
        fits = [
            fit(part, one.fit.matrix, ALL_NINE, SETTLED, near=one.fit) for part, one in zip(level, seen, strict=True)
        ]
        again = _step(start, *_biases(fits), int((start < best.at).sum()))
        added = again.change
        best = best._replace(change=best.change + added, sigma=again.sigma)
    converged = float(np.linalg.norm(added)) < CONVERGED * float(np.linalg.norm(best.change))
    return best if best.is_clear and converged and leaves_less(fits, [one.fit for one in seen]) else None


def leaves_less(fits: Sequence[TurnMatrix], others: Sequence[TurnMatrix]) -> bool:
    """Whether fits to the sensors leave less than other fits to them: the likelihood of equal weights decides."""
    return sum(log(one.left / max(other.left, 1e-12)) for one, other in zip(fits, others, strict=True)) < 0.0


def _biases(fits: Sequence[TurnMatrix]) -> tuple[Array, Array]:
    """(m, 3) the bias in each segment by all sensors, and (m, 3, 3) its weight; each sensor weighs by its scatter."""
    weights, sums = [], []
    for one in fits:
        off = one.own_bias - _mean(one.own_weight, one.own_bias)
        rest = float(np.einsum("mi,mij,mj->", off, one.own_weight, off))
        weight = one.own_weight * (3.0 * len(off) - 3.0) / max(rest, 1e-12)
        weights.append(weight)
        sums.append(np.einsum("mij,mj->mi", weight, -one.own_bias))  # b of eq. 1 is the bias, negated
    total: Array = np.sum(weights, axis=0)
    bias: Array = np.linalg.solve(total, np.sum(sums, axis=0)[..., None])[..., 0]
    return bias, total


def _mean(weight: Array, values: Array) -> Array:
    made: Array = np.linalg.solve(weight.sum(axis=0), np.einsum("mij,mj->i", weight, values))
    return made


def _step(start: Array, bias: Array, weight: Array, split: int) -> BiasJump:
    """A step before segment ``split``, by least squares with a mean before it and one after it."""
    parts, rest = [], 0.0
    for rows in (slice(None, split), slice(split, None)):
        middle = _mean(weight[rows], bias[rows])
        off = bias[rows] - middle
        rest += float(np.einsum("mi,mij,mj->", off, weight[rows], off))
        parts.append((middle, np.linalg.inv(weight[rows].sum(axis=0))))
    excess = max(rest / (3.0 * len(bias) - 6.0), 1e-12)
    return _make_jump(parts[1][0] - parts[0][0], excess * (parts[0][1] + parts[1][1]), float(start[split]))
