"""The reader's conclusion as one frozen value: columns, scales, clock, and the decisions that led to them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from levelhead.open_types import JsonObject
from levelhead.recording import Array
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.conclusions.sentences import notes, sentence
from levelhead.sources.hints import Hints, Scale, command, merge_hints
from levelhead.sources.table import Column

NS = 1_000_000_000
SENSORS = ("gyr", "acc", "mag")
RELATIVE_SCALE, SECONDS = Scale(1.0, "relative"), Scale(1.0, "s")


@dataclass(frozen=True)
class ClockRule:
    """The rule that turns stamps into seconds.

    Attributes:
        columns: names of the columns with the stamps; a second one holds the rest of a second; none: rows at ``rate``.
        scale: of one stamp.
        start: the first stamp, which is subtracted, where stamps count from a date; else 0.
        t0: s, the same; None where nothing is subtracted.
        rate: samples a second of a log without stamps.
        first_row: of such a log, the number of the first row.
        fraction: s that one number of a second column is.
        repairs: names of the further repairs; each needs the whole log.
        session: part that is read of a clock that begins again, from 1; None: the longest.
    """

    columns: tuple[str, ...] = ()
    scale: Scale = SECONDS
    start: float | int = 0
    t0: float | None = None
    rate: float | None = None
    first_row: int = 0
    fraction: float = 0.0
    repairs: tuple[str, ...] = ()
    session: int | None = None

    @property
    def name(self) -> str:
        """The clock's name in sentences."""
        return " + ".join(self.columns)

    def stamps(self, columns: Sequence[Column]) -> Column:
        """(n,) stamps of the columns, in the unit of ``scale``."""
        if len(columns) == 1:
            return columns[0]
        whole = np.rint(columns[0]).astype(np.int64)
        joined: Column = whole * NS + np.rint(columns[1] * (1e9 * self.fraction)).astype(np.int64)
        return joined

    def seconds(self, stamps: Column) -> Array:
        """(n,) s. Divides where it can: 12 ms / 1000 is the nearest number to 0.012, 12 × 0.001 is not always."""
        values = (stamps - self.start if self.t0 is not None else stamps).astype(np.float64)
        return scale_stamps(values, self.scale)

    def rows(self, count: int) -> Array:
        """(n,) s of rows without stamps."""
        assert self.rate is not None
        made: Array = np.arange(self.first_row, self.first_row + count) / self.rate
        return made


def scale_stamps(values: Array, scale: Scale) -> Array:
    """(n,) stamps in seconds."""
    if scale.divisor == 1.0 and scale.factor < 1.0:
        return values / round(1.0 / scale.factor)
    return values * (scale.factor / scale.divisor)


