"""The two constant rotations of eq. (1), by closed forms, robustly.

With A standing for E·C(A)·D, X·A·Y = B is the problem of robot-world and hand-eye calibration (H. Zhuang, Z. S. Roth,
R. Sudhakar, Simultaneous robot/world and tool/flange calibration by solving homogeneous transformation equations of the
form AX = YB, IEEE Transactions on Robotics and Automation 10(4), 1994, 549-554). Their quaternion form is linear, but
needs the signs of all quaternions to agree. Three forms that do not ask for signs are used here:

1. The rotation between two instants does not depend on X: with a and b the rotation vectors of A_i* A_j and B_i* B_j,

    b = Y* a                                                                                                    (2)

   which is Wahba's problem for Y; weights spare pairs whose angles differ. (Y. C. Shiu, S. Ahmad, Calibration of
   wrist-mounted robotic sensors by solving homogeneous transform equations of the form AX = XB, 1989, eq. 5.)

2. With one side known the other is a mean of rotations, the eigenvector of F. L. Markley et al., Averaging
   Quaternions, Journal of Guidance, Control, and Dynamics 30(4), 2007, eq. (13) with weights:

    X = mean B (A Y)*,    Y = mean (X A)* B                                                                     (3)

3. If X may only turn heading, it is eq. (5) of ``levelhead.evaluate.attitude_error``, with weights.

Both sides are found by (2), then (3) in turns. Each round is weighted after P. J. Huber, Robust Estimation of a
Location Parameter, 1964: 1 up to 1.5 σ, then as the inverse of the error, σ from the median error.
"""

from typing import Literal, NamedTuple

import numpy as np

from levelhead.evaluate.align.quaternion_convention import TO_ENU, TO_REFERENCE, Convention
from levelhead.evaluate.attitude_error import error_quaternion, heading_offset
from levelhead.recording import Array
from levelhead.rotations import (
    ONE,
    about_up,
    angle,
    conjugate,
    from_matrix,
    mean,
    nearest_rotation,
    product,
    relative_rotation,
    rotvec,
)

Earth = Literal["none", "heading", "any"]
Sensor = Literal["none", "any"]

TRIM = 0.9  # share of the samples, those with the least error, by which hypotheses are judged
_MEDIAN_ANGLE = 1.538  # median length of a vector of three standard normal numbers
_ROUNDS = 6
_STRIDE = 1.0  # s between the two instants of eq. (2)
_LONGEST_TURN = 2.5  # rad; beyond it the way around may be the other one
_HALF_WEIGHT_ANGLE = 0.1  # rad, a difference of the two angles of eq. (2) that halves the weight
_STILL = 1e-6  # rad², less turning than this gives no start


class Freedom(NamedTuple):
    """The constant rotations that are allowed."""

    earth: Earth
    sensor: Sensor

    @property
    def cost(self) -> int:
        """2 for each angle that may be chosen: an angle fits more than a choice of two does."""
        return 2 * ({"none": 0, "heading": 1, "any": 3}[self.earth] + {"none": 0, "any": 3}[self.sensor])


class Fit(NamedTuple):
    """One hypothesis, fitted.

    Attributes:
        convention: C, E and D.
        freedom: the rotations allowed for X and Y.
        earth: (4,) X, wxyz.
        sensor: (4,) Y, wxyz.
        trimmed: RMS angle in rad between both sides of eq. (1) over the best ``TRIM`` of the samples.
    """

    convention: Convention
    freedom: Freedom
    earth: Array
    sensor: Array
    trimmed: float

    @property
    def cost(self) -> int:
        """Cost of the hypothesis: departures of the convention and free angles."""
        return self.convention.cost + self.freedom.cost

    def apply(self, quat: Array) -> Array:
        """(m, 4) the right side of eq. (1) of (m, 4) raw quaternions."""
        return product(self.earth, apply_frames(self.convention, quat), self.sensor)


def apply_frames(convention: Convention, quat: Array) -> Array:
    """(m, 4) E·C(A)·D of (m, 4) raw quaternions."""
    left, right = TO_ENU[convention.earth], TO_REFERENCE[convention.sensor]
    return product(left, convention.read(quat), right)


def trimmed_rms(errors: Array) -> float:
    """RMS of the least ``TRIM`` of the (m,) angles."""
    kept = max(1, int(TRIM * len(errors)))
    return float(np.sqrt(np.mean(np.partition(errors, kept - 1)[:kept] ** 2)))


def huber_weights(errors: Array) -> Array:
    """(m,) weights of angles in rad."""
    sigma = max(float(np.median(errors)) / _MEDIAN_ANGLE, 1e-6)
    weights: Array = np.minimum(1.0, 1.5 * sigma / np.maximum(errors, 1e-12))
    return weights


def estimate_mounting(when: Array, estimate: Array, reference: Array) -> Array:
    """(4,) Y from eq. (2), of (m, 4) quaternions at the instants ``when``; 1 where nothing turns."""
    stride = round(_STRIDE / max(float(np.median(np.diff(when))), 1e-9))
    stride = min(max(stride, 1), len(when) // 2)
    a, b = (rotvec(relative_rotation(quat[:-stride], quat[stride:])) for quat in (estimate, reference))
    long, other = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    good = (long < _LONGEST_TURN) & (other < _LONGEST_TURN) & (when[stride:] - when[:-stride] < 3.0 * _STRIDE)
    weights = good / (1.0 + ((long - other) / _HALF_WEIGHT_ANGLE) ** 2)
    profile = np.einsum("k,ki,kj->ij", weights, a, b)  # Σ a bᵀ: Y is the rotation nearest to it
    if np.trace(profile.T @ profile) < _STILL**2:
        return ONE
    return from_matrix(nearest_rotation(profile))


def fit_rotations(convention: Convention, freedom: Freedom, quat: Array, reference: Array, start: Array) -> Fit:
    """X and Y for one hypothesis.

    Args:
        convention: C, E and D.
        freedom: the rotations allowed for X and Y.
        quat: (m, 4) raw quaternions of the estimate.
        reference: (m, 4) quaternions of the reference at the same instants.
        start: Y from ``mounting``, in the order and direction of ``convention``; used if both sides are free.
    """
    estimate = apply_frames(convention, quat)
    both = freedom.earth != "none" and freedom.sensor == "any"
    earth, sensor = ONE, start if both else ONE
    weights = np.ones(len(reference))
    for _ in range(_ROUNDS * (1 + both) if freedom.cost else 1):
        earth = _earth(freedom.earth, product(estimate, sensor), reference, weights)
        if freedom.sensor == "any":
            sensor = mean(relative_rotation(product(earth, estimate), reference), weights)
        errors = angle(relative_rotation(reference, product(earth, estimate, sensor)))
        weights = huber_weights(errors)
    return Fit(convention, freedom, earth, sensor, trimmed_rms(errors))


def _earth(freedom: Earth, estimate: Array, reference: Array, weights: Array) -> Array:
    if freedom == "none":
        return ONE
    error = error_quaternion(estimate, reference)
    if freedom == "any":
        return mean(conjugate(error), weights)
    offset = heading_offset(error * np.sqrt(weights)[:, None], np.ones(len(error), bool))
    return about_up(-offset)
