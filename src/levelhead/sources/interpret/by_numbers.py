"""Columns without names: which is the clock, the accelerometer, the gyroscope, by their numbers."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, median
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.formats.text.delimited import TextTable
from levelhead.sources.hints import Hints
from levelhead.sources.interpret import unit_inference
from levelhead.sources.interpret.counts import ACC
from levelhead.sources.table import ArrayTable, Column
from levelhead.units import GRAVITY

_ROWS = 20_000
_MOST = 64  # columns that are looked at
_MOVED, _STEADY = 0.04, 0.25  # spread of a length from which it was motion; share of it that is far steadier
_TWIN = 0.1  # by which the length of a second accelerometer differs, at most
_TRIED = 8  # sets of three columns that may be the accelerometer
_SPREAD = 0.25  # median deviation of the length of gravity from its median, as a share, at most
_EXACT = 2e-4  # a length that constant is a unit vector's: a row of a rotation matrix, a quaternion's part
_AXES = "xyz"
_ONE_SENSOR = {1: ["1"], 3: ["x", "y", "z"], 4: ["time", "x", "y", "z"]}


class Guess(NamedTuple):
    """Positions of what was found; None or () if it was not."""

    t: int | None
    acc: tuple[int, ...]
    gyr: tuple[int, ...]
    mag: tuple[int, ...]
    user: tuple[int, ...] = ()  # acceleration without the gravity that ``acc`` holds alone


def with_names(table: TextTable, hints: Hints) -> ArrayTable:
    """A text table without a header, its columns named by what their numbers say, which is a guess and noted.

    Raises:
        LevelheadError: no three columns that look like an accelerometer with a gyroscope beside it.
    """
    width = len(table.names)
    everything = [i for i in range(width) if i not in table.layout.words][:_MOST]
    if width in _ONE_SENSOR or width > _MOST:
        return _one_sensor(table, list(range(width)))
    columns = table.read(everything, frozenset(everything))
    values = np.zeros((len(columns[everything[0]]), width))
    for i, column in columns.items():
        values[:, i] = column
    stamps = table.layout.stamps
    second = _split_clock(values)
    if second is not None:
        values[:, second] += 1e-9 * values[:, second + 1]
        values[:, second + 1] = 0.0
    guess = guess_columns(values[:_ROWS], sorted(stamps) if second is None else [second])
    step = 0.0
    if not guess.acc and guess.t is not None:
        step = median(np.diff(_seconds(values[:, guess.t])))
        increments = guess_columns(values[:_ROWS] / np.where(np.arange(width) == guess.t, 1.0, step), [guess.t])
        guess = increments if increments.acc and increments.gyr else guess
    if not guess.acc or not guess.gyr:
        lively = [i for i in everything if i in stamps or _varies(values[:, i])]
        if len(lively) in _ONE_SENSOR and len(lively) > 1:
            return _one_sensor(table, lively)
        raise LevelheadError(
            f"{table.source} has no header that names its {width} columns, and its numbers show no "
            f"{'gyroscope' if guess.acc else 'accelerometer'}; expected hints such as "
            f"{_example(width)} (columns by number)"
        )
    arrays = {str(i + 1): columns[i] for i in everything}
    if step > 0.0:  # angles and velocities gained since the row before
        arrays |= {str(i + 1): columns[i] / step for i in (*guess.acc, *guess.gyr)}
    named: dict[str, int] = {"t": guess.t} if guess.t is not None else {}
    if second is not None:
        named = {"stamp.sec": second, "stamp.nanosec": second + 1}
    if guess.user and not hints.map:
        named |= {f"gravity_{axis}": i for axis, i in zip(_AXES, guess.acc, strict=True)}
    for role, positions in (("gyr", guess.gyr), ("acc", guess.user or guess.acc), ("mag", guess.mag)):
        if role not in hints.map:
            word = "userAcceleration" if role == "acc" and guess.user and not hints.map else role
            named |= {f"{word}_{axis}": i for axis, i in zip(_AXES, positions, strict=False)}
    listed = " ".join(
        f"{role}={','.join(str(i + 1) for i in positions)}"
        for role, positions in (
            ("t", () if guess.t is None else (guess.t,)), ("gyr", guess.gyr),
            *((("gravity", guess.acc), ("user acceleration", guess.user)) if guess.user else (("acc", guess.acc),)),
            ("mag", guess.mag),
        )
        if positions
    )  # fmt: skip
    units = {k: "ns" for k, i in enumerate(everything) if i in stamps}
    given = dict(zip((str(i + 1) for i in everything), everything, strict=True))
    titles = {position: name for name, position in named.items() if position in given.values()}
    renamed = {titles.get(i, str(i + 1)): arrays[str(i + 1)] for i in everything}
    facts = {"listed": listed, "step": step}
    found = [*table.conclusions, Conclusion("columns", "by_numbers", named, Basis.GUESS, facts)]
    return ArrayTable(table.source, renamed, rate=table.rate, conclusions=found, column_units=units)


def _one_sensor(table: TextTable, positions: Sequence[int]) -> ArrayTable:
    """The columns of a file that holds one sensor, which its name tells: x, y, z, perhaps after a stamp."""
    titles = _ONE_SENSOR.get(len(positions), list(table.names))
    columns = table.read(positions, frozenset([positions[0], positions[-1]]))
    if len(titles) == 4 and not _goes_on(columns[positions[0]]) and _goes_on(columns[positions[3]]):
        titles = ["x", "y", "z", "time"]
    arrays = {title: columns[i] for i, title in zip(positions, titles, strict=True)}
    units = {k: "ns" for k, i in enumerate(positions) if i in table.layout.stamps}
    return ArrayTable(table.source, arrays, rate=table.rate, conclusions=list(table.conclusions), column_units=units)


def _goes_on(column: Column) -> bool:
    return len(column) > 2 and bool((column[1:] >= column[:-1]).all()) and bool(column[-1] > column[0])


def guess_columns(values: Array, stamps: Sequence[int] = ()) -> Guess:
    """What the columns of (n, k) ``values`` are; ``stamps`` are columns with dates."""
    n, width = values.shape
    t = stamps[0] if stamps else _clock(values)
    usable = [
        i for i in range(width)
        if i != t and i not in stamps and _varies(values[:, i]) and not (np.diff(values[:, i]) == 1.0).all()
    ]  # fmt: skip
    quats = [range(i, i + 4) for i in range(width - 3) if _is_constant(values[:, i : i + 4], 1.0)]
    usable = [i for i in usable if not any(i in four for four in quats)]
    triples = [(i, i + 1, i + 2) for i in range(width - 2) if {i, i + 1, i + 2} <= set(usable)]
    first = 0 if t is None else t + 1  # sensors mostly stand in threes from here on
    units = {one for one in triples if _is_constant(values[:, list(one)], 1.0)}
    triples = [one for one in triples if one in units or not any(set(one) & set(unit) for unit in units)]
    scored = sorted(
        (score + 0.01 * triple[0] + (0.02 if (triple[0] - first) % 3 else 0.0), triple)
        for triple in triples
        if (score := gravity_score(values[:, list(triple)])) is not None
    )
    seconds = np.arange(n) / 100.0 if t is None else _seconds(values[:, t])
    for acc in _less_steady_first(values, [triple for _, triple in scored[:_TRIED]]):
        gyr = _gyroscope(values, seconds, acc, [one for one in triples if not set(one) & set(acc)])
        if gyr:
            user = _user_acceleration(values, acc, [one for one in triples if not set(one) & {*acc, *gyr}])
            mag = _magnetometer(values, user or acc, gyr, triples)
            return Guess(t, acc, gyr, mag, user if acc in units else ())
    return Guess(t, scored[0][1] if scored else (), (), ())


def _less_steady_first(values: Array, triples: Sequence[tuple[int, ...]]) -> Sequence[tuple[int, ...]]:
    """The candidates for the accelerometer, behind the others those whose length is far steadier in motion.

    A magnetometer turns as gravity does, and in some units it is as long; but motion disturbs gravity's length only.
    """
    spread = {one: _length_spread(values[:, list(one)]) for one in triples}
    most = max(spread.values(), default=0.0)
    steady = [one for one in triples if most > _MOVED and spread[one] < _STEADY * most]
    return [*(one for one in triples if one not in steady), *steady]


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
    from levelhead.sources.interpret.clock_choice import guess_unit

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
    known = [GRAVITY, 1.0, 1000.0, *(one for one in ACC if one >= 256.0)]
    near = min(abs(math.log(typical / one)) for one in known) if typical > 0 else 9.0
    spread = float(np.median(np.abs(length / typical - 1.0))) if typical > 0 else 9.0
    if near > 0.2 or spread > _SPREAD:
        return None
    return spread + 0.3 * near + (1.0 if _is_constant(triple) else 0.0)


def _is_constant(triple: Array, usual: float | None = None) -> bool:
    """Whether three columns have one length, but for rounding: a direction that software worked out (``usual``: 1)."""
    length = np.sqrt((triple * triple).sum(axis=1))
    length = length[np.isfinite(length)]
    typical = median(length) if len(length) else 0.0
    if len(length) < 5 or not typical > 0.0 or (usual is not None and abs(typical / usual - 1.0) > _EXACT):
        return False
    whole = bool((triple[:100] == np.rint(triple[:100])).all())
    return float(np.quantile(np.abs(length / typical - 1.0), 0.9)) < (max(_EXACT, 1.0 / typical) if whole else _EXACT)


def _user_acceleration(
    values: Array, gravity: tuple[int, ...], triples: Sequence[tuple[int, int, int]]
) -> tuple[int, ...]:
    """The three columns beside a direction of gravity that hold little of it: Core Motion's user acceleration."""
    down = values[:, list(gravity)]
    for one in triples:
        moved = values[:, list(one)]
        rows = np.isfinite(down).all(axis=1) & np.isfinite(moved).all(axis=1)
        beside = one[0] == gravity[2] + 1 or one[2] == gravity[0] - 1
        if beside and rows.any() and 0.0 < float(np.abs(moved[rows]).mean()) < 1.0:
            part = float((moved[rows] * down[rows]).sum() / (down[rows] ** 2).sum())
            if abs(part) < 0.5:
                return one
    return ()


