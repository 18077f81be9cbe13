"""A proposal where the names of columns show no sensor: their roles by their numbers, as the hint ``map``."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.signals.gravity_turn import median_norm, turn_of_gravity
from levelhead.sources.hints import Hints, NeedsHints
from levelhead.sources.interpret.by_numbers import Guess, gravity_score, guess_columns, list_ranges
from levelhead.sources.names.column_groups import group_axes, order_positions
from levelhead.sources.names.column_name import Name, understand
from levelhead.sources.table import Table, stack, words_of

MAX_COLUMNS = 64  # columns that are looked at
ROWS = 20_000
AXES = ("x", "y", "z")
_AWAY = 2.0  # mean of rates over their spread, from which they are none
_MOVED = 0.03  # spread of the force over its length, from which the sensor does not rest
_TURNING, _SOME = 0.1, 0.2  # turn of the force that must show in the rates; correlation that shows it
MIN_CORRELATION = 0.75  # correlation of gravity's turn with the rates


def suggest(error: LevelheadError, table: Table, hints: Hints) -> LevelheadError:
    """The error, with a map of columns that look like a gyroscope and an accelerometer, if there are such.

    Gravity's length and its turn against the rates determine them, as in a file without a header. Names need not be
    known. A file of one sensor gets the way to read it beside the other.
    """
    known = [understand(name, table.context) for name in table.names]
    wanted = [i for i in range(len(table.names)) if i not in words_of(table)][:MAX_COLUMNS]
    if isinstance(error, NeedsHints):
        return error
    if not hints.map and _is_one_sensor([known[i] for i in wanted]):
        return LevelheadError(f"{error}; if another file holds it, put both into one folder, and give the folder")
    if not _is_open(table, hints, known, wanted):
        return error
    try:
        columns = table.read(wanted)
    except LevelheadError:
        return error
    values = stack({k: columns[i].astype(np.float64)[:ROWS] for k, i in enumerate(wanted)}, range(len(wanted)))
    names, seen = [table.names[i] for i in wanted], [known[i] for i in wanted]
    guess = guess_columns(values)
    roles, words = _likely_roles(values, names, seen, guess)
    if not roles:
        return LevelheadError(f"{error}; {list_ranges(names, values)}")
    if guess.t is not None and not any(name.role == "t" for name in known):
        roles["t"] = (guess.t,)
    found = {role: [table.names[wanted[k]] for k in positions] for role, positions in roles.items()}
    return NeedsHints(f"{error}; {words} {_name_columns(found)} look like it", map=found)


def _is_one_sensor(known: Sequence[Name]) -> bool:
    """Whether there are three axes, and no three columns besides that may be others."""
    axes = [name.axis or name.raw.lower() for name in known if name.role != "t"]
    return sorted(axis for axis in axes if axis in AXES) == list(AXES) and len(axes) < 6


def _likely_roles(
    values: Array, names: Sequence[str], known: Sequence[Name], guess: Guess
) -> tuple[dict[str, tuple[int, ...]], str]:
    """(positions of "gyr" and "acc", {} if none are likely; the words for how they were found)."""
    roles = {"gyr": guess.gyr, "acc": guess.acc}
    if _fits(roles, known) and _turns(values, guess):
        return roles, "by their numbers"
    roles = _by_elimination(values, names, known, guess.t)
    likely = roles if roles and _may_be(values, roles, guess.t) else {}
    return likely, "nothing turns clearly here, but by size and place, a guess,"


def _fits(roles: Mapping[str, Sequence[int]], known: Sequence[Name]) -> bool:
    """Whether both sensors were found, and no name contradicts it."""
    return all(roles.values()) and all(known[k].role in ("", role) for role, at in roles.items() for k in at)


def _is_open(table: Table, hints: Hints, known: Sequence[Name], wanted: Sequence[int]) -> bool:
    """Whether neither hints nor names settle which columns are the sensors, and there are enough to choose from."""
    named = {role for role in ("gyr", "acc") if any(name.role == role and name.axis for name in known)}
    hinted = {"gyr", "acc"} & set(hints.map) or hints.sensor is not None
    return not hinted and len(named) < 2 and len(wanted) >= 6 and len(set(table.names)) == len(table.names)


def _by_elimination(
    values: Array, names: Sequence[str], known: Sequence[Name], t: int | None
) -> dict[str, tuple[int, ...]]:
    """Positions of "gyr" and "acc" where nothing turns: three columns as long as gravity, and three others.

    Columns that belong together stand side by side under names that differ in one place. Of several threes that may be
    the gyroscope, the one beside the accelerometer; {} if there is none.
    """
    named = {role: _named_axes(role, known) for role in ("gyr", "acc")}
    lively = [len(set(column[np.isfinite(column)][:ROWS].tolist())) > 2 for column in values.T]
    threes: list[tuple[int, ...]] = []
    i = 0
    while i < len(names) - 2:
        free = all(lively[i : i + 3]) and not any(one.role for one in known[i : i + 3])
        if free and (t is None or not i <= t < i + 3) and _alike(names[i : i + 3]):
            threes.append((i, i + 1, i + 2))
            i += 2
        i += 1
    scores = {one: score for one in threes if (score := gravity_score(values[:, list(one)])) is not None}
    acc = named["acc"] or min(scores, key=lambda one: scores[one], default=())
    rest = [one for one in threes if not set(one) & set(acc)]
    gyr = named["gyr"] or min(rest, key=lambda one: abs(one[0] - acc[0] - 0.5) if acc else 0, default=())
    return {"gyr": gyr, "acc": acc} if gyr and acc else {}


def _named_axes(role: str, known: Sequence[Name]) -> tuple[int, ...]:
    complete, _ = group_axes(role, known, None)
    return order_positions(role, complete[0]) if complete else ()


def _alike(names: Sequence[str]) -> bool:
    """Whether three names differ in one letter or number only: kimozgas_a, kimozgas_b, kimozgas_c."""
    ends = [re.fullmatch(r"(.*?)([A-Za-z]|\d+)(\W*)", name) for name in names]
    starts = [re.fullmatch(r"()([A-Za-z])(\W.*)", name) for name in names]
    for found in (ends, starts):
        if (
            all(found)
            and len({(one[1], one[3]) for one in found if one}) == 1
            and len({one[2] for one in found if one}) == 3
        ):
            return True
    return False


def _turns(values: Array, guess: Guess) -> bool:
    """Whether gravity turns as the rates predict, whatever their unit; counts with an offset do not pass."""
    turn = turn_of_gravity(_even(values, guess.t), values[:, list(guess.gyr)], values[:, list(guess.acc)])
    return turn is not None and turn.correlation > MIN_CORRELATION and turn.turned > 0.05


def _even(values: Array, t: int | None) -> Array:
    """(n,) s: the clock in column ``t``, stretched to 100 Hz, or the rows at it."""
    if t is None:
        return np.arange(len(values)) / 100.0
    stamps = values[:, t] - values[0, t]
    even: Array = stamps / max(1e-9, median(np.diff(stamps))) * 0.01
    return even


def _may_be(values: Array, roles: Mapping[str, Sequence[int]], t: int | None) -> bool:
    """Whether columns may be sensors, where gravity's turn does not prove it.

    Where the force turns much, the rates must have some part in it. Rates come back to zero, and positions, altitudes
    and counters do not.
    """
    gyr, acc = (values[:, list(roles[role])] for role in ("gyr", "acc"))
    spread, middle = (np.sqrt((one(gyr, axis=0) ** 2).sum()) for one in (np.nanstd, np.nanmean))
    moved = float(np.sqrt((np.nanstd(acc, axis=0) ** 2).sum())) > _MOVED * median_norm(acc)
    if (moved and middle > _AWAY * spread) or _is_unit(gyr):
        return False
    turn = turn_of_gravity(_even(values, t), gyr, acc)
    return turn is None or turn.turned < _TURNING or abs(turn.correlation) > _SOME


def _is_unit(rates: Array) -> bool:
    """Whether (n, 3) numbers stay within a unit vector and reach it: a direction, or a quaternion's part."""
    length = np.sqrt((rates * rates).sum(axis=1))
    length = length[np.isfinite(length)]
    return len(length) > 0 and 0.5 < float(np.quantile(length, 0.9)) < 1.001 and float(length.max()) < 1.001


def _name_columns(found: dict[str, list[str]]) -> str:
    return " and ".join(f"{', '.join(found[role])}" for role in ("gyr", "acc"))
