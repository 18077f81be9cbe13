"""The sensor by its behaviour: delay between sensors, bias that runs, noise beside chips, corrected data."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.inspection.findings import Finding
from levelhead.recording import Array, Recording
from levelhead.signals.gravity_turn import turn_of_gravity
from levelhead.signals.rest import rest_rows
from levelhead.simulate.presets import CHIPS, DataSheet
from levelhead.units import factor

ROWS = 20_000  # that are compared at other delays
FARTHEST = 0.12  # s of delay that is looked for
PARTS, MIN_SIGMAS = 4, 4.0  # of a recording whose delays must agree, and standard errors by which they must
MIN_CORRELATION = 0.7  # correlation of gravity's turn that a delay needs
DELAY = 0.012  # s
MIN_BIAS_SIGMAS = 5.0  # standard errors by which the bias of two rests must differ
RUNS = np.radians(0.1)  # rad/s
STRETCH = 1.0  # s of rest whose mean is one value of the bias
NOISY, QUIET = 3.0, 0.25  # of the chips' noise
CORRECTED = np.radians(0.01)  # rad/s: no gyroscope is that near to 0 by itself
SHEET = {"gyr": ("deg/s/√Hz", 180.0 / np.pi), "acc": ("µg/√Hz", 1e6 / 9.80665)}


class Delay(NamedTuple):
    """By how many seconds the accelerometer comes later than the gyroscope, its standard error, and in how many parts
    it was seen.
    """

    delay: float
    sigma: float
    parts: int


def find_delay(recording: Recording) -> Delay | None:
    """The delay between both sensors, the same in all parts of a recording; None: it is not clear."""
    step = 1.0 / recording.rate if recording.rate > 0.0 else 1.0
    reach = int(FARTHEST / step)
    size = min(len(recording), ROWS) // PARTS
    if reach < 2 or size < 30 * reach or step > DELAY:
        return None
    shifts = np.unique(np.linspace(-reach, reach, 13).round().astype(int))
    found = []
    for part in range(PARTS):
        rows = slice(part * size, (part + 1) * size)
        one = _delay(recording.t[rows], recording.gyr[rows], recording.acc[rows], shifts, step)
        if one is not None:
            found.append(one)
    if len(found) < PARTS - 1:
        return None
    return Delay(float(np.mean(found)), float(np.std(found, ddof=1) / np.sqrt(len(found))), len(found))


def examine_delay(recording: Recording) -> Iterator[Finding]:
    """Whether the accelerometer comes later or earlier than the gyroscope, by the same time in all parts."""
    found = find_delay(recording)
    if found is not None and abs(found.delay) > max(DELAY, 1.5 / recording.rate) + MIN_SIGMAS * found.sigma:
        yield Finding(
            "sensor_delay",
            "note",
            f"the accelerometer comes {1e3 * abs(found.delay):.0f} ms {'later' if found.delay > 0 else 'earlier'} "
            "than the gyroscope",
            f"where gravity's turn fits best, in {found.parts} parts, ±{1e3 * found.sigma:.0f} ms",
            "Give both sensors one filter and one clock.",
            value=1e3 * found.delay,
            interval=(1e3 * (found.delay - 2.0 * found.sigma), 1e3 * (found.delay + 2.0 * found.sigma)),
            unit="ms",
        )


def _delay(t: Array, gyr: Array, acc: Array, shifts: NDArray[np.intp], step: float) -> float | None:
    """The delay of the accelerometer in s at which gravity's turn fits the gyroscope best; None: it is not clear."""
    fits = []
    for shift in shifts:
        late, early = slice(max(shift, 0), len(t) + min(shift, 0)), slice(max(-shift, 0), len(t) - max(shift, 0))
        turn = turn_of_gravity(t[late], gyr[early], acc[late])
        fits.append(-1.0 if turn is None or turn.turned < 0.05 else turn.correlation)
    best = int(np.argmax(fits))
    if fits[best] < MIN_CORRELATION or best in (0, len(fits) - 1):
        return None
    square, linear, _ = np.polyfit(shifts[best - 1 : best + 2] * step, fits[best - 1 : best + 2], 2)
    return float(-0.5 * linear / square) if square < 0.0 else None


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
