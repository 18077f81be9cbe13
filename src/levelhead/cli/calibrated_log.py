"""Logs of a sensor whose errors ``levelhead calibrate`` has found, or is to find."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.options import Reading, simulate_recording
from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.filters.contract import Filter
    from levelhead.recording import Recording

CalibrationFile = Annotated[
    Path | None,
    Parameter(
        name="--calibration",
        metavar="FILE",
        help="The sensor's errors, as written by `levelhead calibrate`; readings are corrected first.",
    ),
]


def read_with_field(reading: Reading, log: Path) -> "Recording":
    """The recording in a log, also with a magnetometer whose field does not turn with the body."""
    return reading.read(log, lambda found: found.without("mag.used", "does_not_turn"))


def read_calibrated(reading: Reading, log: Path, calibration: Path | None) -> "Recording":
    """The recording in a log without the errors in a file.

    Raises:
        LevelheadError: no such file, or it holds no calibration.
    """
    recording = reading.read(log)
    if calibration is None:
        return recording
    from levelhead.calibration import Calibration

    return Calibration.read(calibration).apply(recording)


def read_without_iron(reading: Reading, log: Path, flt: "Filter", first_pass: bool = True) -> "Recording":
    """The recording in a log, for a filter that follows its magnetometer.

    A filter that learns the magnetometer's errors takes it as it is. For another a raw magnetometer is calibrated by
    a first pass over the log, and corrected; a note reports it. Without a gain, or without a first pass, the readings
    stay as they are.
    """
    found = reading.read(log)
    if flt.calibration is not None or "heading" not in flt.estimates or not first_pass:
        return found
    from levelhead.calibrate import correct_magnetometer

    recording = found if found.mag is not None else read_with_field(reading, log)
    better = correct_magnetometer(recording)
    return found if better is recording else better


def log_or_simulation(
    log: Path | None, simulate: str | None, seed: int | None, reading: Reading, calibration: Path | None = None
) -> "Recording":
    """The recording of a verb that takes a log or a simulation, one of the two."""
    if (log is None) == (simulate is None):
        raise LevelheadError("give either a log or --simulate, such as: --simulate lesson")
    if log is not None:
        if seed is not None:
            raise LevelheadError("--seed is for --simulate; a log has no seed")
        return read_calibrated(reading, log, calibration)
    if calibration is not None:
        raise LevelheadError("--calibration is for a log; --simulate has a sensor of its own")
    if reading != Reading():
        raise LevelheadError("--map, --units, --counts and --rate are for a log; --simulate needs none of them")
    return simulate_recording(str(simulate), seed)
