"""Whether gyroscope, accelerometer and magnetometer agree about each turn: scale, wiring and mounting of each.

Let the matrices G, A and B lead from the true rate, force and field to the readings. From u' = u × ω follows that
the matrix M between the gyroscope and the turn that a sensor shows is det(A) A G⁻¹ (for an orthogonal A), or
det(B) B G⁻¹. Each fault of one sensor is a family of such matrices. The fits and their covariances judge each; the
one with the least χ² + penalty wins (G. Schwarz, Estimating the dimension of a model, Ann. Statist. 6, 1978). Twice
the logarithm of its odds above 2 is positive evidence, above 6 strong (R. Kass and A. Raftery, Bayes factors, J. Am.
Stat. Assoc. 90, 1995).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from levelhead.inspection.delays import remove_delay
from levelhead.inspection.learned_turn import LearnedTurn, learn_turn
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import (
    ALL_NINE,
    IDENTITY,
    MAX_SEGMENTS,
    NONE,
    WIRINGS,
    Segments,
    TurnMatrix,
    cut,
    fit,
    predict_left,
    screen,
)
from levelhead.units import DEGREE

FLOOR = 0.02  # 1σ of each number of M: scale errors of good sensors, and errors beyond any model
FOLLOWS = 0.6  # share of the turn that forces, or iron nearby, may mimic
MIMICKED = 0.1  # the same for the filter, which averages over seconds
CONTRARY = 25.0  # χ² of nine numbers, which one pair in 300 exceeds
SETTLED = 0.03  # 1σ of each number of M beside the fault that was found
AXIS_SPREAD = 0.3  # 1σ of the logarithm of one axis's scale beside the others'
MIN_SCALE_SIGMAS = 4.0  # σ by which a scale must differ from 0: no turn has no scale
UNITS = (DEGREE, 1.0 / DEGREE)  # factors that people take one unit for another by
UNIT_SIGMA = 0.01  # of such a factor, as a share of it
BEYOND = 4000.0 * DEGREE  # rad/s: the widest range of gyroscopes in use (data sheet of the LSM6DSV)
RARE, IMPOSSIBLE = 0.01, 60.0  # share of rates beyond it that are spikes; penalty of more of them
CONTRAST = 1.5  # below which forces hide the turn of gravity
CLEAR, LONG = 5.0, 3  # contrast below which segments LONG times as long are looked at: their velocities stay as small
CANDIDATES = 3  # wirings that are fitted
TRIED = 6  # turns that are tried with a whole fit of the residual of M
UNLIKE = 0.3  # by which a number of M is off the identity's, from which other starts are tried
SEARCHED = 12  # segments on which they are
SCALES = (0.5, 2.0)  # that are tried besides the wirings
ASKEW = 30.0 * DEGREE  # mountings about each axis that are tried too
BASINS = 0.9  # of the identity's residual: the limit below which another wiring starts the fit
MAX_ROWS = 100_000  # rows that show the distribution of rates
LIKELY_ODDS, SURE_ODDS = 3.0, 8.0  # 2 ln of the odds from which a fault is likely, and from which it is sure
MAX_EXCESS = 6.0  # χ² a number, beyond which no fault explains the readings
TIED = 8.0  # by which two faults differ


class Seen(NamedTuple):
    """The evidence of one vector.

    Attributes:
        role: "acc" or "mag".
        fit: the matrix, its covariance and its evidence.
        weight: the inverse of its covariance, with the errors beyond any model, (9, 9).
        contrast: how many times more is left where nothing is turned back.
        low_pass: 2 ln of the odds that the delay is the time constant of a filter; 0: it is a delay.
        segments: that were compared.
    """

    role: str
    fit: TurnMatrix
    weight: Array
    contrast: float
    low_pass: float
    segments: Segments


class Hypothesis(NamedTuple):
    """A hypothesis.

    Attributes:
        kind: "none", "scale", "axis_scale", "wiring", "mounting" or "matrix".
        role: the sensor at fault.
        matrix: the factor that makes its readings right, (3, 3).
        chi: χ² of the matrices seen.
        penalty: for how seldom people do that, and for the numbers that were fitted.
        covariance: of the scale, or of the three angles of a mounting, rad; of a wiring (0, 0).
    """

    kind: str
    role: str
    matrix: Array
    chi: float
    penalty: float
    covariance: Array = np.zeros((0, 0))

    @property
    def sigma(self) -> float:
        """1σ of the scale, or of the angle of a mounting."""
        if self.kind != "mounting":
            return float(self.covariance[0, 0] ** 0.5)
        axis = np.array([self.matrix[2, 1], self.matrix[0, 2], self.matrix[1, 0]]) - np.array(
            [self.matrix[1, 2], self.matrix[2, 0], self.matrix[0, 1]]
        )
        return float(np.sqrt(axis @ self.covariance @ axis) / max(float(np.linalg.norm(axis)), 1e-12))

    @property
    def score(self) -> float:
        """χ² + penalty."""
        return self.chi + self.penalty


def look(role: str, seg: Segments) -> Seen:
    """The matrix that fits best, from the best start."""
    whole = _fit_from(seg, _screened(seg))
    if seg.scatter < CLEAR * whole.left and np.abs(whole.matrix - IDENTITY).max() > UNLIKE:
        other = _fit_from(seg, _searched(seg))
        whole = other if other.left < BASINS * whole.left else whole
    whole, share, low_pass = remove_delay(seg, whole, 1.0)
    contrast = 1.0 / max(share, 1e-9)
    floor = FLOOR + FOLLOWS / max(contrast**2 - 1.0, 1e-3)  # residual over the part that the turn explains
    covariance = whole.covariance + floor**2 * np.eye(9)
    weight = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    return Seen(role, whole, weight, contrast, low_pass, seg)


def _fit_from(seg: Segments, starts: Sequence[Array]) -> TurnMatrix:
    """The fit of all nine numbers from the identity, or from a start that leaves clearly less."""
    if not starts:
        return fit(seg, IDENTITY)
    usual = best = fit(seg, IDENTITY, IDENTITY[None])
    parts = seg.split()
    for start in starts:
        basis = start[None] / np.abs(start).max()
        rough = fit(parts, start, basis)
        one = fit(seg, rough.matrix, basis, near=rough)
        if one.left < BASINS * best.left:
            best = one
    whole = fit(seg, usual.matrix, ALL_NINE, near=usual)
    if best is usual:
        return whole
    other = fit(seg, best.matrix, ALL_NINE, near=best)
    return other if other.left < BASINS * whole.left else whole


def _screened(seg: Segments) -> list[Array]:
    """Starts by the vector's turn; none where the readings as they are explain it best."""
    judged = screen(seg)
    usual = next((share for share, one in judged if np.allclose(one / np.abs(one).max(), IDENTITY)), 1.0)
    starts = [one for share, one in judged[:CANDIDATES] if share <= usual and not _is_usual(one)]
    return starts + ([DEGREE * IDENTITY] if np.abs(seg.rate).max() > BEYOND else [])


