"""The clock of a sensor that is late and drifts, in another mounting, from simulated truth and from readings."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate.clock_difference import clock_difference
from levelhead.rotations import product


def test_offset_and_drift_within_their_sigma():
    rec = lh.simulate.recording("ICM-20948", "hand", duration=120.0, seed=1)
    mounted = product(rec.truth.quat, np.array([0.5, 0.5, -0.5, 0.5]))
    found = clock_difference(lh.Track(rec.t * (1.0 + 50e-6) + 0.123, mounted), lh.Track(rec.t, rec.truth.quat))
    assert abs(found.drift - 50e-6) < 4.0 * found.sigma_drift < 2e-5
    assert abs(found.offset - 0.123 - 50e-6 * found.middle) < 4.0 * found.sigma_offset < 5e-4
    assert "ppm" in str(found)


def test_sensors_at_rest_share_no_rotation():
    t = 0.01 * np.arange(3000)
    still = lh.Track(t, np.tile([1.0, 0.0, 0.0, 0.0], (3000, 1)))
    with pytest.raises(lh.LevelheadError, match="share no rotation"):
        clock_difference(still, still)
