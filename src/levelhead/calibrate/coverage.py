"""What poses and turns cannot tell, and which one would."""

from itertools import product

import numpy as np

from levelhead.calibrate.accelerometer import NAMES, PRIOR, information
from levelhead.calibration import UNLEARNED
from levelhead.recording import Array

SIDES = [np.array(side, dtype=float) for side in product((1, 0, -1), repeat=3) if any(side)]
ENOUGH = 0.7  # of what is left of the worst σ by a further pose: above, it is not worth the trouble


def unknown(sigma: Array) -> list[str]:
    """Names of the accelerometer's numbers that the poses have not told."""
    return [name for name, one, prior in zip(NAMES, sigma, PRIOR, strict=True) if one > UNLEARNED * prior]


def next_poses(covariance: Array, gravity: float, sigma: float, most: int = 3) -> list[str]:
    """Sides to put up, the best first, until every number is told, each in words.

    Args:
        covariance: (9, 9) of the accelerometer's numbers.
        gravity: m/s².
        sigma: 1σ of the length of the specific force in a pose, m/s².
        most: how many sides.
    """
    found: list[str] = []
    now = covariance.copy()
    while len(found) < most and (np.sqrt(np.diag(now)) > UNLEARNED * PRIOR).any():
        rows = [(side, information(side / np.linalg.norm(side), gravity, sigma)) for side in SIDES]
        after = [_with(now, row) for _, row in rows]
        badness = [float((np.diag(one) / PRIOR**2).sum()) for one in after]
        best = int(np.argmin(np.round(badness, 3) + 1e-4 * np.array([np.abs(side).sum() for side, _ in rows])))
        if badness[best] > ENOUGH * float((np.diag(now) / PRIOR**2).sum()) and found:
            break
        now = after[best]
        found.append(words(rows[best][0]))
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
