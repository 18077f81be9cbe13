"""The states of ``ESKF`` and its memory: each block of states is declared once, and all else here follows from that.

Offsets, lengths of rows and the memory are plain integers. Kernels import this module as ``at`` and write
``m[at.MEAN + at.GYR_BIAS]``. A further block of states needs a line among the blocks below, a line in one of the three
kernels below them, which declare its σ at the start and its random walk, and parameters for these two.

The memory is one row of floats: the covariance P by rows, the mean of the additive states (attitude is not), the
correction x gathered in a block of samples, a row h of a measurement, P hᵀ, the couplings 1 − F of the states that
others drive, their rows of F P, a prior, sums of aiding measurements, and integrals over the block of samples.
"""

from collections.abc import Callable
from math import prod, radians
from typing import NamedTuple

from levelhead.compiler.mark import kernel, with_globals
from levelhead.filters.contract import HEIGHT
from levelhead.filters.eskf.params import ESKF, MILLI
from levelhead.filters.parameters import Params
from levelhead.kernels.arrays import Floats
from levelhead.units import DEGREE

# When a block of states exists
ALWAYS = "always"
WITH_MAG = "with a magnetometer"
WITH_AIDING = "with position, velocity or height"


class Block(NamedTuple):
    """Consecutive error states of one kind."""

    name: str  # that of its offset in small letters, and of its field in a Calibration
    first: int
    shape: tuple[int, ...]
    unit: str
    meaning: str
    exists: str
    calibration: bool  # part of a Calibration
    prior: bool  # a later run may start with it
    relative: bool  # kept as a share of the first field's norm
    turn_on: float  # 1σ by which it differs from one switching-on of the sensor to the next, in its unit

    @property
    def size(self) -> int:
        """How many states."""
        return prod(self.shape)


_declared: list[Block] = []


def states(
    name: str, shape: tuple[int, ...], unit: str, meaning: str, exists: str,
    *, calibration: bool = False, prior: bool = False, relative: bool = False, turn_on: float = 0.0,
) -> int:  # fmt: skip
    """Declares the next block of states and returns the offset of its first one."""
    first = _declared[-1].first + _declared[-1].size if _declared else 0
    _declared.append(
        Block(
            name=name, first=first, shape=shape, unit=unit, meaning=meaning, exists=exists, calibration=calibration,
            prior=prior, relative=relative, turn_on=turn_on,
        )
    )  # fmt: skip
    return first


# The states. Those before HEADING are the horizon and the states that depend on it: a magnetometer only considers them.
# It changes those from there up to FIELD by a share, as far as its offset is known. Velocity is driven by attitude and
# the states before it, attitude by those from GYR_BIAS up to BODY_VELOCITY. Those that always exist come first, those
# of aiding last, so the first n are those that exist. The σ of a bias from one switching-on to the next is a choice in
# the range of the zero-rate and zero-g repeatability of consumer chips, which their data sheets do not give.
ACC_BIAS = states("acc_bias", (3,), "m/s²", "accelerometer bias c", ALWAYS, calibration=True, prior=True, turn_on=0.02)
VELOCITY = states("velocity", (3,), "m/s", "velocity v, earth frame", ALWAYS)
ATTITUDE = states("attitude", (2,), "rad", "attitude error θ about east and north", ALWAYS)
HEADING = states("heading", (1,), "rad", "attitude error θ about the vertical", ALWAYS)
GYR_BIAS = states(
    "gyr_bias", (3,), "rad/s", "gyroscope bias b", ALWAYS, calibration=True, prior=True, turn_on=radians(0.3)
)
GYR_MATRIX = states(
    "gyr_matrix", (3, 3), "", "gyroscope matrix S: scale factors and cross-axis terms", ALWAYS,
    calibration=True, prior=True,
)  # fmt: skip
BODY_VELOCITY = states(
    "body_velocity", (3,), "m/s", "body velocity u: velocity that is fixed to the sensor, sensor frame", ALWAYS
)
FIELD = states("field", (3,), "µT", "field H of the surroundings, frame of the gyroscope", WITH_MAG, relative=True)
PLACE = states("place", (3,), "µT", "part s of the field that belongs to the place", WITH_MAG, relative=True)
MAG_OFFSET = states(
    "mag_offset", (3,), "µT", "magnetometer offset o", WITH_MAG, calibration=True, prior=True, relative=True
)
SOFT_IRON = states(
    "soft_iron", (5,), "", "soft iron: symmetric matrix without trace, xx yy xy xz yz", WITH_MAG,
    calibration=True, prior=True,
)  # fmt: skip
MAG_DELAY = states(
    "mag_delay", (1,), "s", "time d by which the magnetometer is later than the gyroscope", WITH_MAG,
    calibration=True, prior=True,
)  # fmt: skip
POSITION = states("position", (3,), "m", "position p, earth frame", WITH_AIDING)
BARO_OFFSET = states("baro_offset", (1,), "m", "offset β of the barometer's height", WITH_AIDING)
BLOCKS = tuple(_declared)
N = sum(block.size for block in BLOCKS)
DRIVEN = GYR_BIAS - VELOCITY  # from VELOCITY on

