"""Sets of three columns that may be a sensor, and which of them is the one to take."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from levelhead.sources.names.column_name import Name, split
from levelhead.sources.names.vocabulary import PAIRS, WORDS

# Words that make a set of columns second or third choice beside another one for the same sensor.
_SECOND = {"uncalibrated", "uncal", "uncalib", "unfiltered", "secondary", "backup"}
_COUNTS = {"raw", "counts", "adc", "lsb", "unscaled", "digits"}
_DERIVED = {"linear", "lin", "user", "free", "filtered", "filt", "lowpass", "lpf", "smooth", "smoothed", "est"}
_DERIVED |= {"estimated", "estimate", "world", "earth", "global", "ned", "enu", "nav", "hg", "highg", "high", "dmp"}
_DERIVED |= {"body", "predicted", "pred", "simulated", "dynamic", "motion", "relative", "absolute"}
_DERIVED |= {"linearacceleration", "roll", "f", "fx"}
_GRAVITY_REMOVED = {"linear", "lin", "user", "free", "dynamic", "linearacceleration"}
_OF_SENSORS = frozenset().union(*WORDS.values(), *PAIRS)
_PLAIN, _SECOND_CHOICE, _RAW, _OTHER = range(4)
_FILLERS = {"imu", "sensor", "data", "field", "msg", "cal", "calibrated", "corrected", "x", "y", "z", "axis", "value"}


class ColumnGroup(NamedTuple):
    """Three columns, or four of a quaternion, that belong together.

    Attributes:
        positions: x, y, z.
        names: as the file spells them.
        rank: 0 for the sensor itself, more for duplicates and derived columns.
        words: the rest of the name beside sensor, axis and unit, which distinguishes several sensors.
    """

    positions: tuple[int, ...]
    names: tuple[str, ...]
    rank: int
    words: frozenset[str]

    @property
    def gravity_removed(self) -> bool:
        """Whether the name has it."""
        return bool(_GRAVITY_REMOVED & self.words)

    @property
    def distinction(self) -> frozenset[str]:
        """The words without those that every sensor of its kind has: the shortest is the plainest."""
        return self.words - _OF_SENSORS

    @property
    def label(self) -> str:
        """The common part of the names, for ``--sensor`` and for sentences."""
        return shared_name(self.names)


def column_group(positions: Sequence[int], names: Sequence[str], context: str = "") -> ColumnGroup:
    """The group of columns with these names; ``context`` is the name of their file or sheet."""
    words: set[str] = set()
    for name in (names[0], context):
        for token in split(name):
            word, digits = token.rstrip("0123456789"), token[len(token.rstrip("0123456789")) :]
            words |= {word, *([digits] if digits else [])}
    words -= {""}
    rank = _PLAIN
    if words & _SECOND:
        rank = _SECOND_CHOICE
    if words & _COUNTS:
        rank = _RAW
    if words & _DERIVED:
        rank = _OTHER
    return ColumnGroup(tuple(positions), tuple(names), rank, frozenset(words - _FILLERS))


def best_pair(
    gyrs: Sequence[ColumnGroup], accs: Sequence[ColumnGroup]
) -> tuple[ColumnGroup | None, ColumnGroup | None]:
    """The gyroscope and the accelerometer to take: the plainest, of the same unit of sensors, the first of them."""
    if not gyrs or not accs:
        return (_best(gyrs), _best(accs))

    def order(pair: tuple[ColumnGroup, ColumnGroup]) -> tuple[object, ...]:
        one, other = pair
        more = len(one.distinction) + len(other.distinction)
        return (one.rank + other.rank, -_alike(one, other), more, one.positions, other.positions)

    return min(((gyr, acc) for gyr in gyrs for acc in accs), key=order)


def nearest_group(groups: Sequence[ColumnGroup], gyr: ColumnGroup | None) -> ColumnGroup | None:
    """The magnetometer that belongs to a gyroscope."""
    if gyr is None:
        return _best(groups)
    return min(groups, key=lambda group: (group.rank, -_alike(gyr, group), group.positions), default=None)


def others(groups: Sequence[ColumnGroup], taken: ColumnGroup) -> list[ColumnGroup]:
    """Groups that could as well have been taken: other sensors of the same kind."""
    return [group for group in groups if group.rank == taken.rank and group.positions != taken.positions]


def _best(groups: Sequence[ColumnGroup]) -> ColumnGroup | None:
    return min(groups, key=lambda group: (group.rank, len(group.distinction), group.positions), default=None)


def _alike(one: ColumnGroup, other: ColumnGroup) -> float:
    """How much the words of two groups overlap, 0 to 1; a number that differs (imu1, imu2) counts most."""
    if {word for word in one.words if word.isdigit()} != {word for word in other.words if word.isdigit()}:
        return 0.0
    return 0.5 + 0.5 / (1.0 + len(one.distinction ^ other.distinction))


def shared_name(names: Sequence[str]) -> str:
    """The beginning of the names, as the file spells it: "quat" of quat_w, quat_x, …."""
    same = [len(set(letters)) == 1 for letters in zip(*names, strict=False)]
    return names[0][: [*same, False].index(False)].rstrip(" _.[(-/") or names[0]


def group_axes(
    role: str, known: Sequence[Name], filled: frozenset[int] | None
) -> tuple[list[dict[str, int]], list[dict[str, int]]]:
    """(complete sets of axes, incomplete ones) of the columns of a role, in the order of the file.

    Empty columns (``filled`` names the others) are left out. Where a name comes twice, as under a group
    of two header rows, the second one begins another set.
    """
    sets: dict[str, list[dict[str, int]]] = {}
    for i, name in enumerate(known):
        if name.role != role or (role == "q" and not name.reference) or (filled is not None and i not in filled):
            continue
        axes = sets.setdefault(name.stem, [{}])
        if name.axis in axes[-1]:
            axes.append({})
        axes[-1][name.axis] = i
    every = [axes for several in sets.values() for axes in several]
    return [axes for axes in every if order_positions(role, axes)], [
        axes for axes in every if not order_positions(role, axes)
    ]


_AXES = {"q": ("wxyz", "0123", "1234")}


def order_positions(role: str, axes: Mapping[str, int]) -> tuple[int, ...]:
    """The positions in the order x, y, z (w first for a quaternion); () if one is missing."""
    for letters in _AXES.get(role, ("xyz", "012", "123")):
        if set(letters) <= set(axes):
            return tuple(axes[letter] for letter in letters)
    return ()
