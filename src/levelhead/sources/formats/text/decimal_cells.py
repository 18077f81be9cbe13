"""Columns of decimal numbers out of text by array operations, to the bit what ``float`` and ``int`` give.

A number of at most 15 digits is m / 10^k with whole m below 2^53 and k up to 22: both are floats, and IEEE 754 rounds
their quotient correctly (Clinger, How to read floating point numbers accurately, PLDI 1990). For m up to 10^18, as
Python prints numbers, the rest of the division is added, which is exact in floats (Dekker 1971). Eight digits at a time
are summed in one 64-bit word, pairs first (Lemire, Quickly parsing eight digits, 2018). Other cells are left to the
caller.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_PAD = 24  # bytes before the text, so that three words end at any cell
_NEWLINE, _BLANK, _PLUS, _MINUS, _POINT = b"\n +-."
_MAX_WHOLE_DIGITS = 18  # that fit into 63 bits, whatever they are
_MAX_EXACT = 2**53
_U = np.uint64
_ZEROS = _U(0x3030303030303030)  # "00000000"
_ABOVE_NINE = _U(0x7676767676767676)  # takes a byte above 9 to 0x80
_HIGH_BITS = _U(0x8080808080808080)
_MASKS = np.array([0, *((0xFFFFFFFFFFFFFFFF << 8 * (8 - count)) & 0xFFFFFFFFFFFFFFFF for count in range(1, 9))], _U)
_MAX_DECIMALS = 22  # 10^22 is a float
_FLOAT_POWERS = 10.0 ** np.arange(_MAX_DECIMALS + 1)
_SPLIT = 2.0**27 + 1.0
_MARGIN = 1e-9  # share of half a last bit, within which a rest is not rounded for certain
_POWERS = 10 ** np.arange(_MAX_WHOLE_DIGITS + 1, dtype=np.int64)

Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Numbers(NamedTuple):
    """A column: (n,) numbers, and whether each cell is one; the others are any number."""

    values: NDArray[np.float64] | Whole
    known: Flags


class DecimalCells:
    """The cells of lines that all have ``width`` cells, found by their delimiters."""

    def __init__(self, text: str, starts: Whole, ends: Whole, bytes_: NDArray[np.uint8]) -> None:
        self._text = text
        self._starts, self._ends, self._bytes = starts, ends, bytes_  # (width, rows), (width, rows), with the pad
        self._words = np.ndarray((len(bytes_) - 7,), "<u8", bytes_, strides=(1,))  # eight bytes from any place on

    @cached_property
    def _points(self) -> Whole:
        """The places of all points, and one behind the text."""
        return np.append(np.flatnonzero(self._bytes == _POINT), len(self._bytes))

    def __len__(self) -> int:
        return len(self._starts[0])

    def cell(self, row: int, column: int) -> str:
        """The text of one cell."""
        return self._text[self._starts[column, row] - _PAD : self._ends[column, row] - _PAD]

    def floats(self, column: int) -> Numbers:
        """A column as floats."""
        start, end, negative = self._bounds(column)
        point = self._find_points(start, end)
        decimals = np.maximum(end - point - 1, 0)
        digits = point - start + decimals
        many = digits > _MAX_WHOLE_DIGITS  # which 0.00123… has, and no more that count
        known = (digits > 0) & (~many | ((point - start <= 1) & (decimals <= _MAX_DECIMALS)))
        if not known.all():
            decimals = np.where(known, decimals, 0)
            start = np.where(known, start, point)
        whole, whole_known = self._digits(point, point - start)
        parts, parts_known = self._digits(end, decimals)
        known &= whole_known & parts_known & (~many | (whole == 0))
        mantissa = whole * _power(np.minimum(decimals, _MAX_WHOLE_DIGITS)) + parts
        power = _FLOAT_POWERS[decimals]
        values = mantissa / power
        long = np.flatnonzero(mantissa >= _MAX_EXACT)
        if len(long):
            values[long], known[long] = _divide_exactly(mantissa[long], power[long], known[long])
        np.negative(values, out=values, where=negative)
        return Numbers(values, known)

    def _find_points(self, start: Whole, end: Whole) -> Whole:
        """The place of the first point in each cell, else its end; mostly all have as many decimals."""
        first = int(self._points_behind(start[:1], end[:1])[0])
        same = end - (int(end[0]) - first)
        if (same >= start).all() and (self._bytes[same] == _POINT).all():
            return same
        return self._points_behind(start, end)

    def _points_behind(self, start: Whole, end: Whole) -> Whole:
        return np.minimum(self._points[np.searchsorted(self._points, start)], end)

    def integers(self, column: int) -> Numbers:
        """A column as whole numbers."""
        start, end, negative = self._bounds(column)
        count = end - start
        known = (count > 0) & (count <= _MAX_WHOLE_DIGITS)
        values, digits = self._digits(end, np.where(known, count, 0))
        return Numbers(np.where(negative, -values, values), known & digits)

    def _bounds(self, column: int) -> tuple[Whole, Whole, Flags]:
        """(first place behind blanks and the sign, place behind the last digit, whether the sign is a minus)."""
        start, end = self._starts[column], self._ends[column]
        while (blank := (self._bytes[start] == _BLANK) & (start < end)).any():
            start = start + blank
        while (blank := (self._bytes[end - 1] == _BLANK) & (start < end)).any():
            end = end - blank
        sign = self._bytes[start]
        negative = sign == _MINUS
        return start + (negative | (sign == _PLUS)), end, negative

    def _digits(self, end: Whole, count: Whole) -> tuple[Whole, Flags]:
        """(the number that the ``count`` digits before ``end`` are, whether they all are digits)."""
        total = np.zeros(len(end), np.int64)
        known = np.ones(len(end), np.bool_)
        least, most = int(count.min()), int(count.max())
        for k in range(0, most, 8):
            masks = _MASKS[min(least - k, 8)] if least == most else _MASKS[np.clip(count - k, 0, 8)]
            word = (self._words[end - k - 8] ^ _ZEROS) & masks
            known &= (((word + _ABOVE_NINE) | word) & _HIGH_BITS) == 0
            number = _number(word).astype(np.int64)
            if k == 16:
                known &= number < 100  # eighteen digits that count
            total += number * _POWERS[k]
        return total, known


def find_decimal_cells(text: str, delimiter: str, width: int) -> DecimalCells | None:
    """The cells of text without quotes and comments; None if some line has more or less than ``width``."""
    if not text.isascii():
        return None
    raw = np.frombuffer(b"%s%s\n" % (b"\n" * _PAD, text.encode("ascii")), np.uint8)
    ends = np.flatnonzero((raw == ord(delimiter)) | (raw == _NEWLINE))[_PAD:]
    if len(ends) % width:
        return None
    ends = ends.reshape(-1, width)
    signs = raw[ends]
    if not ((signs[:, -1] == _NEWLINE).all() and (signs[:, :-1] != _NEWLINE).all()):
        return None
    ends = np.ascontiguousarray(ends.T)
    starts = np.empty_like(ends)
    starts[1:] = ends[:-1] + 1
    starts[0, 0] = _PAD
    starts[0, 1:] = ends[-1, :-1] + 1
    return DecimalCells(text, starts, ends, raw)


def _power(decimals: Whole) -> Whole | np.int64:
    """Ten to the number of decimals, one for all lines if that is the same."""
    power: Whole | np.int64 = _POWERS[decimals[0] if (decimals == decimals[0]).all() else decimals]
    return power


def _divide_exactly(mantissa: Whole, power: NDArray[np.float64], known: Flags) -> Numbers:
    """(m / 10^k, ``known`` where it is certain to be rounded correctly) of whole m below 10^18.

    The quotient of the rounded m, and the rest of the division over 10^k beside it.
    """
    high = mantissa.astype(np.float64)
    low = (mantissa - high.astype(np.int64)).astype(np.float64)
    first = high / power
    product = first * power
    a, b = (one * _SPLIT - (one * _SPLIT - one) for one in (first, power))
    error = ((a * b - product) + a * (power - b) + (first - a) * b) + (first - a) * (power - b)
    second = ((high - product) - error + low) / power
    values = first + second
    rest, half = np.abs(second - (values - first)), 0.5 * np.spacing(values)
    sure = (np.abs(rest - half) > _MARGIN * half) & (np.frexp(values)[0] != 0.5)
    return Numbers(values, known & sure)


def _number(word: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The number that eight digits are, the first in the lowest byte, each as 0 to 9."""
    pairs = word * _U(10) + (word >> _U(8))
    low = _U(0x000000FF000000FF)
    first = (pairs & low) * _U(0x000F424000000064)  # 100 + (1000000 << 32)
    second = ((pairs >> _U(16)) & low) * _U(0x0000271000000001)  # 1 + (10000 << 32)
    return (first + second) >> _U(32)
