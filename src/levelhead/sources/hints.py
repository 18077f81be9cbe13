"""Hints of a person about a file: columns, units, raw counts, rate."""

import csv
import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from levelhead import units as unit_table
from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import JsonObject, ReadOnlyJson

WIDTH = {"t": 1, "gyr": 3, "acc": 3, "mag": 3, "q": 4}
QUANTITY = {"t": "time", "gyr": "gyr", "acc": "acc", "mag": "mag"}  # name of its units
MEANING = {"t": "time", "gyr": "gyroscope", "acc": "accelerometer", "mag": "magnetometer", "q": "reference quaternion"}


_V = TypeVar("_V")


@dataclass(frozen=True)
class Scale:
    """How the numbers of one sensor become SI: value / divisor × factor, and its name in a sentence."""

    factor: float
    name: str
    divisor: float = 1.0


@dataclass(frozen=True)
class Hints:
    """Checked hints.

    Attributes:
        map: role ("t", "gyr", "acc", "mag", "q") to the names of its columns; no names: leave the role out.
        scale: role to the scale that ``units`` or ``counts`` gave.
        rate: samples a second for files without time stamps; None: not given.
        sensor: a word in the names of the wanted one of several sensors.
        session: the part to take, from 1, of a file whose clock begins again.
        words: the hints as words of the command line: (option, value).
    """

    map: Mapping[str, Sequence[str]] = field(default_factory=dict)
    scale: Mapping[str, Scale] = field(default_factory=dict)
    rate: float | None = None
    sensor: str | None = None
    session: int | None = None
    words: tuple[tuple[str, str], ...] = ()

    @property
    def given(self) -> bool:
        """Whether any hint was given."""
        return bool(self.words)

    def options(self) -> JsonObject:
        """The hints as the arguments of ``check``."""
        made: JsonObject = {}
        for option, value in self.words:
            role, _, text = value.partition("=")
            if option == "map":
                made.setdefault("map", {})[role] = next(csv.reader([text], skipinitialspace=True), [])
            elif option in ("units", "counts"):
                made.setdefault(option, {})[role] = text
            else:
                made[option] = {"rate": float, "session": int, "sensor": str}[option](value)
        return made


class SuggestsCommand(LevelheadError):
    """An error that a command line settles.

    Attributes:
        sentence: the error without the command.
        suggested: hints, the arguments of ``check``.
        path: the log; "" while no command with these hints was tried.
    """

    def __init__(self, sentence: str, path: str = "", /, **suggested: Any) -> None:
        super().__init__(sentence)
        self.sentence, self.path, self.suggested = sentence, path, suggested

    def command(self, verb: str = "fuse") -> str:
        """The command line; "" where none was tried."""
        return command(self.path, self.suggested, verb) if self.path else ""

    def text(self, verb: str = "fuse") -> str:
        """The sentence, with the command line of a verb behind it."""
        return f"{self.sentence}; try: {self.command(verb)}" if self.path else self.sentence

    def about(self, part: str, path: str) -> "SuggestsCommand":
        """The same error of a log of which ``part`` is a copy."""
        renamed = path if self.path == part else self.path
        return type(self)(self.sentence.replace(part, path), renamed, **self.suggested)

    def __str__(self) -> str:
        return self.text()


class NeedsHints(SuggestsCommand):
    """A file lacks a fact, and hints supply it."""


def check(
    map: Mapping[str, Sequence[str] | str] | None,
    units: Mapping[str, str] | None,
    counts: Mapping[str, str] | None,
    rate: float | None,
    sensor: str | None = None,
    session: int | None = None,
) -> Hints:
    """Hints as a user gives them, checked.

    Raises:
        LevelheadError: unknown role or unit (the nearest is named), wrong number of columns, a rate that is none.
    """
    columns = {role: _columns(role, names) for role, names in (map or {}).items()}
    scale = {role: _unit(role, text) for role, text in (units or {}).items()}
    for role, text in (counts or {}).items():
        if role in scale:
            raise LevelheadError(f"both units and counts are given for {role}; give one of them")
        scale[role] = _counts(role, text)
    words = [
        *(("map", f"{role}={','.join(map_word(name) for name in names)}") for role, names in columns.items()),
        *(("units", f"{role}={text}") for role, text in (units or {}).items()),
        *(("counts", f"{role}={text}") for role, text in (counts or {}).items()),
        *_single_words(rate, sensor, session),
    ]
    return Hints(columns, scale, None if rate is None else float(rate), sensor, session, tuple(words))


def _single_words(rate: float | None, sensor: str | None, session: int | None) -> list[tuple[str, str]]:
    """Hints that come once, as words of the command line.

    Raises:
        LevelheadError: a rate or a session that is none.
    """
    words = [] if sensor is None else [("sensor", sensor)]
    if rate is not None:
        if not (isinstance(rate, int | float) and math.isfinite(rate) and rate > 0.0):
            raise LevelheadError(f"rate is {rate!r}; expected samples a second, a number above 0, such as rate=100")
        words.insert(0, ("rate", f"{rate:.12g}"))
    if session is not None:
        if not isinstance(session, int) or session < 1:
            raise LevelheadError(f"session is {session!r}; expected a number from 1")
        words.append(("session", str(session)))
    return words