def _split_clock(values: Array) -> int | None:
    """The column of whole seconds right before one of nanoseconds, as ROS writes stamps; None: there is none."""
    for i in range(min(3, values.shape[1] - 1)):
        whole, rest = values[:, i], values[:, i + 1]
        steps = np.diff(whole)
        if len(whole) < 20 or not np.isfinite(values[:, i : i + 2]).all() or (steps < 0).any() or not steps.any():
            continue
        nano = rest.min() >= 0 and 1e6 < rest.max() < 1e9 and bool((rest == np.rint(rest)).all())
        if nano and bool((whole == np.rint(whole)).all()) and bool((np.diff(whole + 1e-9 * rest) >= 0).all()):
            return i
    return None


def _gyroscope(
    values: Array, t: Array, acc: tuple[int, ...], triples: Sequence[tuple[int, int, int]]
) -> tuple[int, ...]:
    """The three columns against which gravity turns; without motion, those beside the accelerometer.

    Of those beside it, not a second accelerometer, whose numbers are as long as the first one's.
    """
    force = values[:, list(acc)]
    force = force / unit_inference.median_norm(force) * GRAVITY
    best: tuple[float, tuple[int, ...]] = (0.5, ())
    for triple in triples:
        turn = unit_inference.turn_of_gravity(t, values[:, list(triple)], force)
        if turn is not None and turn.turned > 0.03 and abs(turn.correlation) > best[0]:
            best = abs(turn.correlation), triple
    if best[1]:
        return best[1]
    length = unit_inference.median_norm(values[:, list(acc)])
    others = [one for one in triples if abs(unit_inference.median_norm(values[:, list(one)]) / length - 1.0) < _TWIN]
    first = acc[2] + 1
    while any(one[0] == first for one in others):
        first += 3
    beside = [one for one in triples if one[0] == first] or [one for one in triples if one[2] == acc[0] - 1]
    return beside[0] if beside else ()


