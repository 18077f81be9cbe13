"""A clock without a name of one: a column that goes on evenly, as time does."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from levelhead import units
from levelhead.errors import LevelheadError
from levelhead.recording import median
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.interpret.rate import rate_of_turn
from levelhead.sources.interpret.roles import Roles
from levelhead.sources.interpret.stamp_unit import guess_unit
from levelhead.sources.names.column_name import unit_in
from levelhead.sources.table import Column, Table, words_of

MAX_COLUMNS = 64  # columns that are looked at
MIN_ROWS = 20  # rows below which nothing is concluded
FORWARD, EVEN = 0.999, 1.0  # share of steps that go on; spread of the steps, in usual ones
RATES = (4.0, 10_000.0)  # Hz, between which a clock is believed
MAX_RATE_ERROR = 0.2  # by which the rate of a clock without unit may differ from that of gravity's turn


def with_clock(table: Table, roles: Roles, columns: Mapping[int, Column]) -> tuple[Roles, dict[int, Column]]:
    """The roles with the time, and the columns with its stamps, if a column without a role goes on as a clock does.

    A name with a unit of time settles it ("MET [sec]", "MonoNS"). Another one must give the rate at which gravity turns
    as the gyroscope measures; that is a guess, and noted.
    """
    found = dict(columns)
    used = {i for positions in roles.columns.values() for i in positions}
    free = [i for i in range(len(table.names)) if i not in used | words_of(table)][:MAX_COLUMNS]
    known: list[float | None] = []  # the rate of gravity's turn, worked out when it is asked for
    for i in free:
        try:
            stamps = table.read([i], frozenset([i]))[i]
            said = unit_in(table.names[i], "t", "")
        except LevelheadError:
            continue
        step = _even_step(stamps)
        if step == 0.0:
            continue
        if said is None:
            known = known or [rate_of_turn(roles.columns, columns)]
            if (
                known[0] is None
                or abs(math.log(known[0] * step * units.factor("time", guess_unit(stamps)))) > MAX_RATE_ERROR
            ):
                continue
        elif not RATES[0] <= 1.0 / (step * units.factor("time", said)) <= RATES[1]:
            continue
        found[i] = stamps
        reason, basis = ("even", Basis.NUMBERS) if said else ("even_at_rate", Basis.GUESS)
        name = table.names[i]
        clock = Conclusion("t.column", reason, name, basis, confirm={"map": {"t": [name]}})
        ignored = tuple(name for name in roles.ignored if name != table.names[i])
        made = replace(
            roles, columns={**roles.columns, "t": (i,)}, ignored=ignored, conclusions=(*roles.conclusions, clock)
        )
        return made, found
    return roles, found


def _even_step(stamps: Column) -> float:
    """The step of stamps that increase by about one; 0 if they do not, or count the rows."""
    if len(stamps) < MIN_ROWS or not np.isfinite(stamps).all():
        return 0.0
    steps = np.diff(stamps).astype(np.float64)
    usual = median(steps)
    if not usual > 0.0 or float((steps > 0.0).mean()) < FORWARD or float((steps == 1.0).mean()) > 0.9:
        return 0.0
    low, high = np.quantile(steps, [0.05, 0.95])
    return usual if high - low < EVEN * usual else 0.0
