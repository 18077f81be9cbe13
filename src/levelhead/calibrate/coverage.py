"""The numbers that poses and turns do not show, and the pose that would."""

from itertools import product

import numpy as np

from levelhead.calibrate import gyroscope
from levelhead.calibrate.accelerometer import NAMES, PRIOR, information
from levelhead.calibrate.magnetometer import FieldFit
from levelhead.calibration import UNLEARNED
from levelhead.recording import Array

SIDES = [np.array(side, dtype=float) for side in product((1, 0, -1), repeat=3) if any(side)]
TAKEN = np.cos(0.44)  # 25°: nearer to a pose that was taken, a side needs no other
WEAK_FIELD = 0.1  # of the field, 1σ of an offset from which on it is weak
NAMED = {
    (0, 0, 1): "on its bottom",
    (0, 0, -1): "on its top",
    (0, 1, 0): "on its right side",
    (0, -1, 0): "on its left side",
    (1, 0, 0): "on its back end",
    (-1, 0, 0): "on its front end",
}  # x forward, y left, z up
MAX_REMAINING = 0.7  # ratio of the worst σ after a further pose: above, the pose is not worth the trouble


def unobservable_numbers(sigma: Array) -> list[str]:
    """Names of the accelerometer's numbers that the poses do not show."""
    return [name for name, one, prior in zip(NAMES, sigma, PRIOR, strict=True) if one > UNLEARNED * prior]


def unobservable_rates(sigma: Array) -> list[str]:
    """Axes of the gyroscope whose scale the turns do not show, from the (3, 3) σ of S."""
    return [axis for i, axis in enumerate("xyz") if sigma[i, i] > UNLEARNED * gyroscope.SCALE]


def unobservable_field(found: FieldFit) -> list[str]:
    """Axes of the magnetometer whose offset is weak."""
    sigma = np.sqrt(np.diag(found.covariance)[:3])
    return [axis for axis, one in zip("xyz", sigma, strict=True) if one > WEAK_FIELD * found.strength]


def next_side(covariance: Array, gravity: float, sigma: float, taken: Array) -> Array:
    """(3,) the side to put up next: of the six sides those that were not up yet come first, then edges and corners.

    Args:
        covariance: (9, 9) of the accelerometer's numbers.
        gravity: m/s².
        sigma: 1σ of the length of the specific force in a pose, m/s².
        taken: (k, 3) directions that were up, of length 1.
    """
    free = [side for side in SIDES if not (taken @ (side / np.linalg.norm(side)) > TAKEN).any()] or SIDES
    fewest = min(_corners(side) > 1 for side in free)
    asked = [side for side in free if (_corners(side) > 1) == fewest]
    return asked[_best(covariance, gravity, sigma, asked)[0]]


def _corners(side: Array) -> int:
    """1 for a side, 2 for an edge, 3 for a corner."""
    return int(np.abs(side).sum())


def _best(now: Array, gravity: float, sigma: float, sides: list[Array]) -> tuple[int, Array, float]:
    """Which of the sides leaves least of the variances, their covariance then, and the variances over the prior's."""
    after = [_with(now, information(side / np.linalg.norm(side), gravity) / sigma) for side in sides]
    badness = [float((np.diag(one) / PRIOR**2).sum()) for one in after]
    best = int(np.argmin(np.round(badness, 3) + 1e-4 * np.array([_corners(side) for side in sides])))
    return best, after[best], badness[best]


def next_poses(covariance: Array, gravity: float, sigma: float, most: int = 3) -> list[str]:
    """Sides to put up, the best first, until every number is known, each in words.

    Args:
        covariance: (9, 9) of the accelerometer's numbers.
        gravity: m/s².
        sigma: 1σ of the length of the specific force in a pose, m/s².
        most: how many sides.
    """
    found: list[str] = []
    now = covariance.copy()
    while len(found) < most and (np.sqrt(np.diag(now)) > UNLEARNED * PRIOR).any():
        best, after, badness = _best(now, gravity, sigma, SIDES)
        if badness > MAX_REMAINING * float((np.diag(now) / PRIOR**2).sum()) and found:
            break
        now = after
        found.append(words(SIDES[best]))
    return found


def _with(covariance: Array, row: Array) -> Array:
    """The covariance with one more measurement of variance 1."""
    through = covariance @ row
    reduced: Array = covariance - np.outer(through, through) / (1.0 + float(row @ through))
    return reduced


def words(side: Array) -> str:
    """A side in words: "+x up", "the edge between +x and −y up"."""
    names = [("+" if value > 0 else "−") + axis for axis, value in zip("xyz", side, strict=True) if value]
    if len(names) == 1:
        return f"{names[0]} up"
    kind = "edge" if len(names) == 2 else "corner"
    return f"the {kind} between {', '.join(names[:-1])} and {names[-1]} up"


def side_up(acc: Array) -> str:
    """Which side is up, from (k, 3) readings: "+x", "+x −y"; nothing for none."""
    mean = acc[np.isfinite(acc).all(axis=1)].mean(axis=0) if np.isfinite(acc).all(axis=1).any() else np.zeros(3)
    if not mean.any():
        return ""
    near = max(SIDES, key=lambda side: float(side @ mean) / float(np.linalg.norm(side)))
    return " ".join(("+" if value > 0 else "−") + axis for axis, value in zip("xyz", near, strict=True) if value)


def lay_down(side: Array) -> str:
    """How to put the sensor down so that a side is up: "on its left side (−y up)"."""
    x, y, z = (int(value) for value in side)
    named = NAMED.get((x, y, z))
    return f"with {words(side)}, leaned against something" if named is None else f"{named} ({words(side)})"
