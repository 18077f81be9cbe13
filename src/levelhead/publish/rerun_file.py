"""A recording and its orientation as a file of the viewer rerun (.rrd)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.motion import VectorSeries
from levelhead.open_types import Untyped
from levelhead.recording import Array, Recording
from levelhead.track import Track

NOTHING_MORE: Mapping[str, VectorSeries] = {}


def write_rerun(
    recording: Recording, track: Track | None, path: Path, motion: Mapping[str, VectorSeries] = NOTHING_MORE
) -> None:
    """Curves of the readings in rad/s, m/s² and µT, and of the orientation in ° with the body that it turns.

    ``motion``: further curves by name, as ``motion_series`` gives them, with their σ.

    Raises:
        LevelheadError: rerun is not installed, or the file cannot be written.
    """
    try:
        import rerun
    except ImportError:
        raise LevelheadError("a file for rerun needs its library: pip install 'levelhead[rerun]'") from None
    with atomic_path(path) as temporary:
        stream = rerun.RecordingStream("levelhead")
        stream.save(temporary)
        _add(rerun, stream, "gyr", recording.t, recording.gyr, "xyz")
        _add(rerun, stream, "acc", recording.t, recording.acc, "xyz")
        if recording.mag is not None:
            _add(rerun, stream, "mag", recording.t, recording.mag, "xyz")
        if track is not None:
            _add(rerun, stream, "angles", track.t, track.euler(), ("roll", "pitch", "yaw"))
            time = rerun.TimeColumn("time", duration=track.t)
            turns = rerun.Transform3D.columns(quaternion=track.quat[:, [1, 2, 3, 0]])
            stream.log("body", rerun.Boxes3D(half_sizes=[0.45, 0.3, 0.075]), static=True)
            stream.send_columns("body", indexes=[time], columns=turns)
        for name, series in motion.items():
            _add(rerun, stream, name, recording.t, series.value, "xyz")
            if series.sigma is not None:
                _add(rerun, stream, f"sigma_{name}", recording.t, series.sigma, "xyz")
        stream.flush()
        stream.disconnect()


def _add(rerun: Untyped, stream: Untyped, name: str, t: Array, values: Array, axes: str | tuple[str, ...]) -> None:
    """A curve per axis; missing values are left out."""
    for i, axis in enumerate(axes):
        known = np.isfinite(values[:, i])
        time = rerun.TimeColumn("time", duration=t[known])
        stream.send_columns(f"{name}/{axis}", indexes=[time], columns=rerun.Scalars.columns(scalars=values[known, i]))
