"""What a log is expected to be good for: from σ, without the reference."""

import numpy as np
import pytest

from levelhead.inspection.verdict import _drift


def test_heading_drifts_from_where_its_sigma_is_least():
    """A raw gyroscope's σ falls once its bias is known; from there it grows by √(13² − 5²) ° in two minutes."""
    t = np.linspace(0.0, 130.0, 1301)
    sigma = np.where(t < 10.0, 40.0 - 3.5 * t, np.sqrt(25.0 + 144.0 * (t - 10.0) / 120.0))
    assert _drift(t, sigma) == pytest.approx(6.0, rel=1e-6)
    assert _drift(t[100:], sigma[100:]) == pytest.approx(6.0, rel=1e-6)
