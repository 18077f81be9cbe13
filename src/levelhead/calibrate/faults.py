"""Faults that no calibration corrects: an axis that is reversed, swapped, clipped, stuck or of another range."""

from collections.abc import Iterator, Sequence

import numpy as np

from levelhead.calibrate.gyroscope import Turns, fit_gyroscope
from levelhead.calibrate.least_squares import Solution
from levelhead.calibrate.poses import MeasuredTurn, Pose
from levelhead.errors import LevelheadError
from levelhead.inspection.turns import change_of
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import IDENTITY, WIRINGS
from levelhead.units import DEGREE, GRAVITY

MAX_SCALE_ERROR = 0.2  # of a scale factor, beyond any sensor's tolerance
MAX_BIAS = 3.0  # m/s²
MAX_MISS = 0.1  # rad, RMS by which turns miss from which their cause is looked for
MIN_GAIN = 4.0  # times less missed with the cause allowed for
FACTORS = (0.25, 0.5, 0.8, 1.25, 2.0, 4.0)  # of a range or unit that was mistaken
LIKELY = 4  # causes that are fitted
MIN_CLIPPED_ROWS, MIN_CLIPPED_SHARE, MAX_BESIDE = (
    5,
    0.05,
    0.2,
)  # rows at the largest value: least, of a turn; of those just below
FULL = 0.97  # of g: an axis that reads so much is not clipped


def clipped_axes(recordings: Sequence[Recording], poses: Sequence[Pose], turns: Sequence[MeasuredTurn]) -> list[str]:
    """Of each turn the axis of the gyroscope that is at its full scale: "x", or nothing."""
    limits = [_limits(one.gyr) for one in recordings]
    return [_clipped_axis(recordings, limits, poses[one.first], poses[one.first + 1]) for one in turns]


def _limits(gyr: Array) -> Array:
    """(2, 3) largest and least values at which the axes stand; infinite where they do not."""
    found: Array = np.full((2, 3), np.inf) * np.array([[1.0], [-1.0]])
    for axis, values in enumerate(gyr.T):
        for side, sign in enumerate((1.0, -1.0)):
            several, counts = np.unique(sign * values[np.isfinite(values)], return_counts=True)
            if len(several) > 1 and counts[-1] >= MIN_CLIPPED_ROWS and counts[-2] <= MAX_BESIDE * counts[-1]:
                found[side, axis] = sign * several[-1]
    return found


def _clipped_axis(recordings: Sequence[Recording], limits: Sequence[Array], before: Pose, after: Pose) -> str:
    recording, limit = recordings[before.log], limits[before.log]
    rows = slice(*np.searchsorted(recording.t, [before.end, after.start]))
    gyr = recording.gyr[rows]
    count = ((gyr >= limit[0]) | (gyr <= limit[1])).sum(axis=0)
    worst = int(count.argmax())
    return "xyz"[worst] if count[worst] >= max(MIN_CLIPPED_ROWS, MIN_CLIPPED_SHARE * len(gyr)) else ""


def require_turns(clipped: Sequence[str]) -> None:
    """Makes sure that at most half of the turns are clipped.

    Raises:
        LevelheadError: more are; the sentence names the axis.
    """
    bad = [axis for axis in clipped if axis]
    if 2 * len(bad) > len(clipped):
        axis = max(set(bad), key=bad.count)
        raise LevelheadError(
            f"the gyroscope's {axis} axis is clipped in {len(bad)} of {len(clipped)} turns; turn the sensor more "
            "slowly, or set a larger full scale"
        )


def require_moving_axes(recordings: Sequence[Recording], poses: Sequence[Pose]) -> None:
    """Makes sure that no axis has one and the same reading.

    Raises:
        LevelheadError: an axis of gyroscope or accelerometer is stuck, or the accelerometer's is clipped in poses.
    """
    for name, sensor in (("gyr", "gyroscope"), ("acc", "accelerometer")):
        for axis in range(3):
            if all(
                np.nanmax(values) == np.nanmin(values) for values in (getattr(one, name)[:, axis] for one in recordings)
            ):
                raise LevelheadError(
                    f"the {sensor}'s {'xyz'[axis]} axis has the same reading throughout; expected readings that "
                    "change: the axis is stuck, or its column is another one"
                )
    rows = [
        (recordings[pose.log], slice(*np.searchsorted(recordings[pose.log].t, [pose.start, pose.end])))
        for pose in poses
    ]
    constant = np.array([np.ptp(one.acc[part], axis=0) == 0.0 for one, part in rows])
    reading = np.abs([one.acc[part][0] for one, part in rows])
    if 2 * int(constant.sum()) > constant.size:
        return  # all axes are coarser than their noise
    for axis in range(3):
        top = float(reading[:, axis].max())
        at = constant[:, axis] & (reading[:, axis] == top)
        if at.sum() > 1 and top < FULL * GRAVITY:
            raise LevelheadError(
                f"the accelerometer's {'xyz'[axis]} axis stands at {top:.3g} m/s² in {int(at.sum())} poses; expected "
                f"{GRAVITY:.3g} m/s² or more in a pose with this axis upright: it is clipped"
            )


