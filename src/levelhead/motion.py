"""Specific force, accelerations without gravity and rate without bias of many samples, each with its σ.

With f the specific force in the sensor's axes, R its orientation and g gravity,

    a_e = R f − g e_up,    a_s = Rᵀ a_e                                                                      (1)

A small error φ of the attitude about east, north and up, and an error δf of the sensor make

    δa_e = φ × R f + R δf                                                                                   (2)

The components of φ and of δf are taken as independent, as a track has no covariances.
"""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array
from levelhead.rotations import matrix
from levelhead.units import GRAVITY

QUIET_SHARE = 0.1  # of the windows, in which a sensor's noise is measured
WINDOW = 200  # samples
SECOND_DIFFERENCE = 6.0**0.5  # σ of x₋ − 2 x + x₊ over that of independent x


class VectorSeries(NamedTuple):
    """Three numbers for each sample.

    Attributes:
        value: (n, 3); NaN where a reading is missing.
        sigma: (n, 3) 1σ in the same axes, or None where the track has no σ.
    """

    value: Array
    sigma: Array | None


def white_noise(readings: Array) -> Array:
    """(3,) 1σ of the white noise of (n, 3) readings, where they move least: the RMS of their second differences there.

    The differences of a slow motion vanish, and those of independent errors have 6 times their variance.
    """
    steps = np.diff(readings, 2, axis=0) ** 2
    steps = steps[np.isfinite(steps).all(axis=1)]
    count = len(steps) // WINDOW
    if count == 0:
        return np.sqrt(np.mean(steps, axis=0)) / SECOND_DIFFERENCE if len(steps) else np.zeros(3)
    windows = steps[: count * WINDOW].reshape(count, WINDOW, 3).mean(axis=1)
    quiet = np.argsort(windows.sum(axis=1))[: max(1, int(QUIET_SHARE * count))]
    found: Array = np.sqrt(windows[quiet].mean(axis=0)) / SECOND_DIFFERENCE
    return found


def acceleration_in_earth(quat: Array, force: Array, sigma: Array | None, sigma_force: Array) -> VectorSeries:
    """(1) and (2) in the earth's axes (x east, y north, z up).

    Args:
        quat: (n, 4) orientation, sensor to earth.
        force: (n, 3) specific force in m/s².
        sigma: (n, 3) 1σ of the attitude about east, north and up in rad; None: not known.
        sigma_force: (3,) 1σ of the specific force.
    """
    axes = matrix(quat)
    turned = np.einsum("nij,nj->ni", axes, force)
    value = turned - [0.0, 0.0, GRAVITY]
    if sigma is None:
        return VectorSeries(value, None)
    variance = np.einsum("nij,j->ni", axes**2, sigma_force**2)
    (x, y, z), (e, n, u) = (turned**2).T, (sigma**2).T
    by_attitude = np.stack([n * z + u * y, u * x + e * z, e * y + n * x], axis=1)
    return VectorSeries(value, np.sqrt(variance + by_attitude))


def acceleration_in_body(quat: Array, force: Array, sigma: Array | None, sigma_force: Array) -> VectorSeries:
    """(1) and (2) in the sensor's axes; arguments as for ``acceleration_in_earth``.

    There δa_s = δf + (Rᵀ φ) × g Rᵀ e_up: heading does not matter.
    """
    axes = matrix(quat)
    up = axes[:, 2]
    value = force - GRAVITY * up
    if sigma is None:
        return VectorSeries(value, None)
    tilt = GRAVITY * np.stack([axes[:, 1], -axes[:, 0]], axis=2)  # columns: by an error about east, about north
    variance = np.einsum("nik,nk->ni", tilt**2, sigma[:, :2] ** 2)
    return VectorSeries(value, np.sqrt(variance + sigma_force**2))
