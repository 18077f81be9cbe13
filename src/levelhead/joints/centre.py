"""The centre of a joint has one acceleration, whichever sensor it is computed from.

With f the specific force, ω the rate and r the position of the centre in a sensor's frame,

    a(f, ω, r) = f + ω̇ × r + ω × (ω × r),    Rz(δ) R a(f_u, ω_u, r_u) = S a(f_l, ω_l, r_l)                      (4)

(T. Seel, J. Raisch, T. Schauer, Sensors 14(4), 2014, section 3.2). For a given δ this is linear in both r. It
distinguishes a heading from the opposite one, also where an axis that stays level does not.
"""

import math
from collections.abc import Callable

import numpy as np

from levelhead.joints.axes_fit import CORRELATION, MAX_ROWS, about_vertical
from levelhead.recording import Array, Recording
from levelhead.rotations import cross_matrix

Cost = Callable[[Array], float]


def centre_cost(t: Array, upper: Array, lower: Array, recordings: tuple[Recording, Recording]) -> Cost:
    """Minus the log of the likelihood of (n,) headings δ in rad, by the residual of (4).

    Args:
        t: (n,) s.
        upper: (n, 3, 3) rotations, sensor to earth.
        lower: the same of the other sensor.
        recordings: the readings of both.
    """
    step = -(-len(t) // MAX_ROWS)
    forces, levers = zip(*(_at(t, recording) for recording in recordings), strict=True)
    known = np.flatnonzero(np.isfinite(sum(force.sum(axis=1) for force in forces)))[::step]
    upper, lower = upper[known], lower[known]
    force = upper @ forces[0][known, :, None], (lower @ forces[1][known, :, None])[:, :, 0]
    lever = upper @ levers[0][known], lower @ levers[1][known]
    count: float = 1.5 * min((t[-1] - t[0]) / CORRELATION, len(known))

    def cost(heading: Array) -> float:
        angle = heading[known]
        target = force[1] - about_vertical(force[0][:, :, 0], angle)
        design = np.concatenate([about_vertical(lever[0], angle), -lever[1]], axis=2)
        normal = np.einsum("nia,nib->ab", design, design)
        right = np.einsum("nia,ni->a", design, target)
        left = float(np.sum(target**2) - right @ np.linalg.lstsq(normal, right, rcond=None)[0])
        return count * math.log(max(left, 1e-12 * len(known)))

    return cost


def _at(t: Array, recording: Recording) -> tuple[Array, Array]:
    """(n, 3) m/s² and (n, 3, 3) s⁻², the factor of r in (4), at the stamps ``t``."""
    readings = np.concatenate([recording.gyr, recording.acc], axis=1)
    gyr, acc = np.split(np.stack([np.interp(t, recording.t, one) for one in readings.T], axis=1), 2, axis=1)
    cross = cross_matrix(gyr)
    return acc, cross_matrix(np.gradient(gyr, t, axis=0)) + cross @ cross
