"""Messages that hold several samples each: {"Timestamp": 12, "ArrayAcc": [{"x": …}, {"x": …}], "ArrayGyro": […]}."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from levelhead.open_types import Fields

_VECTORS = (3, 4)  # numbers in a list that are one sample's axes
_FEW = 2  # lists of one length, at least, that are a batch


def unpack_batches(objects: Sequence[Fields]) -> list[Fields]:
    """One object for each sample; the samples of a message share its stamp. Others stay as they are."""
    return [sample for item in objects for sample in _samples(item)]


def _samples(item: Fields) -> list[Fields]:
    lengths = Counter(len(values) for values in _series(item))
    if not lengths:
        return [item]
    length, count = lengths.most_common(1)[0]
    return [_pick(item, k, length) for k in range(length)] if count >= _FEW else [item]


def _series(item: Fields) -> Iterator[Sequence[Any]]:
    """The lists in an object, and in the objects in it, that hold a number or a vector for each of several samples."""
    for value in item.values():
        if isinstance(value, dict):
            yield from _series(value)
        elif isinstance(value, list) and _is_series(value):
            yield value


def _is_series(values: Sequence[Any]) -> bool:
    if not values:
        return False
    if all(isinstance(one, dict) for one in values):
        return all(isinstance(part, int | float) for one in values for part in one.values())
    if all(isinstance(one, list) and len(one) in _VECTORS for one in values):
        return True
    return len(values) not in (1, *_VECTORS) and all(isinstance(one, int | float) for one in values)


def _pick(item: Fields, k: int, length: int) -> Fields:
    return {
        key: _pick(value, k, length) if isinstance(value, dict)
        else value[k] if isinstance(value, list) and _is_series(value) and len(value) == length
        else value
        for key, value in item.items()
    }  # fmt: skip
