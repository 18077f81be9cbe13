"""EKF: attitude and gyroscope bias in a multiplicative extended Kalman filter."""

from levelhead.filters.mekf.filter import EKF, FILTER

__all__ = ["EKF", "FILTER"]
