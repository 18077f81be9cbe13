"""A magnetometer's calibration from any motion: its numbers with σ, its gain, and the turn that is still missing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from levelhead.calibrate.field_blocks import FieldBlocks, field_blocks
from levelhead.calibrate.magnetometer import (
    DELAY,
    LATE,
    OFFSET,
    SYMMETRIC,
    FieldFit,
    fit_field,
    level_sigma,
)
from levelhead.calibrate.pose_calibration import Residual, digits, quantity, words_of_gain
from levelhead.calibration import Calibration, Quantity
from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording

MIN_MOTION = 5.0  # s of motion with a field
FOLDS, PARTS = 5, 20  # a fold leaves out every fifth of so many parts
WEAK = 0.05  # share of the field: an offset whose σ is larger needs another turn
NEAR_AXIS = 0.9  # cosine from which a direction is named by its axis
MIN_OFFSET, MIN_SIGMAS = 0.08, 4.0  # share of the field, and σ, that an offset must exceed
MIN_GAIN = 2.0  # ratio of the errors before and after
UNEVEN = 0.02  # share of their mean by which lengths of readings scatter; a field below it leaves no offset to find
CELLS = 100  # of the sphere, of equal area


@dataclass(frozen=True, eq=False)
class FieldCalibration:
    """A calibration of a magnetometer.

    Attributes:
        calibration: the numbers with their σ, for ``Calibration.save``, ``apply`` and ``fuse(prior=…)``.
        readings: (n, 3) means of blocks as read, µT.
        corrected: (n, 3) the same without the errors, µT.
        centre: (3,) middle of the readings' ellipsoid, µT.
        strength: of the field, µT.
        dip: of the field below the horizon, degrees.
        heading: error of the field's azimuth in the frame of the gyroscope, degrees.
        sigma: 1σ of the heading of a level sensor by these numbers, degrees.
        coverage: share of the directions from which the field has come.
        advice: sentences: the turn that is missing.
    """

    calibration: Calibration
    readings: Array
    corrected: Array
    centre: Array
    strength: float
    dip: float
    heading: Residual
    sigma: float
    coverage: float
    advice: tuple[str, ...]

    def verdict(self) -> list[str]:
        """Sentences: the offset, the gain in heading, its σ, then the missing turns."""
        share = float(np.linalg.norm(self.centre)) / self.strength
        return [
            f"magnetometer: offset {float(np.linalg.norm(self.centre)):.1f} µT, {100.0 * share:.0f} % of the field of "
            f"{self.strength:.1f} µT, dip {self.dip:.0f}°",
            words_of_gain("heading by the field", self.heading, f"{len(self.readings)} blocks"),
            f"1σ of a level sensor's heading by these numbers {self.sigma:.1f}°; the field came from "
            f"{100.0 * self.coverage:.0f} % of all directions",
            *self.advice,
        ]  # fmt: skip

    def note(self) -> str:
        """The note of a run that subtracted this calibration from its readings."""
        where = ", ".join(f"{axis} {one:+.1f}" for axis, one in zip("xyz", self.centre, strict=True))
        return (
            f"raw magnetometer: offset {where} µT, {100.0 * float(np.linalg.norm(self.centre)) / self.strength:.0f} % "
            f"of the field, found in this log and taken off; heading by the field was off by "
            f"{digits(self.heading.before)}°, and is by {digits(self.heading.held_out)}° where held out"
        )

    def to_dict(self) -> JsonObject:
        """For JSON."""
        return {
            "offset_uT": self.centre.tolist(),
            "strength_uT": self.strength,
            "dip_deg": self.dip,
            "heading_deg": self.heading._asdict() | {"ratio": self.heading.ratio},
            "sigma_heading_deg": self.sigma,
            "coverage": self.coverage,
            "verdict": self.verdict(),
            "calibration": self.calibration.to_dict(),
        }


def calibrate_magnetometer(
    recordings: Recording | Sequence[Recording], *, progress: Callable[[float], None] = lambda fraction: None
) -> FieldCalibration:
    """Offset, soft iron and delay of a magnetometer, from any motion in which the sensor turns about two axes.

    Args:
        recordings: one or several of the same sensor at the same place, with gyroscope and accelerometer.
        progress: called with the fraction done.

    Returns:
        A FieldCalibration; filters, node and export take its ``calibration``.

    Raises:
        LevelheadError: no magnetometer, too short, a field that does not turn with the gyroscope, no gain, or
            a σ of heading above the error without a calibration.
    """
    require("scipy", "calibration", "scipy")
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    for one in several:
        if one.mag is None:
            raise LevelheadError("this recording has no magnetometer; expected one to calibrate")
        if one.duration < MIN_MOTION or not np.isfinite(one.mag).all(axis=1).any():
            raise LevelheadError(
                f"the recording has {one.duration:.1f} s; expected {MIN_MOTION:g} s or more of a sensor that turns, "
                "with a field"
            )
    blocks = field_blocks(several)
    progress(0.3)
    fit = fit_field(blocks)
    progress(0.5)
    heading = heading_gain(blocks, fit, lambda share: progress(0.5 + 0.5 * share))
    if not heading.better:
        raise LevelheadError(
            f"the magnetometer is as good without a calibration: heading by the field is off by {heading.before:.2g}° "
            f"without and {heading.held_out:.2g}° with one, where held out; no file is needed, or more turns are: "
            f"{'; '.join(_missing_turns(fit)) or 'turn it about two axes, far from iron'}"
        )
    sigma = float(np.degrees(level_sigma(fit)))
    if sigma >= heading.before:  # a fit of this part, whose numbers hold for no other attitude
        raise LevelheadError(
            f"the magnetometer's numbers are too vague: 1σ of a level sensor's heading by them is {sigma:.0f}°, and "
            f"it is off by {heading.before:.0f}° without; turn it more: "
            f"{'; '.join(_missing_turns(fit)) or 'about two axes, far from iron'}"
        )
    level = float(np.hypot(*fit.field[:2]))
    return FieldCalibration(
        _calibration(fit), blocks.mag, blocks.mag @ fit.linear[:, :3].T + fit.linear[:, 3], fit.centre, fit.strength,
        float(np.degrees(np.arctan2(-fit.field[2], level))), heading, sigma,
        coverage(blocks.mag @ fit.linear[:, :3].T + fit.linear[:, 3]), tuple(_missing_turns(fit)),
    )  # fmt: skip


def find_raw_magnetometer(recording: Recording) -> FieldCalibration | None:
    """The calibration of a magnetometer with an offset beyond doubt; None for a calibrated one, or too few turns."""
    try:
        found = calibrate_magnetometer(recording)
    except LevelheadError:
        return None
    offset = found.calibration.mag_offset
    assert offset is not None
    clear = np.linalg.norm(found.centre) > max(
        MIN_OFFSET * found.strength, MIN_SIGMAS * float(np.linalg.norm(offset.sigma))
    )
    return found if clear and found.heading.ratio > MIN_GAIN else None


def correct_magnetometer(recording: Recording) -> Recording:
    """The recording without the errors of a raw magnetometer, for a filter that does not learn them itself.

    A first pass over the recording finds them, as ``calibrate_magnetometer`` does. They are taken off only where the
    offset is beyond doubt, and makes heading by the field better on stretches that it was not found from. A note in
    ``meta["notes"]`` reports it.

    Args:
        recording: with gyroscope and accelerometer, and a magnetometer or none.

    Returns:
        A new recording; the given one where nothing is taken off.

    Raises:
        LevelheadError: SciPy is missing.
    """
    require("scipy", "calibration", "scipy")
    if recording.mag is None or not _is_uneven(recording.mag):
        return recording
    found = find_raw_magnetometer(recording)
    if found is None:
        return recording
    better, notes = found.calibration.apply(recording), recording.meta.get("notes", ())
    return replace(better, meta={**better.meta, "notes": (*notes, found.note())})


def _is_uneven(mag: Array) -> bool:
    """Whether the lengths of readings differ by more than noise: a cheap test before a first pass."""
    lengths = np.linalg.norm(mag[np.isfinite(mag).all(axis=1) & mag.any(axis=1)], axis=1)
    return len(lengths) > 0 and bool(lengths.std() > UNEVEN * lengths.mean())


def magnetic_parts(fit: FieldFit) -> dict[str, Quantity | None]:
    """The quantities of a Calibration."""
    offset, covariance = fit.offset()
    unlearned = np.array(OFFSET * fit.strength)
    delay = np.array([np.sqrt(fit.covariance[LATE, LATE])])
    return {
        "mag_offset": quantity(offset, np.sqrt(np.diag(covariance)), unlearned),
        "mag_matrix": quantity(fit.matrix, fit.matrix_sigma(), np.array(SYMMETRIC)),
        "mag_delay": quantity(fit.value[[LATE]], delay, np.array(DELAY)),
    }


def _calibration(fit: FieldFit) -> Calibration:
    """The magnetometer's numbers alone; of the others nothing is known."""
    return Calibration.of_nothing(**magnetic_parts(fit))


