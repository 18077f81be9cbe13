"""The three angles of a joint: about an axis of the upper segment, a floating one, and an axis of the lower segment.

With B the rotation from the lower segment's frame to the upper one's, z the first axis in the upper and y the last one
in the lower frame,

    B = Rz(α) Rx(β) Ry(γ)                                                                                       (3)

(E. Grood, W. Suntay, J. Biomech. Eng. 105(2), 1983; G. Wu et al., J. Biomech. 35(4), 2002: for a knee flexion,
adduction and internal rotation, with x forward, y up and z to the right).
"""

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.joints.axes_fit import AxesFit, tangents
from levelhead.recording import Array

MOST_RISE = 0.7  # sine of the elevation of the main axis in a neutral pose
LEAST_COSINE = 0.05  # of β: nearer to ±90° the other two angles are one


def cardan_angles(upper: Array, lower: Array) -> Array:
    """(n, 3) rad, α, β, γ of (3), of (n, 3, 3) rotations from the segments' frames to the earth; α and γ continuous."""
    b = np.einsum("nji,njk->nik", upper, lower)
    alpha = np.unwrap(np.arctan2(-b[:, 0, 1], b[:, 1, 1]))
    gamma = np.unwrap(np.arctan2(-b[:, 2, 0], b[:, 2, 2]))
    return np.stack([alpha, np.arcsin(np.clip(b[:, 2, 1], -1.0, 1.0)), gamma], axis=1)


def cardan_sigma(angle: Array, upper: Array, lower: Array, tilt_variance: Array, heading_variance: Array) -> Array:
    """(n, 3) rad, 1σ of the angles (rad).

    A small relative rotation φ in the earth frame changes α and γ by φ·d/cos β, where d is across the other axis in the
    plane of both, and β by φ along the floating axis. Tilt counts by the level part, heading by the vertical part.
    """
    first, last = upper[:, :, 2], lower[:, :, 1]
    cosine = np.maximum(np.cos(angle[:, 1]), LEAST_COSINE)[:, None]
    floating = np.cross(last, first) / cosine
    directions = np.stack([np.cross(floating, last) / -cosine, floating, np.cross(first, floating) / -cosine], axis=1)
    level = np.sum(directions[:, :, :2] ** 2, axis=2)
    variance = level * tilt_variance[:, None] + directions[:, :, 2] ** 2 * heading_variance[:, None]
    sigma: Array = np.sqrt(variance)
    return sigma


def frames_of_axes(fit: AxesFit) -> tuple[Array, Array]:
    """(3, 3) frames of both segments, segment to sensor: z is the first axis in the upper, y the last in the lower."""
    x, y = tangents(fit.upper).T
    first = np.stack([x, y, fit.upper], axis=1)
    z, x = tangents(fit.lower).T
    return first, np.stack([x, fit.lower, z], axis=1)


def frames_of_pose(axis: Array, upper: Array, lower: Array) -> tuple[Array, Array]:
    """The same of a neutral pose: z is the axis (upper sensor), y is up as far as z lets it; both frames are one there.

    ``upper`` and ``lower`` are rotations (3, 3) of the sensors to one earth frame in that pose.

    Raises:
        LevelheadError: the axis is nearly vertical there.
    """
    rise = float(upper[2] @ axis)
    if abs(rise) > MOST_RISE:
        raise LevelheadError(
            f"at zero the axis about which the joint bends most is {np.degrees(np.arccos(abs(rise))):.0f}° from the "
            "vertical; expected a neutral pose, in which it is level"
        )
    y = upper[2] - rise * axis
    y /= np.linalg.norm(y)
    first = np.stack([np.cross(y, axis), y, axis], axis=1)
    return first, lower.T @ upper @ first
