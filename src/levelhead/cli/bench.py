"""``levelhead bench accuracy | speed``: levelhead beside its peers."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from levelhead.cli.options import OUT_FOLDER, filter_option, folder, parse_method, print_json, print_line
from levelhead.errors import LevelheadError, require

if TYPE_CHECKING:
    pass

bench = App(
    name="bench", help="Levelhead beside its peers: errors on real recordings, and time.", help_format="markdown"
)


@bench.command
def accuracy(
    *places: Annotated[Path, Parameter(name="DIR", negative="")],
    filter: Annotated[
        tuple[str, ...],
        filter_option(
            "A filter, `default` or a contender such as `vqf.VQF`; may be given several times. All of them if none"
            " is named."
        ),
    ] = (),
    mag: Annotated[bool, Parameter(negative="--no-mag", show_default=False)] = True,
    per_recording: Annotated[bool, Parameter(negative="")] = False,
    jobs: int | None = None,
    out: Annotated[Path | None, OUT_FOLDER] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Errors of all filters and of vqf, imufusion, ahrs and RIANN on recordings with a reference, by group.

    Args:
        places: Folders with recordings: BROAD's .mat, RepoIMU's .csv, or others with a reference.
        mag: Leave the magnetometers out: inclination, and the drift of the heading in 60 s.
        per_recording: Print every recording as well.
        jobs: Number of processes; by default one for each core.
        out: Folder for accuracy.png, .csv, .json and .md; without it, no file is written.
        json: Print all figures as JSON.
    """
    from levelhead.bench import accuracy as run
    from levelhead.bench.methods import all_methods, distinct_methods
    from levelhead.engine.threads import cores
    from levelhead.publish.bench_tables import print_accuracy
    from levelhead.publish.progress import progress

    if jobs is not None and jobs < 1:
        raise LevelheadError(f"{jobs} processes can do nothing; --jobs must be at least 1")
    if out is not None and out.exists():
        folder(out)  # refused before the work, not after it
    methods, absent = (distinct_methods([parse_method(word) for word in filter]), []) if filter else all_methods()
    with progress("comparing") as report:
        result = run(places, methods, with_mag=mag, jobs=jobs or cores(), remarks=absent, progress=report)
    written = []
    if out is not None:
        from levelhead.publish.accuracy_files import write_accuracy

        written = write_accuracy(result, folder(out))
    if json:
        print_json(result.to_dict() | {"written": [str(path) for path in written]})
        return
    print_accuracy(result, per_recording)
    if written:
        print_line("written: " + ", ".join(str(path) for path in written))


@bench.command
def speed(*, samples: int = 200_000, repeats: int = 9, json: Annotated[bool, Parameter(negative="")] = False) -> None:
    """Time of a sample as ratios: all filters against vqf, imufusion and ahrs, in a batch and live.

    Args:
        samples: Samples in a batch; slow loops get fewer.
        repeats: Number of runs of each case, in turn.
        json: Print the figures as JSON.
    """
    from levelhead.bench import speed as run
    from levelhead.bench.methods import all_methods
    from levelhead.publish.bench_tables import print_figures
    from levelhead.publish.progress import progress

    require("scipy", "the benchmark", "bench")
    for absent in all_methods()[1]:
        sys.stderr.write(f"levelhead: {absent}\n")  # at once: the table comes after minutes
    with progress("timing") as report:
        result = run(samples, repeats, report)
    if json:
        print_json(result.to_dict())
        return
    print_figures(result.tables, result.machine, result.remarks)
