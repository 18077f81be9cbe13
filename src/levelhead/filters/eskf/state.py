"""The states of ``ESKF`` and its memory: each block of states is declared once, and all else here follows from that.

Offsets, lengths of rows and the memory are plain integers. Kernels import this module as ``at`` and write
``m[at.MEAN + at.GYR_BIAS]``. A further block of states needs a line among the blocks below, a line in one of the three
kernels below them, which declare its σ at the start and its random walk, and parameters for these two.

The memory is one row of floats: the covariance P by rows, the mean of what is additive (attitude is not), the
correction x gathered in a block of samples, a row h of a measurement, P hᵀ, the couplings F − 1 of the states that
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
    _declared.append(Block(name, first, shape, unit, meaning, exists, calibration, prior, relative, turn_on))
    return first


# The states. Those before HEADING are the horizon and what depends on it: a magnetometer only considers them. Velocity
# and attitude are driven by others. What always exists comes first, what exists with aiding last, so that the first n
# leave out what does not exist. The σ of a bias from one switching-on to the next is a choice in the range of the
# zero-rate and zero-g repeatability of consumer chips, which their data sheets do not give.
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
TRAVEL = states("travel", (3,), "m/s", "travel u: velocity that is fixed to the sensor, sensor frame", ALWAYS)
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

# 1σ at the start, where no parameter says it
FIRST_SPEED = 0.3  # m/s
UNKNOWN = 1.0  # rad, of an attitude that means nothing
RELATIVE_HEADING = 1e-4  # rad: a relative heading is right by definition
FIRST_FIELD = 1.0  # share


def declare_states(m: Floats, first: int, size: int, start: float, walk: float, unit: float) -> None:
    """Stands where ``instance`` puts what is to be done with each block of states.

    ``start`` is 1σ at the start and ``walk`` 1σ of the random walk after one second, both in the unit of the states: a
    prior is divided by ``unit`` to be in it.
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
    declare_states(m, TRAVEL, 3, params.travel, 0.0, 1.0)


@kernel
def magnetic_states(params: ESKF, m: Floats, unit: float) -> None:
    """σ at the start and random walk of the states of a magnetometer; ``unit`` is the first field's norm, µT."""
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


# How much of a row is computed. What does not exist is zero there.
N_INERTIAL = fours(FIELD)  # without a magnetometer
N_MAGNETIC = fours(POSITION)  # without position and velocity
ROW = fours(N)  # all of it; from one row to the next

