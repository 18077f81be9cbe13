"""Lines of numbers that come one by one, CSV, JSON or labelled text: the same rules for names and units as for files.

The first lines are looked at like a file; the conclusions (columns, units) then hold for all later lines.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Array
from levelhead.sample import Sample, Triple
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.formats.json_log import Garbage, flatten_line
from levelhead.sources.formats.text import labelled
from levelhead.sources.formats.text.cells import MISSING, cells, is_comment
from levelhead.sources.formats.text.layout import Layout, layout_of
from levelhead.sources.hints import Hints
from levelhead.sources.interpret import interpret
from levelhead.sources.interpret.by_numbers import map_words, name_by_numbers, shows_turn
from levelhead.sources.interpret.raw_counts import DEFAULT_SCALES, mpu6050_scales
from levelhead.sources.interpret.roles import assign
from levelhead.sources.table import ArrayTable

UNIT_LINES = 20  # lines of numbers by which units are judged
SHOWN = 60  # letters of a line in a sentence
MAX_BYTES = 4096  # bytes of a line; more without an end is not text
MIN_INTERVAL = 1e-3  # s between two samples, at least
UNDERSTOOD = 0.5  # s from the first line, after which the missing part is reported
MIN_NUMBERS = 6  # numbers of a gyroscope and an accelerometer
PATIENCE = 200  # lines that make no sense, before an error
GUESS_TIME, GUESS_LINES, GUESS_STEP = 2.0, 25, 25  # s and lines before columns are guessed; lines until the next try


class StampedLine(NamedTuple):
    """A line: its numbers by name, and when it came (host s)."""

    values: Sequence[float]
    at: float


class QuantityColumns(NamedTuple):
    """The place of a quantity, and its factor to SI."""

    positions: tuple[int, ...]
    scale: float


class LineParser:
    """Makes samples of lines.

    Args:
        source: its name in sentences.
        hints: as for files, checked.

    Attributes:
        garbage: lines so far that were no line of numbers.
        conclusions: the assumptions.
    """

    def __init__(self, source: str, hints: Hints) -> None:
        self.source, self.hints = source, hints
        self.garbage = 0
        self.conclusions: list[Conclusion] = []
        self._seen: list[tuple[str, float]] = []
        self._waits = ""  # the missing quantities
        self._names: tuple[str, ...] = ()
        self._layout: Layout | None = None  # of CSV
        # Of JSON and labelled text: a line as numbers by name.
        self._named: Callable[[str], Mapping[str, float]] = flatten_line
        self._part: dict[str, float] = {}  # of a sample on several lines: the parts so far
        self._columns: dict[str, QuantityColumns] = {}
        self._fraction = 0.0  # s of a second column of stamps

    @property
    def known(self) -> bool:
        """Whether columns and units are known."""
        return bool(self._columns)

    @property
    def stamped(self) -> bool:
        """Whether the lines bring time stamps of their own."""
        return "t" in self._columns

    def take(self, raw: bytes, at: float) -> list[Sample]:
        """The samples that a line makes: none while columns and units are not known, then all that were kept, then one.

        Without a column of time stamps, ``at`` (host s) is the stamp.

        Raises:
            LevelheadError: the first lines have no gyroscope, no accelerometer, or unclear units.
        """
        try:
            text = raw.decode("utf-8").strip()
        except UnicodeDecodeError:
            self.garbage += 1
            return []
        if not text or is_comment(text):
            return []
        if self.known:
            return self._samples([(text, at)])
        self._seen.append((text, at))
        if len(self._seen) < UNIT_LINES:
            return []
        if not self._learn():
            self._seen = self._seen[-PATIENCE:]
            return []
        self._waits = ""
        kept, self._seen = self._seen, []
        return self._samples(kept)

    def lacking(self, at: float) -> str:
        """The lines that arrive and the missing names, while no sample is made by host time ``at``; each once."""
        if self.known or not self._seen or at - self._seen[0][1] < UNDERSTOOD:
            return ""
        waits = "lines" if len(self._seen) < UNIT_LINES else "names"
        last = self._seen[-1][0]
        named = self._named is not flatten_line or last.startswith("{")
        if waits == self._waits or (waits == "names" and named):
            return ""
        self._waits = waits
        if waits == "lines":
            return f"{self.source} has sent {len(self._seen)} lines so far; columns and units need {UNIT_LINES}"
        return (
            f"{self.source} sends lines such as '{last[:SHOWN]}', and none that names the columns; reset the device if "
            f"it prints a header when it starts{self._or_name(self._alike())}"
        )

    def _samples(self, lines: Sequence[tuple[str, float]]) -> list[Sample]:
        found = []
        for text, at in lines:
            try:
                numbers = self._numbers(text)
                found += [] if numbers is None else [self._sample(StampedLine(numbers, at))]
            except Garbage:
                if not self._is_header(text):
                    self.garbage += 1
        return found

    def _is_header(self, text: str) -> bool:
        """A device that was reset sends its header again."""
        return self._layout is not None and tuple(cells(text, self._layout.delimiter)) == self._names

    def _sample(self, row: StampedLine) -> Sample:
        gyr, acc = self._triple("gyr", row), self._triple("acc", row)
        assert gyr is not None and acc is not None  # `assign` has seen to it
        if (gravity := self._triple("gravity", row)) is not None:
            acc = acc[0] + gravity[0], acc[1] + gravity[1], acc[2] + gravity[2]
        mag = self._triple("mag", row)
        if mag is not None and not all(map(math.isfinite, mag)):
            mag = None
        time = self._columns.get("t")
        t = row.at if time is None else self._seconds(row.values, time)
        if not math.isfinite(t):
            raise Garbage
        return Sample(t, gyr, acc, mag)

    def _seconds(self, values: Sequence[float], time: QuantityColumns) -> float:
        if len(time.positions) == 1:
            return values[time.positions[0]] * time.scale
        return values[time.positions[0]] + values[time.positions[1]] * self._fraction

    def _triple(self, role: str, row: StampedLine) -> Triple | None:
        column = self._columns.get(role)
        if column is None:
            return None
        x, y, z = (row.values[i] * column.scale for i in column.positions)
        return x, y, z

    def _numbers(self, text: str) -> Sequence[float] | None:
        """The numbers of a sample, NaN where one is missing; None: the sample goes on in the next line.

        Raises:
            Garbage: another number of cells, a cell that is not a number, an infinite one.
        """
        if self._layout is None:
            given = self._named(text)
            if not set(self._names) & set(given):
                raise Garbage
            if self._named is flatten_line:
                return [given.get(name, math.nan) for name in self._names]
            return self._complete(given)
        found = cells(text, self._layout.delimiter)
        while len(found) > len(self._names) and not found[-1].strip():
            found.pop()
        if len(found) != len(self._names):
            raise Garbage
        return [number(cell, self._layout.decimal_comma) for cell in found]

    def _complete(self, given: Mapping[str, float]) -> Sequence[float] | None:
        """A sample of labelled text: it is whole when all names are there, or when one comes again."""
        part, names = self._part, self._names
        if not part.keys().isdisjoint(given):
            self._part = dict(given)
        else:
            part |= given
            if not part.keys() >= set(names):
                return None
            self._part = {}
        return [part.get(name, math.nan) for name in names]

    def _learn(self) -> bool:
        """Concludes columns and units from the lines so far; False: more lines are needed."""
        lines = [text for text, _ in self._seen]
        self._layout, self._part = None, {}
        if lines[-1].startswith("{"):
            self._named = flatten_line
            self._names = tuple(dict.fromkeys(name for text in lines for name in _or_nothing(text)))
        elif labelled.looks_labelled(lines):
            self._named = labelled.parse
            self._names = tuple(dict.fromkeys(name for text in lines[1:] for name in labelled.parse(text)))
            if sum(1 for _ in labelled.records(lines)) < UNIT_LINES // 2 + 1 and len(lines) < PATIENCE:
                return False
        else:
            self._layout = self._laid_out()
            if self._layout is None:
                return False
            self._names = self._layout.names
        rows = []
        for text, at in self._seen:
            try:
                numbers = self._numbers(text)
            except Garbage:
                continue
            rows += [] if numbers is None else [StampedLine(numbers, at)]
        self._part = {}
        if len(rows) < UNIT_LINES // 2:
            if len(self._seen) >= PATIENCE:
                raise LevelheadError(
                    f"{self.source}: of {len(self._seen)} lines, {len(rows)} are {len(self._names)} numbers; "
                    "expected CSV with a header, or JSON objects, one per line; check the speed of the line"
                )
            return False
        self._columns = self._conclude(rows)
        return True

    def _laid_out(self) -> Layout | None:
        """The layout of the lines that belong together: the first one may be the end of a line. None: no header yet."""
        lines = self._alike()
        layout = layout_of(lines, self.source)
        if not layout.headless:
            return layout
        for i, line in enumerate(lines):  # a header that came later
            if all(_is_word(cell) for cell in cells(line, layout.delimiter)) and i < len(lines) - 1:
                return layout_of(lines[i:], self.source)
        if {"gyr", "acc"} <= set(self.hints.map):
            return layout
        width, count = len(layout.names), len(self._seen)
        if count < PATIENCE:
            ripe = count >= GUESS_LINES and self._seen[-1][1] - self._seen[0][1] >= GUESS_TIME
            return self._guessed(layout, lines) if ripe and count % GUESS_STEP == 0 and width >= MIN_NUMBERS else None
        if width < MIN_NUMBERS:
            raise LevelheadError(
                f"{self.source} sends {width} number{'s' * (width > 1)} per line; expected a gyroscope and an "
                "accelerometer of three axes each, with a header that names them, or words before the numbers"
            )
        guessed = self._guessed(layout, lines)
        if guessed is None:
            raise LevelheadError(
                f"{self.source} sent no header that names its {width} columns, and its numbers do not show them; turn "
                f"the sensor while it starts, or name them{self._how(lines)}"
            )
        return guessed

    def _guessed(self, layout: Layout, lines: Sequence[str]) -> Layout | None:
        """The layout with names by the lines' numbers, as for files without a header; None: they do not show it."""
        if self.hints.map:
            return None
        values = _values(layout, lines)
        table = ArrayTable(self.source, {name: values[:, i] for i, name in enumerate(layout.names)})
        try:
            named = name_by_numbers(table, self.hints)
        except LevelheadError:
            return None
        facts = named.conclusions[-1].facts if named.conclusions else {}
        if len(named.names) != len(layout.names) or facts.get("step", 0.0) != 0.0:
            return None  # rows by turns, or increments, which one line alone does not show
        if len(named.names) - ("t" in named.names) > MIN_NUMBERS and not shows_turn(named):
            return None  # at rest a magnetometer may pass for it
        self.conclusions += named.conclusions
        return replace(layout, names=tuple(named.names))

    def _alike(self) -> list[str]:
        """The lines with the usual number of cells: the first one may be the end of a line."""
        lines = [text for text, _ in self._seen]
        delimiter = layout_of(lines, self.source).delimiter
        widths = [len(cells(line, delimiter)) for line in lines]
        width = Counter(widths).most_common(1)[0][0]
        return [line for line, own in zip(lines, widths, strict=True) if own == width]

    def _or_name(self, lines: Sequence[str]) -> str:
        """The end of a sentence on lines without a header: how to name their columns, if there are enough."""
        width = len(layout_of(lines, self.source).names)
        if width < MIN_NUMBERS:
            return f"; six numbers are needed, of gyroscope and accelerometer, and a line holds {width}"
        return f", or name them{self._how(lines)}"

    def _how(self, lines: Sequence[str]) -> str:
        return f", such as {map_words(_values(layout_of(lines, self.source), lines))} (columns by number)"

    def _conclude(self, rows: Sequence[StampedLine]) -> dict[str, QuantityColumns]:
        values = np.array([row.values for row in rows], dtype=np.float64)
        names = list(self._names)
        arrays: JsonObject = {name: values[:, i] for i, name in enumerate(names)}
        roles = assign(names, self.hints.map, self.source, frozenset(self.hints.scale))
        hints = self.hints
        if not hints.scale and {"gyr", "acc"} <= roles.columns.keys():
            gyr, acc = (values[:, list(roles.columns[role])] for role in ("gyr", "acc"))
            if (counts := mpu6050_scales(gyr, acc)) is not None:
                hints = Hints(hints.map, counts)
                self.conclusions.append(DEFAULT_SCALES)
        if "t" not in roles.columns:  # the host's clock replaces it
            arrays, hints = self._stamp_rows(arrays, rows, hints)
        else:
            arrays = _forward(arrays, names[roles.columns["t"][0]])
        found = interpret(ArrayTable(self.source, arrays), hints)
        before = len(arrays) - len(names)  # the host's clock comes first
        made = {
            role: QuantityColumns(tuple(i - before for i in found.positions[role]), scale.factor / scale.divisor)
            for role, scale in ({"t": found.clock.scale} | dict(found.scales)).items()
            if role in ("gyr", "acc", "mag") or (role == "t" and not before)
        }
        self._fraction = found.clock.fraction
        if "gravity" in found.positions:
            made["gravity"] = QuantityColumns(tuple(i - before for i in found.positions["gravity"]), made["acc"].scale)
        return made

    def _stamp_rows(self, arrays: ReadOnlyJson, rows: Sequence[StampedLine], hints: Hints) -> tuple[JsonObject, Hints]:
        # Lines come in bursts; samples are taken evenly.
        stamps = np.linspace(0.0, max(rows[-1].at - rows[0].at, MIN_INTERVAL * len(rows)), len(rows))
        return {"host_time_s": stamps, **arrays}, Hints({**hints.map, "t": ["host_time_s"]}, hints.scale)


