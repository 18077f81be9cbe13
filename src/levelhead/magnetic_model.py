"""The earth's magnetic field at a place and time by the World Magnetic Model: declination, dip and strength, with 1σ.

The model of NOAA and the British Geological Survey is evaluated by pygeomag (MIT; the coefficients are in the public
domain), which has no dependencies. σ is that of its error model; iron nearby is not part of it.
"""

import datetime
from typing import NamedTuple, SupportsFloat

from levelhead.errors import LevelheadError, require


class EarthField(NamedTuple):
    """The field.

    Attributes:
        declination: degrees from true to magnetic north, positive east.
        dip: degrees below the horizontal.
        strength: µT.
        sigma_declination: degrees, 1σ.
        sigma_dip: degrees, 1σ.
        sigma_strength: µT, 1σ.
    """

    declination: float
    dip: float
    strength: float
    sigma_declination: float
    sigma_dip: float
    sigma_strength: float


def earth_field(
    latitude: float, longitude: float, altitude: float = 0.0, *, date: datetime.date | str | None = None
) -> EarthField:
    """The field at a place.

    Args:
        latitude: degrees, north positive.
        longitude: degrees, east positive.
        altitude: m above the ellipsoid.
        date: a date, or its ISO text; None: today.

    Raises:
        LevelheadError: no such place or date, a date outside of the model's five years, or no pygeomag.
    """
    require("pygeomag", "the field of a place", "place")
    for name, value, limit, unit in (
        ("latitude", latitude, 90.0, "degrees"),
        ("longitude", longitude, 360.0, "degrees"),
        ("altitude", altitude, 850_000.0, "m"),
    ):
        if not isinstance(value, SupportsFloat) or not abs(float(value)) <= limit:
            raise LevelheadError(f"the {name} is {value!r}; expected {unit} within ±{limit:g}")
    when = _date(date)
    from pygeomag import GeoMag

    start = datetime.date(when.year, 1, 1)
    days = (datetime.date(when.year + 1, 1, 1) - start).days
    year = when.year + (when - start).days / days
    try:
        model = GeoMag(base_year=when.year)
        found = model.calculate(glat=float(latitude), glon=float(longitude), alt=1e-3 * float(altitude), time=year)
    except (ValueError, FileNotFoundError):
        raise LevelheadError(f"the World Magnetic Model does not hold for {when}; expected 2010 to 2029") from None
    doubt = found.calculate_uncertainty()
    return EarthField(
        declination=found.d,
        dip=found.i,
        strength=1e-3 * found.f,
        sigma_declination=doubt.d,
        sigma_dip=doubt.i,
        sigma_strength=1e-3 * doubt.f,
    )


def parse_place(text: str) -> tuple[float, float, float]:
    """Latitude, longitude and altitude from "LAT,LON" or "LAT,LON,ALT".

    Raises:
        LevelheadError: not two or three numbers.
    """
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        raise LevelheadError(f"the place is '{text}'; expected LAT,LON or LAT,LON,ALT in degrees and m: 48.1,11.6,520")
    return numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 0.0


def _date(date: datetime.date | str | None) -> datetime.date:
    if date is None:
        return datetime.datetime.now(datetime.UTC).date()
    if isinstance(date, datetime.datetime):
        return date.date()
    if isinstance(date, datetime.date):
        return date
    try:
        return datetime.date.fromisoformat(str(date)[:10])
    except ValueError:
        raise LevelheadError(f"the date is '{date}'; expected YYYY-MM-DD, such as 2026-05-17") from None