def require_true_scale(level: Solution) -> None:
    """Makes sure that the accelerometer's numbers are those of a working sensor.

    Raises:
        LevelheadError: a scale or bias is beyond any tolerance; the sentence names the axis.
    """
    for axis in range(3):
        scale = 1.0 - float(level.value[3 + axis])
        if abs(scale - 1.0) > MAX_SCALE_ERROR:
            raise LevelheadError(
                f"the accelerometer's {'xyz'[axis]} axis reads {1.0 / scale:.2g} times the specific force; expected "
                "0.8 to 1.2: check its range, unit and wiring"
            )
        if abs(level.value[axis]) > MAX_BIAS:
            raise LevelheadError(
                f"the accelerometer's {'xyz'[axis]} axis reads {level.value[axis]:.2g} m/s² too much; expected less "
                f"than {MAX_BIAS:g} m/s²: check its unit and wiring"
            )


def require_true_turns(turns: Turns) -> None:
    """Makes sure that gyroscope and accelerometer agree how the sensor turns, but for the tolerances of a sensor.

    Raises:
        LevelheadError: another wiring or scale of an axis explains the turns; the sentence names it.
    """
    now, s = _fit(turns, IDENTITY)
    if now < MAX_MISS and np.abs(s).max() < MAX_SCALE_ERROR:
        return
    ranked = sorted((_rms(_with(turns, cause).misses(np.zeros((3, 3)))), i) for i, cause in enumerate(_CAUSES))
    fitted = [(_fit(turns, _CAUSES[i])[0], i) for _, i in ranked[:LIKELY]]
    best = min(fitted)[0]
    matrix = _CAUSES[min(i for missed, i in fitted if missed < 2.0 * best)]
    if MIN_GAIN * best > now and np.abs(s).max() < MAX_SCALE_ERROR:
        return
    if best > now:
        best, matrix = now, IDENTITY
    raise LevelheadError(
        f"{_words(matrix, turns)}; gravity misses the next pose by {turns_missed(turns):.0f}° as it is, and by "
        f"{best / DEGREE:.2g}° without this fault"
    )


def turns_missed(turns: Turns) -> float:
    """degrees, RMS by which gravity misses the next pose without a calibration."""
    return float(_rms(turns.misses(np.zeros((3, 3)))) / DEGREE)


def _causes() -> Iterator[Array]:
    """Matrices that would make the rates right: signs and orders of the axes, the likeliest first, then scales."""
    yield from sorted(WIRINGS[1:], key=_changes)
    for factor in FACTORS:
        yield factor * np.eye(3)
    for axis in range(3):
        for factor in FACTORS:
            scale = np.ones(3)
            scale[axis] = factor
            yield np.diag(scale)


def _changes(matrix: Array) -> int:
    return int((matrix != IDENTITY).sum())


_CAUSES = tuple(_causes())


def _with(turns: Turns, matrix: Array) -> Turns:
    return turns._replace(rates=turns.rates @ matrix.T)


def _fit(turns: Turns, matrix: Array) -> tuple[float, Array]:
    """rad, RMS of the misses with a calibration on top, and S (3, 3) of it."""
    changed = _with(turns, matrix)
    s = fit_gyroscope(changed).value.reshape(3, 3)
    return _rms(changed.misses(s)), s


def _words(matrix: Array, turns: Turns) -> str:
    """The fault in words."""
    if np.allclose(matrix @ matrix.T, IDENTITY) and not np.allclose(matrix, IDENTITY):
        words = f"gyroscope {change_of(matrix)}"
        if np.linalg.det(matrix) > 0.0:  # an accelerometer that is mirrored gives the same turns
            diagonal = np.allclose(np.abs(matrix), IDENTITY)
            mirrored = f"accelerometer {change_of(-matrix.T)}"
            if diagonal:
                words = f"{mirrored} or {words}"
            elif _changes(-matrix.T) < _changes(matrix):
                words = mirrored
        return f"the axes do not belong together: {words}"
    s = _fit(turns, matrix)[1]
    factors = 1.0 / np.diag((IDENTITY - s) @ matrix)
    off = np.abs(np.log(np.abs(factors))) > np.log(1.0 + MAX_SCALE_ERROR)
    if off.all():
        return f"the gyroscope reads {factors.mean():.3g} times the true rate: check its range and unit"
    axis = int(np.abs(np.log(np.abs(factors))).argmax())
    return f"the gyroscope's {'xyz'[axis]} axis reads {factors[axis]:.3g} times the true rate: check its range"


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