def _searched(seg: Segments) -> list[Array]:
    """Starts by trial of each wiring and of the usual scales, where forces hide the turn within short spans.

    The first step of a fit chooses the turns that get a whole one. A scale, which needs more steps, always gets it.
    """
    few = seg.choose(SEARCHED).split()
    askew = [_rotation(angle * axis) for axis in IDENTITY for angle in (-ASKEW, ASKEW)]
    likely = sorted([*WIRINGS, *askew], key=lambda one: predict_left(few, one))[:TRIED]
    tried = [*likely, *(scale * IDENTITY for scale in (*SCALES, *UNITS))]
    return sorted(tried, key=lambda one: fit(few, one, NONE).left)[:CANDIDATES]


def _is_usual(start: Array) -> bool:
    """Whether a wiring with its scale leads to the same fit as the readings as they are."""
    scale = float(np.abs(start).max())
    return bool(np.allclose(start / scale, IDENTITY)) and 0.7 < scale < 1.4


def _combine(seen: Seen, learned: LearnedTurn | None) -> Seen:
    """With the M that the filter has learned, where the two do not contradict each other."""
    if learned is None:
        return seen
    floor = FLOOR + MIMICKED / max(seen.contrast**2 - 1.0, 1e-3)
    covariance = learned.covariance + floor**2 * np.eye(9)
    off = (seen.fit.matrix - learned.matrix).ravel()
    if off @ np.linalg.solve(covariance + np.linalg.inv(seen.weight), off) > CONTRARY:
        return seen
    own = np.linalg.inv(covariance)
    total = np.asarray(np.linalg.inv(own + seen.weight), dtype=np.float64)
    matrix = (seen.fit.matrix.ravel() - total @ own @ off).reshape(3, 3)
    return seen._replace(fit=seen.fit._replace(matrix=matrix, covariance=total), weight=own + seen.weight)


def settle(seen: Seen, fault: "Hypothesis | None") -> Seen:
    """Fitted again near the M that the fault explains, so that the rest (delay, bias, iron) is known better."""
    matrix = IDENTITY if fault is None else seen.fit.matrix
    whole = fit(seen.segments, matrix, ALL_NINE, SETTLED, near=seen.fit)
    timed = remove_delay(seen.segments, whole, SETTLED)
    return seen._replace(fit=timed.fit, low_pass=timed.low_pass)


def _chi(seen: Seen, matrix: Array) -> float:
    off = (seen.fit.matrix - matrix).ravel()
    return float(off @ seen.weight @ off)


