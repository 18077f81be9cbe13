"""Which columns are which sensor: from their names, and from hints."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches

from levelhead.errors import LevelheadError, nearest
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.hints import MEANING, QUANTITY, WIDTH, NeedsHints
from levelhead.sources.names.column_groups import (
    ColumnGroup,
    best_pair,
    column_group,
    group_axes,
    nearest_group,
    order_positions,
    others,
    shared_name,
)
from levelhead.sources.names.column_name import Name, holds_gravity, split, understand, unit_in

_USER = re.compile("user|linear", re.IGNORECASE)  # acceleration without the gravity beside it
_MINUS = re.compile(r"\s*[-−]\s*[^\W\d]")  # before a name; "- 1" is none
_SENSORS = ("gyr", "acc", "mag")
NEEDED = ("gyr", "acc")  # without which a log is not a recording
_EXAMPLE = {"gyr": "gyr_x, gyr_y, gyr_z", "acc": "acc_x, acc_y, acc_z"}


@dataclass(frozen=True)
class Roles:
    """Where the quantities stand in a table.

    Attributes:
        columns: role ("t", "gyr", "acc", "mag", "q", "bias", "moving", "seen") to the positions of its columns.
        units: role to the unit that the names give; roles without one are not in it.
        ignored: names of the columns that nothing uses, in the order of the file.
        conclusions: choices that were made.
        mapped: roles that a hint decided.
    """

    columns: Mapping[str, tuple[int, ...]]
    units: Mapping[str, str]
    ignored: tuple[str, ...] = ()
    conclusions: tuple[Conclusion, ...] = ()
    mapped: frozenset[str] = field(default_factory=frozenset)

    @property
    def used(self) -> set[int]:
        """Positions of the columns that have a role."""
        return {i for positions in self.columns.values() for i in positions}


def assign(
    names: Sequence[str],
    hints: Mapping[str, Sequence[str]],
    source: str,
    unit_known: frozenset[str] = frozenset(),
    *,
    sensor: str | None = None,
    context: str = "",
    filled: frozenset[int] | None = None,
    stamps: frozenset[int] = frozenset(),
    needed: Sequence[str] = NEEDED,
) -> Roles:
    """The role of each column.

    ``hints`` is the map of ``sources.hints``: a role with no names is left out. The roles in ``unit_known`` may have
    any unit in their names, because a hint gives theirs. ``sensor`` is a word that the names of the wanted unit of
    sensors share; ``context`` is the name of the file or sheet; ``filled`` are the positions of columns that hold
    numbers at all, ``stamps`` those of columns of dates; ``needed`` are the sensors without which it refuses.

    Of several sets of columns for one sensor the plainest is taken: not the linear, filtered, raw or uncalibrated one;
    of several sensors the first; both are noted. ``columns["t"]`` holds all candidates for the time.

    Raises:
        LevelheadError: a sensor that is needed, an axis or a hinted column that is not there, units that differ
            between axes.
    """
    known = [understand(name, context) for name in names]
    _refuse_repeated(names, hints, known, source)
    columns = _single_columns(known, hints, source, filled, stamps)
    groups = {role: _groups(role, known, names, context, filled) for role in _SENSORS if role not in hints}
    groups = _read_p_q_r(_read_g(groups, known), names)
    gravity = _gravity(names)
    if gravity and not groups.get("acc", True):
        groups["acc"] = user_acceleration(names, context, filled)
    chosen = _choose(groups, columns, sensor, known, source)
    _refuse_negated(chosen, source)
    columns |= {role: group.positions for role, group in chosen.items()}
    columns |= {"gravity": gravity} if gravity and "acc" not in hints else {}
    columns |= _flags(known)
    _disjoint(columns, names, source)
    _complete(columns, names, source, needed)
    units = _units(columns, unit_known, names, source)
    conclusions = tuple(
        _plainest(role, group, groups[role], sensor) for role, group in chosen.items() if len(groups[role]) > 1
    )
    return Roles(columns, units, _unused(columns, names), conclusions, frozenset(hints))


EDGES = "._- /"  # between the name of a sensor and its kind
KINDS = {"gyr", "gyro", "gyroscope", "omega", "acc", "accel", "accelerometer"}


def sensor_names(names: Sequence[str], context: str = "") -> list[str]:
    """The name of each of several sensors of a table: the common part of its gyroscope's and accelerometer's columns.

    Each is a value of the hint ``sensor``; empty where the columns do not pair.
    """
    known = [understand(name, context) for name in names]
    gyrs, accs = (_groups(role, known, names, context, None) for role in ("gyr", "acc"))
    found: dict[str, None] = {}
    for gyr in gyrs:
        for acc in accs:
            shared = shared_name((*gyr.names, *acc.names)).strip(EDGES)
            rest = {group.label.replace(shared, "", 1).strip(EDGES).lower() for group in (gyr, acc)}
            if shared and rest <= KINDS:
                found[shared] = None
    return list(found)


def _single_columns(
    known: Sequence[Name],
    hints: Mapping[str, Sequence[str]],
    source: str,
    filled: frozenset[int] | None,
    stamps: frozenset[int],
) -> dict[str, tuple[int, ...]]:
    """The columns that hints give, and of the roles that one set of columns can have."""
    columns: dict[str, tuple[int, ...]] = {}
    for role in ("t", *_SENSORS, "q", "bias"):
        if role in hints:
            positions = _hinted_columns(role, hints[role], known, source)
        elif role == "t":
            positions = _times(known, filled, stamps)
        else:
            positions = () if role in _SENSORS else _group(role, known, source)
        if positions:
            columns[role] = positions
    return columns


def _flags(known: Sequence[Name]) -> dict[str, tuple[int, ...]]:
    """The columns of the reference's motion and visibility, where there is but one of a kind."""
    flags = {role: tuple(i for i, name in enumerate(known) if name.role == role) for role in ("moving", "seen")}
    return {role: positions for role, positions in flags.items() if len(positions) == 1}


