"""The error of an orientation and its split into heading and tilt, as the BROAD benchmark defines it.

D. Laidig, M. Caruso, A. Cereatti, T. Seel, BROAD: A Benchmark for Robust Inertial Orientation Estimation,
Data 2021, 6(7), 72, section 2.5, with the error quaternion seen in the earth frame:

    q_e = q_est ⊗ q_true*                                                                                       (1)
    total       = 2 acos |w|                                                                                    (2)
    heading     = 2 atan |z / w|                                                                                (3)
    inclination = 2 acos √(w² + z²)                                                                             (4)

Written with atan2 here: acos loses half of its digits near 0, which is where a good filter lives. Heading keeps its
sign.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array
from levelhead.rotations import angle, conjugate, product, tilt


class Errors(NamedTuple):
    """Errors of every sample in rad; NaN where there is no truth.

    Attributes:
        total: (n,) angle of the rotation between estimate and truth, 0 to π.
        tilt: (n,) inclination part: how far "up" is wrong, 0 to π.
        heading: (n,) part about the vertical, −π to π, positive when the estimate is turned anticlockwise of the truth.
    """

    total: Array
    tilt: Array
    heading: Array


def error_quaternion(estimate: Array, truth: Array) -> Array:
    """(n, 4) q_e = q_est ⊗ q_true* (eq. 1) of (n, 4) quaternions wxyz."""
    return product(estimate, conjugate(truth))


def split_error(error: Array) -> Errors:
    """Total, tilt and heading (eqs. 2 to 4) of (n, 4) error quaternions; q and −q give the same."""
    w, z = error[:, 0], error[:, 3]
    heading = 2.0 * np.arctan2(np.where(w < 0.0, -z, z), np.abs(w))
    return Errors(total=angle(error), tilt=tilt(error), heading=heading)


def heading_offset(error: Array, rows: NDArray[np.bool_]) -> float:
    """The constant heading, rad, whose removal leaves the smallest total error over ``rows``.

    Turning the estimate back by δ keeps r² = w² + z² and takes δ from the heading ψ = 2 atan2(z, w), so that
    cos(total) = r² (1 + cos(ψ − δ)) − 1. Its mean is largest where Σ r² sin(ψ − δ) = 0, and r² cos ψ = w² − z²,
    r² sin ψ = 2 w z:

        δ = atan2(Σ 2 w z, Σ (w² − z²))                                                                         (5)

    which is the circular mean of the heading error, each sample weighted by how well its heading is defined.
    """
    w, z = error[rows, 0], error[rows, 3]
    return float(np.arctan2(2.0 * np.sum(w * z), np.sum(w * w - z * z)))
