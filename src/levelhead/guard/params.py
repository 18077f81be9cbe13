"""The guard's parameters."""

from typing import Annotated, NamedTuple

from levelhead.filters.parameters import Param, parameters


@parameters()
class Guard(NamedTuple):
    """What counts as rest, as saturation and as disturbance; the defaults need no thought."""

    gyr_range: Annotated[float, Param("deg/s", "full scale of the gyroscope; 0: found when it clips", low=0.0)] = 0.0
    acc_range: Annotated[float, Param("m/s²", "full scale of the accelerometer; 0: found when it clips", low=0.0)] = 0.0
    rest_gyr: Annotated[
        float, Param("deg/s", "rest: rate off its mean, at most", low=0.0, sweep=(0.2, 10.0), log=True)
    ] = 2.0
    rest_acc: Annotated[
        float, Param("m/s²", "rest: specific force off its mean, at most", low=0.0, sweep=(0.05, 3.0), log=True)
    ] = 0.5
    rest_time: Annotated[float, Param("s", "rest: for so long", low=0.0, sweep=(0.3, 5.0), log=True)] = 1.5
    bias_limit: Annotated[
        float,
        Param("deg/s", "rest: a mean rate beyond this is a turn and no bias", low=0.0, sweep=(0.5, 20.0), log=True),
    ] = 15.0
    acc_gate: Annotated[
        float, Param("m/s²", "accelerating: | |a| − g |, more than", low=0.0, sweep=(1.0, 300.0), log=True)
    ] = 100.0
    acc_angle: Annotated[
        float,
        Param("deg", "accelerating: and so far from the predicted vertical", low=0.0, sweep=(1.0, 90.0), log=True),
    ] = 20.0
    acc_time: Annotated[
        float, Param("s", "accelerating: believed again after", low=0.0, sweep=(0.1, 10.0), log=True)
    ] = 2.0
    mag_gate: Annotated[
        float, Param("", "disturbed: norm off the learned one by this share", low=0.0, sweep=(0.02, 1.0), log=True)
    ] = 0.1
    mag_angle: Annotated[
        float, Param("deg", "disturbed: or dip off the learned one", low=0.0, sweep=(1.0, 90.0), log=True)
    ] = 10.0
    mag_time: Annotated[
        float,
        Param("s", "disturbed: the new field is taken for the earth's after", low=0.0, sweep=(1.0, 100.0), log=True),
    ] = 20.0
