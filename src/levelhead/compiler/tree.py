"""The fixed-size memory inside a state, as plain Python and as compiled code have it: lists and arrays of floats."""

from typing import Any

import numpy as np


def native(value: Any) -> Any:
    """The value with a new array for every list."""
    if isinstance(value, tuple):
        return type(value)(*map(native, value))
    return np.array(value) if isinstance(value, list) else value


def plain(value: Any) -> Any:
    """The value with a new list for every array (or list)."""
    if isinstance(value, tuple):
        return type(value)(*map(plain, value))
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, list) else value


def has_memory(value: Any) -> bool:
    """Whether there is any in the value."""
    return isinstance(value, list | np.ndarray) or (isinstance(value, tuple) and any(map(has_memory, value)))
