"""The truth of a recording from the file of another system, such as motion capture: on its clock, in its axes."""

from dataclasses import replace

from levelhead.engine import smooth
from levelhead.errors import LevelheadError
from levelhead.evaluate.align.result import Alignment
from levelhead.evaluate.align.search import align
from levelhead.evaluate.align.series import OrientationSeries
from levelhead.recording import Recording, Truth
from levelhead.track import Track

MOST_RESIDUAL = 10.0  # °, RMS of the best 90 %: more is another body or another motion


def with_reference(recording: Recording, reference: Track) -> tuple[Recording, Alignment]:
    """The recording with an orientation of its body, measured by another system, as its truth.

    Its clock, its frames and the mounting of its body are unknown: they are those with which it fits the recording
    smoothed without a magnetometer. So a constant error of the mounting, and a constant heading, are not among the
    errors against it; north is not known.

    Args:
        recording: of the sensor.
        reference: the orientation, at any stamps in s; (m, 4) quaternions of any convention.

    Returns:
        The recording, and how its reference was aligned. The truth is NaN where the reference has none.

    Raises:
        LevelheadError: they share no time, or they are not of one motion.
    """
    smoothed = smooth(replace(recording, mag=None, truth=None))
    found = align(reference.t, reference.quat, smoothed.t, smoothed.quat)
    if found.trimmed > MOST_RESIDUAL:
        raise LevelheadError(
            f"the truth is off the smoothed recording by {found.trimmed:.0f}° in its best alignment; expected an "
            "orientation of the same body in the same motion"
        )
    moved = found.apply(reference)
    quat = OrientationSeries.from_samples("the reference", moved.t, moved.quat).at(recording.t)
    return replace(recording, truth=Truth(quat, north=False)), found
