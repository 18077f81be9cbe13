"""Nine numbers of a gyroscope from the turns between poses: gravity must end where the next pose has it.

With the reading w and that at rest w₀ the true rate is (1 − S)(w − w₀). A turn R from the frame at its end to that at
its start takes the direction u of the specific force before to Rᵀu after (Tedaldi, Pretto & Menegatti 2014, eq. 12). R
changes with S by the rotation vector −∫ R(t) dS (w − w₀) dt in the frame at the start, so that each step of Gauss and
Newton is linear.
"""

from collections.abc import Sequence

import numpy as np

from levelhead.calibrate.least_squares import ROBUST, Solution
from levelhead.calibrate.poses import MeasuredTurn, Pose
from levelhead.recording import Array
from levelhead.rotations import from_rotvec, matrix, product

PRIOR = 0.05  # 1σ of each of the nine before any measurement
FLOOR = 5e-4  # rad, 1σ of a direction at the end of a turn that nothing lowers
BIAS_FLOOR = 5e-5  # rad/s, 1σ of the bias during a turn
ROUNDS = 6


class Turns:
    """All turns side by side.

    Attributes:
        before: (k, 3) directions of the specific force at their starts.
        after: (k, 3) at their ends.
        sigma: (k,) 1σ of a component of ``after`` as predicted, rad.
    """

    def __init__(self, turns: Sequence[MeasuredTurn], poses: Sequence[Pose], force: Array) -> None:
        unit = force / np.linalg.norm(force, axis=1, keepdims=True)
        first = [turn.first for turn in turns]
        self.before, self.after = unit[first], unit[[i + 1 for i in first]]
        longest = max(len(turn.rates) for turn in turns)
        self._rates, self._steps = np.zeros((longest, len(turns), 3)), np.zeros((longest, len(turns), 1))
        self.sigma = np.empty(len(turns))
        for k, turn in enumerate(turns):
            self._rates[: len(turn.rates), k], self._steps[: len(turn.rates), k, 0] = turn.rates, turn.steps
            time, a, b = float(turn.steps.sum()), poses[turn.first], poses[turn.first + 1]
            level = np.hypot(a.sigma, b.sigma) / 9.8
            self.sigma[k] = np.sqrt(level**2 + max(a.noise, b.noise) ** 2 * time + (BIAS_FLOOR * time) ** 2 + FLOOR**2)

    def __len__(self) -> int:
        return len(self.sigma)

    def predict(self, s: Array) -> tuple[Array, Array]:
        """(k, 3) where ``before`` is at the end of each turn, and (k, 3, 9) how that changes with S by rows."""
        true = self._rates - self._rates @ s.T
        half = from_rotvec((0.5 * true * self._steps).reshape(-1, 3))
        whole = product(half, half).reshape(*true.shape[:2], 4)
        quat, before = np.tile([1.0, 0.0, 0.0, 0.0], (len(self), 1)), np.empty_like(whole)
        for i, step in enumerate(whole):  # one product for each reading: of what differs from turn to turn alone
            before[i] = quat
            quat = product(quat, step)
        middle = matrix(product(before.reshape(-1, 4), half)).reshape(*true.shape[:2], 3, 3)
        moved = -np.einsum("tkij,tkn->kijn", middle, self._rates * self._steps).reshape(len(self), 3, 9)
        turned = matrix(quat).transpose(0, 2, 1)
        predicted = np.einsum("kij,kj->ki", turned, self.before)
        change = np.einsum("kij,kjn->kin", turned, np.cross(self.before[:, :, None], moved, axis=1))
        return predicted, change

    def misses(self, s: Array) -> Array:
        """(k,) angles between predicted and measured directions at the ends, rad."""
        missed: Array = np.linalg.norm(self.predict(s)[0] - self.after, axis=1)
        return missed


def fit_gyroscope(turns: Turns, start: Array | None = None, rounds: int = ROUNDS) -> Solution:
    """S by rows: robust Gauss–Newton with a prior."""
    s, weight, scale = np.zeros(9) if start is None else start, np.ones(len(turns)), 1.0
    hessian = _hessian(np.zeros((0, 9)))
    for step in range(rounds):
        predicted, change = turns.predict(s.reshape(3, 3))
        over = np.sqrt(weight) / (turns.sigma * scale)
        jacobian = (change * over[:, None, None]).reshape(-1, 9)
        left = ((turns.after - predicted) * over[:, None]).reshape(-1)
        hessian = _hessian(jacobian)
        s = s + np.linalg.solve(hessian, jacobian.T @ left - s / PRIOR**2)
        misses = np.linalg.norm(turns.after - predicted, axis=1) / turns.sigma
        free = 2 * len(turns) - 9  # a direction has two numbers
        if step == 0:
            continue  # these are the misses before
        if free > 0:
            limited = np.minimum(misses, ROBUST * 1.5 * scale)
            scale = max(1.0, float(np.sqrt((limited**2).sum() / free)))
        weight = np.minimum(1.0, ROBUST * scale / np.maximum(misses, 1e-12))
    return Solution(s, np.asarray(np.linalg.inv(hessian), np.float64), scale)


def force_covariance(
    turns: Sequence[MeasuredTurn], poses: Sequence[Pose], s: Array, force: Array, others: Sequence[Array]
) -> Array:
    """(9, 9) covariance of S that comes from directions of gravity which are themselves calibrated.

    Args:
        turns: the turns.
        poses: the poses.
        s: (9,) what was found.
        force: (k, 3) specific force of the poses as corrected.
        others: the same with the accelerometer's numbers off by each column of a root of their covariance.
    """
    first, *off = (fit_gyroscope(Turns(turns, poses, one), s, 1).value for one in (force, *others))
    moved = np.array(off) - first
    spread: Array = moved.T @ moved
    return spread


def _hessian(jacobian: Array) -> Array:
    """(9, 9) with the prior."""
    whole: Array = jacobian.T @ jacobian + np.eye(9) / PRIOR**2
    return whole
