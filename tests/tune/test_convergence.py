"""When a gain has converged: closed forms, and the Riccati equation's own limit."""

import numpy as np
import pytest

from levelhead.engine import fuse_axis
from levelhead.errors import LevelheadError
from levelhead.filters import Kalman
from levelhead.simulate import lesson
from levelhead.tune import find_convergence


def test_an_exponential_settles_when_it_must():
    """1 + 9 exp(−t/τ) is within 1 % from t = τ ln 900 on."""
    t = np.arange(0.0, 60.0, 0.001)
    index = find_convergence(t, 1.0 + 9.0 * np.exp(-t / 2.0))
    assert t[index] == pytest.approx(2.0 * np.log(900.0), abs=2e-3)


def test_it_must_stay_inside_ever_after():
    gain = np.array([2.0, 1.0, 1.0, 1.5, 1.0, 1.005, 1.0])
    assert find_convergence(np.arange(7), gain) == 4
    assert find_convergence(np.arange(7), gain, tolerance=0.001) == 6
    assert find_convergence(np.arange(3), [1.0, 1.0, 1.0]) == 0
    assert find_convergence(np.arange(3), [-2.0, -1.0, -1.0]) == 1
    assert find_convergence([0.0], [3.0]) == 0


def test_the_slowest_of_several_counts():
    gains = np.array([[2.0, 1.0], [1.0, 2.0], [1.0, 1.0]])
    assert find_convergence(np.arange(3), gains) == 2


def test_a_kalman_gain_settles_at_its_steady_state():
    r = lesson(42)
    level, rate = np.degrees(np.arctan2(r.acc[:, 1], r.acc[:, 2])), np.degrees(r.gyr[:, 0])
    gain = fuse_axis(r.t, level, rate, Kalman(r_measure=4.0)).gain_level
    index = find_convergence(r.t, gain)
    assert 0 < index < len(gain) // 2
    assert (np.abs(gain[index:] / gain[-1] - 1.0) <= 0.01).all()
    assert abs(gain[index - 1] / gain[-1] - 1.0) > 0.01


def test_what_is_wrong_is_said():
    with pytest.raises(LevelheadError, match="NaN at row 1"):
        find_convergence(np.arange(3), [1.0, np.nan, 1.0])
    with pytest.raises(LevelheadError, match="gain has shape"):
        find_convergence(np.arange(3), [1.0, 1.0])
    with pytest.raises(LevelheadError, match="positive"):
        find_convergence(np.arange(3), [1.0, 1.0, 1.0], tolerance=0.0)
