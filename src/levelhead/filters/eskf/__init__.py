"""ESKF: the filter that calibrates its sensor while it runs.

Beside attitude and velocity it estimates the errors of gyroscope, accelerometer and magnetometer, in the error-state
form of J. Solà: with ^ on estimates, and ω, a, μ for the readings of the sensors,

    R = exp([θ]×) R^,   everything else x = x^ + δx                                                             (1)
    rate (1 − S) ω − b,   force f = R (a − c),   field h = μ/u − o, later than the rate by d                    (2)

S is a whole matrix: scale factors and cross-axis terms; u is the first norm of the field. At every sample the attitude
is rotated by (2) exactly, and f − g is integrated to v. The couplings of the errors are integrated over a block of
samples of T ≥ ``block`` s:

    θ ← θ − ∫R dt δb − ∫R ⊗ ω dt δS,   v ← v − [∫f dt]× θ − ∫R dt δc                                            (3)

These are the rows of F − 1 in P ← F P Fᵀ + Q; all other states but n, see (5), and u, see (4), are random walks. At the
end of the block scalar measurements follow one after the other. A body stays in the room: with R̄ = ∫R dt/T, its mean
velocity over T is that of travel u, which is fixed to the sensor and a first-order Gauss-Markov process, and a white
noise of density D, which is found from the innovations, ``speed``² at least (``adaptation``):

    0 = v + δv − θ_z × v − R̄ u − R̄ δu,   variance D/T                                                           (4)

This makes tilt observable, without any test whether |a| is g. The term of θ_z keeps (4) from correcting heading. The
block's mean field e = mean R (h − d ω × h + d²/2 ω × (ω × h)) has strength and dip m, and an eastern part n
that differs from place to place by ``mag_place`` (1σ) with the time constant ``place_time``:

    e + θ × e − mean R δo − mean R (ω × h − d ω × (ω × h)) δd − (δn, δm_h, δm_v) = (n, m_h, m_v)                (5)

with a variance that grows with the square of the misfit of norm and dip to m, and to their mean over 20 s. A field that
fits but points elsewhere is measured by its angle alone, with bounded influence. A magnet must not tilt the horizon:
the gains of θ_x, θ_y, v and c are zero in (5) (the consider filter of S. F. Schmidt). At rest

    0 = mean ω − S mean ω − b                                                                                   (6)

Attitudes of which nothing is known (1σ of tilt beyond half a radian, of heading beyond one) are taken from the block's
mean force and field. A field that does not fit (5), but stands still in the earth frame while the sensor turns for
``mag_time``, becomes m, and the variance of heading grows by the square of its angle.

Priors of biases start narrow and are widened where the measurements demand it (``adaptation``).

The estimates of the sensor's errors are ``Track.calibration``, and can be the next run's ``prior``. All equations with
their reasons: docs/self-calibration.md.

| file | equations |
|---|---|
| ``state`` | the states, each block declared once; where they stand in the memory |
| ``params`` | the parameters |
| ``preintegration`` | the integrals of (2), (3), (5) and (6) over a block |
| ``predict`` | F of (3), Q, gaps |
| ``covariance`` | P ← F P Fᵀ + Q, scalar measurements, independent states |
| ``measurements`` | (4), (5), (6) |
| ``adaptation`` | D and the variance of u in (4), widths of priors |
| ``aiding`` | position, velocity and height beside the IMU |
| ``reinitialise`` | tilt, heading and field from a block's mean readings |
| ``calibration`` | the estimates as plain numbers, and a prior |
| ``filter`` | the order of all this, sample by sample |
| ``rts`` | the smoother: what the forward run keeps, and the step back |
"""

from levelhead.filters.contract import Aiding, Filter, Inflation, Schedule, SelfCalibration, Settling, Smoothing
from levelhead.filters.eskf import rts
from levelhead.filters.eskf.filter import (
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
    update_aiding,
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
    aiding=Aiding(update_aiding, nav_state),
    handles=frozenset({"bias", "field"}),
    calibration=SelfCalibration(restart, with_prior, estimate),
    smoothing=Smoothing(
        offline=rts.offline,
        init=rts.init,
        correct=rts.correct,
        width=rts.KEPT,
        block_ended=rts.block_ended,
        keep_start=rts.keep_start,
        keep=rts.keep,
        memory=rts.SIZE,
        begin=rts.begin,
        back=rts.back,
        read=rts.read,
        rotation=rts.rotation,
        restarted=rts.restarted,
    ),
    with_known_bias=with_known_bias,
)

__all__ = ["ESKF", "FILTER"]
