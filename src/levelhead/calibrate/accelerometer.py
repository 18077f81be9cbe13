"""Nine numbers of an accelerometer from its readings at rest: at any pose the true specific force is as long as g.

With the reading f the true specific force is a = f − T f − c. T is upper triangular: the frame is that of the sensor in
which its x axis is the accelerometer's, and its y axis in the plane of the accelerometer's x and y (D. Tedaldi, A.
Pretto, E. Menegatti, A robust and easy to implement method for IMU calibration without external equipments, ICRA 2014,
eqs. 1 to 10). Of the six sides alone come c and the diagonal of T; the other three need poses on edges.
"""

from collections.abc import Sequence

import numpy as np

from levelhead.calibrate.least_squares import Solution, solve
from levelhead.calibrate.poses import Pose
from levelhead.recording import Array

UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # places in T, in the order of the parameters after c
PRIOR = np.array([0.5] * 3 + [0.05] * 3 + [0.02] * 3)  # 1σ before any measurement: m/s², fractions
DOUBT = 0.003  # m/s², error of a pose by the table and the sensor's curvature, as far as poses do not show it
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


def direction_sigma(covariance: Array, acc: Array) -> Array:
    """(n,) rad, 1σ of a component of the direction of (n, 3) readings by the covariance (9, 9) of the numbers."""
    change = np.zeros((len(acc), 3, 9))
    change[:, :, :3] = -np.eye(3)
    for number, (i, j) in enumerate(UPPER, 3):
        change[:, i, number] = -acc[:, j]
    across = change - np.einsum("ki,kj,kjn->kin", acc, acc, change) / np.square(acc).sum(axis=1)[:, None, None]
    variance = 0.5 * np.einsum("kin,nm,kim->k", across, covariance, across)
    sigma: Array = np.sqrt(variance) / np.linalg.norm(acc, axis=1)
    return sigma


def excess(parameters: Array, acc: Array, gravity: float) -> Array:
    """(n,) |a| − g in m/s²."""
    left: Array = np.linalg.norm(correct_forces(parameters, acc), axis=1) - gravity
    return left


def fit_accelerometer(poses: Sequence[Pose], gravity: float) -> Solution:
    """c, then T; a number that the poses do not determine stays near 0, with the σ that it has without them."""
    acc, sigma = np.array([pose.acc for pose in poses]), np.array([pose.sigma for pose in poses])
    doubt = DOUBT / float(np.median(sigma))
    return solve(lambda parameters: excess(parameters, acc, gravity) / sigma, np.zeros(9), PRIOR, doubt)


def information(direction: Array, gravity: float) -> Array:
    """(…, 9) how the residual of a pose with the side (…, 3) up changes with the numbers: rows of the Jacobian."""
    force = gravity * direction
    rows = [-direction[..., i] * force[..., j] for i, j in UPPER]
    return np.concatenate([-direction, np.stack(rows, axis=-1)], axis=-1)