def _values(layout: Layout, lines: Sequence[str]) -> Array:
    """(n, k) the numbers of lines; NaN where there is none."""
    return np.array([[_or_nan(cell, layout.decimal_comma) for cell in cells(line, layout.delimiter)] for line in lines])


def _forward(arrays: ReadOnlyJson, time: str) -> JsonObject:
    """Only the rows at which time goes on, so that one bad stamp does not hide the others."""
    stamps = arrays[time]
    best = np.maximum.accumulate(np.where(np.isfinite(stamps), stamps, -np.inf))
    keep = np.isfinite(stamps) & (stamps > np.concatenate([[-np.inf], best[:-1]]))
    return {name: column[keep] for name, column in arrays.items()}


def _is_word(cell: str) -> bool:
    """Whether a cell can be a name and not a number."""
    try:
        number(cell)
    except Garbage:
        return not cell.strip()[:1].isdigit()
    return False


def number(cell: str, comma: bool = False) -> float:
    """A cell as a number; NaN where it is blank.

    Raises:
        Garbage: it is neither, or infinite.
    """
    try:
        value = float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        if cell.strip().lower() in MISSING:
            return math.nan
        raise Garbage from None
    if math.isinf(value) or "_" in cell:
        raise Garbage
    return value


def _or_nan(cell: str, comma: bool) -> float:
    try:
        return number(cell, comma)
    except Garbage:
        return math.nan


def _or_nothing(text: str) -> Mapping[str, float]:
    try:
        return flatten_line(text)
    except Garbage:
        return {}
