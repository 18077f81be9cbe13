"""The sensor by its behaviour: bias that runs, noise beside chips, corrected data."""

from collections.abc import Iterator

import numpy as np

from levelhead.inspection.findings import Finding
from levelhead.recording import Array, Recording
from levelhead.signals.rest import rest_rows
from levelhead.simulate.presets import CHIPS, DataSheet
from levelhead.units import factor

MIN_BIAS_SIGMAS = 5.0  # standard errors by which the bias of two rests must differ
RUNS = np.radians(0.1)  # rad/s
STRETCH = 1.0  # s of rest whose mean is one value of the bias
NOISY, QUIET = 3.0, 0.25  # of the chips' noise
CORRECTED = np.radians(0.01)  # rad/s: no gyroscope is that near to 0 by itself
SHEET = {"gyr": ("deg/s/√Hz", 180.0 / np.pi), "acc": ("µg/√Hz", 1e6 / 9.80665)}


def _stretches(recording: Recording) -> tuple[Array, Array, float] | None:
    """(middle times, mean rates (k, 3), their standard error) of stretches of rest; None with fewer than four."""
    size = max(8, round(STRETCH * recording.rate))
    still = rest_rows(recording)
    count = len(still) // size
    whole = still[: count * size].reshape(count, size).all(axis=1)
    if whole.sum() < 4:
        return None
    parts = recording.gyr[: count * size].reshape(count, size, 3)[whole]
    error = float(np.median(parts.std(axis=1))) / np.sqrt(size)
    return recording.t[: count * size].reshape(count, size)[whole].mean(axis=1), parts.mean(axis=1), error


def examine_bias(recording: Recording) -> Iterator[Finding]:
    """Findings about the gyroscope's bias over time: one that runs, one that somebody takes off."""
    found = _stretches(recording)
    if found is None:
        return
    t, bias, error = found
    quarter = max(1, len(t) // 4)
    first, last = bias[:quarter].mean(axis=0), bias[-quarter:].mean(axis=0)
    spread = float(np.median(np.abs(np.diff(bias, axis=0)))) * 1.5 / np.sqrt(quarter)
    run = last - first
    axis = int(np.abs(run).argmax())
    if abs(run[axis]) > max(RUNS, MIN_BIAS_SIGMAS * max(error, spread)):
        yield Finding(
            "bias_runs",
            "note",
            f"the gyroscope's bias runs by {np.degrees(run[axis]):+.2f} deg/s ({'xyz'[axis]}) "
            f"from {t[0]:.0f} to {t[-1]:.0f} s",
            f"mean rates in {len(t)} stretches of rest, ±{np.degrees(max(error, spread)):.3f}",
            "It warms up: wait a few minutes, or let the filter follow (BiasRateKalman, ESKF).",
        )
    level = np.abs(np.median(bias, axis=0))
    if len(t) > 8 and float(level.max()) < CORRECTED and error * np.sqrt(STRETCH * recording.rate) > 5.0 * CORRECTED:
        yield Finding(
            "corrected_gyro",
            "note",
            "the gyroscope's bias is 0: a device or an operating system subtracts it",
            f"at most {np.degrees(level.max()):.4f} deg/s in {len(t)} stretches of rest",
            "A subtracted bias may jump; prefer uncalibrated data if the device gives them.",
        )


def examine_noise(recording: Recording) -> Iterator[Finding]:
    """The noise at rest beside the data sheets of known chips."""
    still = rest_rows(recording)
    pairs = still[1:] & still[:-1]
    if pairs.sum() < 200 or not recording.rate > 0.0:
        return
    for role, name in (("gyr", "gyroscope"), ("acc", "accelerometer")):
        steps = np.diff(np.asarray(getattr(recording, role)), axis=0)[pairs]
        if float((steps == 0.0).mean()) > 0.5:  # rounding hides the noise
            continue
        density = float(np.median(np.abs(steps))) / 0.6745 / np.sqrt(2.0) / np.sqrt(recording.rate / 2.0)
        unit, scale = SHEET[role]
        chips = {}
        for chip in CHIPS:
            sheet: DataSheet = getattr(chip, role)
            chips[chip.name] = sheet.scales[sheet.default].noise_density * factor(role, sheet.unit)
        nearest = min(chips, key=lambda chip: abs(np.log(density / chips[chip])))
        if density > NOISY * max(chips.values()) or density < QUIET * min(chips.values()):
            more = density > max(chips.values())
            low, high = min(chips, key=lambda chip: chips[chip]), max(chips, key=lambda chip: chips[chip])
            yield Finding(
                f"noise_{role}",
                "note",
                f"the {name} is {'noisier' if more else 'quieter'} at rest than the chips known here",
                f"{scale * density:.3g} {unit}; data sheets: {scale * chips[low]:.3g} ({low}) to "
                f"{scale * chips[high]:.3g} ({high}); nearest {nearest}",
                "Something shakes it." if more else "A low-pass filter is in front of it, or it is a better sensor.",
            )
