"""``levelhead corpus VERB PLACE…``: one verb over many recordings, on all cores or on a Dask cluster."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from levelhead.cli.options import (
    OUT_FOLDER,
    Engine,
    GuardWords,
    Reading,
    can_draw,
    filter_option,
    folder,
    parameter_names,
    parse_filter_spec,
    parse_guard,
    print_json,
    print_line,
    print_written,
    require_writable,
)
from levelhead.cli.placement import Placement
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.open_types import JsonObject

if TYPE_CHECKING:
    from levelhead.corpora.runner import Progress

corpus = App(
    name="corpus",
    help="One verb over many recordings: folders, patterns and URLs, on all cores or on a Dask cluster.",
    help_format="markdown",
)
Places = Annotated[str, Parameter(metavar="PLACE", negative="")]
Filters = Annotated[
    tuple[str, ...],
    filter_option("A filter with parameters, such as `EKF:acc_tau=3`; may be given several times, for a row each."),
]
NoMag = Annotated[bool, Parameter(name="--mag", negative="--no-mag", show_default=False)]


@Parameter(name="*")
@dataclass(frozen=True)
class Running:
    """Place of the work and of its results."""

    out: Annotated[Path, OUT_FOLDER] = Path("corpus-results")
    """Folder for the results: the Parquet dataset rows/ and report.html. The same command continues an
    interrupted run."""
    workers: Annotated[int | None, Parameter(metavar="N")] = None
    """Processes on this machine; by default one for each core. 0 is this process alone, without Dask."""
    scheduler: Annotated[str | None, Parameter(metavar="ADDRESS")] = None
    """A Dask scheduler to work on instead, such as tcp://10.0.0.1:8786."""
    memory: Annotated[str | None, Parameter(metavar="SIZE")] = None
    """Memory of each process on this machine, such as 2GiB; by default an equal share."""
    plot: bool = True
    """Draw the worst ten into the report (needs the extra levelhead[plot])."""
    json: Annotated[bool, Parameter(negative="")] = False
    """Print the tables as JSON."""


@Parameter(name="*")
@dataclass(frozen=True)
class Fusing:
    """How each recording becomes tracks."""

    filter: Filters = ()
    guard: GuardWords = ()
    mag: NoMag = True
    """Leave the magnetometers out."""
    tracks: Annotated[bool, Parameter(negative="")] = False
    """Write each track to DIR/tracks, as Parquet."""
    same_sensor: Annotated[str, Parameter(metavar="PATTERN")] = ""
    """Start each recording with the calibration of the same sensor's last one. The sensor is a pattern with one group
    in the name of a recording, such as '(unit[0-9]+)/', or column:NAME of its file."""
    engine: Engine = "auto"
    order: Annotated[str, Parameter(metavar="PATTERN")] = ""
    """Pattern or column that orders the recordings in time; by default their names."""
    placement: Placement = Placement()  # noqa: RUF009


