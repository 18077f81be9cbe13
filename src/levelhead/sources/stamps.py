"""Dates and clock times in text, as nanoseconds."""

import re
from datetime import date

from levelhead.errors import LevelheadError

NS = 1_000_000_000
_DAY = 86_400 * NS
_DATE = r"(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)[-/.](\d\d?)[-/.](\d{4}))"
_TIME = r"(\d\d?)[:](\d\d)[:](\d\d)(?:[.,:_](\d{1,9}))?\s*(AM|PM|am|pm)?"
_ZONE = r"(?:\s*(?:Z|UTC|GMT)?\s*[+-]?\d{0,2}:?\d{0,2})?"
STAMP = re.compile(rf"\s*\"?(?:{_DATE}[T _,]*\s*)?{_TIME}{_ZONE}\s*\"?\s*$")


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date with a clock time, or a clock time."""
    return ":" in cell and STAMP.match(cell) is not None


def nanoseconds(cell: str) -> int:
    """Nanoseconds since 1970 on the clock that the text shows, its zone left out; since midnight without a date.

    Raises:
        ValueError: no date and no clock time.
    """
    found = STAMP.match(cell)
    if found is None:
        raise ValueError(cell)
    y, m, d, a, b, late, hour, minute, second, fraction, half = found.groups()
    days = 0
    if y or late:
        year, month, day = (int(y), int(m), int(d)) if y else (int(late), int(b), int(a))
        if month > 12:
            month, day = day, month
        try:
            days = date(year, month, day).toordinal() - date(1970, 1, 1).toordinal()
        except ValueError as error:
            raise LevelheadError(f"'{cell.strip()}' is no date ({error})") from None
    hours = int(hour) % 12 + (12 if half.lower() == "pm" else 0) if half else int(hour)
    whole = ((days * 24 + hours) * 60 + int(minute)) * 60 + int(second)
    return whole * NS + int((fraction or "0").ljust(9, "0"))


def over_midnight(values: list[int]) -> list[int]:
    """Clock times without a date, a day added wherever midnight passed."""
    days, last, found = 0, None, []
    for value in values:
        if last is not None and value < last - _DAY // 2:
            days += 1
        found.append(value + days * _DAY)
        last = value
    return found
