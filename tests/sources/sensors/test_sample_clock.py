"""Stamps from a line fit of the clock: near the truth, increasing, never from the future."""

import numpy as np
import pytest

from levelhead.sources.sensors.sample_clock import SampleClock


@pytest.mark.parametrize("drift", [-0.02, -0.005, 0.0, 0.005, 0.02])
def test_stamps_follow_a_clock_that_is_off(drift):
    """A chip at 200 Hz (1 + drift), looked at whenever the host gets to it, up to 50 ms late."""
    random = np.random.default_rng(1)
    period = 0.005 / (1.0 + drift)
    clock, now, seen = SampleClock(200.0), 0.0, 0
    stamps, truth = [], []
    while now < 60.0:
        now += 0.005 + (0.05 if random.uniform() < 0.01 else abs(random.normal(0.0, 2e-4)))
        there = int(now / period)
        found = clock.stamps(there - seen, now)
        assert all(stamp <= now for stamp in found)
        stamps += found
        truth += [k * period for k in range(seen + 1, there + 1)]
        seen = there
    error = np.array(stamps) - np.array(truth)
    assert (np.diff(stamps) > 0.0).all()
    assert np.abs(error).max() < 2 * period  # even at the beginning
    late = np.array(truth) > 20.0
    assert np.abs(error[late]).max() < 0.6 * period and np.abs(error[late]).mean() < 0.2 * period
    assert clock.period == pytest.approx(period, rel=2e-4)
    assert np.std(np.diff(np.array(stamps)[late])) < 0.05 * period  # the looks jitter by far more than that


def test_after_a_loss_the_line_starts_anew_with_its_slope():
    clock, period = SampleClock(100.0), 0.0102
    for k in range(1, 3000):
        clock.stamps(1, k * period)
    clock.restart()
    first = clock.stamps(1, 40.0)[0]
    assert first == pytest.approx(40.0 - 0.5 * period, abs=1e-3)
    assert clock.stamps(1, 40.0 + period)[0] - first == pytest.approx(period, rel=1e-3)
    assert clock.period == pytest.approx(period, rel=1e-3)


def test_nothing_new_is_nothing():
    clock = SampleClock(100.0)
    assert clock.stamps(0, 1.0) == []
    both = clock.stamps(2, 2.0)
    assert both[0] < both[1] <= 2.0
    assert clock.stamps(1, 2.0)[0] > both[1]  # even when the host's clock stands still
