"""The place and the date of a log: satellite positions beside its sensors, and stamps since 1970."""

import datetime
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.recording import Array, Recording
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.table import Table

WORDS = {
    "latitude": re.compile(r"(?<![a-z])lat(?:itude)?(?![a-z])", re.IGNORECASE),
    "longitude": re.compile(r"(?<![a-z])(?:lon|lng|long|longitude)(?![a-z])", re.IGNORECASE),
    "altitude": re.compile(r"(?<![a-z])(?:alt|altitude|height)(?![a-z])", re.IGNORECASE),
}
WHOLE = 1e-7  # degrees: the unit of whole numbers, as autopilots and u-blox receivers have it
HIGHEST = 20_000.0  # m: above it the unit of the altitude is another
OLDEST, NEWEST = 1.2e9, 4.1e9  # s since 1970: 2008 to 2099; a clock that counts from elsewhere is outside


class Location(NamedTuple):
    """Where and when a log was made.

    Attributes:
        latitude: degrees.
        longitude: degrees.
        altitude: m; 0 where it is not known.
        date: None: the log has no clock with a date.
    """

    latitude: float
    longitude: float
    altitude: float
    date: datetime.date | None


def place_of(recording: Recording) -> Location | None:
    """The place and the date that the reader has found in a log; None: it has no satellite position."""
    found = next((one for one in recording.meta.get("conclusions", ()) if one.about == "place"), None)
    if found is None:
        return None
    facts = found.facts
    return Location(
        facts["latitude"], facts["longitude"], facts["altitude"], _date(facts["unix"]) or date_of(recording)
    )


def date_of(recording: Recording) -> datetime.date | None:
    """The date of the first sample by the log's own clock; None: it does not count from 1970."""
    return _date(float(recording.meta.get("t0", 0.0)) + float(recording.t[0]))


def _date(unix: float | None) -> datetime.date | None:
    if unix is None or not OLDEST < unix < NEWEST:
        return None
    return datetime.datetime.fromtimestamp(unix, datetime.UTC).date()


def satellite_place(
    latitude: Array, longitude: Array, altitude: Array | None = None, unix: float | None = None, source: str = ""
) -> Conclusion | None:
    """The median of satellite positions as a conclusion; None: there is none.

    Args:
        latitude: (n,) degrees, or whole numbers of 1e-7 degrees; 0 and NaN are not a position.
        longitude: likewise.
        altitude: (n,) m.
        unix: s since 1970 of the receiver; None: it has no clock.
        source: of the positions, for the sentence.
    """
    values = [np.asarray(one, np.float64) for one in (latitude, longitude)]
    known = np.isfinite(values[0]) & np.isfinite(values[1]) & ((values[0] != 0.0) | (values[1] != 0.0))
    if not known.any():
        return None
    north, east = (float(np.median(one[known])) for one in values)
    if abs(north) > 90.0 or abs(east) > 360.0:
        north, east = WHOLE * north, WHOLE * east
    if not (abs(north) <= 90.0 and abs(east) <= 360.0):
        return None
    up = np.zeros(1) if altitude is None else np.asarray(altitude, np.float64)
    up = up[np.isfinite(up)]
    height = float(np.median(up)) if len(up) else 0.0
    facts = {
        "latitude": round(north, 5), "longitude": round(east, 5), "altitude": height if abs(height) < HIGHEST else 0.0,
        "unix": unix, "source": source,
    }  # fmt: skip
    return Conclusion("place", "satellites", f"{north:.4f},{east:.4f}", Basis.HEADER, facts)


def column_place(tables: Sequence[Table]) -> Conclusion | None:
    """The place by the first table with columns of latitude and longitude; None: there is none."""
    for table in tables:
        at: Mapping[str, int] = {
            role: next((i for i, name in enumerate(table.names) if word.search(name)), -1)
            for role, word in WORDS.items()
        }
        if at["latitude"] < 0 or at["longitude"] < 0:
            continue
        try:
            read = table.read([i for i in at.values() if i >= 0])
        except LevelheadError:  # words in a cell: no positions
            continue
        columns = {role: np.asarray(read[i], np.float64) for role, i in at.items() if i >= 0}
        names = f"{table.names[at['latitude']]}, {table.names[at['longitude']]}"
        found = satellite_place(columns["latitude"], columns["longitude"], columns.get("altitude"), source=names)
        if found is not None:
            return found
    return None
