"""A whole recording in one call: a motion, a sensor, a seed."""

from dataclasses import replace

from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.simulate.imu import Imu, Iron, observe
from levelhead.simulate.motion import STYLES
from levelhead.simulate.motion import motion as move
from levelhead.simulate.pose_sequence import poses_for
from levelhead.simulate.presets import imu

MOTIONS = (*STYLES, "poses")


def recording(
    sensor: str | Imu = "MPU-6050",
    motion: str = "hand",
    duration: float = 60.0,
    rate: float = 100.0,
    seed: int = 0,
    *,
    mag: str | None = None,
    iron: Iron | None = None,
) -> Recording:
    """The recording of a chip along a motion: ``levelhead simulate`` in Python.

    Args:
        sensor: a name of ``imu``, or an error model.
        motion: a style of ``motion``: "hand", "walking", "drone", "robot", "still", or "poses".
        duration: s.
        rate: samples a second, Hz.
        seed: zero or more; it picks the motion as well as the specimen of the chip, which is the same one for every
            motion, and its noise.
        mag: a magnetometer beside the chip, as in ``imu``.
        iron: hard and soft iron around the magnetometer.

    Returns:
        A Recording with truth.quat and truth.bias; ``meta`` has the arguments.

    Raises:
        LevelheadError: an unknown name (the nearest is named) or a value out of range.
    """
    if isinstance(sensor, str):
        sensor = imu(sensor, mag=mag, iron=iron)
    elif mag is not None or iron is not None:
        raise LevelheadError("an Imu has its own magnetometer and iron; expected a chip's name with mag and iron")
    truth = poses_for(duration, seed, rate) if motion == "poses" else move(seed, duration, rate, style=motion)
    observed = observe(truth, sensor, seed)
    return replace(observed, meta={**observed.meta, "motion": motion})
