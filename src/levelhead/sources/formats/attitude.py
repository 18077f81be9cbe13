"""Orientations that a device computed by itself, as its log holds them."""

import numpy as np

from levelhead.recording import Array
from levelhead.track import Track

LEAST_LENGTH = 0.5  # of a quaternion; a shorter one means none


def attitude_track(t: Array, quat: Array) -> Track:
    """A track of quaternions (n, 4) of about length 1, at those times (n,) that are later than all before."""
    norm = np.linalg.norm(quat, axis=1)
    kept = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]]) & (norm > LEAST_LENGTH)
    return Track(t[kept], quat[kept] / norm[kept, None])
