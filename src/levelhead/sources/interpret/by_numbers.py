"""Columns without names: which is the clock, the accelerometer, the gyroscope, by their numbers."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyJson
from levelhead.recording import Array, median
from levelhead.signals.gravity_turn import median_norm, turn_of_gravity
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import MEANING, Hints
from levelhead.sources.interpret.converter_counts import with_sensors
from levelhead.sources.interpret.counts import ACC
from levelhead.sources.interpret.increments import clock_of_intervals, rates_of_increments
from levelhead.sources.interpret.stamp_unit import guess_unit
from levelhead.sources.names.column_name import understand
from levelhead.sources.table import ArrayTable, Column, Table, stack, words_of
from levelhead.units import GRAVITY

_SHOWN = 14  # columns in a message
_MAX_ROWS = 20_000  # that are looked at
_MAX_COLUMNS = 64  # that are looked at
_MIN_MOTION = 0.04  # spread of a length from which it was motion
_MAX_STEADY_SHARE = 0.25  # of that spread, below which a length is far steadier
_MAX_TWIN_SHARE = 0.1  # by which the length of a second accelerometer differs
_MIN_COSINE = 0.99  # cosine between a second accelerometer and the first; a field dips by more than 8 degrees
_MAX_CANDIDATES = 8  # sets of three columns that may be the accelerometer
_MAX_SPREAD = 0.25  # median deviation of the length of gravity from its median, as a share
_MAX_UNIT_SPREAD = 2e-4  # a length that constant is a unit vector's: a row of a rotation matrix, a quaternion's part
_ROUNDING = 2e-5  # of a quaternion with six digits; noise of a sensor that reads 1 g is larger
_MIN_CORRELATION = 0.5  # of gravity's turn with the gyroscope's
_CLEAR_SHARE = 0.8  # of the best correlation, from which another rate is as good
_MIN_TURN = 0.03  # of gravity, rad
_AXES = "xyz"
_ONE_SENSOR = {1: ["1"], 3: ["x", "y", "z"], 4: ["time", "x", "y", "z"]}
_OF_MATRIX = re.compile(r".*\[\d+\]")  # data[0]: a column of a matrix
_MATRIX_WIDTH = 6  # columns of two sensors
_MAX_STACKED, _MIN_STACKED = 4, 20  # sensors whose rows take turns; samples that show it
_FRACTIONS = {"nanosec": 1e-9, "usec": 1e-6}  # of a second
Triple = tuple[int, ...]


class Guess(NamedTuple):
    """Positions of the columns found; None or () if it was not."""

    t: int | None
    acc: tuple[int, ...]
    gyr: tuple[int, ...]
    mag: tuple[int, ...]
    user: tuple[int, ...] = ()  # acceleration without the gravity that ``acc`` holds alone


class SplitClock(NamedTuple):
    """The position of whole seconds, and the unit of the fraction in the column behind it."""

    seconds: int
    unit: str


def name_columns(table: Table, hints: Hints) -> Table:
    """A table whose file names no column, no column of a matrix, or increments, with names of sensors.

    Any other is given back as it is.

    The names are a guess, which is concluded.

    Raises:
        LevelheadError: no three columns that look like an accelerometer with a gyroscope beside it.
    """
    if table.unnamed:
        return table if {"gyr", "acc"} <= set(hints.map) else name_by_numbers(table, hints)
    if not hints.map and (rates := rates_of_increments(table)) is not None:
        return rates
    if "t" not in hints.map and hints.rate is None:
        table = clock_of_intervals(table) or table
    bare = _bare_matrix(table)
    if bare is not None and not any(name in table.names for names in hints.map.values() for name in names):
        return bare if {"gyr", "acc"} <= set(hints.map) else name_by_numbers(bare, hints)
    return table if hints.map else _matrix(table) or table


def _bare_matrix(table: Table) -> ArrayTable | None:
    """A table that holds nothing but one matrix, its columns by their numbers; None if it holds something else."""
    if not isinstance(table, ArrayTable) or len(table.names) <= _MATRIX_WIDTH:
        return None
    if len({name.rpartition("[")[0] if _OF_MATRIX.fullmatch(name) else name for name in table.names}) > 1:
        return None
    return replace(table, arrays={str(i + 1): column for i, column in enumerate(table.arrays.values())})


def _matrix(table: Table) -> ArrayTable | None:
    """A table that holds nothing but a clock and a matrix of two sensors; None if it holds something else."""
    if not isinstance(table, ArrayTable):
        return None
    known = [understand(name) for name in table.names]
    columns = [i for i, name in enumerate(known) if not name.role and _OF_MATRIX.fullmatch(name.raw)]
    times = [i for i, name in enumerate(known) if name.role == "t"]
    if len(columns) != _MATRIX_WIDTH or len(times) != 1 or {"gyr", "acc"} & {name.role for name in known}:
        return None
    return with_sensors(table, columns, times[0])


def name_by_numbers(table: Table, hints: Hints) -> ArrayTable:
    """A table without names, named by its numbers; raises as ``name_columns`` does."""
    width = len(table.names)
    positions = [i for i in range(width) if i not in words_of(table)][:_MAX_COLUMNS]
    if width == len(_AXES) and (stacked := _stacked_rows(table)) is not None:
        return stacked
    if width in _ONE_SENSOR:
        return _one_sensor(table, list(range(width)))
    columns = table.read(positions, frozenset(positions))
    values = _side_by_side(columns, width)
    stamps = table.column_units
    split = _join_split_clock(values)
    guess, step = _guess_levels_or_increments(values, sorted(stamps) if split is None else [split.seconds])
    if width > _MAX_COLUMNS and guess.t is None:  # each row is a window of one sensor, perhaps
        return _one_sensor(table, list(range(width)))
    if not guess.acc or not guess.gyr:
        varying = [i for i in positions if i in stamps or _varies(values[:, i])]
        return _single_varying_sensor(table, varying, guess, values)
    return _named_table(table, hints, columns, guess, step, split)


def _named_table(
    table: Table, hints: Hints, columns: dict[int, Column], guess: Guess, step: float, split: SplitClock | None
) -> ArrayTable:
    """The columns by names that show the guess."""
    positions, stamps = list(columns), table.column_units
    if step > 0.0:  # angles and velocities gained since the row before
        columns |= {i: columns[i] / step for i in (*guess.acc, *guess.gyr)}
    named = _names(guess, split, hints)
    titles = {position: name for name, position in named.items()}
    arrays = {titles.get(i, str(i + 1)): columns[i] for i in positions}
    units = {k: "ns" for k, i in enumerate(positions) if i in stamps}
    facts = {"listed": _listed(guess), "step": step}
    as_hints = _as_hints(guess) if step == 0.0 and split is None and not guess.user else {}
    found = [*table.conclusions, Conclusion("columns", "by_numbers", named, Basis.GUESS, facts, as_hints)]
    return ArrayTable(table.source, arrays, rate=table.rate, conclusions=found, column_units=units)


def _stacked_rows(table: Table) -> ArrayTable | None:
    """A table whose rows of x, y, z are those of several sensors by turns, side by side; None if they are of one.

    Every second, third or fourth row is then as long as gravity, and the others are not.
    """
    columns = table.read([0, 1, 2])
    rows = stack(columns, [0, 1, 2])
    for count in range(2, _MAX_STACKED + 1):
        samples = len(rows) // count
        if samples < _MIN_STACKED:
            return None
        phases = [rows[k : samples * count : count] for k in range(count)]
        scores = [gravity_score(phase) for phase in phases]
        known = sorted((score, k) for k, score in enumerate(scores) if score is not None)
        if not 0 < len(known) < count or gravity_score(rows) is not None:
            continue
        side = np.hstack(phases)
        triples = [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(count)]
        acc = triples.pop(known[0][1])
        _, gyr = _find_pair(side, np.arange(samples) / 100.0, [acc], triples)
        if not gyr:
            continue
        mag = _magnetometer(side, acc, gyr, triples)
        named = {"acc": acc[0] // 3, "gyr": gyr[0] // 3} | ({"mag": mag[0] // 3} if mag else {})
        arrays = {f"{role}_{axis}": phases[k][:, i] for role, k in named.items() for i, axis in enumerate(_AXES)}
        facts = {"count": count, "listed": ", ".join(f"{MEANING[role]} in line {k + 1}" for role, k in named.items())}
        found = [*table.conclusions, Conclusion("columns", "stacked_rows", count, Basis.GUESS, facts)]
        return ArrayTable(table.source, arrays, rate=table.rate, conclusions=found)
    return None


def _as_hints(guess: Guess) -> ReadOnlyJson:
    """The hint ``map`` that names the same columns."""
    places = {"t": () if guess.t is None else (guess.t,), "gyr": guess.gyr, "acc": guess.acc, "mag": guess.mag}
    return {"map": {role: [str(i + 1) for i in positions] for role, positions in places.items() if positions}}


def _side_by_side(columns: Mapping[int, Column], width: int) -> Array:
    """(n, width) the columns at their positions, 0 elsewhere."""
    values = np.zeros((len(next(iter(columns.values()))), width))
    for i, column in columns.items():
        values[:, i] = column
    return values


def _single_varying_sensor(table: Table, varying: Sequence[int], guess: Guess, values: Array) -> ArrayTable:
    """The columns that vary as one sensor.

    Raises:
        LevelheadError: there are too many or too few of them, and the others were not identified either.
    """
    if len(varying) in _ONE_SENSOR and len(varying) > 1:
        return _one_sensor(table, varying)
    width = len(table.names)
    raise LevelheadError(
        f"{table.source} has no header that names its {width} columns, and its numbers show no "
        f"{'gyroscope' if guess.acc else 'accelerometer'}; expected the hints map gyr=… and map acc=…, three columns "
        f"by number each; {list_ranges(table.names, values)}"
    )


def _guess_levels_or_increments(values: Array, stamps: Sequence[int]) -> tuple[Guess, float]:
    """(the columns' meaning, 0), or, where they are increments since the row before, (the same, s from row to row)."""
    guess = guess_columns(values[:_MAX_ROWS], stamps)
    if guess.acc or guess.t is None:
        return guess, 0.0
    step = median(np.diff(_seconds(values[:, guess.t])))
    rates = values[:_MAX_ROWS] / np.where(np.arange(values.shape[1]) == guess.t, 1.0, step)
    increments = guess_columns(rates, [guess.t])
    return (increments, step) if increments.acc and increments.gyr else (guess, step)


def _names(guess: Guess, split: SplitClock | None, hints: Hints) -> dict[str, int]:
    """Names that show the guess, to their positions; a role that a hint maps keeps its columns' numbers."""
    named: dict[str, int] = {} if guess.t is None else {"t": guess.t}
    if split is not None:
        named = {"stamp.sec": split.seconds, f"stamp.{split.unit}": split.seconds + 1}
    words = {"gyr": guess.gyr, "acc": guess.user or guess.acc, "mag": guess.mag}
    if guess.user and not hints.map:
        words = {"gravity": guess.acc, "gyr": guess.gyr, "userAcceleration": guess.user, "mag": guess.mag}
    for word, positions in words.items():
        if word not in hints.map:
            named |= {f"{word}_{axis}": i for axis, i in zip(_AXES, positions, strict=False)}
    return named


def _listed(guess: Guess) -> str:
    """The guess, for a sentence: "t=1 gyr=2,3,4 acc=5,6,7"."""
    found: dict[str, Triple] = {"t": () if guess.t is None else (guess.t,), "gyr": guess.gyr}
    found |= {"gravity": guess.acc, "user acceleration": guess.user} if guess.user else {"acc": guess.acc}
    return _words(found | {"mag": guess.mag})


def _words(found: Mapping[str, Sequence[int]]) -> str:
    return " ".join(
        f"{role}={','.join(str(i + 1) for i in positions)}" for role, positions in found.items() if positions
    )


def _one_sensor(table: Table, positions: Sequence[int]) -> ArrayTable:
    """The columns of a file that holds one sensor, which its name shows: x, y, z, perhaps after a stamp."""
    titles = _ONE_SENSOR.get(len(positions), list(table.names))
    columns = table.read(positions, frozenset([positions[0], positions[-1]]))
    if len(titles) == 4 and not _is_increasing(columns[positions[0]]) and _is_increasing(columns[positions[3]]):
        titles = ["x", "y", "z", "time"]
    arrays = {title: columns[i] for i, title in zip(positions, titles, strict=True)}
    units = {k: "ns" for k, i in enumerate(positions) if i in table.column_units}
    return ArrayTable(table.source, arrays, rate=table.rate, conclusions=list(table.conclusions), column_units=units)


def _is_increasing(column: Column) -> bool:
    return len(column) > 2 and bool((column[1:] >= column[:-1]).all()) and bool(column[-1] > column[0])


def guess_columns(values: Array, stamps: Sequence[int] = ()) -> Guess:
    """The roles of the columns of (n, k) ``values``; ``stamps`` are columns with dates."""
    t = stamps[0] if stamps else _clock(values)
    triples = _triples(values, _sensor_columns(values, t, stamps))
    directions = {triple for triple in triples if _is_constant(values[:, list(triple)], 1.0)}
    triples = [
        triple for triple in triples
        if triple in directions or not any(set(triple) & set(direction) for direction in directions)
    ]  # fmt: skip
    candidates = _by_gravity(values, triples, 0 if t is None else t + 1)
    seconds = np.arange(len(values)) / 100.0 if t is None else _seconds(values[:, t])
    ordered = _less_steady_first(values, candidates[:_MAX_CANDIDATES])
    acc, gyr = _find_pair(values, seconds, ordered, triples)
    if gyr:
        rest = list(_apart(triples, (*acc, *gyr)))
        user = _user_acceleration(values, acc, rest) if acc in directions else ()
        return Guess(t, acc, gyr, _magnetometer(values, user or acc, gyr, triples), user)
    return Guess(t, candidates[0] if candidates else (), (), ())


def _find_pair(
    values: Array, seconds: Array, candidates: Sequence[Triple], triples: Sequence[Triple]
) -> tuple[Triple, Triple]:
    """(accelerometer, gyroscope): the candidate that turns with other columns, or has some beside it; else ((), ())."""
    apart = {acc: list(_apart(triples, acc)) for acc in candidates}
    turning = {acc: _turning(values, seconds, acc, apart[acc]) for acc in candidates}
    best, rate = max(turning.values(), default=(0.0, ()))  # of all that turns: a field, another accelerometer
    for acc, (correlation, gyr) in turning.items():
        if gyr and (gyr == rate or correlation > _CLEAR_SHARE * best):
            return acc, gyr
    beside = ((acc, _beside(values, acc, apart[acc])) for acc in candidates)
    return next((pair for pair in beside if pair[1]), ((), ()))


def _sensor_columns(values: Array, t: int | None, stamps: Sequence[int]) -> set[int]:
    """Columns that may be a sensor's axis: not a clock, not constant, not a counter, not part of a quaternion."""
    width = values.shape[1]
    usable = {
        i for i in range(width)
        if i != t and i not in stamps and _varies(values[:, i]) and not (np.diff(values[:, i]) == 1.0).all()
    }  # fmt: skip
    for i in range(width - 3):
        if _is_constant(four := values[:, i : i + 4], 1.0) or _is_mostly_unit(four):
            usable -= set(range(i, i + 4))
    return usable


def _triples(values: Array, usable: set[int]) -> list[Triple]:
    """Three columns side by side."""
    return [(i, i + 1, i + 2) for i in range(values.shape[1] - 2) if {i, i + 1, i + 2} <= usable]


def _by_gravity(values: Array, triples: Sequence[Triple], first: int) -> list[Triple]:
    """The triples whose length may be gravity, the best first; sensors mostly stand in threes from ``first`` on."""
    scored = sorted(
        (score + 0.01 * triple[0] + (0.02 if (triple[0] - first) % 3 else 0.0), triple)
        for triple in triples
        if (score := gravity_score(values[:, list(triple)])) is not None
    )
    return [triple for _, triple in scored]


def _apart(triples: Sequence[Triple], taken: Sequence[int]) -> Iterator[Triple]:
    """The triples without a column of ``taken``."""
    return (triple for triple in triples if not set(triple) & set(taken))


def _less_steady_first(values: Array, triples: Sequence[Triple]) -> Sequence[Triple]:
    """The candidates for the accelerometer, behind the others those whose length is far steadier in motion.

    A magnetometer turns as gravity does, and in some units it is as long; but motion disturbs gravity's length only.
    """
    spread = {triple: _length_spread(values[:, list(triple)]) for triple in triples}
    most = {one: max((spread[other] for other in _apart(triples, one)), default=0.0) for one in triples}
    steady = [one for one in triples if most[one] > _MIN_MOTION and spread[one] < _MAX_STEADY_SHARE * most[one]]
    return [*(triple for triple in triples if triple not in steady), *steady]


def _length_spread(triple: Array) -> float:
    length = np.sqrt((triple * triple).sum(axis=1))
    length = length[np.isfinite(length)]
    typical = median(length) if len(length) else 0.0
    return float(np.median(np.abs(length / typical - 1.0))) if typical > 0.0 else 0.0


def _varies(column: Array) -> bool:
    finite = column[np.isfinite(column)]
    return len(finite) > 0 and float(finite.min()) < float(finite.max())


def _clock(values: Array) -> int | None:
    """The first column that goes on evenly."""
    for i in range(min(4, values.shape[1])):
        column = values[:, i]
        if len(column) < 5 or not np.isfinite(column).all():
            continue
        steps = np.diff(column)
        if (steps >= 0).mean() > 0.98 and median(steps) > 0 and not (steps == 1.0).all():
            return i
    return None


def _seconds(stamps: Array) -> Array:
    from levelhead import units

    t = (stamps - stamps[0]) * units.factor("time", guess_unit(stamps))
    forward: Array = np.maximum.accumulate(t) + 1e-7 * np.arange(len(t))
    return forward


def gravity_score(triple: Array) -> float | None:
    """How little the length varies, for three columns whose usual length is gravity in some unit; None: it is not."""
    length = np.sqrt((triple * triple).sum(axis=1))
    length = length[np.isfinite(length)]
    if len(length) < 5:
        return None
    typical = median(length)
    known = [GRAVITY, 1.0, 1000.0, *(counts for counts in ACC if counts >= 256.0)]
    near = min(abs(math.log(typical / length)) for length in known) if typical > 0 else 9.0
    spread = float(np.median(np.abs(length / typical - 1.0))) if typical > 0 else 9.0
    if near > 0.2 or spread > _MAX_SPREAD:
        return None
    return spread + 0.3 * near + (1.0 if _is_constant(triple) else 0.0)


def _is_constant(triple: Array, usual: float | None = None) -> bool:
    """Whether three columns have one length, but for rounding: a direction that software worked out (``usual``: 1)."""
    length = np.sqrt((triple * triple).sum(axis=1))
    length = length[np.isfinite(length)]
    typical = median(length) if len(length) else 0.0
    if len(length) < 5 or not typical > 0.0 or (usual is not None and abs(typical / usual - 1.0) > _MAX_UNIT_SPREAD):
        return False
    whole = bool((triple[:100] == np.rint(triple[:100])).all())
    return float(np.quantile(np.abs(length / typical - 1.0), 0.9)) < (
        max(_MAX_UNIT_SPREAD, 1.0 / typical) if whole else _MAX_UNIT_SPREAD
    )


def _is_mostly_unit(four: Array) -> bool:
    """Whether half of the rows have length 1 to rounding: a quaternion, interpolated in between."""
    return abs(median_norm(four) - 1.0) < _ROUNDING and _is_unit_in_half(four)


def _is_unit_in_half(four: Array) -> bool:
    off = np.abs(np.sqrt((four * four).sum(axis=1)) - 1.0)
    return median(off[np.isfinite(off)]) < _ROUNDING


def _user_acceleration(values: Array, gravity: Triple, triples: Sequence[Triple]) -> Triple:
    """The three columns beside a direction of gravity that hold little of it: Core Motion's user acceleration."""
    down = values[:, list(gravity)]
    for triple in triples:
        moved = values[:, list(triple)]
        rows = np.isfinite(down).all(axis=1) & np.isfinite(moved).all(axis=1)
        beside = triple[0] == gravity[2] + 1 or triple[2] == gravity[0] - 1
        if beside and rows.any() and 0.0 < float(np.abs(moved[rows]).mean()) < 1.0:
            part = float((moved[rows] * down[rows]).sum() / (down[rows] ** 2).sum())
            if abs(part) < 0.5:
                return triple
    return ()


def _join_split_clock(values: Array) -> SplitClock | None:
    """Adds the fraction of a second to the whole seconds in the column before it, as ROS writes stamps."""
    for i in range(min(3, values.shape[1] - 1)):
        for unit, size in _FRACTIONS.items():
            if _is_split_clock(values[:, i], values[:, i + 1], size):
                values[:, i] += size * values[:, i + 1]
                values[:, i + 1] = 0.0
                return SplitClock(i, unit)
    return None


def _is_split_clock(whole: Array, rest: Array, size: float) -> bool:
    """Whether one column holds whole seconds and the other numbers of ``size`` seconds."""
    steps = np.diff(whole)
    if len(whole) < 20 or not (np.isfinite(whole) & np.isfinite(rest)).all() or (steps < 0).any() or not steps.any():
        return False
    if not (rest.min() >= 0 and 1e-3 < size * rest.max() < 1.0 and (rest == np.rint(rest)).all()):
        return False
    return bool((whole == np.rint(whole)).all()) and bool((np.diff(whole + size * rest) >= 0).all())


def _turning(values: Array, t: Array, acc: Triple, triples: Sequence[Triple]) -> tuple[float, Triple]:
    """(correlation, the three columns against which gravity turns); (_, ()) without motion."""
    force = values[:, list(acc)]
    force = force / median_norm(force) * GRAVITY
    correlation = _MIN_CORRELATION
    best: Triple = ()
    for triple in triples:
        turn = turn_of_gravity(t, values[:, list(triple)], force)
        if turn is not None and turn.turned > _MIN_TURN and abs(turn.correlation) > correlation:
            correlation, best = abs(turn.correlation), triple
    return correlation, best


def shows_turn(table: ArrayTable) -> bool:
    """Whether gravity turns with the gyroscope in a table that ``name_by_numbers`` has named; at rest it does not."""
    gyr, acc = (np.stack([table.arrays[f"{role}_{axis}"] for axis in _AXES], axis=1) for role in ("gyr", "acc"))
    t = _seconds(table.arrays["t"]) if "t" in table.arrays else np.arange(len(gyr)) / 100.0
    turn = turn_of_gravity(t, gyr, acc / median_norm(acc) * GRAVITY)
    return turn is not None and turn.turned > _MIN_TURN and abs(turn.correlation) > _MIN_CORRELATION


def _beside(values: Array, acc: Triple, triples: Sequence[Triple]) -> Triple:
    """The three columns right behind the accelerometer, or right before it.

    Not a second accelerometer, whose numbers are as long as the first one's.
    """
    length = median_norm(values[:, list(acc)])
    twins = {
        triple[0] for triple in triples if abs(median_norm(values[:, list(triple)]) / length - 1.0) < _MAX_TWIN_SHARE
    }
    first = acc[2] + 1
    while first in twins:
        first += 3
    behind = [triple for triple in triples if triple[0] == first]
    return next(iter([*behind, *(triple for triple in triples if triple[2] == acc[0] - 1)]), ())


def _magnetometer(values: Array, acc: Triple, gyr: Triple, triples: Sequence[Triple]) -> Triple:
    """Three more columns right behind, or right before, if their length is steady and no unit vector's."""
    behind, before, force = max(acc[2], gyr[2]) + 1, min(acc[0], gyr[0]) - 1, values[:, list(acc)]
    near = sorted((triple for triple in triples if triple[0] == behind or triple[2] == before), reverse=True)
    return next((at for at in near if _is_field(field := values[:, list(at)]) and not _along(field, force)), ())


def _along(one: Array, other: Array) -> bool:
    """Whether (n, 3) vectors point where others do, whatever their unit: a second accelerometer, no field."""
    lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    return float(np.nanmedian((one * other).sum(axis=1) / np.where(lengths > 0.0, lengths, np.nan))) > _MIN_COSINE


def _is_field(triple: Array) -> bool:
    length = np.sqrt((triple**2).sum(axis=1))
    length = length[np.isfinite(length)]
    if not len(length):
        return False
    mean = float(length.mean())
    return float(length.std()) < 0.3 * mean and abs(mean - 1.0) > 1e-3 and mean > 0.1


def map_words(values: Array) -> str:
    """``--map`` for the columns of (n, k) ``values``: as their numbers look, else such as fits how many there are."""
    guess = guess_columns(values)
    found: dict[str, Sequence[int]] = {"t": () if guess.t is None else (guess.t,), "gyr": guess.gyr, "acc": guess.acc}
    if not guess.acc or not guess.gyr or guess.user:
        first = 0 if values.shape[1] < 7 else 1
        found = {"t": range(first), "gyr": range(first + 3, first + 6), "acc": range(first, first + 3)}
        return _options(found)
    return _options(found | {"mag": guess.mag})


def _options(found: Mapping[str, Sequence[int]]) -> str:
    """Each role behind an option of its own, because ``--map`` takes one."""
    return " ".join(f"--map {word}" for word in _words(found).split())


def list_ranges(names: Sequence[str], values: Array) -> str:
    """The columns of (n, k) ``values`` with their ranges, for a person who can name them."""
    shown = []
    for name, column in zip(names[:_SHOWN], values.T, strict=False):
        finite = column[np.isfinite(column)]
        shown.append(f"{name} {finite.min():.4g} to {finite.max():.4g}" if len(finite) else f"{name} empty")
    more = f", and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f"the columns reach: {', '.join(shown)}{more}"
