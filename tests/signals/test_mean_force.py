"""How still gravity holds, in rad/s and in deg/s; without a whole window near 1 g there is no answer."""

import numpy as np
import pytest

from levelhead.signals.mean_force import Steadiness, steadiness_of_gravity
from levelhead.units import GRAVITY

RATE = 100.0  # Hz
TURN = 2.0  # rad/s about x


def turning(seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sensor that turns evenly about a level x axis: gravity is a circle in y and z."""
    t = np.arange(round(seconds * RATE)) / RATE
    gyr = np.tile([TURN, 0.0, 0.0], (len(t), 1))
    acc = GRAVITY * np.stack([np.zeros_like(t), np.sin(TURN * t), np.cos(TURN * t)], axis=1)
    return t, gyr, acc


def test_gravity_holds_still_in_the_right_unit():
    """In rad/s all of g is left; in deg/s gravity stays a circle, of whose arc θ sin(θ/2)/(θ/2) is left."""
    found = steadiness_of_gravity(*turning(5.0))
    left = np.sin(TURN / 2) / (TURN / 2)
    assert found.windows == 5
    assert found.best == pytest.approx(1.0, abs=1e-9)
    assert found.gain == pytest.approx(1.0 - left, abs=0.02)


def test_without_a_window_near_g_there_is_no_answer():
    t, gyr, acc = turning(5.0)
    nothing = Steadiness(0, 0.0, 0.0)
    assert steadiness_of_gravity(t, gyr, 2.0 * acc) == nothing  # on a wheel
    assert steadiness_of_gravity(t[:50], gyr[:50], acc[:50]) == nothing  # half a window
    assert steadiness_of_gravity(t[:1], gyr[:1], acc[:1]) == nothing
    assert steadiness_of_gravity(np.zeros(100), gyr[:100], acc[:100]) == nothing  # no time
