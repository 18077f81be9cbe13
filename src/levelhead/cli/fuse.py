"""``levelhead fuse LOG``: the main job."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.options import (
    FilterName,
    GuardWords,
    Reading,
    folder,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    read_prior,
    require_self_calibration,
)
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import Params
from levelhead.guard import Guard

if TYPE_CHECKING:
    from levelhead.calibration import Calibration
    from levelhead.recording import Recording
    from levelhead.track import Track


def fuse(
    log: Path,
    /,
    *,
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    guard: GuardWords = (),
    declination: Annotated[float | None, Parameter(metavar="DEG")] = None,
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="DIR")] = Path(),
    format: Literal["csv", "parquet"] = "csv",
    plot: bool = True,
    offline: Annotated[bool, Parameter(negative="")] = False,
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    save_calibration: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    verbose: Annotated[bool, Parameter(name=["--verbose", "-v"], negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Fuse a log into orientation: writes the track and a picture, prints a summary.

    Args:
        log: .csv, .tsv, .jsonl, .mat, .h5, .npz or .parquet with gyroscope and accelerometer; units and columns are
            found. The black box of a node, .mcap, is fused as the node did it, unless a filter is named.
        set: a parameter of the filter, such as acc_tau=3; may be given several times.
        declination: degrees from true to magnetic north at the place and time of the log, positive east: the track is
            then relative to true north.
        out: folder for the results LOG-track.csv and LOG-track.png.
        format: of the track.
        plot: draw the picture (needs the extra levelhead[plot]), and for a filter that learns its sensor how it did,
            LOG-calibration.png.
        offline: smooth: every instant uses the whole recording (filter ESKF).
        prior: the calibration of the same sensor from an earlier --save-calibration: the run starts with it.
        save_calibration: file for the calibration of the sensor from this run, with its 1σ, as JSON.
        verbose: print every parameter, every learned number, every kind of fault and every note.
        json: print the summary as JSON, with all parameters and all learned numbers.
    """
    from levelhead.engine import fuse as forward
    from levelhead.engine import smooth
    from levelhead.publish.progress import progress
    from levelhead.publish.summary import facts, summary
    from levelhead.publish.writers import write_track
    from levelhead.track import declination_angle

    params, before = parse_filter(filter, set, offline), parse_guard(guard)
    run = smooth if offline else forward
    if declination is not None:
        declination_angle(declination)  # refused before the work, not after it
    known = read_prior(prior, params)
    if save_calibration is not None:
        require_self_calibration(params, "--save-calibration")
    recording = reading.read(log)
    if "live" in recording.meta and filter is None and not set:
        params, before = node_filter(recording.meta["live"], before, guard)
    if declination is not None:
        _require_north(recording, params)
    with progress("smoothing" if offline else "fusing") as report:
        track = run(recording, params, guard=before, prior=known, progress=report)
    score = None
    if recording.truth is not None:
        from levelhead.evaluate import evaluate

        score = evaluate(recording, track)  # a reference counts as relative to magnetic north, like the filter
    if declination is not None:
        track = track.to_true_north(declination)
    target = folder(out) / f"{log.stem}-track.{format}"
    write_track(track, target)
    written = [target]
    if plot:
        written += _picture(recording, track, target.with_suffix(".png"), quiet=json)
        if track.calibration is not None:
            written += _learned(recording, params, before, known, target.with_name(f"{log.stem}-calibration.png"))
    if save_calibration is not None and track.calibration is not None:
        track.calibration.save(save_calibration)
        written.append(save_calibration)
    if json:
        print_json(facts(recording, track, score, before) | {"written": [str(path) for path in written]})
        return
    notes = tuple(recording.meta.get("notes", ()))
    print_line(summary(recording, track, score, before, verbose=verbose, notes=notes))
    print_line("written: " + ", ".join(str(path) for path in written))


def node_filter(live: Mapping[str, Any], guard: Guard | None, words: Sequence[str]) -> tuple[Params, Guard | None]:
    """The filter and the guard with which a black box was made; thresholds in words win."""
    params = filters.find(live["filter"]).params(**live["params"])
    if words:
        return params, guard
    return params, None if live["guard"] is None else Guard(**live["guard"])


def _require_north(recording: "Recording", params: Params) -> None:
    """Makes sure that heading is relative to a north that can be corrected."""
    flt = filters.of(params)
    why = f"{flt.name} does not follow the magnetometer" if "heading" not in flt.estimates else ""
    why = "there is no magnetometer" if recording.mag is None else why
    if why:
        raise LevelheadError(f"--declination turns magnetic north, but {why}: heading is relative; leave it out")


def _picture(recording: "Recording", track: "Track", path: Path, quiet: bool) -> list[Path]:
    """Draws, unless the plotting extra is missing: then a line says so, and the track is written all the same."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        if not quiet:
            print_line(
                "no picture: it needs matplotlib (pip install 'levelhead[plot]'); --no-plot leaves this line out"
            )
        return []
    from levelhead.publish.plots import track_picture

    track_picture(recording, track, path)
    return [path]


def _learned(
    recording: "Recording", params: Params, guard: Guard | None, known: "Calibration | None", path: Path
) -> list[Path]:
    """Draws the filter's estimates of its sensor's errors over time; nothing without matplotlib."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        return []
    from levelhead.engine.calibration_history import calibration_history
    from levelhead.publish.plots import calibration_picture

    calibration_picture(calibration_history(recording, params, guard=guard, prior=known), path)
    return [path]
