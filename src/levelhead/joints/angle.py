"""The angle about a hinge and its σ."""

import numpy as np

from levelhead.joints.axes_fit import AxesFit, about_vertical, tangents
from levelhead.recording import Array


def hinge_angle(fit: AxesFit, upper: Array, lower: Array) -> Array:
    """(n,) rad, continuous: by how much the lower segment is turned about the axis in the upper one.

    A vector across the axis in the lower sensor is turned into the upper sensor, and its angle about the axis there is
    taken; (n, 3, 3) rotations, sensor to earth. The constant is arbitrary.
    """
    across = about_vertical(lower @ tangents(fit.lower)[:, 0], -fit.heading)
    in_upper = np.einsum("nji,nj->ni", upper, across)
    first, second = (in_upper @ tangents(fit.upper)).T
    angle: Array = np.unwrap(np.arctan2(second, first))
    return angle


def hinge_sigma(fit: AxesFit, lower: Array, tilt_variance: Array) -> Array:
    """(n,) rad, 1σ of the angle.

    With a the direction of the axis in the earth frame, errors of tilt count by its horizontal part and that of the
    relative heading by its vertical part: σ² = (a_x² + a_y²) σ_tilt² + a_z² σ_δ².

    Args:
        fit: the hinge.
        lower: (n, 3, 3) rotations of the lower sensor.
        tilt_variance: (n,) rad² about one horizontal axis, the sum of both sensors'.
    """
    axis = lower @ fit.lower
    level = axis[:, 0] ** 2 + axis[:, 1] ** 2
    sigma: Array = np.sqrt(level * tilt_variance + axis[:, 2] ** 2 * fit.sigma_heading**2)
    return sigma
