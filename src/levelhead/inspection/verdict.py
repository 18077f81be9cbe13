"""What to expect of a fused track, and the verdict in one line."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.inspection.findings import Finding
from levelhead.inspection.physics import rest_rows
from levelhead.recording import Recording, median
from levelhead.units import GRAVITY

BASE = 0.5  # deg: bias of a calibrated accelerometer, 0.01 g
SHAKE = 2.0  # deg of tilt for each g of rms acceleration beside gravity
ADDED = {
    "clipping_gyr": 4.0,
    "too_slow": 3.0,
    "gaps": 1.0,
    "held_samples": 1.0,
    "raw_counts": 1.0,
    "acc_scale": 0.5,
}  # deg
HEADING = 3.0  # deg, with an undisturbed magnetometer
HEADING_ADDED = {
    "mag_offset": 20.0,
    "mag_disturbed": 10.0,
    "mag_axes": 30.0,
    "mag_strength": 10.0,
    "mag_normalised": 5.0,
}
DRIFT = 2.0  # deg a minute after the bias was read off at rest
DRIFT_NO_REST = 12.0  # deg a minute, where it never was


class Expectation(NamedTuple):
    """1σ of tilt and heading in deg, and drift of heading in deg a minute; None where there is none."""

    tilt: float | None
    heading: float | None
    drift: float | None


def expectation(recording: Recording, findings: Sequence[Finding]) -> Expectation:
    """What a track fused from this recording will be good for."""
    names = {one.name for one in findings}
    if any(one.severity == "broken" and one.name != "no_time" for one in findings):
        return Expectation(None, None, None)
    length = np.linalg.norm(recording.acc, axis=1)
    length = length[np.isfinite(length)]
    typical = median(length) if len(length) else 0.0
    shake = float(np.sqrt(np.mean((length - typical) ** 2))) / GRAVITY if len(length) else 0.0
    tilt = float(np.sqrt(BASE**2 + (SHAKE * min(shake, 3.0)) ** 2 + sum(ADDED[one] ** 2 for one in names & set(ADDED))))
    if recording.mag is None:
        rested = float(rest_rows(recording).mean()) > 0.01
        return Expectation(tilt, None, DRIFT if rested else DRIFT_NO_REST)
    heading = np.sqrt(HEADING**2 + tilt**2 + sum(HEADING_ADDED[one] ** 2 for one in names & set(HEADING_ADDED)))
    return Expectation(tilt, float(heading), None)


def verdict(recording: Recording, findings: Sequence[Finding], expected: Expectation) -> str:
    """One line."""
    broken = [one for one in findings if one.severity == "broken"]
    if expected.tilt is None:
        return f"not to be trusted as it is: {broken[0].what}"
    words = f"good for tilt to {expected.tilt:.2g}°"
    if expected.heading is not None:
        words += f", heading to {expected.heading:.2g}°"
    else:
        rest = "" if expected.drift == DRIFT else ", no rest"
        words += f", heading will drift about {expected.drift:g}° a minute: no magnetometer{rest}"
    worse = [one.name for one in findings if one.severity == "warning"]
    return words + (f"; {len(worse)} warnings: {', '.join(worse[:4])}" if worse else "")
