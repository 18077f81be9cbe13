"""``levelhead fuse LOG``: the main job."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from levelhead.cli.options import FilterName, Reading, chosen_filter, folder, say, say_json


def fuse(
    log: Path,
    /,
    *,
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    out: Annotated[Path, Parameter(name=["--out", "-o"], metavar="DIR")] = Path(),
    format: Literal["csv", "parquet"] = "csv",
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Fuse a log into orientation: writes the track and a picture, prints a summary.

    Args:
        log: .csv, .tsv, .mat, .h5, .npz or .parquet with gyroscope and accelerometer; units and columns are found.
        set: a parameter of the filter, such as r_measure=0.1; may be given several times.
        out: folder for the results LOG-track.csv and LOG-track.png.
        format: of the track.
        plot: draw the picture (needs the extra levelhead[plot]).
        json: print the summary as JSON.
    """
    from levelhead.engine import fuse as run
    from levelhead.publish.progress import progress
    from levelhead.publish.summary import facts, summary
    from levelhead.publish.writers import write_track

    recording = reading.read(log)
    params = chosen_filter(filter, set)
    with progress("fusing") as report:
        track = run(recording, params, progress=report)
    score = None
    if recording.truth is not None:
        from levelhead.evaluate import evaluate

        score = evaluate(recording, track)
    target = folder(out) / f"{log.stem}-track.{format}"
    write_track(track, target)
    written = [target]
    if plot:
        written += _picture(recording, track, target.with_suffix(".png"), quiet=json)
    if json:
        say_json(facts(recording, track, score) | {"written": [str(path) for path in written]})
        return
    say(summary(recording, track, score))
    for note in recording.meta.get("notes", ()):
        say(f"note: {note}")
    say("written: " + ", ".join(str(path) for path in written))


def _picture(recording: Any, track: Any, path: Path, quiet: bool) -> list[Path]:
    """Draws, unless the plotting extra is missing: then the track is worth having all the same, and a line says so."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        if not quiet:
            say("no picture: it needs matplotlib (pip install 'levelhead[plot]'); --no-plot leaves this line out")
        return []
    from levelhead.publish.plots import track_picture

    track_picture(recording, track, path)
    return [path]
