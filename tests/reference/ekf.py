"""A multiplicative extended Kalman filter with NumPy's full matrices: slow, plain, independent of the kernels.

The error is (θ, β), corrected at every sample (``block=0``): R = exp([θ]×) R^ in the earth frame, b = b^ + β in
the sensor frame.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.80665
I3, O3 = np.eye(3), np.zeros((3, 3))
NOTHING_KNOWN = np.pi**2 / 3.0  # rad², of an angle on a circle
ARCSINE = (1.0, 1.0 / 6.0, 3.0 / 40.0, 15.0 / 336.0, 105.0 / 3456.0)


def transition(attitude, dt):
    """F of the error over ``dt``, to first order; ``attitude`` is R^ after it."""
    return np.block([[I3, -dt * attitude.as_matrix()], [O3, I3]])


def tilt_rows():
    """H of gravity: ∂(f_y, −f_x)/∂(θ, β)."""
    return np.eye(6)[:2]


def heading_row():
    """H of the field, of which only the turn about the vertical is taken."""
    return np.eye(6)[2:3]


def tilt_innovation(force):
    """How far the averaged specific force (g) is off the vertical, about east and north."""
    x, y, z = force
    level = np.hypot(x, y)
    if z <= 0.0:
        return np.array([2.0, 0.0]) if level == 0.0 else max(2.0 / level - 0.7, 1.3) * np.array([y, -x])
    if level / z <= 0.2:
        return np.array([y, -x])
    sine = level / np.hypot(level, z)
    return sum(c * sine ** (2 * k) for k, c in enumerate(ARCSINE)) * np.array([y, -x])


def heading_innovation(field):
    """Sine of the angle by which the field misses north; behind one's back it is 1."""
    x, y, _ = field
    level = np.hypot(x, y)
    return 0.0 if level == 0.0 else (x / level if y >= 0.0 else (1.0 if x >= 0.0 else -1.0))


@dataclass
class Textbook:
    """The filter, with the parameters of ``levelhead.EKF``."""

    params: object
    attitude: Rotation
    headed: bool
    bias: np.ndarray = field(default_factory=lambda: np.zeros(3))
    force: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    age: float = 0.0
    acc_out: float = 0.0
    mag_out: float = 0.0

    def __post_init__(self):
        tilt, bias = np.radians(self.params.tilt_start) ** 2, np.radians(self.params.bias_start) ** 2
        self.p = np.diag([tilt, tilt, np.radians(60.0) ** 2 if self.headed else 0.0, bias, bias, bias])

    def step(self, gyr, acc, mag, dt):
        """One sample; None for a sensor that said nothing."""
        params = self.params
        self.attitude = self.attitude * Rotation.from_rotvec((gyr - self.bias) * dt)
        self.age = 0.0 if dt > 0.5 else self.age + dt
        if dt > 0.5:
            self.cross_gap(dt)
        else:
            rate = np.radians(params.gyr_noise) ** 2 + params.gyr_noise_per_rate**2 * gyr @ gyr
            q = np.diag([rate * dt] * 3 + [np.radians(params.bias_walk) ** 2 * dt] * 3)
            f = transition(self.attitude, dt)
            self.p = f @ self.p @ f.T + q
        often = 1.0 / min(dt, 0.1)
        error = np.zeros(6)
        if acc is not None:
            error = self.see_gravity(error, self.attitude.apply(acc) / G, often, dt)
        if mag is not None:
            error = self.see_field(error, self.attitude.apply(mag), often, dt)
        turn = error[:3]
        swing = Rotation.from_rotvec(turn)
        if turn[:2] @ turn[:2] < 1e-4:  # a force that is all but upright moves by the small angles
            self.force = self.force + self.force[2] * np.array([turn[1], -turn[0], 0.0])
        else:
            self.force = swing.apply(self.force)
        self.attitude = swing * self.attitude
        self.bias = self.bias + error[3:]

    def see_gravity(self, error, force, often, dt):
        params = self.params
        self.force = self.force + dt / (min(params.acc_tau, self.age) + dt) * (force - self.force)
        off = params.acc_motion * 0.5 * (force @ force - 1.0)  # | |f| − g |/g to first order
        r = ((params.acc_noise / G) ** 2 + off**2) * often
        y = tilt_innovation(self.force)
        if y @ y > params.gate**2 * (max(self.p[0, 0], self.p[1, 1]) + r):
            self.acc_out += dt
            if self.acc_out <= params.gate_time:
                return error
            self.loosen([y @ y] * 3)
        self.acc_out = 0.0
        return self.correct(error, tilt_rows(), y, r)

    def see_field(self, error, field, often, dt):
        params = self.params
        r = np.radians(params.mag_noise) ** 2 * often
        y = heading_innovation(field)
        rest = y - error[2]
        if rest**2 > params.gate**2 * (self.p[2, 2] + r):
            self.mag_out += dt
            if self.mag_out <= params.gate_time:
                return error
            self.loosen([0.0, 0.0, rest**2])
        else:
            self.mag_out = 0.0
        return self.correct(error, heading_row(), np.array([y]), r, still=2)

    def correct(self, error, h, y, r, still=0):
        """The Kalman gain, none for the first ``still`` errors, and P in Joseph's form, which holds for any gain."""
        r = r * np.eye(len(h))
        k = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        k[:still] = 0.0
        rest = np.eye(6) - k @ h
        self.p = rest @ self.p @ rest.T + k @ r @ k.T
        return error + k @ (y - h @ error)

    def loosen(self, variances):
        """The attitude less sure, and what it told about the bias forgotten."""
        self.p[:3, 3:] = self.p[3:, :3] = 0.0
        self.p[:3, :3] += np.diag(variances)

    def cross_gap(self, dt):
        """Anything may have happened: 1 rad/s for so long; the bias walked, at most back to what it was at first."""
        tilt = min(max(self.p[0, 0], self.p[1, 1]) + dt**2, NOTHING_KNOWN)
        heading = min(self.p[2, 2] + dt**2, NOTHING_KNOWN)
        known = np.diag(self.p)[3:].max()
        walked = known + np.radians(self.params.bias_walk) ** 2 * dt
        bias = max(known, min(walked, np.radians(self.params.bias_start) ** 2))
        self.p = np.diag([tilt, tilt, heading, bias, bias, bias])
