"""Keeps values of many GPU threads side by side, number by number: a structure of arrays.

Two tables hold them, one of floats and one of ints and bools; each has a row for each number of a value and a column
for each thread. Neighbouring threads read neighbouring words, which a GPU fetches together. Memory inside a value (an
array) is a stretch of rows, which a thread sees in place as one strided column.

Numba makes no NamedTuple from a row of numbers, so the lines that load and store one are written out for each type.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.compiler.borders import Table
from levelhead.compiler.mark import KernelFunction, compiled_only
from levelhead.compiler.tree import Tree, rebuild


class Leaf(NamedTuple):
    """Where one number, or one array of floats, stands."""

    path: str  # of members: ".sample.gyr.x"
    kind: str  # "float", "int", "bool" or "array"
    row: int  # of its table
    size: int


class ThreadRows(NamedTuple):
    """The rows that hold a value of each thread."""

    load: KernelFunction  # load(floats, wholes, thread) -> value
    store: KernelFunction  # store(floats, wholes, thread, value)
    example: Tree
    leaves: tuple[Leaf, ...]
    floats: int  # rows of the table of floats that are taken by these and all rows before
    wholes: int

    def put(self, floats: Table, wholes: NDArray[np.int64], values: list[Tree]) -> None:
        """Writes a value for each column."""
        columns = [list(_numbers(value)) for value in values]
        for k, (_, kind, row, count) in enumerate(self.leaves):
            table = wholes if kind in ("int", "bool") else floats
            if kind == "array":
                table[row : row + count] = np.array([column[k] for column in columns]).T
            else:
                table[row] = [column[k] for column in columns]

    def get(self, floats: Table, wholes: NDArray[np.int64], thread: int) -> Tree:
        """The value of one column, arrays as lists."""

        def numbers() -> Iterator[float]:
            for _, kind, row, count in self.leaves:
                table = wholes if kind in ("int", "bool") else floats
                yield from table[row : row + count, thread].tolist()

        return rebuild(self.example, numbers())


def thread_rows(example: Tree, after: ThreadRows | None = None) -> ThreadRows:
    """Rows for values of the type of ``example`` (floats, ints, bools, lists of floats, NamedTuples of these).

    They lie behind the rows ``after``.
    """
    at = {"floats": after.floats if after else 0, "wholes": after.wholes if after else 0}
    leaves: list[Leaf] = []
    types: dict[type, str] = {}

    def words(value: Tree, path: str) -> str:
        """The expression that loads a value; its leaves are noted on the way."""
        if isinstance(value, tuple):
            made = types.setdefault(
                type(value), f"{type(value).__name__}_{len(types)}"
            )  # two filters' may share a name
            names = type(value)._fields  # type: ignore[attr-defined]
            parts = [words(part, f"{path}.{name}") for name, part in zip(names, value, strict=True)]
            return f"{made}({', '.join(parts)})"
        kind = "array" if isinstance(value, list | np.ndarray) else type(value).__name__
        table, count = "floats" if kind in ("array", "float") else "wholes", len(value) if kind == "array" else 1
        row = at[table]
        at[table] += count
        leaves.append(Leaf(path, kind, row, count))
        if kind == "array":
            return f"floats[{row} : {row + count}, thread]"
        return f"{table}[{row}, thread]" + (" != 0" if kind == "bool" else "")

    loads = [f"def load(floats, wholes, thread):\n    return {words(example, '')}"]
    stores = ["def store(floats, wholes, thread, value):"]
    for path, kind, row, count in leaves:
        if kind == "array":
            stores += [f"    for k in range({count}):", f"        floats[{row} + k, thread] = value{path}[k]"]
        elif kind == "bool":
            stores.append(f"    wholes[{row}, thread] = 1 if value{path} else 0")
        else:
            stores.append(f"    {'wholes' if kind == 'int' else 'floats'}[{row}, thread] = value{path}")
    names: dict[str, KernelFunction | type] = {name: kind for kind, name in types.items()}
    exec("\n".join([*loads, *stores, "    pass"]), names)
    load, store = compiled_only(names["load"]), compiled_only(names["store"])
    return ThreadRows(load, store, example, tuple(leaves), at["floats"], at["wholes"])


def _numbers(value: Tree) -> Iterator[Tree]:
    if isinstance(value, tuple):
        for part in value:
            yield from _numbers(part)
    else:
        yield value
