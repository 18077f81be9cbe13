"""``levelhead tune LOG… --filter NAME``: a filter's parameters, with truth or without."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from levelhead.cli.calibrated_log import CalibrationFile, read_calibrated
from levelhead.cli.options import (
    OUT_FOLDER,
    Engine,
    FilterName,
    FromFile,
    GuardWords,
    Reading,
    can_draw,
    folder,
    parameter_names,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    print_written,
    read_parameters,
    require_writable,
)
from levelhead.errors import LevelheadError


def tune(
    logs: Annotated[tuple[Path, ...], Parameter(metavar="LOG", negative="")],
    /,
    *,
    filter: FilterName = None,
    parameter: Annotated[
        tuple[str, ...],
        Parameter(name=["--parameter", "-p"], negative="", metavar="NAME[=LOW:HIGH]", completer=parameter_names),
    ] = (),
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    tuned: FromFile = None,
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    calibration: CalibrationFile = None,
    guard: GuardWords = (),
    goal: Literal["truth", "smoother", "likelihood"] | None = None,
    metric: Literal["total", "tilt", "heading"] | None = None,
    runs: Annotated[int | None, Parameter(metavar="N")] = None,
    seed: int = 0,
    engine: Engine = "auto",
    out: Annotated[Path, OUT_FOLDER] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Search a filter's parameters for logs, against their true orientation or else the smoother's.

    Prints the gain on logs that were left out (each log, or quarter of a single one), the flatness of the minimum, and
    the parameters that reduce each symptom. Writes tuned.json for the --params of `fuse`, `run` and `export`, and
    tuned.png.

    Args:
        logs: Recordings of the motion that the filter is for, a minute or more each.
        parameter: A parameter to search, with or without its range, such as kp or kp=0.01:10; may be given several
            times. By default, all that are usually tuned.
        set: A fixed parameter, or the start of the search, such as kp=1; may be given several times.
        noise: The sensor's noise, as written by `levelhead noise`: the start of the search of Q and R.
        goal: Goal of the search: truth if a log has one, else smoother. The likelihood is that of the innovations over
            5 s. With smoother and likelihood, a truth only checks the result.
        metric: Error to minimise, without a constant heading offset: total if all logs have a magnetometer that the
            filter uses, else tilt.
        runs: Runs of the filter in one search; by default 80 for each parameter.
        seed: Seed of the search.
        out: Folder for the results.
        plot: Draw the picture (needs the extra levelhead[plot]).
        json: Print all numbers as JSON.
    """
    from levelhead.publish.progress import progress
    from levelhead.publish.tuning_table import tuning_table
    from levelhead.tune import tune_filter
    from levelhead.tune.parameter_space import space_of

    if filter is None and tuned is None:
        raise LevelheadError("tune needs the filter whose parameters it searches, such as --filter Mahony")
    file = read_parameters(tuned, filter)
    params, before = parse_filter(filter, set, noise=noise, tuned=file), parse_guard(guard, file)
    space_of(params, parameter)
    require_writable(out)
    with progress("reading"):
        recordings = [read_calibrated(reading, log, calibration) for log in logs]
    with progress("tuning") as report:
        found = tune_filter(
            recordings, params, parameter, metric=metric, goal=goal, guard=before, runs=runs, seed=seed,
            engine=engine, progress=report,
        )  # fmt: skip
    written = [folder(out) / "tuned.json"]
    found.file().save(written[0])
    if plot and can_draw():
        from levelhead.publish.plots.tuning_panels import tuning_picture

        written.append(out / "tuned.png")
        tuning_picture(found, written[1])
    if json:
        print_json(found.to_dict() | {"written": [str(path) for path in written]})
        return
    print_line(tuning_table(found))
    print_written(written, plot)
