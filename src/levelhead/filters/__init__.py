"""The filters, one file each: parameters, state, init, step, output and the paper that they come from."""

from typing import Any

from levelhead.errors import LevelheadError, nearest
from levelhead.filters import (
    accel_tilt,
    bias_rate_kalman,
    complementary,
    gyro_integration,
    kalman,
    roll_pitch_kalman,
    triad,
)
from levelhead.filters.accel_tilt import AccelTilt
from levelhead.filters.bias_rate_kalman import BiasRateKalman
from levelhead.filters.complementary import Complementary
from levelhead.filters.contract import Filter
from levelhead.filters.gyro_integration import GyroIntegration
from levelhead.filters.kalman import Kalman
from levelhead.filters.roll_pitch_kalman import RollPitchKalman
from levelhead.filters.triad import Triad

ALL: tuple[Filter, ...] = (
    gyro_integration.FILTER,
    accel_tilt.FILTER,
    triad.FILTER,
    complementary.FILTER,
    kalman.FILTER,
    roll_pitch_kalman.FILTER,
    bias_rate_kalman.FILTER,
)

__all__ = [
    "ALL",
    "AccelTilt",
    "BiasRateKalman",
    "Complementary",
    "Filter",
    "GyroIntegration",
    "Kalman",
    "RollPitchKalman",
    "Triad",
    "best",
    "find",
    "of",
    "resolve",
]


def find(name: str) -> Filter:
    """The filter of that name; case, ``-`` and ``_`` do not count.

    Raises:
        LevelheadError: there is none; the sentence names the nearest.
    """
    plain = name.lower().replace("-", "").replace("_", "")
    for candidate in ALL:
        if candidate.name.lower() == plain:
            return candidate
    raise LevelheadError(f"there is no filter '{name}'; {nearest(name, [f.name for f in ALL])}")


def of(params: object) -> Filter:
    """The filter to which a Params object belongs."""
    for candidate in ALL:
        if isinstance(params, candidate.params):
            return candidate
    raise LevelheadError(f"{params!r} chooses no filter; give the parameters of one, such as Kalman(r_measure=0.1)")


def resolve(choice: Any) -> Any:
    """A Params object from what people give: a Params object, its class, or a name."""
    if isinstance(choice, str):
        return find(choice).params()
    if isinstance(choice, type) and any(choice is f.params for f in ALL):
        return choice()
    of(choice)
    return choice


def best() -> Any:
    """Parameters of the best filter there is for a recording of unknown motion, with or without magnetometer.

    ``Kalman`` with noises that are physics rather than the lesson's: a hand accelerates by 3 m/s² RMS, which tilts the
    measured vertical by 17° (r_measure), iron indoors turns the field as much (r_heading), a consumer gyroscope turns
    on with a bias of 5 °/s (p_bias). It learns the bias and says its σ. The values are round ones in a region that is
    flat on real recordings and on simulated chips alike: benchmarks/default.py shows it.
    """
    return Kalman(q_angle=0.01, q_bias=1e-5, r_measure=300.0, r_heading=300.0, p_bias=25.0)
