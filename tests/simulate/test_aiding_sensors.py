"""Simulated receivers: stamps between the IMU's, errors of the size and the draw that the seed gives."""

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.simulate.aiding_sensors import SATELLITES, Receiver
from levelhead.simulate.noise import generator


def test_a_receiver_adds_its_noise_to_the_truth():
    motion = simulate.circles()
    found = simulate.gnss(motion, Receiver(rate=2.0, position=2.0, velocity=0.1), seed=3)
    draw = generator(3, SATELLITES).standard_normal((2, len(found.t), 3))
    for values, noise, truth in (
        (found.position, 2.0 * draw[0], motion.position),
        (found.velocity, 0.1 * draw[1], motion.velocity),
    ):
        for k in range(3):
            np.testing.assert_allclose(values[:, k] - noise[:, k], np.interp(found.t, motion.t, truth[:, k]), atol=1e-9)


def test_a_receiver_has_its_own_clock():
    motion = simulate.circles()
    found = simulate.gnss(motion, Receiver(rate=2.0), seed=0)
    assert found.t[0] == motion.t[0] + 0.25
    np.testing.assert_allclose(np.diff(found.t), 0.5)
    with pytest.raises(lh.LevelheadError, match="too short for a sensor at 1e-06 Hz"):
        simulate.gnss(motion, Receiver(rate=1e-6))
