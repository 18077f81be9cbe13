"""Findings on a recording's clock: gaps, bursts, jitter, a rate too low for the motion."""

from collections.abc import Iterator

import numpy as np

from levelhead.inspection.findings import Finding
from levelhead.recording import Recording, median

GAP = 3.0  # median intervals
LONG_GAP = 10.0  # median intervals: one of them is worth a finding
MANY_GAPS = 5
JITTER = 0.6  # of the median interval, between the 1st and the 99th percentile
SLOW = 20.0  # Hz
MAX_STEP = 15.0  # deg between two samples, at the 99th percentile, beyond which interpolation fails
BURST = 0.5  # median interval over the mean one


def examine_clock(recording: Recording) -> Iterator[Finding]:
    """Findings about stamps."""
    steps = np.diff(recording.t)
    if len(steps) < 10:
        return
    typical, mean = median(steps), float(recording.duration / len(steps))
    yield from _gaps(recording, steps, max(typical, BURST * mean))
    if typical < BURST * mean and float((steps > GAP * typical).mean()) > 0.05:
        yield Finding(
            "bursts",
            "warning",
            f"samples come in bursts: {1 / typical:.0f} Hz within, {1 / mean:.1f} Hz on average",
            f"steps of {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms, median "
            f"{1e3 * typical:.3g}, mean {1e3 * mean:.3g}",
            "Stamp samples where they are measured, not where they arrive.",
        )
    few = len(steps) // 100
    low, high = (float(one) for one in np.partition(steps, [few, -1 - few])[[few, -1 - few]])
    if high - low > JITTER * typical and typical >= BURST * mean:
        yield Finding(
            "jitter",
            "note",
            f"the clock is uneven: steps of {1e3 * low:.3g} to {1e3 * high:.3g} ms (1st to 99th percentile)",
            f"median {1e3 * typical:.4g} ms",
            "Stamps from the sensor's own clock or data-ready pin are more even.",
        )
    if (steps[0] < 0.1 * typical or (recording.acc[0] == 0.0).all()) and len(steps) > 20:
        yield Finding(
            "garbage_start",
            "note",
            "the first sample is not a measurement",
            f"first step {1e3 * steps[0]:.3g} ms",
            "Leave it out.",
            (0, 0),
        )
    milli = recording.t * 1e3
    if (
        typical < 0.02
        and float(np.abs(milli - np.rint(milli)).max()) < 1e-3
        and len(np.unique(np.rint(1e3 * steps))) > 1
    ):
        yield Finding("coarse_stamps", "note", "stamps are whole milliseconds", f"median step {1e3 * typical:.3g} ms")
    turn = np.degrees(np.sqrt(np.einsum("ij,ij->i", recording.gyr[1:], recording.gyr[1:])) * steps)
    turn = turn[np.isfinite(turn)]
    far = float(np.quantile(turn, 0.99)) if len(turn) else 0.0
    if 1.0 / mean < SLOW or far > MAX_STEP:
        yield Finding(
            "too_slow",
            "warning" if far > MAX_STEP else "note",
            f"{1 / mean:.3g} Hz is slow for this motion: up to {far:.0f} deg between two samples"
            if far > MAX_STEP
            else f"{1 / mean:.3g} Hz is a low sample rate",
            f"mean interval {1e3 * mean:.3g} ms",
            "Record at 50 Hz or more.",
        )


def _gaps(recording: Recording, steps: np.ndarray, typical: float) -> Iterator[Finding]:
    long = steps > GAP * typical
    longest = float(steps.max())
    if long.sum() >= MANY_GAPS or longest > LONG_GAP * typical:
        at, count = int(steps.argmax()), int(long.sum())
        yield Finding(
            "gaps",
            "warning",
            f"{'1 gap' if count == 1 else f'{count} gaps, the longest'} of {longest:.3g} s after row {at}",
            f"steps of more than {GAP:g} intervals of {1e3 * typical:.3g} ms",
            "The attitude is held across gaps of more than 0.5 s; its σ grows.",
            (at, at + 1),
        )
