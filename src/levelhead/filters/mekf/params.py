"""Parameters of ``EKF``."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import Param, parameters
from levelhead.units import DEGREE

# Unasked, ``tune`` searches what depends on the motion and the room. The rest is the sensor's noise (``levelhead
# noise`` measures it) and the start; searched as well it gains nothing on other recordings (docs/tuning.md).


@parameters()
class EKF(NamedTuple):
    """Multiplicative extended Kalman filter: attitude and gyroscope bias, from gravity and field as vectors."""

    gyr_noise: Annotated[
        float,
        Param(
            "(deg/s)/√Hz", "noise density of the rate", low=0.0, low_open=True, sweep=(0.01, 1.0), log=True, tune=False
        ),
    ] = 0.1
    gyr_scale: Annotated[
        float, Param("√s", "noise density of the rate, as a share of the rate", low=0.0, sweep=(5e-4, 0.05), log=True)
    ] = 0.006
    bias_walk: Annotated[
        float, Param("(deg/s)/√s", "random walk of the bias", low=0.0, sweep=(1e-4, 0.1), log=True, tune=False)
    ] = 0.005
    acc_noise: Annotated[
        float,
        Param(
            "(m/s²)/√Hz",
            "density of acceleration at rest",
            low=0.0,
            low_open=True,
            sweep=(0.02, 2.0),
            log=True,
            tune=False,
        ),
    ] = 0.2
    acc_motion: Annotated[
        float, Param("√s", "density of acceleration as a share of | |a| − g |", low=0.0, sweep=(0.01, 3.0), log=True)
    ] = 0.1
    acc_tau: Annotated[
        float, Param("s", "low-pass of specific force in the earth frame", low=0.0, sweep=(0.1, 10.0), log=True)
    ] = 2.0
    mag_noise: Annotated[
        float,
        Param("deg/√Hz", "density of the field's heading", low=0.0, low_open=True, sweep=(1.0, 100.0), log=True),
    ] = 30.0
    tilt_start: Annotated[
        float, Param("deg", "1σ of the first tilt", low=0.0, low_open=True, sweep=(0.5, 30.0), log=True, tune=False)
    ] = 5.0
    bias_start: Annotated[
        float,
        Param("deg/s", "1σ of the bias at the start", low=0.0, low_open=True, sweep=(0.01, 10.0), log=True, tune=False),
    ] = 1.0
    block: Annotated[
        float,
        Param(
            "s", "time between two corrections; 0: at every sample", low=0.0, sweep=(0.005, 0.2), log=True, tune=False
        ),
    ] = 0.02
    gate: Annotated[
        float,
        Param("", "innovations beyond so many σ are not believed", low=0.0, sweep=(2.0, 10.0), log=True, tune=False),
    ] = 5.0
    gate_time: Annotated[
        float, Param("s", "but not for longer than this", low=0.0, sweep=(0.1, 10.0), log=True, tune=False)
    ] = 1.0


def with_known_bias(params: EKF, sigma: float) -> EKF:
    """Parameters for a gyroscope whose bias was subtracted, to within 1σ of ``sigma`` rad/s."""
    return params._replace(bias_start=min(params.bias_start, sigma / DEGREE))
