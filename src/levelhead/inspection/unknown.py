"""The quantities that a log does not show, and the 20 seconds of motion that would."""

from collections.abc import Iterator, Set

import numpy as np

from levelhead.engine.native import has_imu
from levelhead.filters import eskf
from levelhead.recording import Array, Recording
from levelhead.signals.gravity_turn import excerpt
from levelhead.signals.hard_iron import hard_iron
from levelhead.signals.rest import rest_rows

SIDES = 0.35  # spread of the direction of gravity in every direction, from which all axes were seen
CLEAR_TURN = 0.5  # rad/s rms about an axis that shows its sign and scale
RESTED = 2.0  # s


def unknown(recording: Recording, found: Set[str]) -> Iterator[str]:
    """Sentences: the unknown, and the motion that would show it; ``found`` are the names of the findings."""
    rows = excerpt(len(recording))
    gyr, acc = recording.gyr[rows], recording.acc[rows]
    with np.errstate(all="ignore"):
        if found & {"acc_gyr_test_invalid", "too_short"}:
            yield (
                "whether axes, signs and unit of the gyroscope are right: turn it slowly by 90° about each axis, "
                "and back, for 20 s"
            )
        elif missing := [axis for axis, rate in zip("xyz", _rms(gyr), strict=True) if rate < 0.1 * CLEAR_TURN]:
            yield f"sign and scale of the gyroscope's {', '.join(missing)}: turn it about that axis by 90° for 20 s"
        if not has_imu(eskf.FILTER, guarded=True):
            yield (
                "jumps of the gyroscope's bias, and scale errors of some percent: this installation lacks the "
                "native engine, which shows them"
            )
        if _sides(acc) < SIDES:
            yield "offset and scale of each axis of the accelerometer: lay it on its six sides, 3 s each, 20 s in all"
        if float(rest_rows(recording).sum()) < RESTED * recording.rate:
            yield "bias and noise of the gyroscope: leave it on a table for 20 s"
        if recording.mag is None:
            zero = "mag_unusable" in found or "mag_zero" in found
            yield f"heading relative to north: there is no {'usable ' if zero else ''}magnetometer"
        elif "mag_offset" not in found and hard_iron(recording) is None:
            yield "offset of the magnetometer: turn it in a figure of eight about all axes for 20 s, away from iron"


def _rms(values: Array) -> Array:
    rms: Array = np.sqrt(np.nanmean(values * values, axis=0))
    return rms


def _sides(acc: Array) -> float:
    """Spread of the direction of the specific force along the axis that it was turned about least."""
    unit = acc / np.linalg.norm(acc, axis=1)[:, None]
    unit = unit[np.isfinite(unit).all(axis=1)]
    return float(np.sqrt(max(float(np.linalg.eigvalsh(np.cov(unit.T))[0]), 0.0))) if len(unit) > 3 else 0.0
