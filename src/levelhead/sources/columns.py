"""Which columns are which sensor: from their names, and from what a human said about them."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from levelhead.errors import LevelheadError, nearest
from levelhead.sources.hints import MEANING, QUANTITY, WIDTH
from levelhead.sources.names import Name, split, understand, unit_in

_AXES = {"q": ("wxyz", "0123", "1234")}
_EXAMPLE = {"gyr": "gyr_x, gyr_y, gyr_z", "acc": "acc_x, acc_y, acc_z"}


@dataclass(frozen=True)
class Roles:
    """Where the quantities stand in a table.

    Attributes:
        columns: role ("t", "gyr", "acc", "mag", "q", "bias", "moving") to the positions of its columns.
        units: role to the unit that the names give; roles without one are not in it.
        ignored: names of the columns that nothing uses, in the order of the file.
        notes: sentences about choices that were made.
        mapped: roles that a hint decided.
    """

    columns: Mapping[str, tuple[int, ...]]
    units: Mapping[str, str]
    ignored: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    mapped: frozenset[str] = field(default_factory=frozenset)


def assign(
    names: Sequence[str], hints: Mapping[str, Sequence[str]], source: str, unit_known: frozenset[str] = frozenset()
) -> Roles:
    """The role of each column.

    ``hints`` is the map of ``sources.hints``: a role with no names is left out. The roles in ``unit_known`` may have
    any unit in their names, because a hint gives theirs.

    Raises:
        LevelheadError: no gyroscope, no accelerometer, two candidates, an axis or a hinted column that is not there,
            units that differ between axes.
    """
    known = [understand(name) for name in names]
    columns: dict[str, tuple[int, ...]] = {}
    notes: list[str] = []
    for role in ("t", "gyr", "acc", "mag", "q", "bias"):
        if role in hints:
            found = _hinted(role, hints[role], known, source)
        elif role == "t":
            found = _time(known, source)
        else:
            found = _group(role, known, source)
        if found:
            columns[role] = found
    moving = tuple(i for i, name in enumerate(known) if name.role == "moving")
    if len(moving) == 1:
        columns["moving"] = moving
    _disjoint(columns, names, source)
    _complete(columns, names, source)
    units: dict[str, str] = {}
    for role in [role for role in columns if role in QUANTITY]:
        with suppress(*((LevelheadError,) if role in unit_known else ())):
            if unit := _unit(role, columns[role], names, source):
                units[role] = unit
    used = {i for positions in columns.values() for i in positions}
    ignored = tuple(name or f"(column {i + 1})" for i, name in enumerate(names) if i not in used)
    return Roles(columns, units, ignored, tuple(notes), frozenset(hints))


def _time(known: Sequence[Name], source: str) -> tuple[int, ...]:
    times = [i for i, name in enumerate(known) if name.role == "t"]
    exact = [i for i in times if known[i].exact] or times
    lower = [i for i in exact if known[i].raw.strip() != "T"] or exact  # T is the temperature beside a real time
    if len(lower) > 1:
        _two("t", [[known[i].raw] for i in lower], source)
    return tuple(lower)


def _group(role: str, known: Sequence[Name], source: str) -> tuple[int, ...]:
    """The positions of the one complete set of axes; () if there is none."""
    groups: dict[str, dict[str, int]] = {}
    for i, name in enumerate(known):
        if name.role == role and (role != "q" or name.reference):
            axes = groups.setdefault(name.stem, {})
            if name.axis in axes:
                _two(role, [[known[axes[name.axis]].raw], [name.raw]], source)
            axes[name.axis] = i
    complete = [found for axes in groups.values() if (found := _ordered(role, axes))]
    if len(complete) > 1:
        _two(role, [[known[i].raw for i in found] for found in complete], source)
    if not complete and groups and role in {"gyr", "acc", "mag"}:
        axes = max(groups.values(), key=len)
        present = ", ".join(known[i].raw for i in axes.values())
        missing = ", ".join(sorted(set("xyz") - set(axes))) or "x, y, z"
        raise LevelheadError(
            f"{source}: the {MEANING[role]} has {present} but no column for {missing}; "
            f"expected three axes, or the hint map {role}=… (map {role}= leaves it out)"
        )
    return complete[0] if complete else ()


def _ordered(role: str, axes: Mapping[str, int]) -> tuple[int, ...]:
    for letters in _AXES.get(role, ("xyz", "012", "123")):
        if set(letters) <= set(axes):
            return tuple(axes[letter] for letter in letters)
    return ()


def _two(role: str, candidates: Sequence[Sequence[str]], source: str) -> None:
    listed = " and ".join(", ".join(names) for names in candidates)
    meaning = MEANING.get(role, role)
    if len({tuple(names) for names in candidates}) < len(candidates):
        raise LevelheadError(f"{source}: two columns are named {candidates[0][0]}; rename one of them ({meaning})")
    raise LevelheadError(
        f"{source}: {'two' if len(candidates) == 2 else len(candidates)} candidates for the {meaning}: {listed}; "
        f"the hint map {role}={','.join(candidates[0])} decides"
    )


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
        return _hinted("q", listed, known, source)
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
    found = [positions for axes in groups.values() if (positions := _ordered("q", axes))]
    return {_shared_name([names[i] for i in positions]): positions for positions in found}


def _shared_name(names: Sequence[str]) -> str:
    """What the names begin with, as the file spells it: "quat" of quat_w, quat_x, …."""
    same = [len(set(letters)) == 1 for letters in zip(*names, strict=False)]
    return names[0][: [*same, False].index(False)].rstrip(" _.[(-/") or names[0]


def _hinted(role: str, wanted: Sequence[str], known: Sequence[Name], source: str) -> tuple[int, ...]:
    if len(wanted) == 1 and WIDTH[role] > 1:
        return _shared(role, wanted[0], known, source)
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


def _shared(role: str, wanted: str, known: Sequence[Name], source: str) -> tuple[int, ...]:
    """One name for all axes: the columns that have it before their axis."""
    label = "".join(split(wanted))
    axes: dict[str, int] = {}
    for i, name in enumerate(known):
        words = split(name.raw)
        if name.axis and "".join(words) != label and _drop(words, name.axis) == label:
            axes[name.axis] = i
    if found := _ordered(role, axes):
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


def _complete(columns: Mapping[str, tuple[int, ...]], names: Sequence[str], source: str) -> None:
    for role in ("gyr", "acc"):
        if role not in columns:
            listed = ", ".join(name for name in names[:12] if name) + (", …" if len(names) > 12 else "")
            raise LevelheadError(
                f"{source}: there is no {MEANING[role]} among the columns {listed}; "
                f"expected such as {_EXAMPLE[role]}, or the hint map {role}=…"
            )
