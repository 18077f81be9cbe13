"""The errors of a sensor from poses by hand: each number of its three sensors with σ, and a verdict.

>>> found = calibrate_sensor(recording)         # doctest: +SKIP
>>> print(*found.verdict(), sep="\\n")          # doctest: +SKIP
>>> found.calibration.save("sensor.json")       # doctest: +SKIP
"""

from levelhead.calibrate.pose_calibration import PoseCalibration, Residual
from levelhead.calibrate.solve import calibrate_sensor

__all__ = ["PoseCalibration", "Residual", "calibrate_sensor"]