def _unused(columns: Mapping[str, tuple[int, ...]], names: Sequence[str]) -> tuple[str, ...]:
    """The names of the columns that nothing uses; of several times one is used."""
    used = {i for role, positions in columns.items() for i in (positions[:1] if role == "t" else positions)}
    return tuple(name or f"(column {i + 1})" for i, name in enumerate(names) if i not in used)


def _units(
    columns: Mapping[str, tuple[int, ...]], unit_known: frozenset[str], names: Sequence[str], source: str
) -> dict[str, str]:
    """The units that the names give; those in ``unit_known`` may contradict each other.

    Raises:
        LevelheadError: the axes of a sensor differ in unit.
    """
    units: dict[str, str] = {}
    for role in [role for role in columns if role in QUANTITY and role != "t"]:
        with suppress(*((LevelheadError,) if role in unit_known else ())):
            if unit := _unit(role, columns[role], names, source):
                units[role] = unit
    if "t" in columns and "t" not in unit_known and (unit := unit_in(names[columns["t"][0]], "t", source)):
        units["t"] = unit
    return units


def _times(known: Sequence[Name], filled: frozenset[int] | None, stamps: frozenset[int]) -> tuple[int, ...]:
    """All columns that may be the time, those that are called just that first; a T beside a time is a temperature.

    A column of dates is a time under any name.
    """
    times = [
        i for i, name in enumerate(known)
        if (name.role == "t" or (i in stamps and not name.role)) and (filled is None or i in filled)
    ]  # fmt: skip
    lower = [i for i in times if known[i].raw.strip() != "T"] or times
    with_unit = [i for i in lower if not _unknown_unit(known[i].raw)]
    lower = with_unit or lower
    return tuple(sorted(lower, key=lambda i: not known[i].exact))


def _unknown_unit(raw: str) -> bool:
    """Whether the brackets of a name hold a unit that is none of time, as in T(°)."""
    try:
        unit_in(raw, "t", "")
    except LevelheadError:
        return True
    return False


def _groups(
    role: str, known: Sequence[Name], names: Sequence[str], context: str, filled: frozenset[int] | None
) -> list[ColumnGroup]:
    complete, _ = group_axes(role, known, filled)
    return [
        column_group(positions, [names[i] for i in positions], context)
        for positions in (order_positions(role, axes) for axes in complete)
    ]


def _read_g(groups: dict[str, list[ColumnGroup]], known: Sequence[Name]) -> dict[str, list[ColumnGroup]]:
    """The groups, where a G beside a gyroscope is the acceleration that is not there otherwise."""
    gyrs = groups.get("gyr", [])
    by_letter = [group for group in gyrs if known[group.positions[0]].stem == "g"]
    if groups.get("acc", True) or not by_letter or len(gyrs) == len(by_letter):
        return groups
    return groups | {"acc": by_letter, "gyr": [group for group in gyrs if group not in by_letter]}


