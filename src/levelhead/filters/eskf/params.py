"""Parameters of ``ESKF``."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import Param, parameters
from levelhead.units import DEGREE

MILLI = 1e-3

# Unasked, ``tune`` searches four, of the body's motion and of the room. The rest is the sensor's noise (``levelhead
# noise`` measures it), what the filter learns while it runs, the start and the gates; all at once fit the log on which
# they were found (docs/tuning.md).


@parameters()
class ESKF(NamedTuple):
    """Error-state Kalman filter that learns its sensor while it runs: attitude, velocity, field and calibration."""

    gyr_noise: Annotated[
        float,
        Param(
            "(deg/s)/√Hz", "noise density of the rate", low=0.0, low_open=True, sweep=(0.005, 0.5), log=True, tune=False
        ),
    ] = 0.08
    gyr_share: Annotated[
        float,
        Param(
            "√s",
            "noise density of the rate, as a share of the rate",
            low=0.0,
            sweep=(5e-5, 0.005),
            log=True,
            tune=False,
        ),
    ] = 0.001
    bias_walk: Annotated[
        float, Param("(deg/s)/√s", "random walk of the bias", low=0.0, sweep=(1e-4, 0.1), log=True, tune=False)
    ] = 0.0035
    bias_start: Annotated[
        float,
        Param("deg/s", "1σ of the bias of a calibrated gyroscope", low=0.0, sweep=(0.05, 20.0), log=True, tune=False),
    ] = 0.2
    bias_raw: Annotated[
        float,
        Param(
            "deg/s",
            "1σ of the bias of a raw gyroscope, which the first seconds tell from a calibrated one; 0: none is raw",
            low=0.0,
            sweep=(0.5, 20.0),
            log=True,
            tune=False,
        ),
    ] = 6.0
    scale_start: Annotated[
        float,
        Param(
            "", "1σ of the gyroscope's scale and cross-axis factors", low=0.0, sweep=(1e-4, 0.05), log=True, tune=False
        ),
    ] = 0.003
    scale_walk: Annotated[
        float, Param("1/√s", "random walk of these", low=0.0, sweep=(1e-7, 1e-3), log=True, tune=False)
    ] = 1e-5
    acc_noise: Annotated[
        float,
        Param(
            "(m/s²)/√Hz",
            "noise density of specific force",
            low=0.0,
            low_open=True,
            sweep=(1e-3, 0.5),
            log=True,
            tune=False,
        ),
    ] = 0.03
    acc_bias: Annotated[
        float, Param("m/s²", "1σ of the accelerometer's bias", low=0.0, sweep=(1e-3, 0.5), log=True, tune=False)
    ] = 0.07
    acc_walk: Annotated[
        float, Param("(m/s²)/√s", "random walk of this bias", low=0.0, sweep=(1e-7, 1e-2), log=True, tune=False)
    ] = 2e-5
    speed: Annotated[
        float,
        Param(
            "(m/s)·√s", "density of a body's velocity about zero", low=0.0, low_open=True, sweep=(0.05, 5.0), log=True
        ),
    ] = 0.4
    speed_max: Annotated[
        float,
        Param(
            "(m/s)·√s",
            "largest density of velocity that is found from innovations",
            low=0.0,
            sweep=(0.1, 10),
            log=True,
            tune=False,
        ),
    ] = 1.4
    travel: Annotated[
        float,
        Param(
            "m/s", "1σ of the velocity that is fixed to the sensor, at the start", low=0.0, sweep=(0.05, 5), log=True
        ),
    ] = 0.7
    travel_time: Annotated[
        float,
        Param("s", "time constant of this velocity", low=0.0, low_open=True, sweep=(1, 100), log=True, tune=False),
    ] = 16.0
    mag_noise: Annotated[
        float,
        Param(
            "√s", "density of the field's error, as a share of it", low=0.0, low_open=True, sweep=(1e-3, 0.5), log=True
        ),
    ] = 0.025
    mag_place: Annotated[
        float,
        Param(
            "",
            "1σ by which the field of a place points aside of north, as a share of it",
            low=0.0,
            sweep=(1e-3, 0.1),
            log=True,
            tune=False,
        ),
    ] = 0.03
    place_time: Annotated[
        float,
        Param(
            "s", "time constant of being in one place", low=0.0, low_open=True, sweep=(1.0, 1e3), log=True, tune=False
        ),
    ] = 30.0
    mag_gate: Annotated[
        float,
        Param(
            "",
            "misfit of norm and dip, as a share of the field, that doubles this variance",
            low=0.0,
            low_open=True,
            sweep=(0.005, 0.5),
            log=True,
            tune=False,
        ),
    ] = 0.04
    field_gate: Annotated[
        float,
        Param(
            "",
            "departure of norm and dip from their mean over 20 s, as a share of the field, that doubles it once more",
            low=0.0,
            low_open=True,
            sweep=(0.01, 0.5),
            log=True,
        ),
    ] = 0.05
    field_walk: Annotated[
        float,
        Param(
            "1/√s",
            "random walk of the field's strength and dip, as a share of it",
            low=0.0,
            sweep=(0.01, 1.0),
            log=True,
            tune=False,
        ),
    ] = 0.15
    mag_offset: Annotated[
        float,
        Param(
            "",
            "1σ of the magnetometer's offset at the start, as a share of the field",
            low=0.0,
            sweep=(1e-3, 1.0),
            log=True,
            tune=False,
        ),
    ] = 0.015
    offset_walk: Annotated[
        float, Param("1/√s", "random walk of this offset", low=0.0, sweep=(1e-5, 0.05), log=True, tune=False)
    ] = 0.003
    mag_delay: Annotated[
        float,
        Param(
            "ms",
            "1σ of how much later than the gyroscope the magnetometer is",
            low=0.0,
            sweep=(1.0, 100.0),
            log=True,
            tune=False,
        ),
    ] = 15.0
    mag_time: Annotated[
        float,
        Param(
            "s",
            "a field that does not fit is taken for the earth's after",
            low=0.0,
            sweep=(1.0, 100.0),
            log=True,
            tune=False,
        ),
    ] = 20.0
    tilt_start: Annotated[
        float,
        Param("deg", "1σ of the tilt at the start", low=0.0, low_open=True, sweep=(0.5, 30.0), log=True, tune=False),
    ] = 3.0
    baro_walk: Annotated[
        float,
        Param(
            "m/√s",
            "random walk of the barometer's height, by weather and warming",
            low=0.0,
            sweep=(1e-3, 1.0),
            log=True,
            tune=False,
        ),
    ] = 0.03
    block: Annotated[
        float,
        Param(
            "s", "time between two corrections; 0: at every sample", low=0.0, sweep=(0.005, 0.5), log=True, tune=False
        ),
    ] = 0.12


def with_known_bias(params: ESKF, sigma: float) -> ESKF:
    """Parameters for a gyroscope whose bias was subtracted, to within 1σ of ``sigma`` rad/s."""
    return params._replace(bias_start=min(params.bias_start, sigma / DEGREE), bias_raw=0.0)