def _magnetometer(
    values: Array, acc: tuple[int, ...], gyr: tuple[int, ...], triples: Sequence[tuple[int, int, int]]
) -> tuple[int, ...]:
    """Three more columns right behind, if their length is steady and no unit vector's."""
    last = max(acc[2], gyr[2])
    for triple in triples:
        if triple[0] == last + 1:
            length = np.sqrt((values[:, list(triple)] ** 2).sum(axis=1))
            length = length[np.isfinite(length)]
            if (
                len(length)
                and float(length.std()) < 0.3 * float(length.mean())
                and abs(float(length.mean()) - 1.0) > 1e-3
                and float(length.mean()) > 0.1
            ):
                return triple
    return ()


def map_words(values: Array) -> str:
    """``--map`` for the columns of (n, k) ``values``: as their numbers look, else such as fits how many there are."""
    guess = guess_columns(values)
    if not guess.acc or not guess.gyr or guess.user:
        words = ["gyr=4,5,6", "acc=1,2,3"] if values.shape[1] < 7 else ["t=1", "gyr=5,6,7", "acc=2,3,4"]
        return _options(words)
    found = {"t": () if guess.t is None else (guess.t,), "gyr": guess.gyr, "acc": guess.acc, "mag": guess.mag}
    words = [f"{role}={','.join(str(i + 1) for i in positions)}" for role, positions in found.items() if positions]
    return _options(words)


def _options(words: Sequence[str]) -> str:
    """Each word behind an option of its own, because ``--map`` takes one."""
    return " ".join(f"--map {word}" for word in words)


def _example(width: int) -> str:
    """Hints that fit the number of columns."""
    if width < 7:
        return "--map acc=1,2,3 --map gyr=4,5,6 --rate 100"
    return "--map t=1 --map gyr=2,3,4 --map acc=5,6,7"