@corpus.command
def fuse(
    *places: Places,
    fusing: Fusing = Fusing(),
    running: Running = Running(),
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Fuse all recordings: a row each with errors (if truth is known), σ, health and calibration.

    The exit code is 1 if recordings gave no result; their rows have the reason.

    Args:
        places: Folders with all their subfolders, files, patterns, or URLs such as s3://bucket/prefix.
    """
    return _fuse("fuse", places, fusing, running, reading)


@corpus.command
def smooth(
    *places: Places,
    fusing: Fusing = Fusing(),
    running: Running = Running(),
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Estimate all recordings, each from its whole length at every instant: a row each, as for `corpus fuse`.

    Args:
        places: As for `corpus fuse`.
    """
    return _fuse("smooth", places, fusing, running, reading)


@corpus.command
def bench(
    *places: Places,
    filter: Filters = (),
    mag: NoMag = True,
    running: Running = Running(),
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Compare the errors of several methods, also of other packages, such as -f vqf.VQF.

    Args:
        places: As for `corpus fuse`.
        mag: Leave the magnetometers out.
    """
    chosen = [parse_filter_spec(word) if ":" in word else word for word in filter]
    return _run("bench", places, chosen, running, reading, DEFAULT_GUARD, mag)


@corpus.command
def doctor(*places: Places, running: Running = Running(), reading: Reading = Reading()) -> int:  # noqa: B008
    """Examine all recordings: verdict, findings, cures.

    Args:
        places: As for `corpus fuse`.
    """
    return _run("doctor", places, [], running, reading)


@corpus.command
def noise(*places: Places, running: Running = Running(), reading: Reading = Reading()) -> int:  # noqa: B008
    """Measure the noise of sensors at rest: the coefficients of every recording.

    Args:
        places: As for `corpus fuse`.
    """
    return _run("noise", places, [], running, reading)


@corpus.command
def tune(
    *places: Places,
    filter: Annotated[str, Parameter(name=["--filter", "-f"], metavar="NAME[:K=V,…]")],
    parameter: Annotated[
        tuple[str, ...],
        Parameter(name=["--parameter", "-p"], negative="", metavar="NAME[=LOW:HIGH]", completer=parameter_names),
    ] = (),
    guard: GuardWords = (),
    mag: NoMag = True,
    engine: Engine = "auto",
    goal: Literal["truth", "smoother", "likelihood"] | None = None,
    metric: Literal["total", "tilt", "heading"] | None = None,
    runs: Annotated[int | None, Parameter(metavar="N")] = None,
    seed: int = 0,
    running: Running = Running(),
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Search a filter's parameters for all recordings, as `levelhead tune` does for some, and write DIR/tuned.json.

    The workers run the filter. A fifth of the recordings is left out each time and scored. The exit code is 1 if
    recordings could not be used; they are listed.

    Args:
        places: As for `corpus fuse`.
        filter: The filter with its start parameters.
        parameter: A parameter to search, as for `levelhead tune`.
        mag: Leave the magnetometers out.
        goal: Goal of the search, as for `levelhead tune`.
        metric: Error to minimise, as for `levelhead tune`.
        runs: Runs of the filter over each recording in one search.
        seed: Seed of the search.
    """
    from levelhead.corpora.tune_corpus import tune_corpus
    from levelhead.publish.progress import progress
    from levelhead.publish.tuning_table import tuning_table

    require_writable(running.out)
    with progress("corpus tune") as bar:
        found = tune_corpus(
            places, parse_filter_spec(filter), parameter, metric=metric, goal=goal,
            guard=parse_guard(guard), magnetometer=mag, engine=engine, runs=runs, seed=seed, workers=running.workers,
            scheduler=running.scheduler, memory=running.memory, hints=reading.hints(), progress=bar,
        )  # fmt: skip
    tuning, left_out = found.tuning, found.left_out
    written = [folder(running.out) / "tuned.json"]
    tuning.file().save(written[0])
    if running.plot and can_draw():
        from levelhead.publish.plots.tuning_panels import tuning_picture

        written.append(running.out / "tuned.png")
        tuning_picture(tuning, written[1])
    if running.json:
        print_json(tuning.to_dict() | {"left_out": left_out, "written": [str(path) for path in written]})
    else:
        print_line(tuning_table(tuning))
        for name, sentence in left_out.items():
            print_line(f"left out: {name}: {sentence.removeprefix(f'{name}: ')}")
        print_line("written: " + ", ".join(str(path) for path in written))
    return int(bool(left_out))


@corpus.command
def report(
    results: Annotated[Path, Parameter(metavar="DIR")],
    /,
    *,
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Print the report of a folder of results, also of an interrupted run.

    Args:
        results: Folder of an earlier run (its -o).
        plot: Draw the worst ten recordings.
        json: Print the tables as JSON.
    """
    from levelhead.corpora.html_report import write_page
    from levelhead.corpora.results import read_job, read_rows

    table = read_rows(results)
    job = read_job(results)
    page = write_page(results, table, job, {}, plot and can_draw())
    _say(table, job.verb, page, plot, json)


def _fuse(verb: str, places: Sequence[str], fusing: Fusing, running: Running, reading: Reading) -> int:
    chosen = [parse_filter_spec(word) for word in fusing.filter]
    guard = parse_guard(fusing.guard)
    return _run(
        verb, places, chosen, running, reading, guard, fusing.mag, fusing.tracks, fusing.same_sensor, fusing.order,
        fusing.engine, fusing.placement,
    )  # fmt: skip


def _run(
    verb: str,
    places: Sequence[str],
    chosen: Sequence[FilterChoice],
    running: Running,
    reading: Reading,
    guard: Guard | None = DEFAULT_GUARD,
    mag: bool = True,
    tracks: bool = False,
    sensor: str = "",
    order: str = "",
    engine: str = "auto",
    placement: Placement = Placement(),  # noqa: B008
) -> int:
    from levelhead.corpora.html_report import write_page
    from levelhead.corpora.results import read_job
    from levelhead.corpora.runner import corpus as run
    from levelhead.publish.progress import progress

    require_writable(running.out)
    told = False
    with progress(f"corpus {verb}") as bar:

        def report(state: "Progress") -> None:
            nonlocal told
            if state.dashboard and not told:
                sys.stderr.write(f"levelhead: Dask's dashboard is at {state.dashboard}\n")
                told = True
            failed = f", {state.failed} failed" if state.failed else ""
            bar(state.fraction, f"{state.done:,} of {state.recordings:,}, {state.rate:.3g} recordings/s{failed}")

        table = run(
            places, verb, *chosen, out=running.out, guard=guard, magnetometer=mag, tracks=tracks, sensor=sensor,
            order=order, engine=engine, workers=running.workers, scheduler=running.scheduler, memory=running.memory,
            hints=reading.hints(), progress=report, axes="" if placement.mounting is None else str(placement.mounting),
            frame=placement.frame.upper(),
        )  # fmt: skip
    with progress("writing the report"):
        page = write_page(running.out, table, read_job(running.out), {}, running.plot and can_draw())
    return _say(table, verb, page, running.plot, running.json)


def _say(table: object, verb: str, page: Path, plot: bool, json: bool) -> int:
    from levelhead.corpora.overview import Summary

    summary = Summary(table, verb)
    if json:
        tables: JsonObject = {one.title: [dict(row) for row in one.rows] for one in summary.tables()}
        print_json({"heading": summary.heading, "tables": tables, "written": [str(page.parent / "rows"), str(page)]})
    else:
        print_line(str(summary))
        print_written([page.parent / "rows", page], plot)
    return int(bool(summary.without_result))
