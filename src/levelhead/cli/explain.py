"""``levelhead explain LOG``: the symptoms of a track and their causes."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import (
    FilterName,
    FromFile,
    GuardWords,
    Reading,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    read_parameters,
)
from levelhead.errors import LevelheadError


def explain(
    log: Annotated[Path, Parameter(metavar="LOG")],
    /,
    *,
    filter: FilterName = None,
    tuned: FromFile = None,
    set: Annotated[tuple[str, ...], Parameter(negative="", metavar="K=V")] = (),
    guard: GuardWords = (),
    plot: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Explain the symptoms of a fused track, such as drift or jitter, each with its cause and cure.

    The exit code is 0 without symptoms, 1 with symptoms, 2 if the log cannot be read.

    Args:
        log: A recording of 10 s or more.
        set: A parameter of the filter, such as r_measure=0.1; may be given several times.
        plot: File for a picture of the evidence of each symptom, PNG, SVG or PDF (needs the extra levelhead[plot]).
        json: Print symptoms and causes as JSON.
    """
    from levelhead.inspection.explain import explain as run
    from levelhead.publish.progress import progress

    file = read_parameters(tuned, filter)
    params, before = parse_filter(filter, set, tuned=file), parse_guard(guard, file)
    if before is None:
        raise LevelheadError(
            "explain reads the guard's health bits; expected thresholds such as --guard rest_time=3, not off"
        )
    recording = reading.read(log)
    with progress("explaining"):
        found = run(recording, params, guard=before, source=str(log))
    if plot is not None:
        from levelhead.publish.plots.explanation_panels import explanation_picture

        explanation_picture(found, plot)
    if json:
        print_json(found.to_dict())
    else:
        print_line(str(found) if plot is None else f"{found}\nwritten: {plot}")
    return found.exit_code
