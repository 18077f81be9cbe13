"""The errors of a sensor from poses by hand, those of a magnetometer from any motion: numbers with σ, and a verdict.

>>> found = calibrate_sensor(recording)         # doctest: +SKIP
>>> print(*found.verdict(), sep="\\n")          # doctest: +SKIP
>>> found.calibration.save("sensor.json")       # doctest: +SKIP
"""

from levelhead.calibrate.field_calibration import (
    FieldCalibration,
    calibrate_magnetometer,
    correct_magnetometer,
    find_raw_magnetometer,
)
from levelhead.calibrate.pose_calibration import PoseCalibration, Residual
from levelhead.calibrate.solve import calibrate_sensor

__all__ = [
    "FieldCalibration",
    "PoseCalibration",
    "Residual",
    "calibrate_magnetometer",
    "calibrate_sensor",
    "correct_magnetometer",
    "find_raw_magnetometer",
]
