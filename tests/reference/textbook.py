"""The filters as a textbook writes them, with NumPy matrices: slow, plain, and independent of the package."""

import numpy as np
from scipy.spatial.transform import Rotation


def kalman(level, rate, dt, q, r, x, p, joseph=False):
    """Linear Kalman filter, states (level, bias) or (level, bias, bias rate); returns states and covariances (n, …)."""
    size = len(x)
    h = np.zeros((1, size))
    h[0, 0] = 1.0
    states, covariances = [x], [p]
    for z, u in zip(level[1:], rate[1:], strict=True):
        if size == 2:
            f, b = np.array([[1, -dt], [0, 1]]), np.array([dt, 0])
        else:
            f, b = np.array([[1, -dt, -(dt**2) / 2], [0, 1, dt], [0, 0, 1]]), np.array([dt, 0, 0])
        x, p = f @ x + b * u, f @ p @ f.T + q
        k = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
        x = x + (k @ (np.array([z]) - h @ x)).ravel()
        rest = np.eye(size) - k @ h
        p = rest @ p @ rest.T + k @ np.atleast_2d(r) @ k.T if joseph else rest @ p
        states.append(x)
        covariances.append(p)
    return np.array(states), np.array(covariances)


def complementary(level, rate, dt, alpha):
    """angle = alpha (angle + rate dt) + (1 − alpha) level"""
    out = [level[0]]
    for z, u in zip(level[1:], rate[1:], strict=True):
        out.append(alpha * (out[-1] + u * dt) + (1 - alpha) * z)
    return np.array(out)


def compass(acc, mag):
    """Tilt-compensated compass (AN4248): roll, then pitch, then yaw, each by its arctangent."""
    roll = np.arctan2(acc[1], acc[2])
    pitch = np.arctan2(-acc[0], np.hypot(acc[1], acc[2]))
    level = Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply(np.array(mag))
    return Rotation.from_euler("ZYX", [np.arctan2(level[0], level[1]), pitch, roll])


def slerp(p, q, share):
    """Shoemake's formula on 4-vectors, the short way round."""
    p, q = np.asarray(p), np.asarray(q) * (-1.0 if np.dot(p, q) < 0.0 else 1.0)
    angle = np.arctan2(np.linalg.norm(p - q), np.linalg.norm(p + q)) * 2.0
    if angle < 1e-8:
        return p + share * (q - p)
    return (np.sin((1.0 - share) * angle) * p + np.sin(share * angle) * q) / np.sin(angle)


def between(a, b):
    """The shortest rotation that brings the direction a to b."""
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, np.dot(a, b)) if sine > 0.0 else np.zeros(3))


def slerp_complementary(t, gyr, acc, mag, tau, tau_heading):
    """Gyroscope, then slerp to the levelled and to the north-pointing attitude; quaternions wxyz (n, 4).

    Heading begins as a running mean: the sample k after the first counts 1/(k + 1) at least.
    """
    now = compass(acc[0], mag[0])
    out = [now.as_quat(scalar_first=True)]
    for k in range(1, len(t)):
        dt = t[k] - t[k - 1]
        ahead = now * Rotation.from_rotvec(gyr[k] * dt)
        target = between(ahead.apply(acc[k]), [0.0, 0.0, 1.0]) * ahead
        now = _slerped(ahead, target, dt / (tau + dt))
        field = now.apply(mag[k])
        target = Rotation.from_euler("z", np.arctan2(field[0], field[1])) * now
        now = _slerped(now, target, dt / (min(tau_heading, t[k] - t[0]) + dt))
        out.append(now.as_quat(scalar_first=True))
    return np.array(out)


def _slerped(a, b, share):
    quats = a.as_quat(scalar_first=True), b.as_quat(scalar_first=True)
    return Rotation.from_quat(slerp(*quats, share), scalar_first=True)
