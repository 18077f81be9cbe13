"""Readings are rates of an instant: the trapezoidal rule between two stamps, against the closed form of the angle."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.engine.binding import is_guarded
from levelhead.filters import ALL
from levelhead.guard.detectors import GROUP_DELAY

RATE, TURNS, FASTEST = 40.0, 1.0, 5.0  # Hz, turns a second of the oscillation, rad/s
AXIS = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def shaken():
    """A level body that oscillates about the vertical, ω = A cos 2πft, and its heading A/(2πf) sin 2πft."""
    t = np.arange(0.0, 10.0, 1.0 / RATE)
    phase = 2.0 * np.pi * TURNS * t
    gyr = np.outer(FASTEST * np.cos(phase), AXIS)
    heading = FASTEST / (2.0 * np.pi * TURNS) * np.sin(phase)
    return lh.Recording(t, gyr, np.tile([0.0, 0.0, 9.80665], (len(t), 1))), heading


def heading_error(recording, heading, params, **options):
    yaw = np.unwrap(lh.fuse(recording, params, **options).euler(degrees=False)[:, 2])
    return np.abs(yaw - yaw[0] - heading).max()


@pytest.mark.parametrize(
    "flt", [flt for flt in ALL if is_guarded(flt) and "heading" not in flt.estimates], ids=lambda flt: flt.name
)
def test_an_oscillation_is_integrated_to_the_second_order(shaken, flt):
    """The error of the trapezoidal rule is T²/12 (ω'(t) − ω'(0)) at most; that of the later reading alone, ω T/2."""
    recording, heading = shaken
    second_order = 2.0 * FASTEST * 2.0 * np.pi * TURNS / RATE**2 / 12.0
    delay = GROUP_DELAY * FASTEST  # which these ideal readings do not have
    assert heading_error(recording, heading, flt.params()) < 1.1 * second_order + 2.0 * delay
    assert heading_error(recording, heading, flt.params(), guard=None) > 0.4 * FASTEST / RATE
