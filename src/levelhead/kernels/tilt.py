"""Roll, pitch and heading as an accelerometer and a magnetometer see them.

Specific force of a body that does not accelerate is R^T (0, 0, g) = g (−sin θ, sin φ cos θ, cos φ cos θ) with roll φ
and pitch θ (Titterton & Weston, Strapdown Inertial Navigation Technology, 2nd ed., section 10.4), from which the
equations below follow.
"""

from math import pi, sqrt

from levelhead.compiler.mark import kernel
from levelhead.kernels import quat
from levelhead.kernels.quat import Quat
from levelhead.kernels.trig import atan2
from levelhead.kernels.vec3 import Vec3

UNIFORM = pi / sqrt(3.0)  # rad, standard deviation of an angle that is uniform on the circle
GAP_SECONDS = 0.5 + 0.5e-6  # s: across a longer interval the attitude is held; no stamps in µs are so far apart
TURN = 1.0  # rad/s, 1σ of how fast a body may turn in a gap
NO_LENGTH = 1e-200  # squared, in any unit: below it squares lose their digits, and then nothing is unit any more
COS2_LIMIT = 0.0076  # cos² 85°
STEEP2 = 0.04  # below this share of |a|² across the roll axis (pitch beyond 78°) roll is noise, not a measurement


@kernel
def is_present(v: Vec3) -> bool:
    """Whether a sensor is there: an absent one, or one too short for a direction, is the zero vector."""
    x, y, z = v
    return x * x + y * y + z * z > NO_LENGTH


@kernel
def steep(acc: Vec3) -> bool:
    """Whether the roll axis is so near the vertical that the accelerometer does not show roll."""
    across = acc.y * acc.y + acc.z * acc.z
    return across < STEEP2 * (acc.x * acc.x + across)


@kernel
def roll_innovation(up: Vec3, acc: Vec3) -> float:
    """Measured minus predicted roll, rad, on the circle; ``up`` is the predicted vertical in the sensor frame."""
    _, ay, az = acc
    _, uy, uz = up
    return atan2(ay * uz - az * uy, az * uz + ay * uy)


@kernel
def roll_weight(up: Vec3) -> float:
    """cos² θ, at least cos² 85°: a given error of the acceleration turns measured roll by 1/cos θ more than pitch."""
    return max(up.y * up.y + up.z * up.z, COS2_LIMIT)


@kernel
def pitch_innovation(up: Vec3, acc: Vec3) -> float:
    """Measured minus predicted pitch, rad; ``up`` is the predicted vertical in the sensor frame."""
    ax, ay, az = acc
    ux, uy, uz = up
    across_up = sqrt(uy * uy + uz * uz)
    across_acc = sqrt(ay * ay + az * az)
    return atan2(ux * across_acc - ax * across_up, across_acc * across_up + ax * ux)


@kernel
def heading_innovation(attitude: Quat, mag: Vec3) -> float:
    """Measured minus predicted yaw, rad: the angle by which the field, seen in the earth frame, misses north."""
    field = quat.rotate(attitude, mag)
    return atan2(field.x, field.y)


@kernel
def pitch_axis(up: Vec3) -> Vec3:
    """The axis about which pitch turns, in the sensor frame: (0, cos φ, −sin φ); ``up`` is the vertical there."""
    _, y, z = up
    across = sqrt(y * y + z * z)
    if across > 0.0:
        one = 1.0 / across
        return Vec3(0.0, z * one, -y * one)
    return Vec3(0.0, 1.0, 0.0)


@kernel
def in_sensor(axis: Vec3, roll: float, pitch: float) -> Vec3:
    """Roll and pitch rates (or their biases) as one vector in the sensor frame; ``axis`` is ``pitch_axis``."""
    return Vec3(roll, pitch * axis.y, pitch * axis.z)


@kernel
def add_roll_pitch(attitude: Quat, axis: Vec3, roll: float, pitch: float) -> Quat:
    """The attitude with roll and pitch increased, exactly: q ⊗ exp(δθ pitch axis) ⊗ exp(δφ x axis).

    ``axis`` is ``pitch_axis``; the two turns are multiplied out.
    """
    sr, cr = quat.half_angle(0.25 * roll * roll)
    sp, cp = quat.half_angle(0.25 * pitch * pitch)
    sr *= roll
    sp *= pitch
    y = sp * axis.y
    z = sp * axis.z
    return quat.compose(attitude, Quat(cp * cr, cp * sr, y * cr + z * sr, z * cr - y * sr))


@kernel
def add_yaw(attitude: Quat, yaw: float) -> Quat:
    """The attitude turned about the vertical: exp(δψ (0, 0, 1)) ⊗ q, multiplied out."""
    w, x, y, z = attitude
    s, c = quat.half_angle(0.25 * yaw * yaw)
    s *= yaw
    return quat.unit(c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)


@kernel
def after_gap(variance: float, dt: float) -> float:
    """The variance of an angle (rad²) after ``dt`` seconds of unknown motion."""
    return min(variance + TURN * TURN * dt * dt, UNIFORM * UNIFORM)


@kernel
def bias_after_gap(variance: float, walk_variance: float, at_start: float) -> float:
    """The variance of a bias after a gap: larger by ``walk_variance``, but at most that of a sensor just turned on."""
    return max(variance, min(variance + walk_variance, at_start))
