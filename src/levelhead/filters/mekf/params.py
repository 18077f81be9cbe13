"""Parameters of ``EKF``."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import nonnegative, parameters, positive
from levelhead.units import DEGREE

# By default ``tune`` searches the numbers that depend on the motion and the room. The rest is the sensor's noise
# (``levelhead noise`` measures it) and the start; a search of them gains nothing on other recordings
# (docs/howto/tuning.md).


@parameters(tuned=("gyr_noise_per_rate", "acc_motion", "acc_tau", "mag_noise"))
class EKF(NamedTuple):
    """Multiplicative extended Kalman filter: attitude and gyroscope bias, from gravity and field as vectors."""

    gyr_noise: Annotated[float, positive("(deg/s)/√Hz", "noise density of the rate", 0.01, 1.0)] = 0.1
    gyr_noise_per_rate: Annotated[float, nonnegative("√s", "noise density of the rate, per rate", 5e-4, 0.05)] = 0.006
    bias_walk: Annotated[float, nonnegative("(deg/s)/√s", "random walk of the bias", 0.0001, 0.1)] = 0.005
    acc_noise: Annotated[float, positive("(m/s²)/√Hz", "density of acceleration at rest", 0.02, 2.0)] = 0.2
    acc_motion: Annotated[float, nonnegative("√s", "density of acceleration, per | |a| − g |", 0.01, 3.0)] = 0.1
    acc_tau: Annotated[float, nonnegative("s", "low-pass of specific force in the earth frame", 0.1, 10.0)] = 2.0
    mag_noise: Annotated[float, positive("deg/√Hz", "density of the field's heading", 1.0, 100.0)] = 30.0
    tilt_start: Annotated[float, positive("deg", "1σ of the first tilt", 0.5, 30.0)] = 5.0
    bias_start: Annotated[float, positive("deg/s", "1σ of the bias at the start", 0.01, 10.0)] = 1.0
    block: Annotated[float, nonnegative("s", "time between two corrections; 0: at every sample", 0.005, 0.2)] = 0.02
    gate: Annotated[float, nonnegative("", "innovations beyond so many σ are not used", 2.0, 10.0)] = 5.0
    gate_time: Annotated[float, nonnegative("s", "rejected for at most this time", 0.1, 10.0)] = 1.0


def with_known_bias(params: EKF, sigma: float) -> EKF:
    """Parameters for a gyroscope whose bias was subtracted, to within 1σ of ``sigma`` rad/s."""
    return params._replace(bias_start=min(params.bias_start, sigma / DEGREE))
