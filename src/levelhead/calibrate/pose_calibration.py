"""The result of a calibration by poses: its numbers, their σ, and the gain on the sensor."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from levelhead.calibration import Calibration, Quantity
from levelhead.open_types import JsonObject
from levelhead.recording import Array

MIN_GAIN = 1.2  # from which gain on a calibration is worth a file


class Residual(NamedTuple):
    """RMS of the errors without and with a calibration.

    Attributes:
        before: without.
        after: with the calibration.
        held_out: with one that has not seen the pose or turn; where none could be left out, ``after`` or its 1σ.
        unit: of these.
        left_out: how many poses, turns or blocks were left out once; 0: each was needed.
    """

    before: float
    after: float
    held_out: float
    unit: str
    left_out: int

    @property
    def ratio(self) -> float:
        """How many times better the calibration is on poses or turns that it has not seen."""
        return self.before / max(self.held_out, 1e-12)

    @property
    def better(self) -> bool:
        """Whether it is worth its place in the file."""
        return self.ratio >= MIN_GAIN


@dataclass(frozen=True, eq=False)
class PoseCalibration:
    """A calibration by poses.

    Attributes:
        calibration: the numbers with their σ, for ``Calibration.save``, ``apply`` and ``fuse(prior=…)``.
        force: (k, 3) mean specific force of each pose, as read, m/s².
        lengths: (k, 2) its length before and after the calibration, m/s².
        angles: (t, 2) rad by which gravity misses the next pose after each turn, before and after.
        accelerometer: residual of |a| − g, m/s².
        gyroscope: residual at the ends of turns, degrees; None without turns.
        magnetometer: residual of the length of the field, µT; None without magnetometer.
        advice: sentences: the numbers that these poses do not show, and the pose that would.
        gravity: m/s² at the place.
    """

    calibration: Calibration
    force: Array
    lengths: Array
    angles: Array
    accelerometer: Residual
    gyroscope: Residual | None
    magnetometer: Residual | None
    advice: tuple[str, ...]
    gravity: float

    def verdict(self) -> list[str]:
        """Sentences: the gain of each sensor, then the missing poses."""
        lines = [words_of_gain("accelerometer", self.accelerometer, f"{len(self.force)} poses")]
        if self.gyroscope is None:
            lines.append("gyroscope: no turns between the poses, so only its bias is known")
        else:
            lines.append(words_of_gain("gyroscope", self.gyroscope, f"{len(self.angles)} turns"))
        if self.magnetometer is not None:
            lines.append(words_of_gain("magnetometer", self.magnetometer, f"{len(self.force)} poses"))
        return [*lines, *self.advice]

    def to_dict(self) -> JsonObject:
        """For JSON."""
        parts = {"accelerometer": self.accelerometer, "gyroscope": self.gyroscope, "magnetometer": self.magnetometer}
        return {
            "poses": len(self.force),
            "turns": len(self.angles),
            "gravity": self.gravity,
            "residuals": {
                name: None if part is None else part._asdict() | {"ratio": part.ratio} for name, part in parts.items()
            },
            "verdict": self.verdict(),
            "calibration": self.calibration.to_dict(),
        }


def digits(value: float) -> str:
    """Two digits, and no power of ten: 0.41, 6, 85, 210."""
    return f"{float(f'{value:.2g}'):g}"


def words_of_gain(name: str, part: Residual, where: str) -> str:
    """A sentence: before, after, where held out, and how much better that is."""
    gap = "" if part.unit == "°" else " "
    judged = f"{part.held_out:.3g} where held out" if part.left_out else "none could be left out"
    said = f"{name}: {part.before:.3g}{gap}{part.unit} before, {part.after:.3g} after ({where}), {judged}"
    if part.better:
        return f"{said}: better than no calibration by {digits(part.ratio)} ×"
    return f"{said}: no better than no calibration, so the file leaves it out"


def quantity(value: Array, sigma: Array, prior: Array) -> Quantity:
    """A number for each of ``value``'s, whose 1σ was ``prior`` before."""
    whole = np.broadcast_to(prior, value.shape).astype(float)
    return Quantity(value, np.minimum(sigma, whole), whole, whole)