# 1σ at the start, where no parameter has it
FIRST_SPEED = 0.3  # m/s
UNKNOWN = 1.0  # rad, of an attitude that means nothing
RELATIVE_HEADING = 1e-4  # rad: a relative heading is right by definition
FIRST_FIELD = 1.0  # share


def declare_states(m: Floats, first: int, size: int, start: float, walk: float, unit: float) -> None:
    """A placeholder: ``instance`` puts its action on each block of states here.

    ``start`` is 1σ at the start and ``walk`` 1σ of the random walk after one second, both in the unit of the states: a
    prior is divided by ``unit`` to be in it, and a walk is multiplied by it.
    """
    raise RuntimeError("bind `declare_states` first")


@kernel
def inertial_states(params: ESKF, m: Floats, unit: float) -> None:
    """σ at the start and random walk of the states that always exist; ``unit`` is not used."""
    declare_states(m, ACC_BIAS, 3, params.acc_bias, params.acc_walk, 1.0)
    declare_states(m, VELOCITY, 3, FIRST_SPEED, 0.0, 1.0)
    declare_states(m, ATTITUDE, 2, UNKNOWN, 0.0, 1.0)
    declare_states(m, HEADING, 1, RELATIVE_HEADING, 0.0, 1.0)
    declare_states(m, GYR_BIAS, 3, params.bias_start * DEGREE, params.bias_walk * DEGREE, 1.0)
    declare_states(m, GYR_MATRIX, 9, params.scale_start, params.scale_walk, 1.0)
    declare_states(m, BODY_VELOCITY, 3, params.body_velocity, 0.0, 1.0)


@kernel
def magnetic_states(params: ESKF, m: Floats, unit: float) -> None:
    """σ at the start and random walk of the states of a magnetometer.

    ``unit`` is at the start the first field's norm, µT, and for the walk |H| as a share of it.
    """
    declare_states(m, FIELD, 3, FIRST_FIELD, 0.0, unit)
    declare_states(m, PLACE, 3, params.mag_place, 0.0, unit)
    declare_states(m, MAG_OFFSET, 3, params.mag_offset, params.offset_walk, unit)
    declare_states(m, SOFT_IRON, 5, params.soft_iron, 0.0, 1.0)
    declare_states(m, MAG_DELAY, 1, params.mag_delay * MILLI, 0.0, 1.0)


@kernel
def aided_states(params: ESKF, m: Floats, unit: float) -> None:
    """σ at the start and random walk of the states of aiding, all known by definition until the first measurement."""
    declare_states(m, POSITION, 3, 0.0, 0.0, 1.0)
    declare_states(m, BARO_OFFSET, 1, 0.0, params.baro_walk, 1.0)


def block_noise(params: Params) -> dict[int, tuple[int, float, float]]:
    """Offset of each block of states -> its size, σ at the start and random walk, for the parameters; plain Python."""
    found: dict[int, tuple[int, float, float]] = {}

    def record(m: Floats, first: int, size: int, start: float, walk: float, unit: float) -> None:
        found[first] = size, start, walk

    for declaration in (inertial_states, magnetic_states, aided_states):
        of_params: Callable[..., None] = with_globals(declaration, "record", declare_states=record)
        of_params(params, [], 1.0)
    return found


def fours(n: int) -> int:
    """Rounded up to a multiple of four, which vector instructions take."""
    return (n + 3) // 4 * 4