def count_word(value: float) -> str:
    """Counts per unit as they stand in ``--counts``, exact."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def map_word(name: str) -> str:
    """A column's name as in ``--map``: in double quotes if it holds a comma or a quote."""
    return '"' + name.replace('"', '""') + '"' if "," in name or '"' in name or name != name.strip() else name


def command(path: str, options: ReadOnlyJson, verb: str = "fuse") -> str:
    """The command line that reads a file with these hints, ready to paste."""
    words = [word for option, value in check_options(options).words for word in (f"--{option}", shlex.quote(value))]
    return " ".join([f"levelhead {verb}", shlex.quote(path), *words])


def merge_hints(options: ReadOnlyJson, suggested: ReadOnlyJson) -> JsonObject:
    """Hints with others on top; of a role either its unit or its counts stay."""
    made = dict(options)
    for option, value in suggested.items():
        if not isinstance(value, Mapping):
            made[option] = value
            continue
        if option in ("units", "counts"):
            other = "counts" if option == "units" else "units"
            made[other] = {role: text for role, text in made.get(other, {}).items() if role not in value}
        made[option] = {**made.get(option, {}), **value}
    return made


def check_options(options: ReadOnlyJson) -> Hints:
    """``check`` of hints in a dictionary; absent ones are not given."""
    return check(**{name: options.get(name) for name in ("map", "units", "counts", "rate", "sensor", "session")})


def _columns(role: str, names: Sequence[str] | str) -> list[str]:
    _known(role, "map", WIDTH)
    listed = [names] if isinstance(names, str) else [str(name) for name in names]
    if len(listed) not in (0, 1, WIDTH[role]):
        raise LevelheadError(
            f"map gives {len(listed)} columns for {role} ({', '.join(listed)}); expected {WIDTH[role]} for the "
            f"{MEANING[role]}, or the one name they share"
        )
    return listed


def _unit(role: str, text: str) -> Scale:
    _known(role, "units", QUANTITY)
    if text.startswith("-") and role != "t":  # the axes point the other way: Core Motion's accelerometer is in -g
        return Scale(-unit_table.factor(QUANTITY[role], text[1:]), text)
    return Scale(unit_table.factor(QUANTITY[role], text), text)


def _counts(role: str, text: str) -> Scale:
    """'131/deg/s' → 131 counts are 1 deg/s."""
    _known(role, "counts", QUANTITY)
    number, slash, unit = str(text).partition("/")
    try:
        divisor = float(number)
    except ValueError:
        divisor = math.nan
    if not slash or not math.isfinite(divisor) or divisor <= 0.0:
        raise LevelheadError(
            f"counts {role}={text} is not counts per unit; expected such as gyr=131/deg/s or acc=16384/g"
        )
    return Scale(unit_table.factor(QUANTITY[role], unit), f"counts, {number} per {unit}", divisor)


def _known(role: str, hint: str, roles: Iterable[str]) -> None:
    if role not in roles:
        raise LevelheadError(f"{hint} names '{role}', which is not a quantity here; {nearest(role, roles)}")


def parse_map(words: Iterable[str]) -> dict[str, list[str]]:
    """Words of the command line, such as ``gyr=gx,gy,gz`` and ``t=time``, as the argument ``map`` of ``read``.

    A name with a comma is in double quotes. ``mag=`` with nothing behind it leaves the magnetometer out.

    Raises:
        LevelheadError: a word without ``=``, an unknown role, the same role twice.
    """
    return _parse(words, "map", "gyr=gx,gy,gz", lambda text: next(csv.reader([text], skipinitialspace=True), []), WIDTH)


def parse_units(words: Iterable[str]) -> dict[str, str]:
    """Words such as ``gyr=deg/s`` as the argument ``units`` of ``read``.

    Raises:
        LevelheadError: a word without ``=``, an unknown role, the same role twice.
    """
    return _parse(words, "units", "gyr=deg/s", str, QUANTITY)


def parse_counts(words: Iterable[str]) -> dict[str, str]:
    """Words such as ``gyr=131/deg/s`` (131 counts are 1 deg/s) as the argument ``counts`` of ``read``.

    Raises:
        LevelheadError: a word without ``=``, an unknown role, the same role twice.
    """
    return _parse(words, "counts", "gyr=131/deg/s", str, QUANTITY)


def _parse(
    words: Iterable[str], hint: str, example: str, convert: Callable[[str], _V], roles: Iterable[str]
) -> dict[str, _V]:
    parsed: dict[str, _V] = {}
    for word in words:
        role, equals, text = word.partition("=")
        role = role.strip()
        if not equals:
            raise LevelheadError(f"{hint} '{word}' has no '='; expected such as {example}")
        _known(role, hint, roles)
        if role in parsed:
            raise LevelheadError(f"{hint} is given twice for {role}; once is enough")
        try:
            parsed[role] = convert(text.strip())
        except csv.Error as error:
            raise LevelheadError(f"{hint} '{word}' cannot be read ({error}); expected such as {example}") from None
    return parsed
