"""``levelhead align A B``: the difference of two orientations of one motion, in conventions, mounting and time."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.options import Reading, print_json, print_line
from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.track import Track


def align(
    estimate: Annotated[Path, Parameter(name="A")],
    reference: Annotated[Path, Parameter(name="B")],
    /,
    *,
    track: Annotated[tuple[str, ...], Parameter(negative="", metavar="COLUMN")] = (),
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Find convention, mounting, frames and delay that make the orientation in A that in B.

    A log with quaternion columns needs --track COLUMN; a log of readings is smoothed first, without its magnetometer.

    Args:
        estimate: A log or a result of `levelhead fuse`, in any convention; FILE.c3d:MARKER,MARKER,MARKER or
            FILE.sto:SENSOR.
        reference: A log or a result as well: quaternion wxyz, sensor to earth, ENU.
        track: Quaternion columns, such as ahrs_q: once for both logs, or once for each.
        json: Print the alignment as JSON.
    """
    from levelhead.evaluate.align.search import align as search

    if len(track) > 2:
        raise LevelheadError("--track names columns of A and of B; give it at most twice")
    columns = (track * 2)[:2] if track else ("", "")
    first, second = (
        orientation_of(log, column, reading) for log, column in zip((estimate, reference), columns, strict=True)
    )
    found = search(first.t, first.quat, second.t, second.quat)
    if json:
        print_json(found.to_dict())
    else:
        print_line(str(found))


def orientation_of(log: Path, column: str, reading: Reading) -> "Track":
    """The orientation in a file: of a segment that it names, its quaternion columns, or its readings smoothed without a
    magnetometer."""
    from dataclasses import replace

    from levelhead.engine import smooth
    from levelhead.publish.progress import progress
    from levelhead.sources.tracks.named_track import named_track

    if (known := named_track(log)) is not None:
        return known
    if column:
        return reading.orientation(log, column)
    with progress(f"smoothing {log.name}") as report:
        return smooth(replace(reading.read(log), mag=None), progress=report)
