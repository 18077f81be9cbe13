"""Nine numbers of an accelerometer from its readings at rest: at any pose the true specific force is as long as g.

With the reading f the true specific force is a = f − T f − c. T is upper triangular: the frame is that of the sensor in
which its x axis is the accelerometer's, and its y axis in the plane of the accelerometer's x and y (D. Tedaldi, A.
Pretto, E. Menegatti, A robust and easy to implement method for IMU calibration without external equipments, ICRA 2014,
eqs. 1 to 10).
"""

from collections.abc import Sequence

import numpy as np

from levelhead.calibrate.least_squares import Solution, solve
from levelhead.calibrate.poses import Pose
from levelhead.recording import Array

UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # places in T, in the order of the parameters after c
PRIOR = np.array([0.5] * 3 + [0.05] * 6)  # 1σ before any measurement: m/s², fractions
NAMES = (
    "bias x",
    "bias y",
    "bias z",
    "scale x",
    "scale y",
    "scale z",
    "cross-axis xy",
    "cross-axis xz",
    "cross-axis yz",
)


def triangular_matrix(parameters: Array) -> Array:
    """(3, 3) T."""
    found = np.zeros((3, 3))
    for place, value in zip(UPPER, parameters[3:], strict=True):
        found[place] = value
    return found


def correct_forces(parameters: Array, acc: Array) -> Array:
    """(n, 3) a of (n, 3) readings."""
    corrected: Array = acc - acc @ triangular_matrix(parameters).T - parameters[:3]
    return corrected


def excess(parameters: Array, acc: Array, gravity: float) -> Array:
    """(n,) |a| − g in m/s²."""
    left: Array = np.linalg.norm(correct_forces(parameters, acc), axis=1) - gravity
    return left


def fit_accelerometer(poses: Sequence[Pose], gravity: float) -> Solution:
    """c, then T."""
    acc, sigma = np.array([pose.acc for pose in poses]), np.array([pose.sigma for pose in poses])
    return solve(lambda parameters: excess(parameters, acc, gravity) / sigma, np.zeros(9), PRIOR)


def information(direction: Array, gravity: float, sigma: float) -> Array:
    """(9,) how a pose with this side up would change the residual, over σ: a row of the Jacobian."""
    force = gravity * direction
    rows = [-direction[i] * force[j] for i, j in UPPER]
    return np.concatenate([-direction, rows]) / sigma
