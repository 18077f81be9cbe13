"""``levelhead sweep``: one parameter over its range, with the minimum and the flat region."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.calibrated_log import log_or_simulation
from levelhead.cli.options import (
    NO_PICTURE,
    OUT_FOLDER,
    Engine,
    FilterName,
    GuardWords,
    Reading,
    can_draw,
    folder,
    parameter_names,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    require_parameter,
)

WORSE = 0.9  # a reference must be better than the best value by 10 % to be named

if TYPE_CHECKING:
    from levelhead.guard import Guard
    from levelhead.recording import Recording
    from levelhead.tune import Sweep


def sweep(
    log: Path | None = None,
    /,
    *,
    parameter: Annotated[str, Parameter(name=["--parameter", "-p"], metavar="NAME", completer=parameter_names)],
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    guard: GuardWords = (),
    values: Annotated[tuple[float, ...], Parameter(consume_multiple=True, negative="")] = (),
    simulate: Annotated[str | None, Parameter(metavar="WHAT")] = None,
    seed: int | None = None,
    engine: Engine = "auto",
    out: Annotated[Path | None, OUT_FOLDER] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Vary one parameter of a filter over a recording with truth: the best value, and the flatness of the minimum.

    Args:
        log: A recording with truth.
        parameter: Name of the parameter, such as alpha or r_measure.
        set: Another parameter of the filter, held fixed, such as q_bias=0.001; may be given several times.
        values: Values to try; by default, the usual range of the parameter.
        simulate: Use a simulation instead of a log: lesson, hard, hand, walking, drone, robot, still.
        seed: Seed of the simulation; 42 for the lessons, 0 otherwise.
        out: Folder for the picture sweep-PARAMETER.png; without it, no picture is drawn.
        json: Print the table as JSON.
    """
    from levelhead.publish.progress import progress
    from levelhead.publish.terminal_table import print_table
    from levelhead.tune import sweep as run

    before = parse_guard(guard)
    recording = log_or_simulation(log, simulate, seed, reading)
    params = parse_filter(filter, set)
    if filter is None:
        require_parameter(params, parameter)
    with progress("sweeping") as report:
        result = run(recording, params, parameter, list(values) or None, guard=before, engine=engine, progress=report)
    picture = None
    if out is not None and can_draw():
        from levelhead.publish.plots import sweep_picture

        picture = folder(out) / f"sweep-{parameter}.png"
        sweep_picture(result, picture)
    warning = _warning(recording, result, before)
    if json:
        print_json(result.to_dict() | {"warning": warning or None, "written": [str(picture)] if picture else []})
        if warning:
            sys.stderr.write(f"levelhead: {warning}\n")  # the JSON often goes to a file that is not read
        return
    print_table(result)
    if warning:
        print_line(warning)
    asked = "no picture asked for: -o DIR draws the curve" if out is None else NO_PICTURE
    print_line(f"written: {picture}" if picture else asked)


def _warning(recording: "Recording", result: "Sweep", guard: "Guard | None") -> str:
    """A sentence if this recording cannot tune the filter: the default filter, or no motion at all, errs less."""
    import numpy as np

    from levelhead import filters
    from levelhead.engine import fuse
    from levelhead.evaluate import evaluate

    best = float(result.scores[result.index])
    track = fuse(recording, filters.default(), guard=guard)
    still = replace(track, quat=np.broadcast_to(track.quat[:1], track.quat.shape).copy())
    others = {"the default filter, untuned,": track, "a sensor that never moved from its first orientation": still}
    for name, other in others.items():
        error = float(getattr(evaluate(recording, other), result.metric))
        if error < WORSE * best:
            return (
                f"warning: {name} has {error:.2f}°, less than the best value here ({best:.2f}°): no value of this "
                "parameter is worth tuning on this recording; check its bias and truth, or take the default filter"
            )
    return ""
