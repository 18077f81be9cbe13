"""What ``ESKF`` learns of its sensor is what the simulation drew, to within the σ that it states."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.filters import ESKF


@pytest.mark.slow
@pytest.mark.parametrize("guard", [lh.Guard(), None], ids=["guarded", "alone"])
def test_the_bias_is_the_whole_bias(guard):
    """Also that part of it which the guard could have read off at rest: this filter is left to learn it."""
    recording = lh.simulate.recording("LSM6DSO32", "hand", duration=60.0, seed=2, mag="HMC5883L")
    track = lh.fuse(recording, ESKF(), guard=guard)
    matrix = recording.meta["true_errors"]["gyr"]["matrix"]
    np.testing.assert_allclose(track.bias[-1], np.linalg.solve(matrix, recording.truth.bias[-1]), atol=np.radians(0.1))
    assert np.abs(recording.truth.bias[-1]).max() > np.radians(0.25)