# The memory
P = 0  # covariance, N² in rows of ROW
MEAN = P + ROW * ROW
X = MEAN + ROW  # correction of the mean in this block of samples
H = X + ROW  # row of a measurement
U = H + ROW  # P hᵀ/√s
F = U + ROW  # F − 1 of the driven states
W = F + DRIVEN * ROW  # F P of the driven states
PRIOR_MEAN = W + DRIVEN * ROW  # means of an earlier run in the units of a Calibration,
PRIOR_SIGMA = PRIOR_MEAN + N  # and their σ; 0: there is none
RUN_TIME = PRIOR_SIGMA + N  # s over which Q has been added
AID_ROWS = HEIGHT + 1  # rows of aiding: position 3, velocity 3, height by barometer
SUM_INNOVATION = RUN_TIME + 1  # Σ y/σ² of a row's innovations in the block of samples
SUM_WEIGHT = SUM_INNOVATION + AID_ROWS  # Σ 1/σ²
AID_AGE = SUM_WEIGHT + AID_ROWS  # s since a row was last accepted
AID_REJECTED = AID_AGE + AID_ROWS  # s for which it has been rejected, 0: it is accepted
AIDED_SPEED2 = AID_REJECTED + AID_ROWS  # (m/s)², square of velocity while it was aided, 3
AIDED = AIDED_SPEED2 + 3  # 0: there was no aiding measurement
PUSH = AIDED + 1  # m/s, ∫ f dt since the last fix of a receiver's velocity, east and north,
PUSH_TIME = PUSH + 2  # and s since then
FIX = PUSH_TIME + 1  # m/s, velocity of a fix in this block, east and north,
FIX_VARIANCE = FIX + 2  # and its variance; 0: there is none
FIX_BEFORE = FIX_VARIANCE + 2  # m/s, velocity of the last fix,
FIX_NOISE = FIX_BEFORE + 2  # (m/s)², its variance, both axes: as much as that of ΔV along one,
FIX_KNOWN = FIX_NOISE + 1  # 0: there was none
FIX_SUMS = FIX_KNOWN + 1  # of regression, eq. 31: n, Σ P, Σ ΔV, Σ |P|², Σ |ΔV|², Σ P* ΔV
FIX_SUMS_SIZE = 9
PUSH_SIZE = FIX_SUMS + FIX_SUMS_SIZE - PUSH
TRAVEL_VARIANCE = PUSH + PUSH_SIZE  # (m/s)², found
MEAN_INNOVATION = TRAVEL_VARIANCE + 1  # m/s, of velocity, through a low-pass filter, 3
MEAN_DENSITY = MEAN_INNOVATION + 3  # (m/s)²·s, of what velocity does besides, in the mean: horizontal, vertical
DENSITY = MEAN_DENSITY + 2  # (m/s)²·s, as used
EXCESS = DENSITY + 2  # (m/s)², by which velocity is beyond what the body may do: level, upwards
MEAN_UP = EXCESS + 2  # m/s², upward part of the specific force, through a low-pass filter
LOST_FORCE = MEAN_UP + 1  # m/s, F of eq. 38, ∫ f dt since tilt was lost, earth frame of the estimate of then, 3,
LOST_FORCE2 = LOST_FORCE + 3  # m²/s³, ∫ |f|² dt,
LOST_TIME = LOST_FORCE2 + 1  # s,
LOST_TURN = LOST_TIME + 1  # rad, θ of eq. 38, about east and north,
LOST_VARIANCE = LOST_TURN + 2  # rad², of tilt about either axis then
BIAS_BEFORE = LOST_VARIANCE + 1  # (rad/s)², variances of the gyroscope's bias before the measurements of a block, 3
BIAS_CHANGE = BIAS_BEFORE + 3  # rad/s, corrections of this bias over the last seconds, 3,
BIAS_CHANGE_VARIANCE = BIAS_CHANGE + 3  # and their variance as the model has it, 3
BIAS_WALK = BIAS_CHANGE_VARIANCE + 3  # (rad/s)²/s, density of this bias's random walk beyond the parameter
PRIOR_VARIANCE = BIAS_WALK + 1  # of the states up to the gyroscope's bias, as found
MAYBE_RAW = PRIOR_VARIANCE + GYR_MATRIX  # 1: its gyroscope may be raw; 2: the prior may still become narrower
FIELD_INNOVATION = MAYBE_RAW + 1  # share, of the field, through a low-pass filter, 3
MEAN_FIELD_DENSITY = FIELD_INNOVATION + 3  # share²·s, of what changes within seconds, in the mean
FIELD_DENSITY = MEAN_FIELD_DENSITY + 1  # share²·s, as used
MEAN_PLACE = FIELD_DENSITY + 1  # share, by which strength and upward part are off H, through a low-pass filter, 2
PLACE_VARIANCE = MEAN_PLACE + 2  # share², of the field of a place, as found
FIELD_TIME = PLACE_VARIANCE + 1  # s in motion for which this was looked at
NORTH_TURN = FIELD_TIME + 1  # rad, by which the orientation is turned to point north
NORTH_C = NORTH_TURN + 1  # cosine of its half
NORTH_S = NORTH_C + 1  # and sine
NORTH = NORTH_S + 1  # rad, azimuth of north in the frame of the gyroscope, clockwise from y
NORTH_VARIANCE = NORTH + 1  # rad²
NORTH_TIME = NORTH_VARIANCE + 1  # s for which there has been a field
NORTH_EXCESS = NORTH_TIME + 1  # rad², by which the variance of a heading that points north is more than P says
HALF_TURN = NORTH_EXCESS + 1  # rad, 1σ of the attitude by the time of the last reading, eq. 36; sensor frame, 3
MEAN_RATE = HALF_TURN + 3  # rad/s, through a low-pass filter, 3
REST_KNOWN = MEAN_RATE + 3  # 1: the rest of now was measured back to its beginning
INT_R = REST_KNOWN + 1  # ∫ R dt, 9
INT_R_RATE = INT_R + 9  # ∫ R_ik ω_l dt, 27
INT_FORCE = INT_R_RATE + 27  # ∫ f dt, earth frame, 3
INT_RATE = INT_FORCE + 3  # ∫ ω dt, 3
INT_RATE2 = INT_RATE + 3  # ∫ |ω|² dt
INT_ACC2 = INT_RATE2 + 1  # ∫ |f − g|² dt
ACC_TIME = INT_ACC2 + 1  # s with an accelerometer
BLOCK_TIME = ACC_TIME + 1  # s
SUM_FIELD = BLOCK_TIME + 1  # Σ e, 3
SUM_MAG = SUM_FIELD + 3  # Σ μ/u, 3
SUM_R = SUM_MAG + 3  # Σ R at the magnetometer's samples, 9
SUM_R_CROSS = SUM_R + 9  # Σ R (ω × h), 3
MAG_COUNT = SUM_R_CROSS + 3
ADDED_VARIANCE = MAG_COUNT + 1  # rad², of turns that were not measured
ADDED_HEADING_VARIANCE = ADDED_VARIANCE + 1
GAP_TIME = ADDED_HEADING_VARIANCE + 1  # s of a gap before the block
REINITIALISED = GAP_TIME + 1  # 1: its attitude is independent of that before: taken from the sensors, or forgotten
PLACE_DECAY = REINITIALISED + 1  # share by which PLACE has decayed in the block,
TRAVEL_DECAY = PLACE_DECAY + 1  # and TRAVEL
SIZE = TRAVEL_DECAY + 1
