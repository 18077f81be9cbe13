"""Recordings with known truth: the lesson, smooth motions in three dimensions, and sensors with realistic errors.

>>> from levelhead import simulate
>>> simulate.recording("MPU-6050", "hand", duration=10)
Recording(1000 samples, 10.0 s at 100.0 Hz: gyr, acc, truth)

In three steps: ``motion`` makes the truth, ``imu`` the error model of a chip, ``observe`` the recording. ``pressure``
and ``gnss`` are sensors beside it. ``apply_fault`` breaks a recording, simulated or real.
"""

from levelhead.simulate.aiding_sensors import Barometer, Receiver, gnss, pressure
from levelhead.simulate.buoy import buoy
from levelhead.simulate.circles import circles
from levelhead.simulate.disturbance import Bumps, Vibration
from levelhead.simulate.fault import Fault, Faulted, all_faults, apply_fault, parse_fault
from levelhead.simulate.foot import foot
from levelhead.simulate.imu import EARTH_FIELD, Imu, Iron, observe
from levelhead.simulate.lesson import hard_lesson, lesson
from levelhead.simulate.motion import STYLES, Motion, motion
from levelhead.simulate.pipeline import MOTIONS, recording
from levelhead.simulate.pose_sequence import poses
from levelhead.simulate.presets import CHIPS, MAGNETOMETERS, imu
from levelhead.simulate.triad_errors import TriadErrors

__all__ = [
    "CHIPS",
    "EARTH_FIELD",
    "MAGNETOMETERS",
    "MOTIONS",
    "STYLES",
    "Barometer",
    "Bumps",
    "Fault",
    "Faulted",
    "Imu",
    "Iron",
    "Motion",
    "Receiver",
    "TriadErrors",
    "Vibration",
    "all_faults",
    "apply_fault",
    "buoy",
    "circles",
    "foot",
    "gnss",
    "hard_lesson",
    "imu",
    "lesson",
    "motion",
    "observe",
    "parse_fault",
    "poses",
    "pressure",
    "recording",
]
