"""Angles on the circle: what is inside stays to the bit, what is outside comes back by whole turns."""

from math import floor, inf, nextafter, pi

import numpy as np
import pytest

from levelhead.kernels.angle import wrap


@pytest.mark.parametrize("period", [2.0 * pi, 360.0, 1.0, 0.1])
def test_wrap_takes_off_the_floor_of_turns(period):
    rng = np.random.default_rng(8)
    halves = [k * period / 2.0 for k in range(-200, 200)]
    edges = [nextafter(angle, end) for angle in halves for end in (-inf, inf)]
    far = (rng.normal(size=500) * 10.0 ** rng.uniform(-3.0, 12.0, 500)).tolist()
    for angle in [*halves, *edges, *far]:
        inside = -0.5 * period <= angle < 0.5 * period
        assert wrap(angle, period) == (angle if inside else angle - period * floor(angle / period + 0.5))


def test_half_a_turn_is_the_lower_end():
    assert wrap(180.0, 360.0) == -180.0 == wrap(-180.0, 360.0) == wrap(540.0, 360.0)


def test_a_line_has_no_turns():
    assert wrap(1e6, 0.0) == 1e6
