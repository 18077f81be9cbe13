"""What a reference says of the gyroscope, and the gyroscope of the reference: a constant bias, and jumps after gaps."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import levelhead as lh
from levelhead.bench.reference import align_sensor
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.recording import Array, Recording
from levelhead.rotations import ONE, angle, conjugate, from_rotvec, matrix, mean, product, relative_rotation, rotvec

SPAN = 1.0  # s of a window in which the gyroscope is compared with the reference
LOST = 0.1  # s: a longer interval between samples, and the window says nothing
CONTRADICTED = 0.3  # rad: the reference is wrong in such a window
ROUNDS = 6  # of weighting
CAUCHY = 3.0  # times the median residual at which a window has half of its weight
LOST_INTERVALS = 3.0  # usual ones without a sample
APART = 5.0  # ° between the turns by the reference and by the gyroscope while the reference is lost,
JUMP = 2.5  # ° by which the error of tilt changes then: the reference came back at another place


def true_quat(recording: Recording) -> Array:
    """(n, 4) the reference, turned into the sensor's frame."""
    assert recording.truth is not None
    frame = align_sensor(recording)
    return recording.truth.quat if frame is None else frame.turn(recording.truth.quat)


def constant_bias(recording: Recording, quat: Array) -> Array:
    """(3,) rad/s: the constant b that, taken from the gyroscope, turns the sensor as the reference says.

    Over each second the gyroscope's rotation differs from the reference's by J b, J = ∫ R dt with the rotation R since
    the start of that second; b by least squares, windows that fit badly with less weight.
    """
    return _fit(recording, quat, slice(9, 12))


def constant_errors(recording: Recording, quat: Array) -> tuple[Array, Array]:
    """(3, 3) S and (3,) b, rad/s: the constants with which the true rate is ω − S ω − b, by the same least squares."""
    found = _fit(recording, quat, slice(0, 12))
    return found[:9].reshape(3, 3), found[9:]


def _fit(recording: Recording, quat: Array, part: slice) -> Array:
    """Of the nine elements of S and the three of b those that are asked for; the others are 0."""
    first, turned, lever = _windows(recording, quat)
    wrong = rotvec(product(turned, conjugate(relative_rotation(quat[first], quat[first + _samples(recording)]))))
    kept = np.linalg.norm(wrong, axis=1) < CONTRADICTED
    rows, values = lever[kept][..., part].reshape(3 * kept.sum(), -1), wrong[kept].reshape(-1)
    weight = np.ones(len(values))
    for _ in range(ROUNDS):
        found: Array = np.linalg.lstsq(rows * weight[:, None], values * weight, rcond=None)[0]
        residual = values - rows @ found
        weight = 1.0 / np.hypot(1.0, residual / (CAUCHY * np.median(np.abs(residual)) + 1e-9))
    return found


def _samples(recording: Recording) -> int:
    return max(1, round(SPAN * recording.rate))


def _windows(recording: Recording, quat: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Of each usable window its first row, the gyroscope's rotation (m, 4), and its slopes by S and b (m, 3, 12)."""
    count = _samples(recording)
    steps = np.diff(recording.t)
    rate = 0.5 * (recording.gyr[:-1] + recording.gyr[1:])
    bad = np.cumsum(np.append(0, np.isnan(rate).any(axis=1) | (steps > LOST)))
    first = np.arange(0, len(steps) - count + 1, count)
    known = ~np.isnan(quat[first, 0]) & ~np.isnan(quat[first + count, 0])
    first = first[known & (bad[first + count] == bad[first])]
    turned, lever = np.tile(ONE, (len(first), 1)), np.zeros((len(first), 3, 12))
    for k in range(count):
        dt = steps[first + k]
        turn = matrix(turned) * dt[:, None, None]
        lever[..., :9] += np.einsum("mij,ml->mijl", turn, rate[first + k]).reshape(-1, 3, 9)
        lever[..., 9:] += turn
        turned = product(turned, from_rotvec(rate[first + k] * dt[:, None]))
    return first, turned, lever


def vertical_error(estimates: Array | None, bias: Array, quat: Array) -> float:
    """°/s: mean error of a bias (n, 3) about the vertical of the reference; heading drifts by so much."""
    assert estimates is not None
    up = matrix(quat)[:, 2, :]
    return float(np.degrees(np.nanmean(((estimates - bias) * up).sum(axis=1))))


class Jump(NamedTuple):
    """A gap of the reference after which it stands at another place than the gyroscope says.

    Attributes:
        last, first: rows, the last one before the gap and the first one after it.
        longest: s, of the intervals between samples in it.
        lost: whether that is so long that samples were lost.
        reference, gyroscope, apart: ° by which either says that the sensor turned, and between the two rotations.
        before, after: °, errors of tilt.
    """

    last: int
    first: int
    longest: float
    lost: bool
    reference: float
    gyroscope: float
    apart: float
    before: float
    after: float


def gaps(quat: Array) -> list[tuple[int, int]]:
    """The last row before and the first row after each gap of the reference."""
    known = np.flatnonzero(~np.isnan(quat[:, 0]))
    ends = np.flatnonzero(np.diff(known) > 1)
    return [(int(known[i]), int(known[i + 1])) for i in ends]


def jumps(recording: Recording, quat: Array, tilt: Array) -> list[Jump]:
    """Those gaps of the reference ``quat`` in which it turns otherwise than the gyroscope and ``tilt`` (n, °) jumps."""
    seen = lh.fuse(recording, lh.GyroIntegration(), guard=None).quat
    usual = float(np.median(np.diff(recording.t)))
    found = []
    for last, first in gaps(quat):
        if abs(tilt[first] - tilt[last]) <= JUMP:
            continue
        ends = ([last], [first])
        turned, measured = (relative_rotation(*(values[rows] for rows in ends)) for values in (quat, seen))
        angles = (angle(turned), angle(measured), angle(relative_rotation(turned, measured)))
        if np.degrees(angles[2][0]) <= APART:
            continue
        longest = float(np.diff(recording.t[last : first + 1]).max())
        degrees = [float(np.degrees(one[0])) for one in angles]
        errors = float(tilt[last]), float(tilt[first])
        found.append(Jump(last, first, longest, longest > LOST_INTERVALS * usual, *degrees, *errors))
    return found


def after_jumps(count: int, found: Sequence[Jump]) -> NDArray[np.bool_]:
    """(count,) the rows from each jump to a larger error up to the next jump."""
    rows = np.zeros(count, dtype=bool)
    for jump in found:  # in the order of time
        rows[jump.first :] = jump.after > jump.before
    return rows


def tilt_errors(quat: Array, reference: Array, rows: NDArray[np.bool_]) -> Array:
    """(n,) errors of tilt in ° without the constant rotation of the earth frame that fits best over ``rows``."""
    error = error_quaternion(quat, reference)
    return np.degrees(split_error(relative_rotation(mean(error[rows]), error)).tilt)
