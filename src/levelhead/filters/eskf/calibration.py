"""What a filter has learned of its sensor, in plain numbers: out of a state's memory, and into that of the next run."""

from math import sqrt
from typing import NamedTuple

from levelhead.filters.eskf.state import AGE, KNOWN, MEAN, SURE, variance
from levelhead.kernels.arrays import Floats


class Estimate(NamedTuple):
    """Numbers, their 1σ, what this would be by now had nothing been learned of them, and what it was at the start."""

    value: tuple[float, ...]
    sigma: tuple[float, ...]
    unlearned: tuple[float, ...]
    start: tuple[float, ...]


class Learned(NamedTuple):
    """Of a sensor: ω = ω_read − S ω_read − b, a = a_read − c, and the field is h − d ω × h with h = μ_read − o."""

    gyr_matrix: Estimate  # S, 9 by rows
    gyr_bias: Estimate  # b, rad/s, 3
    acc_bias: Estimate  # c, m/s², 3
    mag_offset: Estimate | None = None  # o, µT, 3; None: there was no magnetometer
    mag_delay: Estimate | None = None  # d, s, 1
    field: Estimate | None = None  # horizontal and vertical, µT, 2


def estimate(m: Floats, first: int, count: int, start: float, walk: float, unit: float = 1.0) -> Estimate:
    """States of ``error_state``, which began with σ ``start`` and walk by ``walk`` a √s."""
    age = float(m[AGE])
    at = range(first, first + count)
    return Estimate(
        tuple(float(m[MEAN + i]) * unit for i in at),
        tuple(sqrt(max(float(variance(m, i)), 0.0)) * unit for i in at),
        (sqrt(start * start + walk * walk * age) * unit,) * count,
        (start * unit,) * count,
    )


def tell(m: Floats, first: int, known: Estimate | None) -> None:
    """Puts an earlier estimate, if there is one, to where ``recall`` finds it."""
    if known is None:
        return
    for i, (value, sigma) in enumerate(zip(known.value, known.sigma, strict=True), first):
        m[KNOWN + i], m[SURE + i] = value, sigma
