"""A magnetometer from its readings: the field of a place has one strength, and one angle to gravity.

With the reading μ the true field in the frame of the accelerometer is h = μ − M μ − o. Its length is F at every sample
(an ellipsoid: hard and soft iron), and h·u = F sin δ at every pose with the direction u of the specific force (the
rotation to the accelerometer; M. Kok & T. B. Schön, Magnetometer calibration using inertial sensors, IEEE Sensors J.
16(14), 2016). The strength itself cannot be known, so that the mean of the three scale factors is 1: tr M = 0.
"""

from collections.abc import Sequence

import numpy as np

from levelhead.calibrate.least_squares import Solution, solve
from levelhead.recording import Array, Recording

THINNED = 0.1  # s between samples of the ellipsoid
MOST = 2000  # of them
SPREAD = 0.02  # share of the field, 1σ of its length at a sample at first; then what is left of it counts,
LEAST_SPREAD = 0.002  # at least this share: places differ, and iron is near
PRIOR_MATRIX, PRIOR_OFFSET = 0.3, 0.5  # 1σ before any measurement; of the offset as a share of the field
MEAN_SCALE = 1e-6  # 1σ of tr M


def samples(recordings: Sequence[Recording]) -> Array:
    """(n, 3) readings of all logs, evenly thinned."""
    found = []
    for recording in recordings:
        if recording.mag is not None:
            rows = recording.mag[np.isfinite(recording.mag).all(axis=1) & recording.mag.any(axis=1)]
            found.append(rows[:: max(1, round(THINNED * recording.rate))])
    every = np.concatenate(found) if found else np.zeros((0, 3))
    return every[:: max(1, len(every) // MOST)]


def sphere(mag: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere nearest to (n, 3) points: 2 x·c + (r² − |c|²) = |x|², linear."""
    left = np.hstack([2.0 * mag, np.ones((len(mag), 1))])
    *centre, rest = np.linalg.lstsq(left, (mag**2).sum(axis=1), rcond=None)[0]
    middle = np.array(centre)
    return middle, float(np.sqrt(max(rest + middle @ middle, 1e-12)))


def correct_fields(parameters: Array, mag: Array) -> Array:
    """(n, 3) h of (n, 3) readings."""
    corrected: Array = mag - mag @ parameters[:9].reshape(3, 3).T - parameters[9:12]
    return corrected


def fit_magnetometer(mag: Array, at_rest: Array, up: Array) -> Solution:
    """M by rows, o, F and sin δ.

    Args:
        mag: (n, 3) readings anywhere.
        at_rest: (k, 3) mean readings at the poses.
        up: (k, 3) directions of the specific force there.
    """
    centre, radius = sphere(mag)
    dip = float(np.median(((at_rest - centre) * up).sum(axis=1))) / radius
    start = np.concatenate([np.zeros(9), centre, [radius, np.clip(dip, -0.99, 0.99)]])
    prior = np.array([PRIOR_MATRIX] * 9 + [PRIOR_OFFSET * radius] * 3 + [0.5 * radius, 1.0])
    # Samples that follow each other share their disturbance: all together count like four for each pose.
    weight = np.sqrt(min(1.0, 4.0 * len(at_rest) / len(mag)))

    def left(parameters: Array) -> tuple[Array, Array]:
        strength, sine = parameters[12], parameters[13]
        length = np.linalg.norm(correct_fields(parameters, mag), axis=1) - strength
        return length, (correct_fields(parameters, at_rest) * up).sum(axis=1) - strength * sine

    def residuals(parameters: Array, sigma: float) -> Array:
        length, vertical = left(parameters)
        mean = np.trace(parameters[:9].reshape(3, 3)) / MEAN_SCALE
        return np.concatenate([weight * length / sigma, vertical / sigma, [mean]])

    first = solve(lambda parameters: residuals(parameters, SPREAD * radius), start, prior)
    typical = 1.48 * max(float(np.median(np.abs(part))) for part in left(first.value))
    sigma = min(max(typical, LEAST_SPREAD * radius), SPREAD * radius)
    return solve(lambda parameters: residuals(parameters, sigma), start, prior)
