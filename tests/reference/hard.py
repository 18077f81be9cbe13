"""A recording with everything that can be wrong with one, and when two tracks are the same."""

import numpy as np

import levelhead as lh


def hard_recording(with_mag):
    """Readings missing at the start and later, a gap, fast turns."""
    rng = np.random.default_rng(1)
    n = 700
    gyr = np.cumsum(rng.normal(0, 0.05, (n, 3)), axis=0) * 0.3
    acc, mag = rng.normal(0, 3, (n, 3)) + [0, 0, 9.81], rng.normal(0, 1, (n, 3)) + [0, 19, -45]
    t = np.cumsum(rng.uniform(0.005, 0.015, n))
    t[400:] += 3.0
    gyr[100], acc[0:3], acc[200], mag[300:310] = np.nan, np.nan, np.nan, np.nan
    gyr[500:510] = 40.0, -30.0, 20.0  # so fast that exp leaves its series
    return lh.Recording(t, gyr, acc, mag if with_mag else None)


def assert_same(a, b):
    for name in ("quat", "bias", "sigma", "health", "position", "velocity", "sigma_position", "sigma_velocity"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None)
        if x is not None:
            np.testing.assert_array_equal(x, y, err_msg=name)
