"""The detector of stances, one sample at a time."""

import pytest

from levelhead.guard.stance import MEMORY, begin_stance, step_stance
from levelhead.kernels.vec3 import Vec3


@pytest.mark.parametrize("dt", [0.01, 0.02])
def test_the_noise_of_a_moving_foot_is_a_running_mean(dt):
    """Of constant rates the mean square of a window is their square: x += dt / (MEMORY + dt) (ω²/3 − x)."""
    rate, force = Vec3(3.0, -4.0, 0.0), Vec3(0.0, 0.0, 9.81)
    before = begin_stance()
    for _ in range(200):
        before = step_stance(before, rate, force, dt)
    now = step_stance(before, rate, force, dt)
    assert not now.sigma and now.moving.gyr != before.moving.gyr
    share = (now.moving.gyr - before.moving.gyr) / (25.0 / 3.0 - before.moving.gyr)
    assert share == pytest.approx(dt / (MEMORY + dt), rel=1e-6)
