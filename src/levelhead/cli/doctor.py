"""``levelhead doctor LOG…``: the problems of a log."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import Reading, print_json, print_line
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject


def doctor(
    logs: Annotated[tuple[Path, ...], Parameter(metavar="LOG", negative="")],
    /,
    *,
    picture: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    fix: Annotated[bool, Parameter(negative="")] = False,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"], metavar="FILE")] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Examine logs: their content, their problems with evidence and cure, and the expected accuracy.

    The exit code is 0 for logs without findings, 1 with findings, 2 if a log cannot be read.

    Args:
        logs: Files, folders or zips.
        picture: File for a picture of one log with its findings (needs the extra levelhead[plot]).
        fix: Write the repaired recording to the file of -o as Parquet, with the changes in its metadata.
        out: The file for --fix.
        json: Print the reports as JSON.
    """
    from levelhead.inspection import inspect

    if fix and (out is None or len(logs) != 1):
        raise LevelheadError("--fix writes one log to one file; expected: levelhead doctor LOG --fix -o FILE.parquet")
    if not logs:
        raise LevelheadError("doctor examines logs; expected: levelhead doctor LOG …")
    hints: JsonObject = reading.hints()
    reports = [inspect(log, **hints) for log in logs]
    if json:
        print_json({"reports": [report.to_dict() for report in reports]})
    else:
        print_line("\n\n".join(str(report) for report in reports))
    if fix and out is not None and reports[0].recording is not None:
        from levelhead.inspection.repair import write_repaired

        changes = write_repaired(reports[0], out)
        if not json:
            print_line("\n".join([*changes, f"written: {out}"]))
    if picture is not None and reports[0].recording is not None:
        from levelhead.publish.plots.doctor import doctor_picture

        doctor_picture(reports[0], picture)
        if not json:
            print_line(f"written: {picture}")
    return max(report.exit_code for report in reports)