@dataclass(frozen=True)
class Interpretation:
    """The meaning of a log's columns.

    ``levelhead.sources.interpret.apply`` makes the recording of it. Printed, it is a table of the conclusions, with the
    command line that leaves nothing to guess.

    Attributes:
        source: the log.
        columns: role ("t", "gyr", "acc", "mag", "q", "gravity", "bias", "moving", "seen", "temperature") to the names
            of its columns, x, y, z, or w, x, y, z. "gravity" is added to "acc".
        scales: role to the scale of its numbers; a negative one turns the axes round.
        clock: the rule for the stamps.
        conclusions: every decision, with its basis.
        streamable: whether each row becomes a sample by itself, so that a log can be read in chunks.
        ignored: names of the columns that nothing uses.
        unused: roles that have columns but are left out.
        stride: of rows in which several units of sensors take turns every so many is taken.
        interpolates_acc: whether the accelerometer, on rows of its own, is set to the gyroscope's.
        positions: role to the positions of its columns in the table.
        hints: as they were given.
    """

    source: str
    columns: Mapping[str, tuple[str, ...]]
    scales: Mapping[str, Scale]
    clock: ClockRule
    conclusions: tuple[Conclusion, ...]
    streamable: bool
    ignored: tuple[str, ...] = ()
    unused: frozenset[str] = frozenset()
    stride: int = 1
    interpolates_acc: bool = False
    positions: Mapping[str, tuple[int, ...]] = field(default_factory=lambda: MappingProxyType({}), repr=False)
    hints: Hints = field(default_factory=Hints, repr=False)

    @property
    def units(self) -> JsonObject:
        """Role to the unit of its numbers, in the order time, accelerometer, gyroscope, magnetometer."""
        names = {"t": self.clock.scale.name} | {
            role: self.scales[role].name for role in SENSORS if role in self.scales and role not in self.unused
        }
        return {role: names[role] for role in ("t", "acc", "gyr", "mag") if role in names}

    def only(self, roles: Collection[str]) -> "Interpretation":
        """The interpretation of some roles."""
        return replace(
            self,
            columns={role: names for role, names in self.columns.items() if role in roles},
            positions={role: places for role, places in self.positions.items() if role in roles},
        )

    def without(self, about: str, reason: str) -> "Interpretation":
        """The interpretation with a role in use that a conclusion, such as "mag.used", leaves out."""
        return replace(
            self,
            unused=self.unused - {about.partition(".")[0]},
            conclusions=tuple(one for one in self.conclusions if (one.about, one.reason) != (about, reason)),
        )

    @property
    def guesses(self) -> tuple[Conclusion, ...]:
        """The conclusions that are guesses."""
        return tuple(one for one in self.conclusions if one.basis is Basis.GUESS)

    @property
    def open_guesses(self) -> tuple[Conclusion, ...]:
        """The guesses that no hint settles."""
        return tuple(one for one in self.guesses if not one.confirm)

    def settled(self) -> JsonObject:
        """Arguments of ``levelhead.read`` that give the same recording, with each inference that a hint can replace."""
        options = self.hints.options()
        for one in self.conclusions:
            if one.basis not in (Basis.HINT, Basis.HEADER):
                options = merge_hints(options, one.confirm)
        return options

    def command(self, verb: str = "fuse") -> str:
        """The command line with the hints of ``settled``."""
        return command(self.source, self.settled(), verb)

    def meta(self) -> dict[str, Any]:
        """``Recording.meta`` of a recording that is read by it."""
        made: dict[str, Any] = {
            "source": self.source,
            "notes": notes(self.conclusions),
            "conclusions": self.conclusions,
            "ignored": list(self.ignored),
            "units": self.units,
            "columns": {role: list(names) for role, names in self.columns.items()},
        }
        if self.clock.t0 is not None:
            made["t0"] = self.clock.t0
        if self.units.get("mag") == RELATIVE_SCALE.name:
            made["mag_unit"] = RELATIVE_SCALE.name
        return made

    def to_dict(self) -> JsonObject:
        """Ready for JSON."""
        return {
            "source": self.source,
            "columns": {role: list(names) for role, names in self.columns.items()},
            "units": dict(self.units),
            "ignored": list(self.ignored),
            "streamable": self.streamable,
            "conclusions": [one.to_dict() | {"sentence": sentence(one)} for one in self.conclusions],
            "command": self.command(),
        }

    def __str__(self) -> str:
        return "\n".join([self.source, *self.lines(), f"command  {self.command()}"])

    def lines(self) -> list[str]:
        """A line for each conclusion, its basis in front, and the open questions."""
        width = max((len(one.about) for one in self.conclusions), default=0)
        made = [f"{one.about:{width}}  {one.basis:7}  {sentence(one)}" for one in self.conclusions]
        if self.ignored:
            made.append(f"{'ignored':{width}}  {'':7}  {', '.join(self.ignored)}")
        if self.open_guesses:
            made.append(f"no hint settles: {', '.join(one.about for one in self.open_guesses)}")
        elif not self.guesses:
            made.append("nothing is a guess")
        return made
