"""Parameters of ``ESKF``."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import Param, nonnegative, parameters, positive
from levelhead.units import DEGREE

MILLI = 1e-3

# By default ``tune`` searches four, of the body's motion and of the room. The rest is the sensor's noise (``levelhead
# noise`` measures it), the errors that the filter learns, the start and the gates; all at once fit the log on which
# they were found (docs/howto/tuning.md).


@parameters(tuned=("velocity_density", "body_velocity", "mag_noise", "mag_place"))
class ESKF(NamedTuple):
    """Error-state Kalman filter that learns its sensor while it runs: attitude, velocity, field and calibration."""

    gyr_noise: Annotated[float, positive("(deg/s)/√Hz", "noise density of the rate", 0.005, 0.5)] = 0.08
    gyr_noise_per_rate: Annotated[float, nonnegative("√s", "noise density of the rate, per rate", 5e-5, 0.005)] = 0.001
    bias_walk: Annotated[float, nonnegative("(deg/s)/√s", "random walk of the bias", 0.0001, 0.1)] = 0.0035
    bias_start: Annotated[float, nonnegative("deg/s", "1σ of the bias of a calibrated gyroscope", 0.05, 20.0)] = 0.2
    bias_uncalibrated: Annotated[
        float, nonnegative("deg/s", "1σ of a raw gyroscope's bias; 0: none is raw", 0.5, 20.0)
    ] = 6.0
    scale_start: Annotated[float, nonnegative("", "1σ of the gyroscope's scale and cross-axis", 1e-4, 0.05)] = 0.003
    scale_walk: Annotated[float, nonnegative("1/√s", "random walk of these", 1e-07, 0.001)] = 1e-5
    acc_noise: Annotated[float, positive("(m/s²)/√Hz", "noise density of specific force", 0.001, 0.5)] = 0.03
    acc_bias: Annotated[float, nonnegative("m/s²", "1σ of the accelerometer's bias", 0.001, 0.5)] = 0.07
    acc_walk: Annotated[float, nonnegative("(m/s²)/√s", "random walk of this bias", 1e-07, 0.01)] = 2e-5
    velocity_density: Annotated[float, positive("(m/s)·√s", "density of a body's velocity about zero", 0.05, 5.0)] = 0.4
    max_velocity_density: Annotated[
        float, nonnegative("(m/s)·√s", "largest density found for this velocity", 0.1, 10.0)
    ] = 1.4
    body_velocity: Annotated[float, nonnegative("m/s", "1σ of a velocity fixed to the sensor, at first", 0.05, 5.0)] = (
        0.7
    )
    body_velocity_time: Annotated[float, positive("s", "time constant of this velocity", 1, 100)] = 16.0
    mag_noise: Annotated[float, positive("√s", "least density of the field's changes, relative", 0.001, 0.5)] = 0.04
    mag_place: Annotated[float, nonnegative("", "1σ of a place's part of the field at first", 1e-3, 0.1)] = 0.01
    place_time: Annotated[float, positive("s", "time constant of being in one place", 1.0, 1000.0)] = 60.0
    mag_offset: Annotated[float, nonnegative("", "1σ of the magnetometer's offset, relative", 1e-3, 3.0)] = 1.0
    offset_walk: Annotated[float, nonnegative("1/√s", "random walk of this offset", 1e-05, 0.05)] = 0.0005
    soft_iron: Annotated[float, nonnegative("", "1σ of the magnetometer's soft iron", 1e-3, 0.3)] = 0.03
    field_strength: Annotated[
        float, nonnegative("µT", "strength of the earth's field at the place; 0: unknown", 22.0, 67.0)
    ] = 0.0
    field_dip: Annotated[
        float, Param("deg", "dip of this field, below the horizon", low=-90.0, high=90.0, sweep=(-90.0, 90.0))
    ] = 0.0
    field_sigma: Annotated[
        float, positive("", "1σ of a part of it by buildings and ground, share of the strength", 0.01, 0.5)
    ] = 0.15
    mag_delay: Annotated[float, nonnegative("ms", "1σ of the magnetometer's delay", 1.0, 100.0)] = 15.0
    north_rate: Annotated[
        float, nonnegative("deg/s", "largest rate at which it turns to north; 0: never", 0.1, 100.0)
    ] = 0.0
    tilt_start: Annotated[float, positive("deg", "1σ of the tilt at the start", 0.5, 30.0)] = 3.0
    baro_walk: Annotated[float, nonnegative("m/√s", "random walk of the barometer's height", 1e-3, 1.0)] = 0.03
    block: Annotated[float, nonnegative("s", "time between two corrections; 0: at every sample", 0.005, 0.5)] = 0.12


def with_known_bias(params: ESKF, sigma: float) -> ESKF:
    """Parameters for a gyroscope whose bias was subtracted, to within 1σ of ``sigma`` rad/s."""
    return params._replace(bias_start=min(params.bias_start, sigma / DEGREE), bias_uncalibrated=0.0)


def with_known_field(params: ESKF, strength: float, dip: float) -> ESKF:
    """Parameters with the earth's field of the place as a prior: its strength in µT and its dip in degrees."""
    return params._replace(field_strength=strength, field_dip=dip)
