"""Orientations that a device computed by itself, as its log holds them."""

import numpy as np

from levelhead.recording import Array
from levelhead.rotations import from_rotvec, product
from levelhead.track import Track

LEAST_LENGTH = 0.5  # of a quaternion; a shorter one stands for none


def from_angles(roll: Array, pitch: Array, yaw: Array) -> Array:
    """(n, 4) quaternions wxyz of angles in rad, (n,) each, that turn about z, then y, then x."""
    about = [np.zeros((len(roll), 3)) for _ in range(3)]
    for axis, angle in enumerate((roll, pitch, yaw)):
        about[axis][:, axis] = angle
    return product(*(from_rotvec(one) for one in reversed(about)))


def attitude_track(t: Array, quat: Array) -> Track:
    """A track of quaternions (n, 4) of about length 1, at those times (n,) that are later than all before."""
    norm = np.linalg.norm(quat, axis=1)
    kept = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]]) & (norm > LEAST_LENGTH)
    return Track(t[kept], quat[kept] / norm[kept, None])
