"""Attitude from two directions: TRIAD, and the start of every filter, without any angle.

Two vectors a, b that are seen in the sensor frame and known in the earth frame (H. D. Black, A Passive System for
Determining the Attitude of a Satellite, AIAA Journal 2(7), 1964; M. D. Shuster and S. D. Oh, Three-Axis Attitude
Determination from Vector Observations, J. Guidance and Control 4(1), 1981) give a triad of axes in each frame:

    t₁ = a/|a|,   t₂ = a × b/|a × b|,   t₃ = t₁ × t₂                                                            (1)
    R = t₁ᵉ t₁ᵀ + t₂ᵉ t₂ᵀ + t₃ᵉ t₃ᵀ                                                                             (2)

with ᵉ in the earth frame; R turns sensor-frame vectors into the earth frame. The attitude has the first vector exactly;
of the second only the direction around the first counts.
"""

from levelhead.compiler.mark import kernel
from levelhead.kernels import mat3, quat
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import pitch_axis
from levelhead.kernels.vec3 import Vec3, cross, norm, normalize, scale

PARALLEL = 1e-6  # rad: two directions nearer than this leave the angle around them undetermined


@kernel
def distinct(a: Vec3, b: Vec3) -> bool:
    """Whether the two vectors are there and span a plane."""
    return norm(cross(normalize(a), normalize(b))) > PARALLEL


@kernel
def axes(a: Vec3, b: Vec3) -> Mat3:
    """Eq. 1: t₁, t₂ and t₃ as rows, of ``distinct`` vectors."""
    t1 = normalize(a)
    t2 = normalize(cross(t1, normalize(b)))
    t3 = cross(t1, t2)
    return Mat3(t1.x, t1.y, t1.z, t2.x, t2.y, t2.z, t3.x, t3.y, t3.z)


@kernel
def attitude(first: Vec3, second: Vec3, first_earth: Vec3, second_earth: Vec3) -> Quat:
    """Eq. 2; the identity where two vectors of a frame are not ``distinct``."""
    if distinct(first, second) and distinct(first_earth, second_earth):
        earth = mat3.transpose(axes(first_earth, second_earth))
        return quat.from_matrix(mat3.mul(earth, axes(first, second)))
    return Quat(1.0, 0.0, 0.0, 0.0)


@kernel
def initial_attitude(acc: Vec3, mag: Vec3) -> Quat:
    """The attitude that every filter starts with: TRIAD of gravity and field, as far as they are measured.

    The earth's up, in the sensor frame, is t₁ = a/|a|; magnetic north lies in the plane of gravity and field, so that
    east = −t₂ and north = −t₃. They are the rows of R. Level without accelerometer; yaw 0 without a magnetometer or
    where the field is vertical: the sensor's x axis then points east as far as it can.
    """
    up = normalize(acc)
    if up.x == 0.0 and up.y == 0.0 and up.z == 0.0:
        up = Vec3(0.0, 0.0, 1.0)
    east = cross(normalize(mag), up)
    length = norm(east)
    if length > PARALLEL:
        east = scale(east, 1.0 / length)
        north = cross(up, east)
    else:
        north = pitch_axis(up)  # horizontal, and at right angles to the sensor's x axis
        east = cross(north, up)
    return quat.from_matrix(Mat3(east.x, east.y, east.z, north.x, north.y, north.z, up.x, up.y, up.z))