def _read_p_q_r(groups: dict[str, list[ColumnGroup]], names: Sequence[str]) -> dict[str, list[ColumnGroup]]:
    """The groups, where p, q, r beside an accelerometer are the rates that are not there otherwise."""
    letters = {name.strip().lower(): i for i, name in reversed(list(enumerate(names)))}
    if not groups.get("acc") or groups.get("gyr", True) or not {"p", "q", "r"} <= set(letters):
        return groups
    positions = tuple(letters[letter] for letter in "pqr")
    return groups | {"gyr": [column_group(positions, [names[i] for i in positions])]}


def user_acceleration(names: Sequence[str], context: str, filled: frozenset[int] | None) -> list[ColumnGroup]:
    """Acceleration without gravity, where that is beside it."""
    return _groups("acc", [understand(plain_name(name), context) for name in names], names, context, filled)


def plain_name(name: str) -> str:
    """The name without the word for an acceleration that lacks gravity."""
    return _USER.sub("", name)


def _choose(
    groups: Mapping[str, Sequence[ColumnGroup]],
    columns: Mapping[str, tuple[int, ...]],
    sensor: str | None,
    known: Sequence[Name],
    source: str,
) -> dict[str, ColumnGroup]:
    """The groups to take, of roles that have no ``columns`` yet.

    Raises:
        LevelheadError: no group is of the ``sensor``; a gyroscope or accelerometer has no complete set of axes.
    """
    named = {role: _of_sensor(several, sensor) for role, several in groups.items()}
    if sensor is not None and not any(named.get(role) for role in ("gyr", "acc")):
        labels = dict.fromkeys(group.label for several in groups.values() for group in several)
        raise LevelheadError(f"{source} has no sensor '{sensor}'; {nearest(sensor, labels)}")
    hinted = {role: [column_group(at, [known[i].raw for i in at])] for role, at in columns.items() if at}
    gyr, acc = best_pair(*(hinted.get(role) or named.get(role, []) for role in ("gyr", "acc")))
    mag = nearest_group(named.get("mag", []), gyr)
    chosen = {}
    for role, group in (("gyr", gyr), ("acc", acc), ("mag", mag)):
        if role in columns:
            continue
        if group is not None:
            chosen[role] = group
        elif role in groups:
            _incomplete(role, known, source)
    return chosen


def _plainest(role: str, group: ColumnGroup, several: Sequence[ColumnGroup], sensor: str | None) -> Conclusion:
    """That ``group`` was taken, and not the others of the same role."""
    rest = [other for other in several if other.positions != group.positions]
    equals = others(several, group) if sensor is None else []
    facts = {
        "columns": ", ".join(group.names),
        "rest": "; not ".join(", ".join(other.names) for other in rest[:3]),
        "other_sensor": _distinct(equals[0], group) if equals else "",
    }
    confirm = {"map": {role: list(group.names)}}
    return Conclusion(f"{role}.columns", "plainest", group.names, Basis.HEADER, facts, confirm)


def _of_sensor(groups: Sequence[ColumnGroup], sensor: str | None) -> list[ColumnGroup]:
    if sensor is None:
        return list(groups)
    wanted = "".join(split(sensor))
    return [group for group in groups if any(wanted in "".join(split(name)) for name in group.names)]


def _distinct(group: ColumnGroup, other: ColumnGroup) -> str:
    """A word that names one sensor and not the other."""
    return next(iter(sorted(group.words - other.words, key=lambda word: (word.isdigit(), word))), group.label)


def _gravity(names: Sequence[str]) -> tuple[int, ...]:
    """The columns of a gravity vector that a phone or watch has worked out."""
    axes: dict[str, int] = {}
    for i, name in enumerate(names):
        words = split(name)
        if {"gravity", "grav"} & set(words) and not holds_gravity(words):
            for axis in "xyz":
                if axis in words and axis not in axes:
                    axes[axis] = i
    return order_positions("acc", axes)


def _refuse_repeated(
    names: Sequence[str], hints: Mapping[str, Sequence[str]], known: Sequence[Name], source: str
) -> None:
    """Refuses a table in which a column of a sensor has the name of another one."""
    for i, name in enumerate(known):
        if name.role in {"gyr", "acc"} and name.role not in hints and names.index(names[i]) != i:
            raise LevelheadError(
                f"{source}: two columns are named {name.raw}; rename one of them ({MEANING.get(name.role, name.role)})"
            )


