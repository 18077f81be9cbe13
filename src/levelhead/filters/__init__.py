"""The filters, one file each: parameters, state, init, step, output and the paper that they come from."""

from levelhead.errors import LevelheadError, nearest
from levelhead.filters import (
    accel_tilt,
    bias_rate_kalman,
    complementary,
    eskf,
    gyro_integration,
    kalman,
    madgwick,
    mahony,
    mekf,
    roll_pitch_kalman,
    triad,
)
from levelhead.filters.accel_tilt import AccelTilt
from levelhead.filters.bias_rate_kalman import BiasRateKalman
from levelhead.filters.complementary import Complementary
from levelhead.filters.contract import Filter
from levelhead.filters.eskf.params import ESKF
from levelhead.filters.gyro_integration import GyroIntegration
from levelhead.filters.kalman import Kalman
from levelhead.filters.madgwick import Madgwick
from levelhead.filters.mahony import Mahony
from levelhead.filters.mekf.params import EKF
from levelhead.filters.parameters import FilterChoice, Params, short_name
from levelhead.filters.roll_pitch_kalman import RollPitchKalman
from levelhead.filters.triad import Triad

ALL: tuple[Filter, ...] = (
    gyro_integration.FILTER,
    accel_tilt.FILTER,
    triad.FILTER,
    complementary.FILTER,
    mahony.FILTER,
    madgwick.FILTER,
    kalman.FILTER,
    roll_pitch_kalman.FILTER,
    bias_rate_kalman.FILTER,
    mekf.FILTER,
    eskf.FILTER,
)

__all__ = [
    "ALL",
    "EKF",
    "ESKF",
    "AccelTilt",
    "BiasRateKalman",
    "Complementary",
    "Filter",
    "GyroIntegration",
    "Kalman",
    "Madgwick",
    "Mahony",
    "RollPitchKalman",
    "Triad",
    "default",
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


def module_of(flt: Filter) -> str:
    """Name of the module or package whose docstring describes a filter: that of its FILTER."""
    return flt.step.__module__.removesuffix(".filter")


def resolve(choice: FilterChoice) -> Params:
    """A Params object from any way to name a filter: a Params object, its class, or a name."""
    if isinstance(choice, str):
        return find(choice).params()
    for flt in ALL:
        if choice is flt.params:
            return flt.params()
    of(choice)
    assert not isinstance(choice, type)  # of() accepts objects only
    return choice


def default() -> ESKF:
    """Parameters of the best filter there is for a recording of unknown motion, with or without magnetometer."""
    return ESKF()


def live() -> ESKF:
    """The same for a node, which a person reads as a compass and a robot follows: it turns to north, and never jumps.

    The rate of the turn, 2 °/s at most, is far below that of a heading controller, and its rest is part of σ.
    """
    return ESKF(north_rate=2.0)


def offline() -> ESKF:
    """The same for a recording that is known to its end.

    Later samples measure a body's velocity too, so the model may be weaker: a wider density, a smaller body velocity,
    and a narrower prior of a raw gyroscope. Other errors of a gyroscope (scale over temperature, stamps) average out
    less than noise, so its noise is larger. A place's field begins narrower, as its end is known too. North is that of
    the end, all along.
    """
    return ESKF(
        gyr_noise=0.12, bias_uncalibrated=4.5, velocity_density=0.55, body_velocity=0.25, mag_place=0.005,
        north_rate=1e6,
    )  # fmt: skip


def title(params: Params) -> str:
    """The filter as pictures and summaries name it: with the parameters that differ from its defaults, if they are not
    those of ``offline``, which would fill three lines."""
    if not isinstance(params, ESKF):
        return short_name(params)
    nowhere = params._replace(field_strength=0.0, field_dip=0.0)
    return "ESKF, offline" if nowhere == offline() else short_name(params)
