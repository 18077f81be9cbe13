"""Height from pressure against the printed table of the standard atmosphere."""

import numpy as np
import pytest

from levelhead import atmosphere


@pytest.mark.parametrize(
    ("height", "pressure"),
    [(0.0, 101325.0), (500.0, 95461.0), (1000.0, 89874.6), (2000.0, 79495.2), (5000.0, 54019.9), (10000.0, 26436.3)],
)
def test_table_of_the_standard(height, pressure):
    """Geopotential heights and pressures as ISO 2533 and the U.S. Standard Atmosphere 1976 print them."""
    assert atmosphere.height(pressure) == pytest.approx(height, abs=0.05)
    assert atmosphere.pressure_at(height) == pytest.approx(pressure, rel=1e-5)


def test_slope_is_the_derivative():
    p = np.linspace(30e3, 105e3, 7)
    slope = (atmosphere.height(p - 1.0) - atmosphere.height(p + 1.0)) / 2.0
    np.testing.assert_allclose(atmosphere.metres_per_pascal(p), slope, rtol=1e-6)