def _refuse_negated(chosen: Mapping[str, ColumnGroup], source: str) -> None:
    """Refuses columns some of which have a minus before their names ("-Gyro Y"): their numbers may be reversed."""
    every = [name for group in chosen.values() for name in group.names]
    negated = [name for name in every if _MINUS.match(name)]
    if 0 < len(negated) < len(every):
        raise NeedsHints(
            f"{source}: '{negated[0].strip()}' begins with a minus, so its numbers may have the reversed sign; "
            "multiply such columns by -1 and name them without the minus, or take the numbers as they are",
            map={role: list(group.names) for role, group in chosen.items() if {*negated} & {*group.names}},
        )


def _incomplete(role: str, known: Sequence[Name], source: str) -> None:
    """Refuses a sensor that lacks an axis; a magnetometer of one axis is left out."""
    _, rest = group_axes(role, known, None)
    if not rest or role == "mag":
        return
    axes = max(rest, key=len)
    present = ", ".join(known[i].raw for i in axes.values())
    missing = ", ".join(sorted(set("xyz") - set(axes))) or "x, y, z"
    if (whole := _misspelt(axes, known)) is not None:
        raise NeedsHints(
            f"{source}: the {MEANING[role]} has {present} but no column for {missing}; '{whole[-1]}' looks like it",
            map={role: whole[:-1]},
        )
    raise LevelheadError(
        f"{source}: the {MEANING[role]} has {present} but no column for {missing}; "
        f"expected three axes, or the hint map {role}=…"
    )


def _misspelt(axes: Mapping[str, int], known: Sequence[Name]) -> list[str] | None:
    """The names of x, y and z, and that of the one axis whose name is spelt a little differently; else None."""
    lost = set("xyz") - set(axes)
    if len(lost) != 1:
        return None
    axis, given = lost.pop(), next(iter(axes))
    name = known[axes[given]].raw
    at = name.lower().rfind(given)
    expected = f"{name[:at]}{axis if name[at].islower() else axis.upper()}{name[at + 1 :]}"
    free = [one.raw for one in known if not one.role]
    near = get_close_matches(expected, free, 1, 0.75)
    if not near:
        return None
    return [*(near[0] if letter == axis else known[axes[letter]].raw for letter in "xyz"), near[0]]


def _group(role: str, known: Sequence[Name], source: str) -> tuple[int, ...]:
    """The positions of the first complete set of axes; () if there is none."""
    complete, _ = group_axes(role, known, None)
    return order_positions(role, complete[0]) if complete else ()


def quaternion(wanted: str, names: Sequence[str], source: str) -> tuple[int, ...]:
    """The positions of four columns in the order w, x, y, z, or as they are numbered.

    ``wanted`` is the name that they share (``quat`` for quat_w, …; ``q`` for q0, …), the name of one of them, or all
    four with commas.

    Raises:
        LevelheadError: there is no such quaternion; the nearest is named.
    """
    known = [understand(name) for name in names]
    listed = [part.strip() for part in wanted.split(",")]
    if len(listed) > 1:
        if len(listed) != WIDTH["q"]:
            raise LevelheadError(f"{source}: '{wanted}' names {len(listed)} columns; expected the four of a quaternion")
        return _hinted_columns("q", listed, known, source)
    groups = quaternions(names)
    label = "".join(split(wanted))
    for name, found in groups.items():
        if label and (label == "".join(split(name)) or wanted in [names[i] for i in found]):
            return found
    if not groups:
        raise LevelheadError(
            f"{source} has no quaternion '{wanted}': no four columns share a name but for w, x, y, z or 0 to 3; "
            "name the four with commas"
        )
    raise LevelheadError(f"{source} has no quaternion '{wanted}'; {nearest(wanted, groups)}")


