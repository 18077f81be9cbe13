"""σ of ``ESKF``: that of attitude in P, and errors that P does not model. No estimate changes by this.

**Time of a reading.** The driver integrates readings of an instant. A reading may also be a mean of the interval T
before it, or pass a filter: its time is uniform in ± T/2, and that rotation is part of σ of each axis i:

    σ_i² = P_ii + (R w T)_i²/12                                                                                 (40)

**A bias that nothing measures.** 0.13 of the widest axis in (24) makes the error of heading least where nothing
measures the bias about the vertical. But that bias may be as large as that of the widest axis, a. With the variance of
b_i that would follow, σ² of heading is larger by

    (P_zb/P_bb)² (1/(1/P_bb − 1/s² + 1/a²) − P_bb)   for each axis with s < a                                     (41)

**A heading about a wrong vertical.** P is of first order. Rotations by θ_x and θ_y about level axes leave one of about
θ_x θ_y about the vertical, which depends on their order. So σ² of heading is larger by

    P_xx P_yy                                                                                                   (42)

An unknown tilt makes an unknown heading; a tilt that is known to 3° adds 0.2°.
"""

from math import sqrt

from levelhead.compiler.mark import kernel
from levelhead.filters.eskf import state as at
from levelhead.kernels.arrays import Floats
from levelhead.kernels.tilt import UNIFORM
from levelhead.kernels.vec3 import Vec3


@kernel
def axis_variance(m: Floats, p: int, i: int, prior: float, widest: float) -> float:
    """The addition of eq. 41 to the variance of heading by state i, rad²; ``prior`` and ``widest`` in (rad/s)²."""
    own = m[p + i * at.ROW + i]
    if widest > prior and 0.0 < own < prior:
        slope = m[p + at.HEADING * at.ROW + i] / own
        return slope * slope * (1.0 / (1.0 / own - 1.0 / prior + 1.0 / widest) - own)
    return 0.0


@kernel
def bias_variance(m: Floats, p: int, prior: Vec3) -> float:
    """The addition of eq. 41 to the variance of heading, rad²."""
    x, y, z = prior
    b, widest = at.GYR_BIAS, max(x, y, z)
    added = axis_variance(m, p, b, x, widest) + axis_variance(m, p, b + 1, y, widest)
    return added + axis_variance(m, p, b + 2, z, widest)


@kernel
def angle_sigma(variance: float) -> float:
    """1σ of an angle of this variance, rad."""
    return min(sqrt(max(variance, 0.0)), UNIFORM)


@kernel
def attitude_sigma(m: Floats, p: int, of_north: float, prior: Vec3, turn: Vec3) -> Vec3:
    """1σ of the attitude error about east, north and up, rad, from the covariance at ``p``.

    ``of_north`` is the addition of north's direction to the variance of heading (rad²), ``prior`` are the prior
    variances of the gyroscope's bias ((rad/s)²) and ``turn`` half the turn of the last sample (rad, earth frame).
    """
    v = p + at.ATTITUDE * (at.ROW + 1)
    east, north, up = turn
    heading = m[v + 2 * (at.ROW + 1)] + of_north + bias_variance(m, p, prior) + m[v] * m[v + at.ROW + 1]
    return Vec3(
        angle_sigma(m[v] + east * east),
        angle_sigma(m[v + at.ROW + 1] + north * north),
        angle_sigma(heading + up * up),
    )