def _minimum(seen: Sequence[tuple[Seen, Array]], basis: Array) -> tuple[float, Array, Array]:
    """(χ², x, covariance) of Mₛ = Σ x basis · Rₛ for all sensors s with their fixed Rₛ; basis (p, 3, 3)."""
    p = len(basis)
    normal, right, whole = np.zeros((p, p)), np.zeros(p), 0.0
    for one, fixed in seen:
        columns = (fixed @ basis).reshape(p, 9)
        value = one.fit.matrix.ravel()
        normal += columns @ one.weight @ columns.T
        right += columns @ one.weight @ value
        whole += float(value @ one.weight @ value)
    covariance = np.asarray(np.linalg.pinv(normal), dtype=np.float64)
    x = covariance @ right
    return whole - float(right @ x), x, covariance


def _penalty(wiring: Array) -> float:
    """More for rarer mistakes: one axis reversed 6, a swap 7, a cycle 8, all reversed 6, the rest 11."""
    magnitude, negative = np.abs(wiring), int((wiring < 0.0).sum())
    moved = int(3 - np.trace(magnitude))
    if moved == 0:
        return {1: 6.0, 2: 9.0, 3: 6.0}[negative]
    return (7.0 if moved == 2 else 8.0) + 3.0 * negative


def faults(seen: Sequence[Seen], fastest: float = 0.0) -> list[Hypothesis]:
    """All hypotheses, the likeliest first; ``fastest`` rad/s is the rate that few readings exceed."""
    made = [Hypothesis("none", "", IDENTITY, sum(_chi(one, IDENTITY) for one in seen), 0.0)]
    roles = {one.role: one for one in seen}
    for wiring in WIRINGS[1:]:
        penalty, proper = _penalty(wiring), float(np.linalg.det(wiring)) * wiring
        inverse = wiring.T
        made.append(Hypothesis("wiring", "gyr", inverse, sum(_chi(one, inverse) for one in seen), penalty))
        if np.allclose(proper, IDENTITY):
            continue
        for role, one in roles.items():
            rest = sum(_chi(other, IDENTITY) for other in seen if other is not one)
            made.append(Hypothesis("wiring", role, inverse, rest + _chi(one, proper), penalty))
    made += [*_scales(seen, fastest), *_mountings(seen)]
    made = [one for one in made if one.role != "gyr" or not _is_contradicted(seen, one.matrix)]
    if fastest > BEYOND:  # no gyroscope measures that: it must be scaled down
        made = [
            one if np.abs(one.matrix).max() * fastest < BEYOND else one._replace(penalty=one.penalty + IMPOSSIBLE)
            for one in made
        ]
    return sorted(made, key=lambda one: one.score)


def _is_contradicted(seen: Sequence[Seen], matrix: Array) -> bool:
    """Whether a fault of the gyroscope, which each sensor would see, makes the evidence of one much worse."""
    return any(_chi(one, matrix) - _chi(one, IDENTITY) > CONTRARY for one in seen)


def fit_scale(seen: Sequence[Seen]) -> tuple[float, float, float]:
    """(factor that makes the gyroscope right, its 1σ, χ²)."""
    chi, x, covariance = _minimum([(one, IDENTITY) for one in seen], IDENTITY[None])
    return float(x[0]), float(covariance[0, 0] ** 0.5), chi


def _scales(seen: Sequence[Seen], fastest: float) -> Iterator[Hypothesis]:
    """The gyroscope times a factor, in another unit, or one of its axes times a factor."""
    factor, sigma, chi = fit_scale(seen)
    turns = factor > MIN_SCALE_SIGMAS * sigma
    explained = turns or fastest > BEYOND or max(one.contrast for one in seen) > CLEAR or _is_small_unit(seen)
    if turns:
        yield Hypothesis("scale", "gyr", factor * IDENTITY, chi, 6.0, np.array([[sigma**2]]))
    for unit in UNITS if explained else ():
        right = unit * IDENTITY
        spread = np.array([[(UNIT_SIGMA * unit) ** 2]])
        yield Hypothesis("scale", "gyr", right, sum(_chi(one, right) for one in seen), 5.0, spread)
    for axis in range(3):
        direction = np.diag(IDENTITY[axis])
        shifted = [
            (one._replace(fit=one.fit._replace(matrix=one.fit.matrix - (IDENTITY - direction))), IDENTITY)
            for one in seen
        ]
        chi, x, covariance = _minimum(shifted, direction[None])
        matrix = IDENTITY + (float(x[0]) - 1.0) * direction
        if x[0] > MIN_SCALE_SIGMAS * covariance[0, 0] ** 0.5:
            penalty = 16.0 + (math.log(float(x[0])) / AXIS_SPREAD) ** 2
            yield Hypothesis("axis_scale", "gyr", matrix, chi, penalty, covariance)


