"""The guard's parameters."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import nonnegative, parameters


@parameters()
class Guard(NamedTuple):
    """Thresholds of rest, saturation and disturbance; the defaults need no thought."""

    gyr_range: Annotated[float, nonnegative("deg/s", "full scale of the gyroscope; 0: found when it clips")] = 0.0
    acc_range: Annotated[float, nonnegative("m/s²", "full scale of the accelerometer; 0: found when it clips")] = 0.0
    rest_gyr: Annotated[float, nonnegative("deg/s", "rest: rate off its mean, at most", 0.2, 10.0)] = 2.0
    rest_acc: Annotated[float, nonnegative("m/s²", "rest: specific force off its mean, at most", 0.05, 3.0)] = 0.5
    rest_time: Annotated[float, nonnegative("s", "rest: for so long", 0.3, 5.0)] = 1.5
    bias_limit: Annotated[float, nonnegative("deg/s", "rest: a mean rate beyond is a turn", 0.5, 20.0)] = 15.0
    acc_gate: Annotated[float, nonnegative("m/s²", "accelerating: | |a| − g |, more than", 1.0, 300.0)] = 100.0
    acc_angle: Annotated[float, nonnegative("deg", "accelerating: and so far from the vertical", 1.0, 90.0)] = 20.0
    acc_time: Annotated[float, nonnegative("s", "accelerating: used again after", 0.1, 10.0)] = 2.0
    mag_gate: Annotated[float, nonnegative("", "disturbed: norm off the learned one by this share", 0.02, 1.0)] = 0.1
    mag_angle: Annotated[float, nonnegative("deg", "disturbed: or dip off the learned one", 1.0, 90.0)] = 10.0
    mag_time: Annotated[float, nonnegative("s", "disturbed: after so long it counts", 1.0, 100.0)] = 20.0
    iron: Annotated[
        float, nonnegative("", "raw magnetometer: offset from this share of the field; 0: kept", 0.1, 2.0)
    ] = 0.5