def coverage(fields: Array) -> float:
    """Share of ``CELLS`` directions, even on the sphere (Fibonacci's), that are nearest to some of (n, 3) vectors."""
    turns = np.arange(CELLS) + 0.5
    up, around = 1.0 - 2.0 * turns / CELLS, turns * np.pi * (1.0 + np.sqrt(5.0))
    level = np.sqrt(1.0 - up * up)
    cells = np.stack([level * np.cos(around), level * np.sin(around), up])
    return len(np.unique((fields @ cells).argmax(axis=1))) / CELLS


def heading_errors(blocks: FieldBlocks, fit: FieldFit) -> Array:
    """(n,) degrees by which the azimuth of the corrected field is off that of H."""
    turned = fit.residuals(blocks) + fit.field
    return _angle(turned, fit.field)


def _angle(turned: Array, field: Array) -> Array:
    off = np.arctan2(turned[:, 1], turned[:, 0]) - np.arctan2(field[1], field[0])
    degrees: Array = np.degrees((off + np.pi) % (2.0 * np.pi) - np.pi)
    return degrees


def heading_gain(
    blocks: FieldBlocks, fit: FieldFit, progress: Callable[[float], None] = lambda fraction: None
) -> Residual:
    """Errors of heading without a calibration, with it, and with one that has not seen the stretch."""
    nothing = fit.value.copy()
    nothing[:12] = 0.0
    raw = FieldFit(nothing, fit.covariance, fit.spread)
    turned = raw.residuals(blocks) + raw.field
    unit = turned[:, :2] / np.linalg.norm(turned[:, :2], axis=1, keepdims=True)
    before = _angle(turned, unit.mean(axis=0))
    part = (np.arange(len(blocks)) * PARTS) // len(blocks) % FOLDS
    held = np.empty(len(blocks))
    for fold in range(FOLDS):
        others = fit_field(blocks, part != fold, fit)
        held[part == fold] = heading_errors(blocks, others)[part == fold]
        progress((fold + 1) / FOLDS)
    return Residual(_rms(before), _rms(heading_errors(blocks, fit)), _rms(held), "°", len(blocks))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _missing_turns(fit: FieldFit) -> list[str]:
    """The direction in which the offset is weak, and the turn that would determine it."""
    variances, directions = np.linalg.eigh(fit.covariance[:3, :3])
    if np.sqrt(variances[2]) < WEAK * fit.strength:
        return []
    worst = directions[:, 2]
    axis = int(np.abs(worst).argmax())
    others = [name for i, name in enumerate("xyz") if i != axis]
    towards = "" if abs(worst[axis]) > NEAR_AXIS else f" (direction {', '.join(f'{one:.1f}' for one in worst)})"
    return [
        f"the offset along {'xyz'[axis]}{towards} is weak, ± {np.sqrt(variances[2]):.1f} µT: turn the sensor by half a "
        f"turn or more about {' or '.join(others)}, so that its {'xyz'[axis]} axis changes direction"
    ]
