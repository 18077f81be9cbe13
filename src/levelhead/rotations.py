"""Rotations of many samples: arrays of quaternions wxyz, one row each, and SciPy's Rotation operations for them.

A quaternion turns vectors of the sensor's frame into the earth's frame; p ⊗ q turns by q first. Shape (4,) is a
constant that holds for every row. Within kernels, ``kernels/quat.py`` does the same for one sample.
"""

from typing import TYPE_CHECKING

import numpy as np

from levelhead.kernels import quat as quat_kernels
from levelhead.kernels.mat3 import Mat3
from levelhead.recording import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_HALF = 0.5**0.5
ONE: Array = np.array([1.0, 0.0, 0.0, 0.0])
NED_TO_ENU: Array = np.array([0.0, _HALF, _HALF, 0.0])  # swaps x and y, negates z
NWU_TO_ENU: Array = np.array([_HALF, 0.0, 0.0, _HALF])  # a quarter turn: x north becomes y
FRD_TO_FLU: Array = np.array([0.0, 1.0, 0.0, 0.0])  # forward-right-down: negates y and z
_CONJUGATE: Array = np.array([1.0, -1.0, -1.0, -1.0])
for _constant in (ONE, NED_TO_ENU, NWU_TO_ENU, FRD_TO_FLU, _CONJUGATE):
    _constant.flags.writeable = False


def conjugate(quat: Array) -> Array:
    """q* of (4,) or (m, 4)."""
    return quat * _CONJUGATE


def product(*factors: Array) -> Array:
    """(m, 4) Hamilton product of (4,) and (m, 4) quaternions; (1, 4) if all are constants."""
    result = np.atleast_2d(factors[0])
    for factor in factors[1:]:
        a, b, c, d = result.T
        w, x, y, z = np.atleast_2d(factor).T
        result = np.stack(
            [
                a * w - b * x - c * y - d * z,
                b * w + a * x + c * z - d * y,
                c * w + a * y + d * x - b * z,
                d * w + a * z + b * y - c * x,
            ],
            axis=1,
        )
    return result


def relative_rotation(a: Array, b: Array) -> Array:
    """(m, 4) a* ⊗ b: the rotation from a to b, in the axes of a."""
    return product(conjugate(a), b)


def rotate(quat: Array, vectors: Array) -> Array:
    """(m, 3) vectors, (m, 3) or one (3,) for all, turned by (m, 4) unit quaternions: v + 2w (u×v) + 2 u×(u×v)."""
    w, u = quat[:, :1], quat[:, 1:]
    twice = 2.0 * np.cross(u, vectors)
    turned: Array = vectors + w * twice + np.cross(u, twice)
    return turned


def about_up(angle: float) -> Array:
    """(4,) rotation by an angle in rad about the vertical."""
    return np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)])


def turn_heading(quat: Array, angle: float) -> Array:
    """(m, 4) quaternions turned by ``angle`` (rad) about the earth's vertical."""
    return product(about_up(angle), quat)


def angle(quat: Array) -> Array:
    """(m,) angles of rotation in rad, 0 to π; q and −q give the same."""
    w, x, y, z = quat.T
    found: Array = 2.0 * np.arctan2(np.hypot(np.hypot(x, y), z), np.abs(w))
    return found


def tilt(quat: Array) -> Array:
    """(m,) angles in rad, 0 to π, between the z axes before and after the rotation."""
    w, x, y, z = quat.T
    found: Array = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    return found


def matrix(quat: Array) -> Array:
    """(m, 3, 3) rotation matrices of (m, 4) unit quaternions; NaN where these are."""
    w, x, y, z = quat.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def mean(quat: Array, weights: Array | None = None) -> Array:
    """(4,) the mean of (m, 4) quaternions whatever their signs, each with its weight (m,).

    F. L. Markley, Y. Cheng, J. L. Crassidis, Y. Oshman, Averaging Quaternions, J. Guidance, Control, and Dynamics
    30(4), 2007, eq. (13).
    """
    weighted = quat if weights is None else quat * weights[:, None]
    _, vectors = np.linalg.eigh(weighted.T @ quat)
    found: Array = vectors[:, -1]
    return found


def cross_matrix(vectors: Array) -> Array:
    """(n, 3, 3) matrices of the cross product with (n, 3) vectors from the left."""
    result: Array = np.cross(vectors[:, None, :], np.eye(3)).transpose(0, 2, 1)
    return result


def nearest_rotation(profile: Array) -> Array:
    """(3, 3) the rotation A nearest to Σ b aᵀ (3, 3), with which b = A a fits best over all pairs (Wahba's problem).

    F. L. Markley, J. L. Crassidis, Fundamentals of Spacecraft Attitude Determination and Control, 2014, section 5.4.
    """
    left, _, right = np.linalg.svd(profile)
    found: Array = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return found


def to_scipy(quat: Array) -> "Rotation":
    """A SciPy Rotation of quaternions wxyz."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quat, scalar_first=True)


def rotvec(quat: Array) -> Array:
    """(m, 3) rotation vectors in rad of (m, 4) quaternions."""
    vectors: Array = to_scipy(quat).as_rotvec()
    return vectors


def from_rotvec(vector: Array) -> Array:
    """(4,) quaternion of a rotation vector (3,) in rad."""
    from scipy.spatial.transform import Rotation

    quat: Array = Rotation.from_rotvec(vector).as_quat(scalar_first=True)
    return quat


def from_angles(roll: Array, pitch: Array, yaw: Array) -> Array:
    """(n, 4) quaternions wxyz of angles in rad, (n,) each, that turn about z, then y, then x."""
    about = [np.zeros((len(roll), 3)) for _ in range(3)]
    for axis, angle in enumerate((roll, pitch, yaw)):
        about[axis][:, axis] = angle
    return product(*(from_rotvec(one) for one in reversed(about)))


def from_matrix(rotation: Array) -> Array:
    """(4,) quaternion of a rotation matrix (3, 3)."""
    return np.array(quat_kernels.from_matrix(Mat3(*np.ravel(rotation).tolist())))


def interpolate(when: Array, t: Array, quat: Array) -> Array:
    """(m, 4) unit quaternions at the stamps ``when`` between those of (n, 4) ``quat`` at increasing stamps ``t``.

    On the chord between two neighbours: for a turn of θ between them the angle is wrong by 0.004 θ³ at most.
    """
    after = np.clip(np.searchsorted(t, when, "right"), 1, len(t) - 1)
    first, last = quat[after - 1], quat[after]
    share = np.clip((when - t[after - 1]) / (t[after] - t[after - 1]), 0.0, 1.0)[:, None]
    last = np.where(np.sum(first * last, axis=1, keepdims=True) < 0.0, -last, last)
    chord = first + share * (last - first)
    found: Array = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    return found
