"""``levelhead convert LOG|TRACK|BOX -o FILE``: the same readings and orientation in another format."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from levelhead.cli.options import Reading, print_json, print_line
from levelhead.errors import LevelheadError, nearest

if TYPE_CHECKING:
    from levelhead.recording import Array, Recording
    from levelhead.track import Track

BAGS = (".mcap", ".bag", ".db3")
SUFFIXES = (*BAGS, ".parquet", ".csv", ".npz", ".rrd", ".sto")


def convert(
    log: Path,
    /,
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="FILE")],
    track: Annotated[str | None, Parameter(metavar="COLUMN")] = None,
    motion: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Convert a log, a track of `levelhead fuse` or the black box of a node into another format.

    Args:
        log: The log, as for `levelhead fuse`.
        out: File to write: .mcap, .db3 (ROS 2) and .bag (ROS 1) hold sensor_msgs; .parquet and .csv hold a table; .npz
            keeps all bits; .rrd is for rerun; .sto (OpenSim) holds an orientation alone.
        track: Quaternion columns of the log that hold its orientation, such as q or ahrs_q.
        motion: Write specific force, accelerations without gravity and rate without bias as well, each with its 1σ, as
            `levelhead fuse --motion` does.
        json: Print the result as JSON.
    """
    suffix = out.suffix.lower()
    if suffix not in SUFFIXES:
        raise LevelheadError(f"cannot write {out}: {nearest(suffix or out.name, SUFFIXES)}")
    recording, orientation = _read(log, reading, track)
    found = _motion(recording, orientation, suffix) if motion else None
    _write(recording, orientation, out, suffix, found)
    if json:
        facts = {"samples": len(recording), "rate_hz": recording.rate, "orientation": orientation is not None}
        print_json(facts | {"written": [str(out)]})
        return
    print_line(f"{recording}{' with an orientation' if orientation is not None else ''}")
    print_line(f"written: {out}")


def _read(log: Path, reading: Reading, column: str | None) -> "tuple[Recording, Track | None]":
    """The recording, and the orientation in it: the node's in a black box, or the columns that are named."""
    from levelhead.track import Track

    recording = reading.read(log)
    if column is not None:
        return recording, reading.orientation(log, column)
    if "live" in recording.meta:
        from levelhead.sources.formats.blackbox import FUSED, read_box

        rows = read_box(log).rows
        rows = rows[(rows["flags"] & FUSED) > 0]
        return recording, Track(rows["t"], rows["quat"], rows["bias"], rows["sigma"], rows["health"])
    if recording.truth is not None:
        return recording, Track(recording.t, recording.truth.quat)
    return recording, None


def _motion(recording: "Recording", track: "Track | None", suffix: str) -> "Track":
    """The track with its readings.

    Raises:
        LevelheadError: there is no orientation, it has other stamps, or the format has no place for its motion.
    """
    if track is None:
        raise LevelheadError("--motion needs an orientation, and the log has none; name its columns: --track q")
    if suffix == ".sto":
        raise LevelheadError("a .sto file holds an orientation alone; leave --motion out, or write .csv")
    if not np.array_equal(track.t, recording.t):
        raise LevelheadError("--motion needs an orientation at every sample; fuse the log: levelhead fuse LOG --motion")
    return replace(track, readings=recording)


def _write(recording: "Recording", track: "Track | None", out: Path, suffix: str, moved: "Track | None" = None) -> None:
    """Writes the file, by its suffix; ``moved`` is the track whose motion is written too."""
    from levelhead.publish.writers import motion_columns, motion_series

    if suffix in BAGS:
        from levelhead.sources.formats.rosbag import write_bag

        write_bag(recording, out, track, None if moved is None else motion_series(moved))
    elif suffix == ".rrd":
        from levelhead.publish.rerun_file import write_rerun

        write_rerun(recording, track, out, {} if moved is None else motion_series(moved))
    elif suffix == ".sto":
        from levelhead.publish.opensim import write_sto

        if track is None:
            raise LevelheadError(f"{out} holds an orientation, and the log has none; name its columns: --track q")
        write_sto(track, out)
    elif suffix == ".npz":
        from levelhead.sources.formats.npz import write_npz

        write_npz(recording, out, {} if moved is None else motion_columns(moved))
    else:
        _write_table(recording, track, out, suffix, {} if moved is None else motion_columns(moved))


def _write_table(
    recording: "Recording", track: "Track | None", out: Path, suffix: str, more: "Mapping[str, Array]"
) -> None:
    """Time, readings in SI units and the orientation as columns."""
    from levelhead.publish.tables import write_table

    columns = {"t [s]": recording.t}
    for name, unit, values in (("gyr", "rad/s", recording.gyr), ("acc", "m/s²", recording.acc)):
        columns |= {f"{name}_{axis} [{unit}]": values[:, i] for i, axis in enumerate("xyz")}
    if recording.mag is not None:
        columns |= {f"mag_{axis} [µT]": recording.mag[:, i] for i, axis in enumerate("xyz")}
    if track is not None:
        columns |= {f"q{axis}": track.quat[:, i] for i, axis in enumerate("wxyz")}
        if track.sigma is not None:
            names = ("east", "north", "up")
            columns |= {f"sigma_{axis} [rad]": track.sigma[:, i] for i, axis in enumerate(names)}
    columns |= more
    write_table({name: np.ascontiguousarray(values) for name, values in columns.items()}, out, suffix)
