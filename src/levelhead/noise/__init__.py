"""The noise of a sensor from a recording at rest: Allan deviation, coefficients with intervals, a file for filters.

>>> model = measure_noise(recording)                                    # doctest: +SKIP
>>> model.save("noise.json")                                            # doctest: +SKIP
>>> fuse(another, NoiseModel.read("noise.json").parameters(ESKF()))     # doctest: +SKIP
"""

from levelhead.noise.measure import measure_noise
from levelhead.noise.model import Coefficient, NoiseModel, TriadNoise
from levelhead.noise.temperature_calibration import calibrate_temperature

__all__ = ["Coefficient", "NoiseModel", "TriadNoise", "calibrate_temperature", "measure_noise"]
