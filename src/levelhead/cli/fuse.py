"""``levelhead fuse LOG``: the main job."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.options import (
    FilterName,
    FromFile,
    GuardWords,
    Reading,
    can_draw,
    folder,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    print_written,
    read_parameters,
    read_prior,
    require_self_calibration,
    require_writable,
)
from levelhead.errors import LevelheadError, require
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.open_types import Fields, ReadOnlyFields

if TYPE_CHECKING:
    from levelhead.calibration import Calibration
    from levelhead.evaluate import Score
    from levelhead.recording import Recording
    from levelhead.track import Track

MANY = 1_000_000  # rows from which CSV is the slow way


def find_logs(given: Sequence[Path]) -> list[Path]:
    """The logs that were named, and those in folders that were; a folder with a file per sensor is one log.

    Raises:
        LevelheadError: none at all, one that is not there, or a folder without any.
    """
    if not given:
        raise LevelheadError("there is no log; give a file, several, or a folder: levelhead fuse LOG -o DIR")
    logs: list[Path] = []
    for path in given:
        if path.is_dir():
            from levelhead.sources.formats import BY_SUFFIX, CONTAINERS
            from levelhead.sources.pipeline import is_one_recording

            if is_one_recording(path):
                logs.append(path)
                continue
            known = (*BY_SUFFIX, *CONTAINERS)
            inside = [one for one in sorted(path.iterdir()) if one.suffix.lower() in known and not _is_result(one)]
            if not inside:
                raise LevelheadError(
                    f"there is no log in the folder {path}; expected files ending in {' '.join(known)}"
                )
            logs += inside
        else:
            logs.append(path)
    return logs


def _is_result(path: Path) -> bool:
    """Whether a file is what an earlier run has written."""
    return path.stem.endswith(("-track", "-noise", "-calibration", "tuned"))


def result_names(logs: Sequence[Path]) -> list[str]:
    """What the results of each log are called: its own name, with its folder's where two logs have the same."""
    stems = [log.stem for log in logs]
    names = [f"{log.resolve().parent.name}-{log.stem}" if stems.count(log.stem) > 1 else log.stem for log in logs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise LevelheadError(f"two logs would be written to {twice}-track; fuse them into folders of their own")
    return names


@dataclass(frozen=True)
class Wish:
    """All that was asked for, checked before the first log is read."""

    params: Params
    named: bool  # the filter, or a parameter of it
    guard: Guard | None
    guard_words: Sequence[str]
    declination: float | None
    format: str
    plot: bool
    offline: bool
    known: "Calibration | None"
    save_calibration: Path | None
    reading: Reading
    quiet: bool
    output_rate: float | None  # Hz


class FusionResult(NamedTuple):
    """One log, fused and written."""

    recording: "Recording"
    track: "Track"
    score: "Score | None"
    guard: Guard | None
    written: list[Path]
    rows: int  # of the track in its file


def fuse(
    *logs: Path,
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    guard: GuardWords = (),
    declination: Annotated[float | None, Parameter(metavar="DEG")] = None,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="DIR")] = Path(),
    format: Literal["csv", "parquet"] = "csv",
    output_rate: Annotated[float | None, Parameter(metavar="HZ")] = None,
    plot: bool = True,
    offline: Annotated[bool, Parameter(negative="")] = False,
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    save_calibration: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    tuned: FromFile = None,
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    verbose: Annotated[bool, Parameter(name=["--verbose", "-v"], negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Fuse logs into orientation: writes each track and a picture, prints a summary; of several logs, one table.

    Args:
        logs: .csv, .tsv, .jsonl, .mat, .h5, .npz or .parquet with gyroscope and accelerometer, or a folder of such
            files; units and columns are found. The black box of a node, .mcap, is fused as the node did it, unless a
            filter is named. Of several logs, one that fails is named and the others go on; the exit code is then 2.
        set: a parameter of the filter, such as acc_tau=3; may be given several times.
        declination: degrees from true to magnetic north at the place and time of the log, positive east: the track is
            then relative to true north.
        out: folder for the results LOG-track.csv and LOG-track.png.
        format: of the track; above a million rows parquet is written and read in a tenth of the time.
        output_rate: rows a second that are written, at most: of each period of 1/HZ s the first sample, as it is in the
            whole track. The filter takes every sample all the same; summary and picture show all.
        plot: draw the picture (needs the extra levelhead[plot]), and for a filter that learns its sensor how it did,
            LOG-calibration.png.
        offline: smooth: every instant uses the whole recording (filter ESKF).
        prior: the calibration of the same sensor from an earlier --save-calibration: the run starts with it.
        save_calibration: file for the calibration of the sensor from this run, with its 1σ, as JSON.
        noise: the sensor's noise as `levelhead noise` has written it: Q and R of an ESKF, EKF or Kalman; --set comes
            on top.
        verbose: print every parameter, every learned number, every kind of fault and every note.
        json: print the summary as JSON, with all parameters and all learned numbers.
    """
    chosen = find_logs(logs)
    found = read_parameters(tuned, filter)
    params, before = parse_filter(filter, set, offline, noise, found), parse_guard(guard, found)
    if declination is not None:
        from levelhead.track import declination_angle

        declination_angle(declination)
    if output_rate is not None:
        from levelhead.publish.output_rate import OutputRate

        OutputRate(output_rate)
    if save_calibration is not None:
        require_self_calibration(params, "--save-calibration")
        if len(chosen) > 1:
            raise LevelheadError("--save-calibration names one file for one sensor; give one log with it")
    require_writable(out)
    if format == "parquet":
        require("pyarrow", "writing Parquet", "formats")
    wish = Wish(
        params, filter is not None or bool(set) or not (noise is None and tuned is None), before, guard, declination,
        format, plot, offline, read_prior(prior, params), save_calibration, reading, json, output_rate,
    )  # fmt: skip
    if len(chosen) > 1:
        fuse_several(chosen, out, wish, verbose)
        return
    from levelhead.sources.chunked import NeedsWholeLog, is_long

    if is_long(chosen[0]):
        from levelhead.cli.long_log import fuse_long_log

        with suppress(NeedsWholeLog):
            fuse_long_log(chosen[0], out, wish)
            return
    done = _fuse_one(chosen[0], out, chosen[0].stem, wish)
    if json:
        print_json(_facts(done))
        return
    from levelhead.inspection import short_form
    from levelhead.publish.summary import summary

    notes = tuple(done.recording.meta.get("notes", ()))
    print_line(summary(done.recording, done.track, done.score, done.guard, verbose=verbose, notes=notes))
    for line in short_form(done.recording):
        print_line(f"doctor: {line}")
    if output_rate is not None:
        print_line(f"rows          {done.rows:,} written, at {output_rate:g} Hz")
    print_written(done.written, plot)
    if format == "csv" and done.rows > MANY:
        print_line(f"{done.rows:,} rows are large for CSV: --format parquet writes and reads them much faster")


def _facts(done: FusionResult) -> Fields:
    from levelhead.publish.summary import facts

    said = facts(done.recording, done.track, done.score, done.guard)
    return said | {"rows": done.rows, "written": [str(path) for path in done.written]}


def fuse_several(logs: Sequence[Path], out: Path, wish: Wish, verbose: bool) -> None:
    """Each log for itself; then a table of all.

    Raises:
        LevelheadError: at least one failed; the others are done.
    """
    from levelhead.evaluate.text_table import Column, Row, plain_table

    names, failed, said = result_names(logs), list[str](), list[Fields]()
    rows: list[Row] = []
    for log, name in zip(logs, names, strict=True):
        try:
            done = _fuse_one(log, out, name, wish)
        except (LevelheadError, OSError) as error:
            failed.append(f"{log}: {' '.join(str(error).split())}")
            rows.append({"log": str(log), "filter": "failed", "samples": None, "seconds": None, "error": None})
            said.append({"log": str(log), "error": str(error)})
            continue
        row: Row = {
            "log": str(log),
            "filter": done.track.name,
            "samples": float(len(done.track)),
            "seconds": float(done.recording.t[-1] - done.recording.t[0]),
            "error": None if done.score is None else done.score.total,
        }
        rows.append(row)
        said.append({"log": str(log)} | _facts(done))
    if wish.quiet:
        print_json({"logs": said})
    else:
        columns = [
            Column("log", "log"),
            Column("filter", "filter"),
            Column("samples", "samples", digits=0),
            Column("seconds", "duration", "s", 1),
            Column("error", "total error", "°", 2),
        ]
        print_line(plain_table(columns, rows))
        if len(failed) < len(logs):
            print_line(f"written to {out}: LOG-track.{wish.format}{' and pictures' if wish.plot else ''}")
    if failed:
        raise LevelheadError(f"{len(failed)} of {len(logs)} logs failed: {'; '.join(failed)}")


def _fuse_one(log: Path, out: Path, name: str, wish: Wish) -> FusionResult:
    """Reads, fuses and writes one log."""
    from levelhead.publish.progress import progress

    with progress(f"reading {log.name}"):
        recording = wish.reading.read(log)
    params, guard = wish.params, wish.guard
    if "live" in recording.meta and not wish.named:
        params, guard = node_filter(recording.meta["live"], guard, wish.guard_words)
    if wish.declination is not None:
        require_north(recording, params)
    from levelhead.engine import fuse as forward
    from levelhead.engine import smooth
    from levelhead.publish.writers import write_track

    with progress("smoothing" if wish.offline else "fusing") as report:
        run = smooth if wish.offline else forward
        track = run(recording, params, guard=guard, prior=wish.known, progress=report)
    score = None
    if recording.truth is not None:
        from levelhead.evaluate import evaluate

        score = evaluate(recording, track)  # a reference counts as relative to magnetic north, like the filter
    if wish.declination is not None:
        track = track.to_true_north(wish.declination)
    target = folder(out) / f"{name}-track.{wish.format}"
    with progress(f"writing {target.name}") as report:
        shown = _at_output_rate(track, wish)
        write_track(shown, target, report)
    written = [target]
    if wish.plot and can_draw():
        written += _pictures(recording, track, params, guard, wish.known, out / name)
    if wish.save_calibration is not None and track.calibration is not None:
        track.calibration.save(wish.save_calibration)
        written.append(wish.save_calibration)
    return FusionResult(recording, track, score, guard, written, len(shown))


def _at_output_rate(track: "Track", wish: Wish) -> "Track":
    """The rows of a track that are written."""
    if wish.output_rate is None:
        return track
    from levelhead.publish.output_rate import OutputRate

    reduced = OutputRate(wish.output_rate).reduce(track)
    assert reduced is not None  # it has its first row
    return reduced


def node_filter(live: ReadOnlyFields, guard: Guard | None, words: Sequence[str]) -> tuple[Params, Guard | None]:
    """The filter and the guard with which a black box was made; thresholds in words win."""
    params = filters.find(live["filter"]).params(**live["params"])
    if words:
        return params, guard
    return params, None if live["guard"] is None else Guard(**live["guard"])


def require_north(recording: "Recording", params: Params) -> None:
    """Makes sure that heading is relative to a north that can be corrected."""
    flt = filters.of(params)
    why = f"{flt.name} does not follow the magnetometer" if "heading" not in flt.estimates else ""
    why = "there is no magnetometer" if recording.mag is None else why
    if why:
        raise LevelheadError(f"--declination turns magnetic north, but {why}: heading is relative; leave it out")


def _pictures(
    recording: "Recording",
    track: "Track",
    params: Params,
    guard: Guard | None,
    known: "Calibration | None",
    stem: Path,
) -> list[Path]:
    """Draws the track, and how the filter got to know its sensor."""
    from levelhead.publish.plots import calibration_picture, track_picture
    from levelhead.publish.progress import progress

    with progress("drawing"):
        written = [stem.with_name(f"{stem.name}-track.png")]
        track_picture(recording, track, written[0])
        if track.calibration is not None:
            from levelhead.engine.calibration_history import calibration_history

            written.append(stem.with_name(f"{stem.name}-calibration.png"))
            calibration_picture(calibration_history(recording, params, guard=guard, prior=known), written[1])
    return written
