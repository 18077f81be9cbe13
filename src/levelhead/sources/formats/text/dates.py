"""Dates, clock times and durations in text, as nanoseconds."""

import re
from datetime import date

from levelhead.errors import LevelheadError

NS = 1_000_000_000
_DAY = 86_400 * NS
_YEARS = 290  # from 1970, of which 64 bits hold the nanoseconds
_DATE = r"(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)[-/.](\d\d?)[-/.](\d{4}))"
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTH = re.compile(
    rf"\s*\"?(?:(?:mon|tue|wed|thu|fri|sat|sun)\w*,?\s+)?"
    rf"(?:(?P<d>\d\d?)[-\s](?P<m>{'|'.join(_MONTHS)})\w*[-\s,]+(?P<y>\d{{4}})"
    rf"|(?P<m2>{'|'.join(_MONTHS)})\w*\s+(?P<d2>\d\d?)(?:,?\s+(?P<y2>\d{{4}}))?),?\s+"
    r"(?P<clock>\d\d?:\d\d:\d\d(?:[.,:]\d{1,9})?(?:\s*[AP]M)?)(?:\s+(?:[A-Z]{3,4}\s+)?(?P<y3>\d{4}))?\s*\"?\s*$",
    re.IGNORECASE,
)
_TIME = r"(\d\d?)[:](\d\d)[:](\d\d)(?:[.,:_](\d{1,9}))?\s*(AM|PM|am|pm)?"
_MINUTES = re.compile(r"\s*\"?(\d\d?):(\d\d)\.(\d{1,9})\s*\"?\s*$")  # as spreadsheets shorten a clock time
_CLOCK_FIRST = re.compile(r"\s*\"?(\d\d?:\d\d:\d\d(?:[.,]\d{1,9})?)\s+(\d\d?)[-/.](\d\d?)[-/.](?:20)?(\d\d)\s*\"?\s*$")
_ZONE = r"(?:\s*(?:Z|UTC|GMT)?\s*[+-]?\d{0,2}:?\d{0,2})?"
_UNITS = {"ms": NS // 1000, "s": NS, "sec": NS, "min": 60 * NS, "hr": 3600 * NS}
_DURATION = re.compile(rf"\s*\"?(\d+(?:\.\d+)?)\s*({'|'.join(_UNITS)})\s*\"?\s*$")  # of MATLAB's timetables
STAMP = re.compile(rf"\s*\"?(?:{_DATE}[T _,]*\s*)?{_TIME}{_ZONE}\s*\"?\s*$")


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date with a clock time, a clock time, or a duration with its unit."""
    patterns = (_MINUTES, STAMP, _MONTH, _CLOCK_FIRST) if ":" in cell else (_DURATION,)
    return any(pattern.match(cell) is not None for pattern in patterns)


def _in_digits(cell: str) -> str:
    """A date with the name of its month, as MATLAB and C write it, or behind its clock time, in digits.

    Any other text is given back as it is.
    """
    if last := _CLOCK_FIRST.match(cell):
        return f"{last[2]}/{last[3]}/20{last[4]} {last[1]}"
    found = _MONTH.match(cell)
    if found is None:
        return cell
    year = found["y"] or found["y2"] or found["y3"] or "1970"
    month = _MONTHS.index((found["m"] or found["m2"]).lower()) + 1
    return f"{year}-{month:02d}-{int(found['d'] or found['d2']):02d} {found['clock']}"


def nanoseconds(cell: str) -> int:
    """Nanoseconds since 1970 on the clock that the text shows, its zone left out; since midnight without a date.

    Raises:
        ValueError: no date, no clock time and no duration.
    """
    if duration := _DURATION.match(cell):
        return round(float(duration[1]) * _UNITS[duration[2]])
    if short := _MINUTES.match(cell):
        return (int(short[1]) * 60 + int(short[2])) * NS + int(short[3].ljust(9, "0"))
    found = STAMP.match(cell) or STAMP.match(_in_digits(cell))
    if found is None:
        raise ValueError(cell)
    y, m, d, a, b, late, hour, minute, second, fraction, half = found.groups()
    days = 0
    if y or late:
        year, month, day = (int(y), int(m), int(d)) if y else (int(late), int(b), int(a))
        if month > 12:
            month, day = day, month
        if abs(year - 1970) > _YEARS:
            raise ValueError(cell)
        try:
            days = date(year, month, day).toordinal() - date(1970, 1, 1).toordinal()
        except ValueError:
            raise LevelheadError(f"'{cell.strip()}' is not a date: no calendar has that day") from None
    hours = int(hour) % 12 + (12 if half.lower() == "pm" else 0) if half else int(hour)
    whole = ((days * 24 + hours) * 60 + int(minute)) * 60 + int(second)
    return whole * NS + int((fraction or "0").ljust(9, "0"))


def over_midnight(values: list[int]) -> list[int]:
    """Clock times without a date, a day added wherever midnight passed; an hour, if they are minutes and seconds."""
    days, last, found = 0, None, []
    period = 3600 * NS if max(values, default=0) < 3600 * NS else _DAY
    for value in values:
        if last is not None and value < last - period // 2:
            days += 1
        found.append(value + days * period)
        last = value
    return found
