"""An angle and the bias of its rate: the covariance that several filters share.

    P ← F P Fᵀ + Q,   F = [[1, −Δt], [0, 1]]                                                                    (1)
    P ← (I − K H) P,   or Joseph's form   P ← (I − K H) P (I − K H)ᵀ + K r Kᵀ,   H = (1, 0)                     (2)

The left form of (2) holds for the optimal gain only, Joseph's for any.
"""

from typing import NamedTuple

from levelhead.compiler.mark import kernel


class Covariance(NamedTuple):
    """P of level and bias, symmetric."""

    level: float
    cross: float
    bias: float


class Gain(NamedTuple):
    """K of level and bias."""

    level: float
    bias: float


@kernel
def predict(p: Covariance, dt: float, q_level: float, q_bias: float) -> Covariance:
    """Eq. 1 with Q = diag(q_level, q_bias)."""
    level, cross, bias = p
    return Covariance(level + dt * (dt * bias - 2.0 * cross) + q_level, cross - dt * bias, bias + q_bias)


@kernel
def correct(p: Covariance, k: Gain) -> Covariance:
    """Eq. 2, left."""
    level, cross, bias = p
    return Covariance(level - k.level * level, cross - k.level * cross, bias - k.bias * cross)


@kernel
def joseph(p: Covariance, k: Gain, r: float) -> Covariance:
    """Eq. 2, right."""
    level, cross, bias = p
    a, b = k
    rest = 1.0 - a
    return Covariance(
        rest * rest * level + a * a * r,
        rest * (cross - b * level) + a * b * r,
        bias - 2.0 * b * cross + b * b * (level + r),
    )
