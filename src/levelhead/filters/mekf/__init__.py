"""EKF: multiplicative extended Kalman filter for attitude and gyroscope bias, with gravity and field as vectors.

E. J. Lefferts, F. L. Markley and M. D. Shuster keep the attitude in a unit quaternion and its error in a small rotation
vector, here θ in the **earth** frame, and the bias error β in the sensor frame (with ^ on estimates):

    R = exp([θ]×) R^,   b = b^ + β                                                                              (1)
    θ' = −R β + noise,   β' = noise                                                                             (2)

so that with P in blocks A = E[θθᵀ], C = E[θβᵀ], B = E[ββᵀ], in one step of Δt

    C ← C − Δt R B                                                                                              (3)
    A ← A − Δt (R Cᵀ + C Rᵀ) + Δt² R B Rᵀ + q_θ Δt I                                                            (4)
    B ← B + q_β Δt I                                                                                            (5)

In the earth frame both measurements are plain. Specific force f = R a of a body that does not accelerate is (0, 0, g),
and the field h = R m has no eastern part. To first order in θ

    f_y/g = θ_x + v_x,   −f_x/g = θ_y + v_y,   h_x/√(h_x² + h_y²) = θ_z + v_z                                   (6)

Each row of H is a unit vector, so the updates are scalar ones, one after the other, with a division each:

    K = P hᵀ/(h P hᵀ + r),   x ← x + K y,   P ← P − K h P                                                       (7)

A body that stays in the room does not accelerate on average: f is low-passed in the earth frame, where gravity is
constant however the sensor turns, before it is a measurement. The variance r of the rest follows | |a| − g |, as q_θ
follows the rate, whose error is a share of itself.

A magnet may turn the heading but never tilt the horizon: the dip of the field does not enter, nor does, in (6), the
effect of tilt errors on h_x (its part h_z/h_y θ_y is noise), and the row of θ_z has no gain for θ_x and θ_y (the
consider filter of Schmidt):

    P ← P − K h P − (K h P)ᵀ + K (h P hᵀ + r) Kᵀ,   K_x = K_y = 0                                               (8)

The rest is indirect: heading teaches the bias about the vertical, which the next turn shares out.

A measurement whose innovation is beyond ``gate`` σ is rejected, for ``gate_time`` at most. After that the square of the
innovation is added to A, and the measurement is used.

Files: ``params`` the parameters; ``covariance`` P and eqs. 3 to 5 and 7; ``measurements`` the sums of a block, the
innovations of eq. 6, gates and eq. 8; ``filter`` the state and the functions that the driver calls.
"""

from levelhead.filters.contract import Filter, Inflation, Schedule, Settling
from levelhead.filters.mekf.filter import at_rest, correct, due, inflate, inflate_heading, init, output, step
from levelhead.filters.mekf.params import EKF, with_known_bias

FILTER = Filter(
    name="EKF",
    params=EKF,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "heading", "bias", "sigma"}),
    uses=frozenset({"gyr", "acc", "mag"}),
    citation="E. J. Lefferts, F. L. Markley, M. D. Shuster, Kalman Filtering for Spacecraft Attitude Estimation, "
    "Journal of Guidance, Control, and Dynamics 5(5), 1982",
    settles=Settling(15.0, 120.0),
    inflation=Inflation(inflate, inflate_heading),
    at_rest=at_rest,
    schedule=Schedule(due, correct),
    with_known_bias=with_known_bias,
)

__all__ = ["EKF", "FILTER"]
