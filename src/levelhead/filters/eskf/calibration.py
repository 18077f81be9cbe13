"""The sensor's errors as ``ESKF`` estimates them, in plain numbers: out of a state's memory, and into that of a later
run. Plain Python."""

from collections.abc import Mapping
from math import hypot, sqrt
from typing import NamedTuple

from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.covariance import state_variance
from levelhead.filters.eskf.north import north_of
from levelhead.filters.parameters import Params
from levelhead.kernels.arrays import Floats
from levelhead.kernels.tilt import UNIFORM


class Estimate(NamedTuple):
    """Numbers of one kind, their 1σ, the 1σ that they would have by now without any measurement, and at the start."""

    value: tuple[float, ...]
    sigma: tuple[float, ...]
    unlearned: tuple[float, ...]
    start: tuple[float, ...]


def estimates(params: Params, m: Floats, norm: float) -> dict[str, Estimate]:
    """Name of a block of states -> its estimate, for all that are part of a Calibration and exist.

    ``norm`` is that of the first field in µT; 0: there was no magnetometer.
    """
    time = float(m[at.RUN_TIME])
    found = {}
    for block in at.BLOCKS:
        if not block.calibration or (block.exists == at.WITH_MAG and norm == 0.0):
            continue
        size, start, walk = at.block_noise(params)[block.first]
        unit = norm if block.relative else 1.0
        places = range(block.first, block.first + size)
        found[block.name] = Estimate(
            value=tuple(float(m[at.MEAN + i]) * unit for i in places),
            sigma=tuple(sqrt(max(float(state_variance(m, i)), 0.0)) * unit for i in places),
            unlearned=(sqrt(start * start + walk * walk * time) * unit,) * size,
            start=(start * unit,) * size,
        )
    if norm > 0.0:
        found["field"] = field_estimate(m, norm)
        north = north_of(m)
        found["north"] = Estimate(
            value=(north.azimuth,), sigma=(sqrt(north.variance),), unlearned=(UNIFORM,), start=(UNIFORM,)
        )
    return found


def covariance_of(m: Floats, first: int, size: int) -> list[list[float]]:
    """The covariance of so many states from ``first`` on."""
    places = range(first, first + size)
    return [[float(m[at.P + min(i, j) * at.ROW + max(i, j)]) for j in places] for i in places]


def field_estimate(m: Floats, norm: float) -> Estimate:
    """Horizontal and upward strength of the field of the surroundings, µT."""
    x, y, z = (float(m[at.MEAN + at.FIELD + i]) for i in range(3))
    level = max(hypot(x, y), 1e-9)
    p = at.P + at.FIELD * at.ROW + at.FIELD
    variance = x * x * m[p] + 2.0 * x * y * m[p + 1] + y * y * m[p + at.ROW + 1]
    sigma = sqrt(max(float(variance), 0.0)) / level, sqrt(max(float(state_variance(m, at.FIELD + 2)), 0.0))
    start = (at.FIRST_FIELD * norm, at.FIRST_FIELD * norm)
    return Estimate(
        value=(level * norm, z * norm), sigma=(sigma[0] * norm, sigma[1] * norm), unlearned=start, start=start
    )


def set_prior(m: Floats, known: Mapping[str, Estimate]) -> None:
    """Puts estimates of an earlier run to where the start finds them."""
    for block in at.BLOCKS:
        if block.prior and block.name in known:
            part = known[block.name]
            for i, (value, sigma) in enumerate(zip(part.value, part.sigma, strict=True), block.first):
                m[at.PRIOR_MEAN + i], m[at.PRIOR_SIGMA + i] = value, sigma
