"""The fixed-size memory inside a state, as plain Python and as compiled code have it: lists and arrays of floats."""

from collections.abc import Iterator
from itertools import chain, islice
from typing import Any

import numpy as np

Tree = Any  # a float, int, bool, row of floats, or NamedTuple of these: a recursion that mypy cannot express


def native(value: Tree) -> Tree:
    """The value with a new array for every list."""
    if isinstance(value, tuple):
        return type(value)(*map(native, value))
    return np.array(value) if isinstance(value, list) else value


def plain(value: Tree) -> Tree:
    """The value with a new list for every array (or list)."""
    if isinstance(value, tuple):
        return type(value)(*map(plain, value))
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, list) else value


def has_memory(value: Tree) -> bool:
    """Whether there is any in the value."""
    return isinstance(value, list | np.ndarray) or (isinstance(value, tuple) and any(map(has_memory, value)))


def leaves(value: Tree) -> Iterator[float]:
    """The numbers of a value, in order."""
    if isinstance(value, tuple):
        return chain.from_iterable(map(leaves, value))
    return iter(value if isinstance(value, list | np.ndarray) else (value,))


def rebuild(example: Tree, numbers: Iterator[float]) -> Tree:
    """A value like ``example`` of these numbers; truth values come as whole ones."""
    if isinstance(example, tuple):
        return type(example)(*(rebuild(part, numbers) for part in example))
    if isinstance(example, list):
        row = list(islice(numbers, len(example)))
        if len(row) < len(example):
            raise ValueError(f"{len(row)} numbers are left for a row of {len(example)}")
        return row
    return bool(next(numbers)) if isinstance(example, bool) else next(numbers)
