"""Products of quaternions wxyz, arrays and constants alike."""

from typing import TYPE_CHECKING

import numpy as np

from levelhead.evaluate.attitude_error import error_quaternion, split
from levelhead.recording import Array

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

ONE: Array = np.array([1.0, 0.0, 0.0, 0.0])
_CONJUGATE: Array = np.array([1.0, -1.0, -1.0, -1.0])
ONE.flags.writeable = _CONJUGATE.flags.writeable = False


def conjugate(quat: Array) -> Array:
    """q* of (4,) or (m, 4)."""
    return quat * _CONJUGATE


def product(*factors: Array) -> Array:
    """(m, 4) product of (4,) and (m, 4) quaternions; (1, 4) if all are constants."""
    result = np.atleast_2d(factors[0])
    for factor in factors[1:]:
        result = error_quaternion(result, conjugate(np.atleast_2d(factor)))
    return result


def between(a: Array, b: Array) -> Array:
    """a* ⊗ b: the rotation from a to b, in the axes of a."""
    return product(conjugate(a), b)


def angles(a: Array, b: Array) -> Array:
    """(m,) angles in rad, 0 to π, between two orientations."""
    return split(between(a, b)).total


def mean(quat: Array, weights: Array) -> Array:
    """(4,) the weighted mean of (m, 4) quaternions whatever their signs: Markley et al. 2007, eq. (13)."""
    _, vectors = np.linalg.eigh((quat * weights[:, None]).T @ quat)
    found: Array = vectors[:, -1]
    return found


def rotation(quat: Array) -> "Rotation":
    """A SciPy Rotation of quaternions wxyz."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quat, scalar_first=True)


def rotvec(quat: Array) -> Array:
    """(m, 3) rotation vectors in rad of (m, 4) quaternions."""
    vectors: Array = rotation(quat).as_rotvec()
    return vectors


def of_rotvec(vector: Array) -> Array:
    """(4,) quaternion of a rotation vector (3,) in rad."""
    from scipy.spatial.transform import Rotation

    quat: Array = Rotation.from_rotvec(vector).as_quat(scalar_first=True)
    return quat
