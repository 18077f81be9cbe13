"""Nine numbers of a gyroscope from the turns between poses: gravity must end where the next pose has it.

With the reading w and that at rest w₀ the true rate is (1 − S)(w − w₀). A turn R from the frame at its end to that at
its start takes the direction u of the specific force before to Rᵀu after (Tedaldi, Pretto & Menegatti 2014, eq. 12). R
changes with S by the rotation vector −∫ R(t) dS (w − w₀) dt in the frame at the start, so that each step of Gauss and
Newton is linear.

A turn on a table against an edge has a known angle α about u too: u · log(R exp(−α u)) = 0. It gives the scale of the
axis that is upright, which gravity does not show.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.calibrate.least_squares import ROBUST, Solution
from levelhead.calibrate.poses import MeasuredTurn, Pose
from levelhead.recording import Array
from levelhead.rotations import conjugate, from_rotvec, matrix, product, rotvec
from levelhead.units import DEGREE, GRAVITY

SCALE, CROSS_AXIS = 0.03, 0.02  # 1σ of a number on the diagonal of S, and beside it, before any measurement
PRIOR = np.where(np.eye(3) > 0.0, SCALE, CROSS_AXIS)  # (3, 3)
FLOOR = 1e-4  # rad, 1σ of a direction at the end of a turn that nothing lowers
EDGE = 0.25 * DEGREE  # rad, 1σ of a turn from edge to edge
BIAS_FLOOR = 5e-5  # rad/s, 1σ of the bias during a turn
LEVEL = 5.0 * DEGREE  # rad between gravity before and after a turn on a table
ROUNDS = 6


class Turns(NamedTuple):
    """All turns side by side.

    Attributes:
        before: (k, 3) directions of the specific force at their starts.
        after: (k, 3) at their ends.
        sigma: (k,) 1σ of a component of ``after`` as predicted, rad.
        turn_sigma: (k,) 1σ of the angle from edge to edge, rad.
        rates: (m, k, 3) mean rates of the intervals, rad/s; 0 after a turn's end.
        steps: (m, k, 1) their lengths, s.
        angle: (k,) known angles about ``before``, rad; NaN: not known.
    """

    before: Array
    after: Array
    sigma: Array
    turn_sigma: Array
    rates: Array
    steps: Array
    angle: Array

    def part(self, keep: NDArray[np.bool_]) -> "Turns":
        """Some of the turns."""
        return Turns(
            self.before[keep], self.after[keep], self.sigma[keep], self.turn_sigma[keep], self.rates[:, keep],
            self.steps[:, keep], self.angle[keep],
        )  # fmt: skip

    @property
    def spread(self) -> Array:
        """(k, 4) rad, 1σ of the residuals."""
        made: Array = np.stack([self.sigma, self.sigma, self.sigma, self.turn_sigma], axis=1)
        return made

    def residuals(self, s: Array) -> tuple[Array, Array]:
        """(k, 4) of each turn, and (k, 4, 9) their changes with S by rows.

        Three are ``after`` minus its prediction; the fourth is the angle missed. Where it is known, and so gravity
        stays, the three are 0; else the fourth is.
        """
        true = self.rates - self.rates @ s.T
        half = from_rotvec((0.5 * true * self.steps).reshape(-1, 3))
        whole = product(half, half).reshape(*true.shape[:2], 4)
        quat, before = np.tile([1.0, 0.0, 0.0, 0.0], (len(self.sigma), 1)), np.empty_like(whole)
        for i, step in enumerate(whole):  # one product for each reading: of the parts that differ from turn to turn
            before[i] = quat
            quat = product(quat, step)
        middle = matrix(product(before.reshape(-1, 4), half)).reshape(*true.shape[:2], 3, 3)
        moved = -np.einsum("tkij,tkn->kijn", middle, self.rates * self.steps).reshape(len(self.sigma), 3, 9)
        turned = matrix(quat).transpose(0, 2, 1)
        left, change = np.empty((len(self.sigma), 4)), np.empty((len(self.sigma), 4, 9))
        left[:, :3] = self.after - np.einsum("kij,kj->ki", turned, self.before)
        change[:, :3] = -np.einsum("kij,kjn->kin", turned, np.cross(self.before[:, :, None], moved, axis=1))
        known = np.isfinite(self.angle)
        left[known, :3], change[known, :3] = 0.0, 0.0
        asked = from_rotvec(np.where(known, self.angle, 0.0)[:, None] * self.before)
        off = rotvec(product(quat, conjugate(asked)))
        left[:, 3] = known * np.einsum("ki,ki->k", self.before, off)
        change[:, 3] = known[:, None] * np.einsum("ki,kin->kn", self.before, moved)
        return left, change

    def misses(self, s: Array) -> Array:
        """(k,) angles by which gravity, and a known angle, are missed at the ends, rad."""
        missed: Array = np.linalg.norm(self.residuals(s)[0], axis=1)
        return missed


def gather_turns(
    turns: Sequence[MeasuredTurn], poses: Sequence[Pose], force: Array, unsure: Array, step: float | None
) -> Turns:
    """The turns with the specific force of the poses as corrected.

    Args:
        turns: the turns.
        poses: the poses.
        force: (n, 3) specific force of the poses as corrected.
        unsure: (n,) 1σ of a component of its direction by the accelerometer's numbers, rad.
        step: rad; turns on the table are by a multiple of it. None: their angle is not known.
    """
    unit = force / np.linalg.norm(force, axis=1, keepdims=True)
    first = np.array([turn.first for turn in turns])
    longest = max(len(turn.rates) for turn in turns)
    rates, steps = np.zeros((longest, len(turns), 3)), np.zeros((longest, len(turns), 1))
    sigma, turn_sigma = np.empty(len(turns)), np.empty(len(turns))
    for k, turn in enumerate(turns):
        rates[: len(turn.rates), k], steps[: len(turn.rates), k, 0] = turn.rates, turn.steps
        time, a, b = float(turn.steps[1:-1].sum()), poses[turn.first], poses[turn.first + 1]
        level, bias = np.hypot(a.sigma, b.sigma) / GRAVITY, np.hypot(turn.bias_sigma, BIAS_FLOOR)
        level = np.hypot(level, np.hypot(*unsure[turn.first : turn.first + 2]))
        drift = max(a.noise, b.noise) ** 2 * time + (bias * time) ** 2
        sigma[k], turn_sigma[k] = np.sqrt(level**2 + drift + FLOOR**2), np.sqrt(drift + EDGE**2)
    angle = np.full(len(turns), np.nan)
    if step is not None:
        flat = np.einsum("ki,ki->k", unit[first], unit[first + 1]) > np.cos(LEVEL)
        about = np.einsum("ki,mki,mkj->k", unit[first], rates, steps)
        number = np.rint(about / step)
        angle[flat & (number != 0)] = (number * step)[flat & (number != 0)]
    return Turns(unit[first], unit[first + 1], sigma, turn_sigma, rates, steps, angle)


def fit_gyroscope(
    turns: Turns, start: Array | None = None, rounds: int = ROUNDS, prior: Array = PRIOR
) -> Solution:  # fmt: skip
    """S by rows: robust Gauss–Newton with a prior, (3, 3) 1σ of S about 0."""
    count, known = len(turns.sigma), int(np.isfinite(turns.angle).sum())
    s, weight, scale = np.zeros(9) if start is None else start, np.ones(count), 1.0
    information = np.diag(prior.ravel() ** -2.0)
    hessian = information
    for step in range(rounds):
        left, change = turns.residuals(s.reshape(3, 3))
        over = np.sqrt(weight)[:, None] / (turns.spread * scale)
        jacobian = (change * over[:, :, None]).reshape(-1, 9)
        hessian = jacobian.T @ jacobian + information
        s = s - np.linalg.solve(hessian, jacobian.T @ (left * over).reshape(-1) + information @ s)
        misses = np.linalg.norm(left / turns.spread, axis=1)
        free = 2 * count - known - 9  # a direction has two numbers, an angle one
        if step == 0:
            continue  # these are the misses before
        if free > 0:
            limited = np.minimum(misses, ROBUST * 1.5 * scale)
            scale = max(1.0, float(np.sqrt((limited**2).sum() / free)))
        weight = np.minimum(1.0, ROBUST * scale / np.maximum(misses, 1e-12))
    return Solution(s, np.asarray(np.linalg.inv(hessian), np.float64), scale)


def force_covariance(turns: Turns, s: Array, others: Sequence[Turns]) -> Array:
    """(9, 9) covariance of S that comes from directions of gravity which are themselves calibrated.

    Args:
        turns: the turns.
        s: (9,) the estimate.
        others: the same with the accelerometer's numbers off by each column of a root of their covariance.
    """
    first, *off = (fit_gyroscope(one, s, 1).value for one in (turns, *others))
    moved = np.array(off) - first
    spread: Array = moved.T @ moved
    return spread
