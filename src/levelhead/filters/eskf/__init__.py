"""ESKF: the filter that calibrates its sensor while it runs.

Beside attitude and velocity it estimates what gyroscope, accelerometer and magnetometer do wrong, in the error-state
form of J. Solà: with ^ on what is estimated, and ω, a, μ what the sensors say,

    R = exp([θ]×) R^,   everything else x = x^ + δx                                                             (1)
    rate (1 − S) ω − b,   force f = R (a − c),   field h = μ/u − o, later than the rate by d                    (2)

S is a whole matrix: scale factors and cross-axis terms; u the first norm of the field. At every sample attitude is
turned by (2) exactly and v by f − g. What the errors do is summed up over a block of T ≥ ``block`` s:

    θ ← θ − ∫R dt δb − ∫R ⊗ ω dt δS,   v ← v − [∫f dt]× θ − ∫R dt δc                                            (3)

which are the rows of F − 1 in P ← F P Fᵀ + Q; all else but n, see (5), walks at random. Then rows are measured one
after the other. A body stays in the room, so that its mean velocity over T is zero but for what is left of a density
``speed``²:

    0 = v + δv − θ_z × v,   variance speed²/T                                                                   (4)

which is what makes tilt observable, without any test whether |a| is g; a turn by θ_z takes v along, so that (4) tells
nothing of heading. The block's mean field e = mean R (h − d ω × h + d²/2 ω × (ω × h)) has strength and dip m, and an
eastern part n that differs from place to place by ``mag_place``, and is forgotten over ``place_time``:

    e + θ × e − mean R δo − mean R (ω × h − d ω × (ω × h)) δd − (δn, δm_h, δm_v) = (n, m_h, m_v)                (5)

with a variance that grows by the square of what norm and dip differ from m. A magnet must not tilt the horizon: the
gains of θ_x, θ_y, v and c are zero in (5) (the consider filter of S. F. Schmidt). At rest

    0 = mean ω − S mean ω − b                                                                                   (6)

What cannot be corrected to first order (tilt beyond half a radian, heading beyond one, a velocity 5 σ away for a
second) is taken from the block's mean force and field as at the start. A field that does not fit, but stands still in
the earth frame while the sensor turns for ``mag_time``, is taken for the earth's.

What was learned is ``Track.calibration``, the next run's ``prior``. All equations with their reasons:
docs/self-calibration.md.
"""

from levelhead.filters.contract import Aiding, Filter, Inflation, Schedule, SelfCalibration, Settling
from levelhead.filters.eskf.filter import (
    aid,
    at_rest,
    correct,
    due,
    estimate,
    inflate,
    inflate_heading,
    init,
    nav_state,
    output,
    restart,
    step,
    with_prior,
)
from levelhead.filters.eskf.params import ESKF, with_known_bias

FILTER = Filter(
    name="ESKF",
    params=ESKF,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="J. Solà, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508, 2017",
    settles=Settling(15.0, 120.0),
    inflation=Inflation(inflate, inflate_heading),
    at_rest=at_rest,
    schedule=Schedule(due, correct),
    aiding=Aiding(aid, nav_state),
    handles=frozenset({"bias", "field"}),
    calibration=SelfCalibration(restart, with_prior, estimate),
    with_known_bias=with_known_bias,
)

__all__ = ["ESKF", "FILTER"]
