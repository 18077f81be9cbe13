"""A way out where the names of columns tell no sensor: what their numbers look like, as the hint ``map``."""

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.sources.headerless import Guess, guess_columns
from levelhead.sources.hints import Hints, NeedsHints
from levelhead.sources.names import understand
from levelhead.sources.table import Table, stack, words_of
from levelhead.sources.unit_inference import turn_of_gravity

MOST = 64  # columns that are looked at
ROWS = 20_000
SURE = 0.75  # correlation of gravity's turn with the rates


def suggest(error: LevelheadError, table: Table, hints: Hints) -> LevelheadError:
    """The error, with a map of columns that look like a gyroscope and an accelerometer, if there are such.

    Gravity's length and its turn against the rates tell them, as in a file without a header. Names need not be known.
    """
    known = [understand(name, table.context) for name in table.names]
    named = {role for role in ("gyr", "acc") if any(name.role == role and name.axis for name in known)}
    wanted = [i for i in range(len(table.names)) if i not in words_of(table)][:MOST]
    settled = isinstance(error, NeedsHints) or {"gyr", "acc"} & set(hints.map) or hints.sensor is not None
    if settled or len(named) == 2 or len(wanted) < 6 or len(set(table.names)) < len(table.names):
        return error
    try:
        columns = table.read(wanted)
    except LevelheadError:
        return error
    values = stack({k: columns[i].astype(np.float64)[:ROWS] for k, i in enumerate(wanted)}, range(len(wanted)))
    guess = guess_columns(values)
    roles = {"gyr": guess.gyr, "acc": guess.acc}
    if not all(roles.values()) or any(known[wanted[k]].role not in ("", r) for r, at in roles.items() for k in at):
        return error
    if not _turns(values, guess):
        return error
    if guess.t is not None and not any(name.role == "t" for name in known):
        roles["t"] = (guess.t,)
    found = {role: [table.names[wanted[k]] for k in positions] for role, positions in roles.items()}
    return NeedsHints(f"{error}; by their numbers {_name_columns(found)} look like it", map=found)


def _turns(values: Array, guess: Guess) -> bool:
    """Whether gravity turns as the rates say, whatever their unit; counts with an offset do not pass."""
    t = np.arange(len(values)) / 100.0 if guess.t is None else values[:, guess.t] - values[0, guess.t]
    turn = turn_of_gravity(
        t / max(1e-9, median(np.diff(t))) * 0.01, values[:, list(guess.gyr)], values[:, list(guess.acc)]
    )
    return turn is not None and turn.correlation > SURE and turn.turned > 0.05


def _name_columns(found: dict[str, list[str]]) -> str:
    return " and ".join(f"{', '.join(found[role])}" for role in ("gyr", "acc"))
