"""Madgwick's and Mahony's filters as their papers write them, with matrices: slow, plain, independent of the package.

q = (w, x, y, z) rotates sensor-frame vectors into the earth frame, ENU; vectors are unit vectors.
"""

import numpy as np

UP = np.array([0.0, 0.0, 1.0])


def product(p, q):
    """Hamilton's product as a matrix."""
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ q


def rotation(q):
    """R(q) of a unit quaternion, sensor to earth."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def f_general(q, d, s):
    """Madgwick 2010, eq. (20), for any direction d of the earth."""
    q1, q2, q3, q4 = q
    dx, dy, dz = d
    return np.array(
        [
            2 * dx * (0.5 - q3**2 - q4**2) + 2 * dy * (q1 * q4 + q2 * q3) + 2 * dz * (q2 * q4 - q1 * q3) - s[0],
            2 * dx * (q2 * q3 - q1 * q4) + 2 * dy * (0.5 - q2**2 - q4**2) + 2 * dz * (q1 * q2 + q3 * q4) - s[1],
            2 * dx * (q1 * q3 + q2 * q4) + 2 * dy * (q3 * q4 - q1 * q2) + 2 * dz * (0.5 - q2**2 - q3**2) - s[2],
        ]
    )


def f_gravity(q, a):
    """Eq. (25): d = (0, 0, 1), up, and the specific force."""
    q1, q2, q3, q4 = q
    return np.array(
        [
            2 * (q2 * q4 - q1 * q3) - a[0],
            2 * (q1 * q2 + q3 * q4) - a[1],
            2 * (0.5 - q2**2 - q3**2) - a[2],
        ]
    )


def j_gravity(q):
    """Eq. (26)."""
    q1, q2, q3, q4 = q
    return np.array(
        [
            [-2 * q3, 2 * q4, -2 * q1, 2 * q2],
            [2 * q2, 2 * q1, 2 * q4, 2 * q3],
            [0, -4 * q2, -4 * q3, 0],
        ]
    )


def f_field(q, b, m):
    """Eq. (29) with the field's horizontal part along north: b = (0, b_y, b_z)."""
    q1, q2, q3, q4 = q
    _, by, bz = b
    return np.array(
        [
            2 * by * (q1 * q4 + q2 * q3) + 2 * bz * (q2 * q4 - q1 * q3) - m[0],
            2 * by * (0.5 - q2**2 - q4**2) + 2 * bz * (q1 * q2 + q3 * q4) - m[1],
            2 * by * (q3 * q4 - q1 * q2) + 2 * bz * (0.5 - q2**2 - q3**2) - m[2],
        ]
    )


def j_field(q, b):
    """Eq. (30), derived for b = (0, b_y, b_z)."""
    q1, q2, q3, q4 = q
    _, by, bz = b
    return 2 * np.array(
        [
            [by * q4 - bz * q3, by * q3 + bz * q4, by * q2 - bz * q1, by * q1 + bz * q2],
            [bz * q2, -2 * by * q2 + bz * q1, bz * q4, -2 * by * q4 + bz * q3],
            [-by * q2, -by * q1 - 2 * bz * q2, by * q4 - 2 * bz * q3, by * q3],
        ]
    )


def reference(q, m):
    """Eqs. (45) and (46): the measured field in the earth frame, with its horizontal part turned to north."""
    h = rotation(q) @ m
    return np.array([0.0, np.hypot(h[0], h[1]), h[2]])


def gradient(q, a, m=None):
    """Jᵀ f, eqs. (34) and (44) before normalising: (4,)."""
    found = j_gravity(q).T @ f_gravity(q, a)
    if m is not None:
        b = reference(q, m)
        found = found + j_field(q, b).T @ f_field(q, b, m)
    return found


def madgwick(q, beta, dt, a, m=None):
    """One step of eq. (43) without rotation, from q: q − β ∇f/|∇f| dt, unit again."""
    g = gradient(q, a, m)
    q = q - beta * dt * g / np.linalg.norm(g)
    return q / np.linalg.norm(q)


def mahony_correction(q, a, m=None, k_mag=1.0, whole=False):
    """ω_mes of Mahony, Hamel & Pflimlin 2008, eq. (32c), as vex of skew matrices, for up and for north."""
    r = rotation(q)
    pairs = [(1.0, a, r.T @ UP)]
    if m is not None and whole:
        pairs.append((k_mag, m, r.T @ reference(q, m)))
    elif m is not None:
        h = r @ m
        flat = np.array([h[0], h[1], 0.0]) / np.hypot(h[0], h[1])
        pairs.append((k_mag, r.T @ flat, r.T @ np.array([0.0, 1.0, 0.0])))
    skew = sum(k * (np.outer(v_hat, v) - np.outer(v, v_hat)) for k, v, v_hat in pairs)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
