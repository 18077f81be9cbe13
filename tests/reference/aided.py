"""Simulated motions with a barometer or a receiver beside the IMU, and the errors of their tracks."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate


def flown(seed, style="drone", duration=60.0, chip="LSM6DSO32"):
    motion = simulate.motion(seed, duration, 100.0, style=style)
    return motion, simulate.observe(motion, simulate.imu(chip, mag="HMC5883L"), seed)


def accelerated(seed=0, gnss=True):
    """A car: 4 s at 3 m/s² to the east, later as much braking, again and again."""
    t = np.arange(6000) / 100
    push = np.where(t < 5, 0.0, 3.0 * np.sign(np.sin(2 * np.pi * (t - 5) / 16)) * (np.abs((t - 5) % 8 - 4) < 2))
    a = np.stack([push, np.zeros(6000), np.zeros(6000)], 1)
    v = np.cumsum(a, axis=0) / 100
    p = np.cumsum(v, axis=0) / 100
    still = np.tile([1.0, 0, 0, 0], (6000, 1))
    motion = simulate.Motion(t, still, np.zeros((6000, 3)), p, v, a)
    recording = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed)
    return motion, replace(recording, gnss=simulate.gnss(motion, seed=seed)) if gnss else recording


def tilt(track, truth):
    error = track.as_rotation() * Rotation.from_quat(truth.quat, scalar_first=True).inv()
    return np.degrees(np.arccos(np.clip(error.apply([0.0, 0.0, 1.0])[:, 2], -1, 1)))


def rms(x):
    return np.sqrt(np.mean(np.square(x), axis=0))


def turned(motion, seed, off, change=lambda fixes: fixes):
    """The motion's frame turned by ``off`` degrees about the vertical: a relative heading starts so far off.

    Returns the run without a magnetometer, and its heading error in degrees.
    """
    turn = Rotation.from_euler("z", off, degrees=True)
    rec = simulate.observe(motion, simulate.imu("LSM6DSO32"), seed)
    fixes = simulate.gnss(motion, seed=seed)
    fixes = replace(fixes, position=turn.apply(fixes.position.copy()), velocity=turn.apply(fixes.velocity.copy()))
    track = lh.fuse(replace(rec, gnss=change(fixes)), "ESKF")
    true = turn * Rotation.from_quat(motion.quat.copy(), scalar_first=True)
    return track, np.degrees((track.as_rotation() * true.inv()).as_rotvec()[:, 2])
