"""``levelhead fuse LOG``: the main job."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from levelhead import filters
from levelhead.cli.calibrated_log import read_calibrated, read_without_iron
from levelhead.cli.fuse_options import BAGS, FuseArguments, FuseOptions, require_north
from levelhead.cli.options import Reading, can_draw, folder, print_json, print_line, print_written
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.open_types import JsonObject, ReadOnlyJson

if TYPE_CHECKING:
    from levelhead.calibration import Calibration
    from levelhead.evaluate import Score
    from levelhead.heave import Heave
    from levelhead.magnetic_model import EarthField
    from levelhead.recording import Array, Recording
    from levelhead.track import Track

CHUNKED = ("csv", "parquet")  # formats that are written part by part
MIN_SAMPLES = 10  # of which an orientation follows
MIN_SLOW_ROWS = 1_000_000  # rows from which CSV is the slow way


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
    """Whether a file is the result of an earlier run."""
    return path.stem.endswith(("-track", "-noise", "-calibration", "tuned"))


def result_names(logs: Sequence[Path]) -> list[str]:
    """The names of each log's results: the log's own, with its folder's where two logs have the same."""
    stems = [log.stem for log in logs]
    names = [f"{log.resolve().parent.name}-{log.stem}" if stems.count(log.stem) > 1 else log.stem for log in logs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise LevelheadError(f"two logs would be written to {twice}-track; fuse them into folders of their own")
    return names


class FusionResult(NamedTuple):
    """One log, fused and written."""

    recording: "Recording"
    track: "Track"
    score: "Score | None"
    guard: Guard | None
    written: list[Path]
    rows: int  # of the track in its file
    heave: "Heave | None" = None
    field: "EarthField | None" = None  # of the place


def fuse(*logs: Path, arguments: FuseArguments = FuseArguments()) -> None:  # noqa: B008
    """Fuse logs into orientation: writes each track and a picture and prints a summary, of several logs a table.

    Args:
        logs: .csv, .tsv, .jsonl, .mat, .h5, .npz or .parquet with gyroscope and accelerometer, or a folder of such
            files; - is standard input. Units and columns are detected. The black box of a node, .mcap, is fused as the
            node did it, heading included, unless a filter is named. If one of several logs fails, the others are fused
            all the same and the exit code is 2.
    """
    fuse_logs(logs, arguments, smooth=False)


def fuse_logs(given: Sequence[Path], arguments: FuseArguments, smooth: bool) -> None:
    """Fuse or smooth the logs that were named, and print a summary or a table.

    Raises:
        LevelheadError: there is no log, an option is wrong, or a log failed.
    """
    logs = find_logs(given)
    if arguments.dry_run:
        print_interpretations(logs, arguments.reading, "smooth" if smooth else "fuse", arguments.json)
        return
    options = arguments.check(smooth, len(logs))
    if options.reading.sensor == "all":
        fuse_sensors(logs, options)
        return
    if len(logs) > 1:
        fuse_several(logs, options)
        return
    from levelhead.sources.chunked import NeedsWholeLog, is_long

    if is_long(logs[0]) and options.calibration is None and options.format in CHUNKED and not options.needs_log:
        from levelhead.cli.long_log import fuse_long_log

        with suppress(NeedsWholeLog):
            fuse_long_log(logs[0], options)
            return
    done = _fuse_one(_read(logs[0], options), logs[0].stem, options)
    if options.as_json:
        print_json(_facts(done, options))
    else:
        _print_summary(done, options)


def print_interpretations(logs: Sequence[Path], reading: Reading, verb: str, as_json: bool) -> None:
    """Prints the reader's conclusions about logs, and the command line of a verb that leaves nothing to guess."""
    from levelhead.sources.pipeline import interpret

    found = [interpret(log, **reading.hints()) for log in logs]
    if as_json:
        print_json({"logs": [one.to_dict() | {"command": one.command(verb)} for one in found]})
        return
    for one in found:
        print_line("\n".join([one.source, *one.lines(), f"command  {one.command(verb)}"]))


def _print_summary(done: FusionResult, options: FuseOptions) -> None:
    from levelhead.inspection import short_form
    from levelhead.publish.summary import summary

    notes = tuple(done.recording.meta.get("notes", ()))
    print_line(summary(done.recording, done.track, done.score, done.guard, verbose=options.verbose, notes=notes))
    for line in short_form(done.recording):
        print_line(f"doctor: {line}")
    if options.mounting is not None:
        print_line(f"axes          of the body: the sensor's {options.mounting}")
    if options.frame != "ENU":
        print_line(f"frame         {options.frame} in the file; the angles above are in ENU")
    if done.heave is not None:
        print_line(f"heave         {done.heave.words()}")
    if done.field is not None:
        from levelhead.publish.field_sentence import field_sentence

        print_line(f"field         {field_sentence(done.field, done.recording, done.track)}")
    if options.output_rate is not None:
        print_line(f"rows          {done.rows:,} written, at {options.output_rate:g} Hz")
    print_written(done.written, options.plot)
    if options.format == "csv" and done.rows > MIN_SLOW_ROWS:
        print_line(f"{done.rows:,} rows are large for CSV: --format parquet writes and reads them much faster")


def _facts(done: FusionResult, options: FuseOptions) -> JsonObject:
    from levelhead.publish.summary import facts

    said = facts(done.recording, done.track, done.score, done.guard)
    said |= {"frame": options.frame, "axes": None if options.mounting is None else str(options.mounting)}
    if (heave := done.heave) is not None:
        said["heave"] = {"significant_height_m": heave.significant_height, "mean_period_s": heave.mean_period}
    return said | {"rows": done.rows, "written": [str(path) for path in done.written]}


def fuse_sensors(logs: Sequence[Path], options: FuseOptions) -> None:
    """Each sensor of each log for itself; then a table of all.

    Raises:
        LevelheadError: a log with one sensor only, or at least one failed; the others are done.
    """
    from levelhead.sources import sensor_names

    for log in logs:
        found = sensor_names(log)
        if len(found) < 2:
            raise LevelheadError(f"{log} has no names of several sensors in its columns; leave --sensor all out")
        chosen = [replace(options, reading=replace(options.reading, sensor=name)) for name in found]
        fuse_several([log] * len(found), options, [f"{log.stem}-{name}" for name in found], chosen)


def fuse_several(
    logs: Sequence[Path],
    options: FuseOptions,
    names: Sequence[str] | None = None,
    each: Sequence[FuseOptions] | None = None,
) -> None:
    """Each log for itself; then a table of all.

    Args:
        logs: files; one may stand there for each of its sensors.
        options: of the table.
        names: of the results; None: those of the logs.
        each: the options of each log; None: ``options``.

    Raises:
        LevelheadError: at least one failed; the others are done.
    """
    from levelhead.evaluate.text_table import Column, Row, plain_table

    names = result_names(logs) if names is None else names
    failed, said = list[str](), list[JsonObject]()
    rows: list[Row] = []
    for log, name, own in zip(logs, names, each or [options] * len(logs), strict=True):
        done = _fuse_or_explain(log, name, own)
        if isinstance(done, str):
            failed.append(done)
            rows.append({"log": str(log), "filter": "failed", "samples": None, "seconds": None, "error": None})
            said.append({"log": str(log), "error": done})
            continue
        row: Row = {
            "log": str(log) if each is None else name,
            "filter": done.track.name,
            "samples": float(len(done.track)),
            "seconds": float(done.recording.t[-1] - done.recording.t[0]),
            "error": None if done.score is None else done.score.total,
        }
        rows.append(row)
        said.append({"log": str(log)} | _facts(done, options))
    if options.as_json:
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
            print_line(f"written to {options.out}: LOG-track.{options.format}{' and pictures' if options.plot else ''}")
    if failed:
        raise LevelheadError(f"{len(failed)} of {len(logs)} logs failed: {'; '.join(failed)}")


def _read(log: Path, options: FuseOptions) -> "Recording":
    """The recording in a log.

    Raises:
        LevelheadError: as the reader, and for one of fewer than ``MIN_SAMPLES``.
    """
    if options.calibration is None:
        recording = read_without_iron(options.reading, log, filters.of(options.params), options.first_pass)
    else:
        recording = read_calibrated(options.reading, log, options.calibration)
    if len(recording) < MIN_SAMPLES:
        count = "1 sample" if len(recording) == 1 else f"{len(recording)} samples"
        raise LevelheadError(f"{log} is too short: {count}; expected {MIN_SAMPLES} or more")
    return recording


def _fuse_or_explain(log: Path, name: str, options: FuseOptions) -> FusionResult | str:
    """One log of several, or the sentence that explains its failure and names it, as those of the reader do."""
    try:
        recording = _read(log, options)
    except (LevelheadError, OSError) as error:
        return " ".join(str(error).split())
    try:
        return _fuse_one(recording, name, options)
    except (LevelheadError, OSError) as error:
        return f"{log}: {' '.join(str(error).split())}"


def _fuse_one(recording: "Recording", name: str, options: FuseOptions) -> FusionResult:
    """Fuses and writes one recording."""
    from levelhead.publish.progress import progress

    options = options.at_place(recording)
    params, guard = options.params, options.guard
    if "live" in recording.meta and not options.named:
        params, guard = node_filter(recording.meta["live"], guard, options.guard_words)
    if options.declination is not None:
        require_north(recording, params)
    from levelhead.engine import fuse as forward
    from levelhead.engine import smooth

    with progress("smoothing" if options.smooth else "fusing") as report:
        run = smooth if options.smooth else forward
        track = run(recording, params, guard=guard, prior=options.prior, progress=report)
    node = "live" in recording.meta and not options.named and not options.smooth  # it keeps the node's bits
    track = track if node else options.to_magnetic_north(track)
    score = None
    if recording.truth is not None:
        from levelhead.evaluate import evaluate

        score = evaluate(recording, track)  # a reference counts as relative to magnetic north, like the filter
    track = options.of_body(track if node and options.declination is None else options.to_north(track), recording)
    seen = recording if options.mounting is None else options.mounting.rotate(recording)
    heave = track.heave() if options.heave else None
    target = folder(options.out) / f"{name}-track.{options.format}"
    with progress(f"writing {target.name}") as report:
        rows = _write(seen, track, heave, target, options, report)
    written = [target]
    if options.plot and can_draw():
        written += _pictures(seen, track, params, guard, options.prior, options.out / name)
    if options.save_calibration is not None and track.calibration is not None:
        track.calibration.save(options.save_calibration)
        written.append(options.save_calibration)
    return FusionResult(seen, track, score, guard, written, rows, heave, options.field)


def _write(
    seen: "Recording",
    track: "Track",
    heave: "Heave | None",
    target: Path,
    options: FuseOptions,
    report: Callable[[float], None],
) -> int:
    """Writes a track in ENU as a table in its frame, or with its readings as a bag; how many rows it has."""
    from levelhead.publish.writers import motion_series, write_track

    if options.format in BAGS:
        from levelhead.sources.formats.rosbag import write_bag

        write_bag(seen, target, track, motion_series(track) if options.motion else None)
        return len(track)
    shown, more = _rows_to_write(track.to_frame(options.frame), heave, options)
    write_track(shown, target, report, more)
    return len(shown)


def _rows_to_write(track: "Track", heave: "Heave | None", options: FuseOptions) -> "tuple[Track, dict[str, Array]]":
    """The rows of a track that are written, and further columns."""
    from levelhead.publish.writers import motion_columns

    more = motion_columns(track) if options.motion else {}
    more |= {} if heave is None else heave.columns()
    if options.output_rate is None:
        return track, more
    from levelhead.publish.output_rate import OutputRate

    reduced = OutputRate(options.output_rate).reduce(track)
    assert reduced is not None  # it has its first row
    rows = np.searchsorted(track.t, reduced.t)
    return reduced, {name: values[rows] for name, values in more.items()}


def node_filter(live: ReadOnlyJson, guard: Guard | None, words: Sequence[str]) -> tuple[Params, Guard | None]:
    """The filter and the guard with which a black box was made; thresholds in words win."""
    params = filters.find(live["filter"]).params(**live["params"])
    if words:
        return params, guard
    return params, None if live["guard"] is None else Guard(**live["guard"])


def _pictures(
    recording: "Recording",
    track: "Track",
    params: Params,
    guard: Guard | None,
    known: "Calibration | None",
    stem: Path,
) -> list[Path]:
    """Draws the track, and the sensor's errors as the filter learned them."""
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