# The computed part of a row. States that do not exist are zero there.
N_INERTIAL = fours(FIELD)  # without a magnetometer
N_MAGNETIC = fours(POSITION)  # without position and velocity
ROW = fours(N)  # all of it; from one row to the next
TOGETHER = 3  # scalar measurements that P takes at once
PARTIAL = FIELD - HEADING  # states of which a magnetometer takes a share
AID_ROWS = HEIGHT + 1  # rows of aiding: position 3, velocity 3, zero velocity 3, height by barometer


class MemoryPlace(NamedTuple):
    """Consecutive numbers of the memory."""

    first: int
    size: int
    unit: str
    meaning: str


_places: list[MemoryPlace] = []


def place(size: int, unit: str, meaning: str) -> int:
    """Declares the next place of the memory and returns its offset."""
    first = _places[-1].first + _places[-1].size if _places else 0
    _places.append(MemoryPlace(first=first, size=size, unit=unit, meaning=meaning))
    return first


# The memory, place after place
P = place(ROW * ROW, "", "covariance, N² in rows of ROW")
MEAN = place(ROW, "", "mean of the additive states")
X = place(ROW, "", "correction of the mean in this block of samples")
H = place(ROW, "", "row of a measurement")
U = place(TOGETHER * ROW, "", "P hᵀ/√s of the measurements that P does not contain yet, by rows")
SHARE_OF_U = place(TOGETHER * PARTIAL, "", "β of it, of the states from HEADING up to FIELD, eq. 19")
ROOT_OF_U = place(TOGETHER * PARTIAL, "", "√(β (2 − β)) of it")
F = place(DRIVEN * ROW, "", "1 − F of the driven states")
W = place(DRIVEN * ROW, "", "F P of the driven states")
PRIOR_MEAN = place(N, "", "means of an earlier run, in the units of a Calibration")
PRIOR_SIGMA = place(N, "", "their σ; 0: there is none")
RUN_TIME = place(1, "s", "time over which Q has been added")
# Aiding
SUM_INNOVATION = place(AID_ROWS, "", "Σ y/σ² of a row's innovations in the block of samples")
SUM_WEIGHT = place(AID_ROWS, "", "Σ 1/σ²")
AID_AGE = place(AID_ROWS, "s", "time since a row was last accepted")
AID_REJECTED = place(AID_ROWS, "s", "time for which it has been rejected; 0: it is accepted")
AIDED_SPEED2 = place(3, "(m/s)²", "square of velocity while it was aided")
AIDED = place(1, "", "0: there was no aiding measurement")
# Heading from the velocity of a receiver (``coarse_heading``)
VELOCITY_GAIN = place(2, "m/s", "∫ f dt since the last fix of a receiver's velocity, east and north")
GAIN_TIME = place(1, "s", "time since then")
GNSS_VELOCITY = place(2, "m/s", "velocity of a fix in this block, east and north")
GNSS_VARIANCE = place(2, "(m/s)²", "its variances; 0: there is none")
FIX_BEFORE = place(2, "m/s", "velocity of the last fix")
FIX_NOISE = place(1, "(m/s)²", "its variance, both axes: as much as that of ΔV along one")
FIX_KNOWN = place(1, "", "0: there was none")
FIX_SUMS = place(9, "", "sums of the regression, eq. 33: n, Σ P, Σ ΔV, Σ |P|², Σ |ΔV|², Σ P* ΔV")
FIX_SUMS_END = place(0, "", "behind them")
# Motion (``adaptation``)
BODY_VELOCITY_VARIANCE = place(1, "(m/s)²", "variance of body velocity, as found")
MEAN_INNOVATION = place(3, "m/s", "innovation of velocity, through a low-pass filter")
MEAN_DENSITY = place(2, "(m/s)²·s", "mean density of the rest of the velocity: horizontal, vertical")
DENSITY = place(2, "(m/s)²·s", "the same as used")
EXCESS = place(2, "(m/s)²", "square of velocity beyond that of a body: level, upwards")
MEAN_UP = place(1, "m/s²", "upward part of the specific force, through a low-pass filter")
# A lost tilt, eq. 43 (``reinitialise``)
LOST_FORCE = place(3, "m/s", "F, ∫ f dt since tilt was lost, earth frame of the estimate of then")
LOST_FORCE2 = place(1, "m²/s³", "∫ |f|² dt")
LOST_TIME = place(1, "s", "time since then")
LOST_TURN = place(2, "rad", "θ, about east and north")
LOST_VARIANCE = place(1, "rad²", "variance of tilt about either axis then")
# The gyroscope's bias (``adaptation``)
BIAS_BEFORE = place(3, "(rad/s)²", "variances before the measurements of a block")
BIAS_CHANGE = place(3, "rad/s", "corrections over the last seconds")
BIAS_CHANGE_VARIANCE = place(3, "(rad/s)²", "their variance in the model")
BIAS_WALK = place(1, "(rad/s)²/s", "density of the random walk beyond the parameter")
PRIOR_VARIANCE = place(GYR_MATRIX, "", "variance of the states up to the gyroscope's bias, as found")
GYR_PRIOR_OPEN = place(1, "", "1: the gyroscope may be raw; 2: the prior may still become narrower")
# The field and north
FIELD_INNOVATION = place(3, "", "innovation of the field, share, through a low-pass filter")
MEAN_FIELD_DENSITY = place(1, "s", "mean density of changes within seconds, share²·s")
FIELD_DENSITY = place(1, "s", "the same as used")
PLACE_VARIANCE = place(1, "", "variance of the field of a place by |H|², as found")
NORTH_TURN = place(1, "rad", "turn of the orientation towards north")
NORTH_C = place(1, "", "cosine of half of it")
NORTH_S = place(1, "", "sine of half of it")
NORTH = place(1, "rad", "azimuth of north in the frame of the gyroscope, clockwise from y")
NORTH_VARIANCE = place(1, "rad²", "its variance")
NORTH_TIME = place(1, "s", "time for which there has been a field")
NORTH_EXCESS = place(1, "rad²", "variance of a heading that points north, beyond that in P")
# The known field of the place (``known_field``)
KNOWN_LEVEL = place(1, "", "its level part, share; 0: unknown")
KNOWN_UP = place(1, "", "its upward part, share")
KNOWN_UP_SET = place(1, "", "1: it is part of P")
KNOWN_EAST = place(1, "", "direction along which the level part of H was set,")
KNOWN_NORTH = place(1, "", "towards north,")
KNOWN_TARGET = place(1, "", "to which value, share,")
KNOWN_VARIANCE = place(1, "", "with which variance; 0: it was not")
# The last samples
HALF_TURN = place(3, "rad", "1σ of the attitude by the time of the last reading, eq. 40; sensor frame")
MEAN_RATE = place(3, "rad/s", "rate through a low-pass filter")
REST_KNOWN = place(1, "", "1: the rest of now was measured back to its beginning")
# The block of samples; all from here on is set to zero at its start
INT_R = place(9, "s", "∫ R dt")
INT_R_RATE = place(27, "rad", "∫ R_ik ω_l dt")
INT_FORCE = place(3, "m/s", "∫ f dt, earth frame")
INT_RATE = place(3, "rad", "∫ ω dt")
INT_RATE2 = place(1, "rad²/s", "∫ |ω|² dt")
INT_ACC2 = place(1, "m²/s³", "∫ |f − g|² dt")
INT_VELOCITY = place(3, "m", "∫ v dt, earth frame")
ACC_TIME = place(1, "s", "time with an accelerometer")
BLOCK_TIME = place(1, "s", "time")
SUM_FIELD = place(3, "", "Σ e")
SUM_MAG = place(3, "", "Σ μ/u")
SUM_R = place(9, "", "Σ R at the magnetometer's samples")
SUM_R_CROSS = place(3, "rad/s", "Σ R (ω × h)")
MAG_COUNT = place(1, "", "number of the magnetometer's samples")
ADDED_VARIANCE = place(1, "rad²", "variance of rotations that were not measured")
ADDED_HEADING_VARIANCE = place(1, "rad²", "the same about the vertical")
ADDED_VELOCITY_VARIANCE = place(1, "m²/s²", "variance of specific forces beyond full scale")
GAP_TIME = place(1, "s", "length of a gap before the block")
REINITIALISED = place(1, "", "1: the attitude is independent of that before")
PLACE_DECAY = place(1, "", "factor of PLACE in the block")
BODY_VELOCITY_DECAY = place(1, "", "factor of BODY_VELOCITY in the block")
SIZE = place(0, "", "number of all")