def quaternions(names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """The sets of four columns that may be a quaternion: the name that they share to their positions."""
    groups: dict[str, dict[str, int]] = {}
    for i, raw in enumerate(names):
        name = understand(raw)
        if name.axis and name.role not in {"gyr", "acc", "mag", "t"}:
            groups.setdefault(_drop(split(raw), name.axis), {})[name.axis] = i
    found = [positions for axes in groups.values() if (positions := order_positions("q", axes))]
    return {shared_name([names[i] for i in positions]): positions for positions in found}


def _hinted_columns(role: str, wanted: Sequence[str], known: Sequence[Name], source: str) -> tuple[int, ...]:
    if len(wanted) == 1 and WIDTH[role] > 1:
        return _shared_columns(role, wanted[0], known, source)
    positions = tuple(_position(role, name, known, source) for name in wanted)
    if len(set(positions)) < len(positions):
        raise LevelheadError(f"{source}: map {role}={','.join(wanted)} names a column twice; expected {WIDTH[role]}")
    return positions


def _position(role: str, wanted: str, known: Sequence[Name], source: str) -> int:
    exactly = [i for i, name in enumerate(known) if name.raw == wanted]
    loosely = [i for i, name in enumerate(known) if name.raw.strip().lower() == wanted.strip().lower()]
    bare = [i for i, name in enumerate(known) if _without_unit(name.raw) == wanted.strip().lower()]
    for found in (exactly, loosely, bare):
        if len(found) == 1:
            return found[0]
        if found:
            raise LevelheadError(f"{source}: {len(found)} columns are named '{wanted}' (map {role}); rename them")
    hint = nearest(wanted, [name.raw for name in known if name.raw])
    raise LevelheadError(f"{source}: there is no column '{wanted}' (map {role}); {hint}")


def _without_unit(raw: str) -> str:
    """ "Gx [deg/s]" as people call it: gx."""
    return re.sub(r"\s*[(\[][^()\[\]]*[)\]]\s*$", "", raw).strip().lower()


def _shared_columns(role: str, wanted: str, known: Sequence[Name], source: str) -> tuple[int, ...]:
    """One name for all axes: the columns that have it before their axis."""
    label = "".join(split(wanted))
    axes: dict[str, int] = {}
    for i, name in enumerate(known):
        words = split(name.raw)
        if name.axis and "".join(words) != label and _drop(words, name.axis) == label:
            axes[name.axis] = i
    if found := order_positions(role, axes):
        return found
    labels = dict.fromkeys(name.stem for name in known if name.axis)
    raise LevelheadError(
        f"{source}: map {role}={wanted} names one column, expected {WIDTH[role]}, or the name that they share; "
        f"{nearest(wanted, [*labels, *(name.raw for name in known if name.raw)])}"
    )


def _drop(words: Sequence[str], axis: str) -> str:
    left = list(words)
    if axis in left:
        del left[len(left) - 1 - left[::-1].index(axis)]
        return "".join(left)
    return "".join(left).removesuffix(axis)


def _unit(role: str, positions: Sequence[int], names: Sequence[str], source: str) -> str | None:
    said = {unit_in(names[i], role, source): names[i] for i in positions}
    if len(said) > 1:
        raise LevelheadError(
            f"{source}: the columns of the {MEANING[role]} differ in unit ({', '.join(said.values())}); "
            f"expected one unit, or the hint units {role}=…"
        )
    return next(iter(said))


def _disjoint(columns: Mapping[str, tuple[int, ...]], names: Sequence[str], source: str) -> None:
    seen: dict[int, str] = {}
    for role, positions in columns.items():
        for i in positions:
            if i in seen:
                raise LevelheadError(
                    f"{source}: column '{names[i]}' would be both {MEANING.get(seen[i], seen[i])} and "
                    f"{MEANING.get(role, role)}; the hint map decides, or leaves one out (map {role}=)"
                )
            seen[i] = role


def _complete(columns: Mapping[str, tuple[int, ...]], names: Sequence[str], source: str, needed: Sequence[str]) -> None:
    for role in needed:
        if role not in columns:
            listed = ", ".join(name for name in names[:12] if name) + (", …" if len(names) > 12 else "")
            angles = [name for name in names if name.lower() in ("roll", "pitch", "yaw")]
            made = f"; {' and '.join(angles)} are made of such readings" if len(angles) > 1 else ""
            expected = f"such as {_EXAMPLE[role]}, or the hint map {role}=…{made}"
            raise missing_sensor(source, role, f"the columns {listed}", expected)


def missing_sensor(source: str, role: str, places: str, expected: str) -> LevelheadError:
    """The error for a log without a sensor: ``places`` were searched."""
    return LevelheadError(f"{source}: there is no {MEANING[role]} among {places}; expected {expected}")
