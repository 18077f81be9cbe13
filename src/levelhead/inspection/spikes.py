"""Spikes: single readings far from those before and after them, which no motion makes."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.inspection.findings import Finding
from levelhead.inspection.values import NAMES
from levelhead.recording import Array, Recording

FLOOR = {"gyr": np.radians(10.0), "acc": 3.0, "mag": 8.0}  # rad/s, m/s², µT; smaller ones hardly move an attitude
UNITS = {"gyr": ("deg/s", 180.0 / np.pi), "acc": ("m/s²", 1.0), "mag": ("µT", 1.0)}
BESIDE = 0.2  # share of a spike by which the readings before and after it may differ
FLANK = 0.15  # and by which they may leave the line between the readings before and after them
AROUND = 10  # samples on either side
ALONE = 5.0  # how many times the largest deviation around it a spike is: an impact rings, a vibration goes on
KNOCK = 1.5  # times the largest step of the rate around, by which it changes at a knock
BLOCK = 1_000_000  # rows at a time


class Spikes(NamedTuple):
    """Rows at which a sensor has a reading of its own, and how far each is off, in SI units."""

    rows: NDArray[np.intp]
    off: Array


def examine_spikes(recording: Recording) -> Iterator[Finding]:
    """A finding for each sensor with spikes: how many, how large, where."""
    for role in ("gyr", "acc", "mag"):
        values = getattr(recording, role)
        if values is None or (role == "mag" and recording.meta.get("mag_unit") == "relative"):
            continue
        found = find_spikes(values, FLOOR[role])
        if role == "acc":
            found = _without_knocks(found, recording.gyr)
        if not len(found.rows):
            continue
        unit, factor = UNITS[role]
        worst = int(found.off.argmax())
        count = len(found.rows)
        many = "1 reading is a spike" if count == 1 else f"{count} readings are spikes"
        shown = ", ".join(f"{recording.t[row]:.2f}" for row in found.rows[:5]) + (", …" if count > 5 else "")
        yield Finding(
            f"spikes_{role}",
            "note" if role == "acc" and count == 1 else "warning",  # some knocks do not turn it
            f"{many} of the {NAMES[role]}, up to {found.off[worst] * factor:.3g} {unit} from those beside it",
            f"isolated rows, at {shown} s",
            "Look for a bus or serial line that loses bits, and leave such rows blank.",
            (int(found.rows[0]), int(found.rows[-1])),
        )


def _without_knocks(found: Spikes, gyr: Array) -> Spikes:
    """Spikes of a force beside which the rate goes on as it did; a knock is as short, but changes the rate at once."""
    kept = []
    for row in found.rows:
        first = max(0, row - AROUND)
        steps = np.nan_to_num(np.linalg.norm(np.diff(gyr[first : row + AROUND], axis=0), axis=1))
        beside = np.arange(len(steps)) + first - row
        at = (beside == -1) | (beside == 0)
        kept.append(steps[at].max() <= KNOCK * steps[~at].max())
    return Spikes(found.rows[kept], found.off[kept])


def find_spikes(values: Array, floor: float) -> Spikes:
    """The rows of (n, 3) ``values`` that lie more than ``floor`` from the mean of the rows beside them, alone.

    The neighbours agree with each other, and no reading around comes near in size: an impact rings for some samples and
    a vibration goes on, but a lost bit is alone.
    """
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    kept = values if len(rows) == len(values) else values[rows]
    if len(kept) < 4 * AROUND:
        return Spikes(np.empty(0, dtype=np.intp), np.empty(0))
    off = np.zeros(len(kept))
    beside = np.full(len(kept), np.inf)
    for start in range(0, len(kept) - 2, BLOCK):  # a long recording is not copied several times
        part, into = kept[start : start + BLOCK + 2], slice(start + 1, min(start + BLOCK + 1, len(kept) - 1))
        off[into] = np.linalg.norm(part[1:-1] - 0.5 * (part[:-2] + part[2:]), axis=1)
        beside[into] = np.linalg.norm(part[2:] - part[:-2], axis=1)
    candidates = np.flatnonzero((off > floor) & (beside < BESIDE * off)).tolist()
    found = [k for k in candidates if _stands_alone(off, k) and _is_sharp(kept, off[k], k)]
    return Spikes(rows[found], off[found])


def _is_sharp(values: Array, size: float, k: int) -> bool:
    """Whether the readings right beside row ``k`` lie between those further away: a short motion has flanks."""
    if not 2 <= k < len(values) - 2:
        return False
    before, after = values[k - 2], values[k + 2]
    line = before + np.array([[0.25], [0.75]]) * (after - before)
    flanks = np.linalg.norm(values[[k - 1, k + 1]] - line, axis=1)
    return bool((flanks < FLANK * size).all())


def _stands_alone(off: Array, k: int) -> bool:
    """Whether no deviation around row ``k`` comes near its own; those beside it hold half of it."""
    near = np.concatenate([off[max(0, k - AROUND) : max(0, k - 1)], off[k + 2 : k + AROUND + 1]])
    beyond = near[near < 0.4 * off[k]]  # another spike near by does not count
    return bool(len(near)) and len(beyond) >= 0.8 * len(near) and float(beyond.max(initial=0.0)) * ALONE < off[k]
