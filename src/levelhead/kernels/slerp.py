"""An attitude moved towards a measured direction: a share of the way on the unit quaternions' great circle.

Slerp from q₀ to q₁ is exp(w log(q₁ q₀*)) q₀ (K. Shoemake, Animating Rotation with Quaternion Curves, SIGGRAPH 1985):
the share w of one turn. Accelerometer and field measure different parts of an attitude, so each has a turn of its own,
as in the complementary filter of R. G. Valenti, I. Dryanovski and J. Xiao, Keeping a Good Attitude: A Quaternion-Based
Orientation Filter for IMUs and MARGs, Sensors 15(8), 2015 (who take a linear interpolation, normalised, where the turn
is small). Neither uses roll and pitch, so none is singular.
"""

from math import pi, sqrt

from levelhead.compiler.mark import kernel
from levelhead.kernels import quat, tilt
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import Vec3


@kernel
def level(attitude: Quat, acc: Vec3, share: float) -> Quat:
    """The attitude turned by a share (0 to 1) of the shortest turn that brings the specific force up.

        f = q a q*,   φ = atan2(√(f_x² + f_y²), f_z),   n = (f_y, −f_x, 0)/√(f_x² + f_y²)                       (1)
        q ← exp(w φ n) q                                                                                        (2)

    The axis n is horizontal: heading stays. Where the force points exactly down any horizontal axis will do.
    """
    fx, fy, fz = quat.rotate(attitude, acc)
    across = sqrt(fx * fx + fy * fy)
    if across > 0.0:
        angle = atan2(across, fz)
    elif fz < 0.0:
        angle = pi
        across = 1.0
        fy = 1.0
    else:
        return attitude
    turn = share * angle
    size, c = quat.half_angle(0.25 * turn * turn)
    size *= share / across * angle
    a = size * fy
    b = -size * fx
    w, x, y, z = attitude
    return quat.unit(c * w - a * x - b * y, c * x + a * w + b * z, c * y - a * z + b * w, c * z + a * y - b * x)


@kernel
def turn_north(attitude: Quat, mag: Vec3, share: float) -> Quat:
    """The attitude turned about the vertical by a share of the angle from north to the field.

    h = q m q*,   q ← exp(w atan2(h_x, h_y) (0, 0, 1)) q                                                    (3)
    """
    return tilt.add_yaw(attitude, share * tilt.heading_innovation(attitude, mag))
