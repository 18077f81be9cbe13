"""Attitude that trembles faster than people move."""

from collections.abc import Iterator

import numpy as np

from levelhead.inspection.evidence import RunEvidence
from levelhead.inspection.spectrum import MIN_FREQUENCY, SpectralLine, lines, spectrum
from levelhead.inspection.symptom import Symptom, SymptomKind
from levelhead.inspection.symptoms.jump import find_disturbances
from levelhead.recording import Array

OWN = 0.5  # of the jitter: with less the filter does not make it
MAX_JITTER = 0.3  # deg rms above MIN_FREQUENCY; a fast hand has 0.13
PIECE = 256  # samples that are looked at together
LASTING = 0.2  # share of pieces that must tremble: a jump shakes one or two
SAME_LINE = 1.5  # Hz between a line of the track and one of a sensor


def find_jitter(evidence: RunEvidence) -> Iterator[Symptom]:
    """Attitude that trembles faster than people move, and the line of a sensor that makes it."""
    rate = evidence.recording.rate
    pieces = None if rate < 4.0 * MIN_FREQUENCY else _angle_density(evidence)
    if pieces is None:
        return
    frequency, power = pieces
    sizes = np.degrees(np.sqrt(power.sum(axis=1) * frequency[1]))
    size = float(np.quantile(sizes, 1.0 - LASTING))
    if size <= MAX_JITTER:
        return
    peak = float(frequency[int(np.median(power[sizes >= size], axis=0).argmax())])
    for role, name in (("gyr", "gyroscope"), ("acc", "accelerometer")):
        line = _line_near(np.asarray(getattr(evidence.recording, role)), rate, peak)
        if line is not None:
            unit, factor = ("°/s", 180.0 / np.pi) if role == "gyr" else ("m/s²", 1.0)
            yield Symptom(
                "jitter", size, "deg", f"attitude jitters by {size:.2g}° at {peak:.0f} Hz", "vibration",
                f"the {name} vibrates at {line.frequency:.0f} Hz ({factor * line.rms:.2g} {unit} rms)",
                "Mount it softer, or switch on the sensor's low-pass filter.", None, f"vibration_{role}",
            )  # fmt: skip
            return
    name = evidence.track.name
    beside = float(np.degrees(np.sqrt(np.mean(np.sum(np.diff(evidence.corrections, axis=0) ** 2, axis=1)))))
    what = f"attitude jitters by {size:.2g}° above {MIN_FREQUENCY:g} Hz"
    # Independent rotations w of variance beside² add up to an angle whose density is 2 beside²/(r (2 sin πf/r)²) at the
    # rate r; this is its rms from MIN_FREQUENCY to r/2.
    if beside * np.sqrt(1.0 / (2.0 * np.pi * np.tan(np.pi * MIN_FREQUENCY / rate))) < OWN * size:
        yield Symptom(
            "jitter", size, "deg", what, "shaking",
            f"the gyroscope itself measures it, at no single frequency: {name} turns by {beside:.2g}° rms beside it",
            "A body that shakes, such as a phone on somebody who runs, moves so; else mount the sensor tighter.",
        )  # fmt: skip
        return
    yield Symptom(
        "jitter", size, "deg", what, "noise",
        f"no sensor has a line there; {name} is turned by {beside:.2g}° rms at every sample beside the gyroscope",
        "Let it trust the gyroscope more, or take a filter that does, such as ESKF.",
    )  # fmt: skip


def _angle_density(evidence: RunEvidence) -> tuple[Array, Array] | None:
    """Frequencies in Hz (k,) and density of the angle in rad²/Hz (m, k) above MIN_FREQUENCY, for pieces of the track.

    A difference of the angle between two samples has (2 sin πf/r)² times its density at the rate r. None: it is too
    short for a piece.
    """
    turns, rate = evidence.turns, evidence.recording.rate
    vector = 2.0 * turns[:, 1:] * np.where(turns[:, :1] < 0.0, -1.0, 1.0) * rate
    count = len(vector) // PIECE
    if count == 0:
        return None
    window = np.hanning(PIECE)
    sound = np.ones(len(vector), dtype=np.bool_)
    for event in find_disturbances(evidence):  # their effect is a jump
        sound[max(0, event.first - 1) : event.last + PIECE] = False
    whole = sound[: count * PIECE].reshape(count, PIECE).all(axis=1)
    if not whole.any():
        return None
    parts = vector[: count * PIECE].reshape(count, PIECE, 3)[whole]
    parts = (parts - parts.mean(axis=1, keepdims=True)) * window[:, None]
    frequency: Array = np.asarray(np.fft.rfftfreq(PIECE, 1.0 / rate), dtype=np.float64)
    density = 2.0 * (np.abs(np.fft.rfft(parts, axis=1)) ** 2).sum(axis=2) / (rate * float((window**2).sum()))
    difference = 2.0 * rate * np.sin(np.pi * frequency / rate)
    power: Array = np.where(frequency > MIN_FREQUENCY, density / np.maximum(difference**2, 1.0), 0.0)
    return frequency, power


def _line_near(values: Array, rate: float, frequency: float) -> SpectralLine | None:
    found = spectrum(values, rate)
    near = [] if found is None else [one for one in lines(found, 0.0) if abs(one.frequency - frequency) < SAME_LINE]
    return near[0] if near else None


JITTER = SymptomKind(
    name="jitter",
    unit="deg",
    measure=f"RMS angle above {MIN_FREQUENCY:g} Hz, in at least a fifth of the log; times of a jump do not count",
    bound=f"{MAX_JITTER:g}°",
    absent="does not jitter",
    colour="#CC79A7",
    find=find_jitter,
    spectrum="gyr",
)
