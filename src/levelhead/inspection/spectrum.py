"""Lines in the spectra: vibration of propellers and motors, and aliasing at half the sample rate."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from levelhead.inspection.findings import Finding
from levelhead.recording import Array, Recording

SEGMENTS = (512, 128)  # samples of one periodogram, of long and of short recordings
MIN_WINDOWS = 8  # of them
FALSE_ALARM = 1e-6  # of a whole spectrum, for white noise
MIN_FREQUENCY = 12.0  # Hz; below it people move, and steps have harmonics
MIN_LINE = {"acc": 0.1, "gyr": np.radians(0.5)}  # m/s², rad/s rms of a line that matters
AROUND = 15  # bins on either side whose median is the background
UNITS = {"gyr": ("deg/s", 180.0 / np.pi), "acc": ("m/s²", 1.0)}
EDGE, EDGE_SHARE = 0.8, 0.35  # of half the sample rate; of the power above MIN_FREQUENCY that may lie beyond it


class Spectrum(NamedTuple):
    """Averaged periodograms of a triad: frequencies in Hz (k,), density in unit²/Hz (k,), segments averaged."""

    frequency: Array
    density: Array
    segments: int


class SpectralLine(NamedTuple):
    """A line: its frequency in Hz and its rms in the triad's SI unit."""

    frequency: float
    rms: float


def spectrum(values: Array, rate: float) -> Spectrum | None:
    """Welch's method for (n, 3) values, the three axes added; None if they are too short.

    P. Welch, The use of fast Fourier transform for the estimation of power spectra, 1967; Hann window, half overlap.
    """
    finite = np.isfinite(values).all(axis=1)
    values = values[finite]
    size = SEGMENTS[len(values) < (MIN_WINDOWS + 1) * SEGMENTS[0] // 2]
    count = (len(values) - size) // (size // 2) + 1
    if count < MIN_WINDOWS or not rate > 0.0:
        return None
    starts = np.arange(count)[:: max(1, count // 400)] * (size // 2)
    window = np.hanning(size)
    total = np.zeros(size // 2 + 1)
    for start in starts:
        piece = values[start : start + size]
        piece = (piece - piece.mean(axis=0)) * window[:, None]
        total += (np.abs(np.fft.rfft(piece, axis=0)) ** 2).sum(axis=1)
    density: Array = 2.0 * total / (len(starts) * rate * float((window**2).sum()))
    frequency: Array = np.asarray(np.fft.rfftfreq(size, 1.0 / rate), dtype=np.float64)
    return Spectrum(frequency, density, len(starts))


def lines(found: Spectrum, least: float) -> list[SpectralLine]:
    """Lines that stand out of their surroundings further than noise does, the strongest first.

    The sum of a bin over ``segments`` periodograms of three axes is χ² with 6·segments degrees of freedom (half of that
    for the overlap); its quantile by Wilson and Hilferty, 1931.
    """
    freedom = 3.0 * found.segments
    normal = np.sqrt(-2.0 * np.log(FALSE_ALARM / len(found.density)))  # beyond which a normal number lies so rarely
    limit = (1.0 - 2.0 / (9.0 * freedom) + normal * np.sqrt(2.0 / (9.0 * freedom))) ** 3
    padded = np.pad(found.density, AROUND, mode="edge")
    background = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1), axis=1)
    above = found.density > np.maximum(3.0, limit) * background
    peak = np.zeros(len(above), dtype=np.bool_)
    peak[1:-1] = (found.density[1:-1] >= found.density[:-2]) & (found.density[1:-1] > found.density[2:])
    step = float(found.frequency[1])
    made = []
    for i in np.flatnonzero(above & peak & (found.frequency > MIN_FREQUENCY)):
        near = slice(max(0, i - 2), i + 3)
        power = float((found.density[near] - background[near]).clip(0.0).sum()) * step
        if np.sqrt(power) > least:
            made.append(SpectralLine(float(found.frequency[i]), float(np.sqrt(power))))
    return sorted(made, key=lambda one: -one.rms)


def examine_spectra(recording: Recording) -> Iterator[Finding]:
    """Findings about vibration."""
    rate = recording.rate
    for role, name in (("acc", "accelerometer"), ("gyr", "gyroscope")):
        found = spectrum(np.asarray(getattr(recording, role)), rate)
        if found is None or rate < 4.0 * MIN_FREQUENCY:
            continue
        unit, factor = UNITS[role]
        strong = lines(found, MIN_LINE[role])
        if strong:
            listed = ", ".join(f"{one.frequency:.1f} Hz ({factor * one.rms:.2g} {unit} rms)" for one in strong[:3])
            yield Finding(
                f"vibration_{role}",
                "note",
                f"the {name} vibrates at {listed}",
                f"{60 * strong[0].frequency:.0f} turns a minute, if something turns; {found.segments} periodograms",
                "Mount it softer, or switch on the sensor's low-pass filter.",
            )
        high = found.frequency > MIN_FREQUENCY
        beyond = found.frequency > EDGE * rate / 2.0
        total = float(found.density[high].sum())
        share = float(found.density[beyond].sum()) / total if total > 0.0 else 0.0
        rms = np.sqrt(float(found.density[beyond].sum()) * float(found.frequency[1]))
        white = float(beyond.sum() / max(1, high.sum()))  # the share that white noise has
        if share > max(EDGE_SHARE, 1.6 * white) and rms > 3.0 * MIN_LINE[role]:
            yield Finding(
                f"aliasing_{role}",
                "note",
                f"the {name}'s vibration does not end at half the sample rate: part of it is folded back",
                f"{100 * share:.0f} % of the power above {MIN_FREQUENCY:g} Hz lies beyond {EDGE * rate / 2:.0f} Hz, "
                f"{factor * rms:.2g} {unit} rms",
                "Sample faster, or set the sensor's low-pass filter below half the rate.",
            )
