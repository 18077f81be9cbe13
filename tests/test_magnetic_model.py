"""The World Magnetic Model: test values that NOAA publishes with it, and what is refused."""

import datetime
import math

import pytest

import levelhead as lh
from levelhead.magnetic_model import earth_field, parse_place

pytest.importorskip("pygeomag")


@pytest.mark.parametrize(
    "place, field",
    [  # WMM2025_TestValues.txt of NOAA, 2025.0, on the ellipsoid: latitude, longitude; X north, Y east, Z down in nT
        ((80.0, 0.0), (6521.6, 145.9, 54791.5)),
        ((0.0, 120.0), (39677.8, -109.6, -10580.2)),
        ((-80.0, 240.0), (6117.5, 15751.9, -52022.5)),
    ],
)
def test_the_published_test_values(place, field):
    north, east, down = field
    found = earth_field(*place, date=datetime.date(2025, 1, 1))
    assert found.declination == pytest.approx(math.degrees(math.atan2(east, north)), abs=0.002)
    assert found.dip == pytest.approx(math.degrees(math.atan2(down, math.hypot(north, east))), abs=0.002)
    assert found.strength == pytest.approx(1e-3 * math.hypot(north, east, down), abs=2e-4)
    assert 0.2 < found.sigma_declination < 2.0 and found.sigma_strength == pytest.approx(0.138)


@pytest.mark.parametrize(
    "given, date, said",
    [
        ((91.0, 0.0), "2026-01-01", "the latitude is 91"),
        ((48.0, 11.0, 1e9), "2026-01-01", "the altitude is"),
        ((48.0, 11.0), "spring", "expected YYYY-MM-DD"),
        ((48.0, 11.0), "2091-01-01", "does not hold for 2091-01-01"),
        ((float("nan"), 11.0), None, "the latitude is nan"),
    ],
)
def test_no_field(given, date, said):
    with pytest.raises(lh.LevelheadError, match=said):
        earth_field(*given, date=date)


def test_a_place_as_text():
    assert parse_place("48.1,11.6") == (48.1, 11.6, 0.0) and parse_place("48.1,11.6,520") == (48.1, 11.6, 520.0)
    for text in ("48.1", "a,b", "1,2,3,4"):
        with pytest.raises(lh.LevelheadError, match="expected LAT,LON"):
            parse_place(text)
