"""``levelhead compare LOG``: filters side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.calibrated_log import CalibrationFile, log_or_simulation
from levelhead.cli.options import (
    FILTERS,
    NO_PICTURE,
    OUT_FOLDER,
    FromFile,
    GuardWords,
    Reading,
    can_draw,
    column_names,
    filter_option,
    folder,
    parse_filter_spec,
    parse_guard,
    print_json,
    print_line,
    read_parameters,
    require_writable,
)
from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.evaluate import Alignment, Comparison
    from levelhead.recording import Recording
    from levelhead.track import Track

COLUMN = "column:"  # in front of the name of a column that holds one angle
LEAST_OVERLAP = 0.1  # of a recording; an orientation that covers less of it is on another clock


def compare(
    log: Path | None = None,
    /,
    *,
    simulate: Annotated[str | None, Parameter(metavar="WHAT")] = None,
    seed: int | None = None,
    filter: Annotated[
        tuple[str, ...],
        filter_option(
            f"{FILTERS}; with parameters if you like: -f Kalman:r_measure=4,q_bias=0.001 -f Complementary. "
            "All of them if none is named."
        ),
    ] = (),
    track: Annotated[
        tuple[str, ...],
        Parameter(
            name="--track",
            negative="",
            metavar="NAME",
            help="Also the orientation in the log's quaternion columns NAME, such as a vendor's own: ahrs_q for "
            "ahrs_qw … ahrs_qz, q for q0 … q3, an array (n, 4), or four names with commas. Order, inverse and NED are "
            "found and printed. column:NAME is one angle, such as column:board_roll: roll, pitch or yaw, in degrees or "
            "with rad in its name. May be given several times.",
        ),
    ] = (),
    truth: Annotated[str | None, Parameter(metavar="FILE:NAME")] = None,
    tuned: FromFile = None,
    calibration: CalibrationFile = None,
    guard: GuardWords = (),
    out: Annotated[Path | None, OUT_FOLDER] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Compare filters on one recording: errors, bias, lag and cost in a table, and the four-panel picture.

    Args:
        log: A recording; errors need a recording with truth. Orientations that the device itself computed get rows of
            their own: those of a chip or an autopilot in a black box, in .ulg, .bin and .tlog.
        simulate: Use a simulation instead of a log: lesson, hard (the lesson with 10° noise and a bias that walks 0.1
            °/s), or a motion (hand, walking, drone, robot, still) with an MPU-6050.
        seed: Seed of the simulation; 42 for the lessons, 0 otherwise.
        truth: The true orientation from another file, such as motion capture: FILE.c3d:MARKER,MARKER,MARKER of a rigid
            body, FILE.sto:SENSOR, or quaternion columns, mocap.csv:q. Clock, frames and mounting are found.
        out: Folder for the picture compare.png; without it, no picture is drawn.
        json: Print the table as JSON.
    """
    from levelhead import filters

    file = read_parameters(tuned, None)
    named = [parse_filter_spec(word) for word in filter]
    if file is not None:
        named.insert(0, file.params)
    chosen = named or [flt.params() for flt in filters.ALL]
    before = parse_guard(guard, file)
    if out is not None:
        require_writable(out)
    recording = log_or_simulation(log, simulate, seed, reading, calibration)
    recording, aligned = _with_truth(recording, truth)
    from levelhead.evaluate import compare as run
    from levelhead.evaluate.external_track import Angle
    from levelhead.publish.progress import progress
    from levelhead.publish.terminal_table import print_table
    from levelhead.sources import attitudes

    names = column_names(track)
    columns = [name for name in names if name.startswith(COLUMN)]
    own = {} if log is None else attitudes(log)
    tracks = {name: one for name, one in own.items() if _overlap(one, recording) > LEAST_OVERLAP}
    tracks |= {name: reading.orientation(log, name) for name in names if name not in columns}
    angles = {name: Angle(*reading.angle(log, name.removeprefix(COLUMN))) for name in columns}
    with progress("comparing") as report:
        comparison = run(recording, chosen, tracks=tracks, angles=angles, guard=before, progress=report)
    picture = _draw(comparison, out)
    if json:
        truth_facts = None if aligned is None else {"source": truth} | aligned.to_dict()
        print_json(comparison.to_dict() | {"truth": truth_facts, "written": [str(picture)] if picture else []})
        return
    print_table(comparison)
    if aligned is not None:
        print_line(f"Truth of {truth}, aligned with the smoothed recording: {aligned}")
    print_line(_picture_line(picture, out))


def _draw(comparison: "Comparison", out: Path | None) -> Path | None:
    """The picture in a folder; None without one, without truth or without the library."""
    if out is None or comparison.recording.truth is None or not can_draw():
        return None
    from levelhead.publish.plots import lesson_picture

    picture = folder(out) / "compare.png"
    lesson_picture(comparison, picture)
    return picture


def _with_truth(recording: "Recording", name: str | None) -> "tuple[Recording, Alignment | None]":
    """The recording with the orientation in another file as its truth, and how the two were aligned; None: its own."""
    if name is None:
        return recording, None
    from levelhead.evaluate.reference import with_reference
    from levelhead.publish.progress import progress

    reference = _read_truth(name)
    with progress("aligning the truth"):
        return with_reference(recording, reference)


def _read_truth(name: str) -> "Track":
    from levelhead.sources import orientation
    from levelhead.sources.tracks.named_track import named_track

    file, _, column = name.rpartition(":")
    if Path(name).is_file() or not file or not column:
        raise LevelheadError(
            f"--truth {name} names no orientation; expected FILE:COLUMN, such as mocap.csv:q, "
            "FILE.c3d:MARKER,MARKER,MARKER or FILE.sto:SENSOR"
        )
    return named_track(Path(name)) or orientation(file, column)


def _picture_line(picture: Path | None, out: Path | None) -> str:
    """Where the picture is, or why there is none."""
    if picture:
        return f"written: {picture}"
    if out is None:
        return "no picture asked for: -o DIR draws the four panels"
    if not can_draw():
        return NO_PICTURE
    return "no picture: the four panels need the true orientation; `levelhead fuse` draws a recording without one"


def _overlap(track: "Track", recording: "Recording") -> float:
    """The part of the recording in which the track is known."""
    both = min(track.t[-1], recording.t[-1]) - max(track.t[0], recording.t[0])
    return float(both) / max(recording.duration, 1e-9)
