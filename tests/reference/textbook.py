"""The filters as a textbook writes them, with NumPy matrices: slow, plain, and independent of the package."""

import numpy as np


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
