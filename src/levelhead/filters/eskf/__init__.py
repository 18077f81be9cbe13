"""ESKF: the filter that calibrates its sensor while it runs.

Beside attitude and velocity it estimates the errors of gyroscope, accelerometer and magnetometer, in the error-state
form of J. Solà. docs/explanation/self-calibration.md derives the equations, with the same numbers.
With ^ on estimates, and ω, a, μ for the readings of the sensors,

    R = exp([θ]×) R^,   everything else x = x^ + δx                                                             (1)
    rate w = ω − S ω − b                                                                                        (2)
    force f = R (a − c)                                                                                         (3)
    field h = μ/u − S_m μ/u − o, later than the rate by d                                                       (4)

S is a whole matrix: scale factors and cross-axis terms; S_m is symmetric and has no trace; u is the norm of the first
field. At every sample the attitude
is rotated by (2) exactly, and f − g is integrated to v. The couplings of the errors are integrated over a block of
samples of T ≥ ``block`` s:

    θ ← θ − ∫R dt δb − ∫R ⊗ ω dt δS,   v ← v − [∫f dt]× θ − ∫R dt δc                                            (7)

These are the rows of F − 1 in P ← F P Fᵀ + Q; all other states are random walks (10) or constants, but for s (11) and
u (12), which decay. At the end of the block scalar measurements (13) follow one after the other. A body stays in the
room. With R̄ = ∫R dt/T, its mean velocity over T has two parts. The body velocity u is fixed to the sensor and a
first-order Gauss-Markov process. The rest is white noise of density D, found from the innovations (``adaptation``) and
at least ``velocity_density``²:

    0 = v̄ + δv + w × θ − θ_z × v − R̄ u − R̄ δu,   variance D/T                                                  (22)

v̄ is the mean of v over the block, and w = v − v̄ + g T/2 the velocity that the force added since. This makes tilt
observable, without any test whether |a| is g. The term of θ_z keeps (22) from correcting heading. The frame is the
gyroscope's: heading is right by definition at the start, and the field H of the surroundings may point anywhere in it.
The part s of the field belongs to a place. The block's mean field is e = mean R (h − d w × h + d²/2 w × (w × h)):

    e + θ × e − mean R (δo + δS_m μ/u + (w × h − d w × (w × h)) δd) − δH − δs = H + s,   variance D_f/T         (16)

D_f and the variance of s are found from the innovations (``adaptation``). North is the azimuth of H (18). A magnet must
not tilt the horizon: the gains of θ_x, θ_y, v and c are zero in (16) (the consider filter of S. F. Schmidt). At rest

    0 = mean ω − S mean ω − b                                                                                  (15)

A tilt known to no better than half a radian is corrected on the sphere by the mean force since then (43), and so is
one that a mean force contradicts which points down; a heading known to no better than a radian is that by which the
mean field is H + s. A mean of the velocity's innovations beyond the share of the largest D is caused by a turn that
the gyroscope missed; its variance is process noise of the next block (28).

The prior of the gyroscope's bias is wide at the start and becomes narrow within seconds; later the priors of both
biases are widened where the measurements demand it (``adaptation``). Corrections of the gyroscope's bias that add up to
more than their variances allow are those of a sensor that warms up; its random walk is faster then (29).

The estimates of the sensor's errors are ``Track.calibration``, and can be the next run's ``prior``.

| file | equations |
|---|---|
| ``state`` | the states, each block declared once; where they stand in the memory |
| ``params`` | the parameters |
| ``preintegration`` | (2), (3), (4), and the integrals of (7), (15) and (16) over a block |
| ``predict`` | F (7), Q (8) to (12), (28) and (29), gaps |
| ``covariance`` | P ← F P Fᵀ + Q, scalar measurements (13), (19), independent states |
| ``measurements`` | (14) to (17), (20) and (22) |
| ``adaptation`` | D (23), variance of u (12), turns (28), walk of b (29), priors (24) to (26), field (35), (36) |
| ``aiding`` | position, velocity, height and standing still beside the IMU |
| ``coarse_heading`` | heading from the velocity of a receiver (32), (33) |
| ``known_field`` | the field of the place as a prior of H (37), (38) |
| ``reinitialise`` | large errors of tilt (43) and heading |
| ``north`` | north (18), and the turn of the orientation to it (39) |
| ``calibration`` | the estimates as plain numbers, and a prior |
| ``sigma`` | σ: from P, and beyond it (40), (41), (42) |
| ``filter`` | the order of all this, sample by sample |
| ``rts`` | the smoother: the quantities that the forward run keeps, and the step back (30), (31) |
| ``rts_aided`` | the same with position, velocity and height (34) |
"""

from levelhead.filters.contract import Aiding, Filter, Inflation, Schedule, SelfCalibration, Settling, Smoothing
from levelhead.filters.eskf import rts, rts_aided
from levelhead.filters.eskf.filter import (
    at_rest,
    correct,
    due,
    estimate,
    inflate,
    inflate_heading,
    inflate_velocity,
    init,
    nav_state,
    output,
    restart,
    step,
    update_aiding,
    with_prior,
)
from levelhead.filters.eskf.params import ESKF, with_known_bias, with_known_field

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
    inflation=Inflation(inflate, inflate_heading, inflate_velocity),
    at_rest=at_rest,
    schedule=Schedule(due, correct),
    aiding=Aiding(update_aiding, nav_state),
    handles=frozenset({"bias", "field"}),
    calibration=SelfCalibration(restart, with_prior, estimate),
    smoothing=Smoothing(
        offline=rts.offline,
        init=rts.init,
        correct=rts.correct,
        width=rts.BLOCK_SIZE,
        is_block_end=rts.is_block_end,
        keep_start=rts.keep_start,
        keep=rts.keep,
        memory=rts.SIZE,
        begin=rts.begin,
        back=rts.back,
        read=rts.read,
        rotation=rts.rotation,
        is_restart=rts.is_restart,
        turn_north=rts.turn_north,
    ),
    aided_smoothing=rts_aided.AIDED,
    with_known_bias=with_known_bias,
    with_known_field=with_known_field,
)

__all__ = ["ESKF", "FILTER"]
