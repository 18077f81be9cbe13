"""``levelhead sync LOG LOG…``: the clocks of several sensors on one body against each other."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.align import orientation_of
from levelhead.cli.options import Reading, print_json, print_line
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject


def sync(
    *logs: Path,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Find offset and drift of each log's clock against that of the first, from the rotation that the sensors share.

    Args:
        logs: Logs of sensors on one rigid body, in any mounting. The first is the reference.
        json: Print the figures as JSON.
    """
    from levelhead.evaluate.clock_difference import clock_difference

    if len(logs) < 2:
        raise LevelheadError("clocks are compared with that of the first log; give two logs or more")
    reference = orientation_of(logs[0], "", reading)
    said: list[JsonObject] = []
    for log in logs[1:]:
        found = clock_difference(orientation_of(log, "", reading), reference)
        said.append({"log": str(log)} | found._asdict())
        if not json:
            print_line(f"{log}: late by {found}")
    if json:
        print_json({"reference": str(logs[0]), "clocks": said})