def _is_small_unit(seen: Sequence[Seen]) -> bool:
    """Whether deg/s were taken for rad/s, by the fits' own covariances: the floor of the others hides so small an M."""
    own = [(one._replace(weight=np.asarray(np.linalg.inv(one.fit.covariance), float)), IDENTITY) for one in seen]
    _, x, covariance = _minimum(own, IDENTITY[None])
    scale, sigma = float(x[0]), float(covariance[0, 0] ** 0.5)
    return scale > MIN_SCALE_SIGMAS * sigma and abs(scale - DEGREE) < 0.1 * DEGREE + sigma


def _mountings(seen: Sequence[Seen]) -> Iterator[Hypothesis]:
    """One sensor turned against the others by less than 60°."""
    for role in ("gyr", *(one.role for one in seen)):
        if role == "gyr" and len(seen) == 1:
            continue
        mine = list(seen) if role == "gyr" else [one for one in seen if one.role == role]
        rest = sum(_chi(other, IDENTITY) for other in seen if other not in mine)
        rotation, chi, covariance = IDENTITY, 0.0, np.zeros((3, 3))
        for _ in range(6):
            basis = np.array([skew @ rotation for skew in _GENERATORS])
            shifted = [(one._replace(fit=one.fit._replace(matrix=one.fit.matrix - rotation)), IDENTITY) for one in mine]
            chi, x, covariance = _minimum(shifted, basis)
            rotation = _rotation(x) @ rotation
        chi = sum(_chi(one, rotation) for one in mine)
        if angle_of(rotation) < np.pi / 3.0:
            matrix = rotation if role == "gyr" else rotation.T
            yield Hypothesis("mounting", role, matrix, rest + chi, 16.0, covariance)


_GENERATORS: Array = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]],
    dtype=np.float64,
)


def angle_of(rotation: Array) -> float:
    """rad, of a rotation (3, 3)."""
    return float(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0)))


def _rotation(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    skew = np.tensordot(vector, _GENERATORS, 1)
    made: Array = IDENTITY + np.sinc(angle / np.pi) * skew + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (skew @ skew)
    return made


class Agreement(NamedTuple):
    """The evidence, the hypotheses (the likeliest first), and the ratio of χ² to the model's."""

    seen: Sequence[Seen]
    faults: Sequence[Hypothesis]
    excess: float

    @property
    def gain(self) -> float:
        """2 ln of the odds for the likeliest fault against none."""
        none = next((one.score for one in self.faults if one.kind == "none"), 0.0)
        return (none - self.faults[0].score) / self.excess if self.faults else 0.0

    @property
    def fault(self) -> Hypothesis | None:
        """The fault that is likely; None: no fault, or the motion does not show it."""
        return self.faults[0] if self.gain > LIKELY_ODDS and not self.is_contradictory else None

    @property
    def is_contradictory(self) -> bool:
        """Whether the sensors disagree as no fault explains."""
        return self.excess > MAX_EXCESS

    @property
    def is_sure(self) -> bool:
        """Whether the fault is beyond doubt."""
        return self.gain > SURE_ODDS

    def rivals(self, fault: Hypothesis) -> list[Hypothesis]:
        """Other faults of the same kind that explain the same about as well.

        A force or a field with all signs turned round turns alike: of the two, the one that is done more often stands.
        """
        near = [one for one in self.faults if one.score - fault.score < TIED * self.excess]
        known = [(one.role, -one.matrix) for one in (fault, *near) if one.role != "gyr" and one.penalty < 9.0]

        def is_twin(one: Hypothesis) -> bool:
            return any(one.role == role and np.allclose(one.matrix, matrix) for role, matrix in known)

        return [one for one in near if one.kind == fault.kind and one is not fault and not is_twin(one)]


def agree(recording: Recording, most: int = MAX_SEGMENTS) -> Agreement:
    """Compares the sensors of a recording over up to ``most`` segments."""
    seen = []
    for role in ("acc", "mag"):
        values = getattr(recording, role)
        if values is None:
            continue
        seg = cut(recording.t, recording.gyr, values, role == "acc", most)
        if seg is None or not seg.size > 0.0:
            continue
        seen.append(look(role, seg))
        if role == "acc" and seen[-1].contrast < CLEAR:
            long = cut(recording.t, recording.gyr, values, True, most, LONG)
            other = seen[-1] if long is None else look(role, long)
            if other.contrast > seen[-1].contrast:
                seen[-1] = other._replace(segments=seg)
        if role == "acc":
            seen[-1] = _combine(seen[-1], learn_turn(recording))
    if not seen:
        return Agreement((), (), 1.0)
    rates = np.linalg.norm(recording.gyr[:: 1 + len(recording) // MAX_ROWS], axis=1)
    judged = faults(seen, float(np.nanquantile(rates, 1.0 - RARE)))
    return Agreement(seen, judged, max(1.0, judged[0].chi / (9.0 * len(seen))))
