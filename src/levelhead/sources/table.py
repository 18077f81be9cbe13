"""The common result of every format: named columns that can be read, and words for a row's place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.recording import Array
from levelhead.sources.conclusions import Conclusion

Column = NDArray[np.float64] | NDArray[np.int64]


class Table(Protocol):
    """Named columns of one file.

    Attributes:
        source: the path, as errors name it.
        names: one name per column, as the file spells it.
        units: role ("gyr", …) to a unit that the file gives elsewhere than in the names.
        rate: samples a second, if the file has it.
        north: whether a reference quaternion is known to point its y axis to magnetic north.
        conclusions: decisions that were made while reading.
        context: the name of the file, sheet or row type, if that names a sensor, else "".
        unnamed: whether the file names no column; ``names`` are their numbers then, from 1.
        origin: further evidence of the file's writer beside its names: lines above the header, names before a merger.
        column_units: position to the unit of a column that the reader has and its name has not.
    """

    @property
    def context(self) -> str: ...  # noqa: D102
    @property
    def unnamed(self) -> bool: ...  # noqa: D102
    @property
    def origin(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def column_units(self) -> Mapping[int, str]: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102
    @property
    def names(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def units(self) -> Mapping[str, str]: ...  # noqa: D102
    @property
    def rate(self) -> float | None: ...  # noqa: D102
    @property
    def conclusions(self) -> Sequence[Conclusion]: ...  # noqa: D102

    def read(self, wanted: Sequence[int], exact: frozenset[int] = frozenset()) -> dict[int, Column]:
        """The columns at the positions ``wanted``, each (n,) float64 with NaN where a value is missing.

        ``exact`` are the positions of columns that come as int64 if they hold whole numbers only, because a time stamp
        in nanoseconds since 1970 does not fit a float64.

        Raises:
            LevelheadError: names file, line and column.
        """
        ...

    def where(self, row: int) -> str:
        """The place of row ``row`` (from 0), for a human: "line 17" as a text editor counts, or "row 16"."""
        ...


@dataclass(frozen=True)
class ArrayTable:
    """Columns that are in memory already; the table of the array formats.

    ``arrays`` maps the names to (n,) numbers, ``labels`` those of columns of words to (n,) words. See ``Table`` for the
    rest.
    """

    source: str
    arrays: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    rate: float | None = None
    conclusions: Sequence[Conclusion] = ()
    context: str = ""
    column_units: Mapping[int, str] = field(default_factory=dict)
    origin: Sequence[str] = ()
    labels: Mapping[str, NDArray[np.str_]] = field(default_factory=dict)

    @property
    def unnamed(self) -> bool:
        """False: arrays have names."""
        return False

    @property
    def names(self) -> list[str]:
        """The names, in the order of the file."""
        return list(self.arrays)

    def read(self, wanted: Sequence[int], exact: frozenset[int] = frozenset()) -> dict[int, Column]:
        """See ``Table``."""
        names = self.names
        columns = {i: self._column(names[i], i in exact) for i in wanted}
        first = wanted[0]
        for i, column in columns.items():
            if len(column) != len(columns[first]):
                raise LevelheadError(
                    f"{self.source}: {names[i]} has {len(column)} samples, but {names[first]} has "
                    f"{len(columns[first])}; expected the same number"
                )
        return columns

    def _column(self, name: str, exact: bool) -> Column:
        array = self.arrays[name]
        if array.dtype.kind not in "iufb" or array.dtype.itemsize > 8:
            raise LevelheadError(f"{self.source}: {name} holds {array.dtype} values; expected real numbers")
        if (
            exact
            and array.dtype.kind in "iu"
            and not (array.dtype == np.uint64 and (array > np.iinfo(np.int64).max).any())
        ):
            return array.astype(np.int64)
        return array.astype(np.float64)

    def where(self, row: int) -> str:
        """See ``Table``."""
        return f"row {row}"


class CachedTable:
    """A table of which each column is read once. ``table`` is the table itself; see ``Table``."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self._columns: dict[tuple[int, bool], Column] = {}

    @property
    def source(self) -> str:
        """See ``Table``."""
        return self.table.source

    @property
    def names(self) -> Sequence[str]:
        """See ``Table``."""
        return self.table.names

    @property
    def units(self) -> Mapping[str, str]:
        """See ``Table``."""
        return self.table.units

    @property
    def rate(self) -> float | None:
        """See ``Table``."""
        return self.table.rate

    @property
    def conclusions(self) -> Sequence[Conclusion]:
        """See ``Table``."""
        return self.table.conclusions

    @property
    def context(self) -> str:
        """See ``Table``."""
        return self.table.context

    @property
    def origin(self) -> Sequence[str]:
        """See ``Table``."""
        return self.table.origin

    @property
    def column_units(self) -> Mapping[int, str]:
        """See ``Table``."""
        return self.table.column_units

    @property
    def unnamed(self) -> bool:
        """See ``Table``."""
        return self.table.unnamed

    @property
    def words(self) -> frozenset[int]:
        """Positions of the columns that hold words."""
        return words_of(self.table)

    @property
    def labels(self) -> Mapping[str, NDArray[np.str_]]:
        """The columns of words, name to (n,) words."""
        return labels_of(self.table)

    def read(self, wanted: Sequence[int], exact: frozenset[int] = frozenset()) -> dict[int, Column]:
        """See ``Table``."""
        missing = [i for i in wanted if (i, i in exact) not in self._columns]
        if missing:
            columns = self.table.read(missing, exact & frozenset(missing))
            self._columns |= {(i, i in exact): column for i, column in columns.items()}
        return {i: self._columns[i, i in exact] for i in wanted}

    def where(self, row: int) -> str:
        """See ``Table``."""
        return self.table.where(row)


def in_memory(table: Table, name: str) -> ArrayTable:
    """A table with its numbers read, since the file it lies in may go; ``name`` is the name of its file."""
    wanted = [i for i, title in enumerate(table.names) if title.strip() and i not in words_of(table)]
    columns = table.read(wanted, frozenset(wanted)) if wanted else {}
    arrays: dict[str, Column] = {}
    for i in wanted:
        title = table.names[i] if table.names[i] not in arrays else f"{table.names[i]} ({i + 1})"
        arrays[title] = columns[i]
    units = {k: table.column_units[i] for k, i in enumerate(wanted) if i in table.column_units}
    context = f"{name} {table.context}".strip()
    return ArrayTable(
        table.source, arrays, dict(table.units), table.rate, list(table.conclusions), context, units,
        list(table.origin), dict(labels_of(table)),
    )  # fmt: skip


def add_conclusion(table: Table, conclusion: Conclusion) -> Table:
    """The table with one more conclusion."""
    array = table if isinstance(table, ArrayTable) else in_memory(table, "")
    return replace(array, conclusions=[*array.conclusions, conclusion])


def words_of(table: Table) -> frozenset[int]:
    """Positions of the columns that hold words, as far as the reader has seen."""
    found: frozenset[int] = getattr(table, "words", frozenset())
    return found


def labels_of(table: Table) -> Mapping[str, NDArray[np.str_]]:
    """The columns of words, name to (n,) words, as far as the reader keeps them."""
    found: Mapping[str, NDArray[np.str_]] = getattr(table, "labels", {})
    return found


def stack(columns: Mapping[int, Column], positions: Sequence[int]) -> Array:
    """The columns at ``positions`` side by side: (n, len(positions)) float64."""
    stacked = np.empty((len(columns[positions[0]]), len(positions)))
    for k, i in enumerate(positions):
        stacked[:, k] = columns[i]
    return stacked
