"""From a live source to the recording of a guided calibration."""

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from levelhead.calibrate.next_pose import POSES, Guide, Instruction
from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.sample import Sample
from levelhead.sources.devices.source import Source
from levelhead.units import GRAVITY

GIVE_UP = 5.0  # s without a reading
PAUSE = 0.005  # s between two questions to a source that has nothing new


def record_poses(
    source: Source,
    show: Callable[[Instruction], None],
    *,
    gravity: float = GRAVITY,
    poses: int = POSES,
    give_up: float = GIVE_UP,
) -> Recording:
    """Guides through poses until they show every number, or a replay ends.

    Args:
        source: a live source that has not been started; it is closed in the end.
        show: called with what to do now, after every poll.
        gravity: m/s² at the place.
        poses: how many at least.
        give_up: s without a reading after which the source is refused.

    Returns:
        Everything that was read, for ``calibrate_sensor``.

    Raises:
        LevelheadError: no reading for ``give_up`` s, the same reading all the time, or a source that fails.
    """
    with ThreadPoolExecutor(1) as executor:
        guide = Guide(executor, gravity, poses)
        try:
            source.start()
            heard = time.monotonic()
            while True:
                samples = [sample for sample in source.poll() if _is_whole(sample)]
                if samples:
                    guide.add(samples)
                    heard = time.monotonic()
                instruction = guide.instruction()
                show(instruction)
                if instruction.done or (source.ended and not samples):
                    return guide.recording()
                if time.monotonic() - heard > give_up:
                    raise LevelheadError(
                        f"{source.name} gave no reading for {give_up:g} s; expected samples of gyroscope and "
                        "accelerometer: check that it is connected and sends"
                    )
                if not samples:
                    time.sleep(PAUSE)
        finally:
            source.close()


def _is_whole(sample: Sample) -> bool:
    """Whether both inertial sensors sent readings."""
    return math.isfinite(sum(sample.gyr) + sum(sample.acc))
