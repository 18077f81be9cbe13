"""Recordings whose truth is known, and the contenders that are there."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from levelhead import simulate
from levelhead.bench import contenders
from levelhead.recording import Recording
from levelhead.rotations import turn_heading


@functools.cache
def headed(degrees: float, seed: int = 3, duration: float = 20.0, *, rotation: float = 20.0) -> Recording:
    """A gentle motion that starts with this heading (anticlockwise from east), seen by perfect sensors."""
    motion = simulate.motion(seed, duration, 100.0, style="hand", rotation=rotation, translation=0.1)
    east, north, up = simulate.EARTH_FIELD
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    field = (c * east + s * north, c * north - s * east, up)  # the world turned back instead of the sensor forth
    found = simulate.observe(motion, simulate.Imu(mag=simulate.TriadErrors()), field=field)
    assert found.truth is not None
    quat = turn_heading(found.truth.quat, np.radians(degrees))  # in the world as it is, so y is north again
    return replace(found, truth=replace(found.truth, quat=quat, north=True))


@pytest.fixture(params=[contender.name for contender in contenders.ALL])
def contender(request: pytest.FixtureRequest) -> contenders.Contender:
    """Each contender in turn; skips where its package is not installed."""
    one = contenders.BY_NAME[request.param]
    if not one.installed:
        pytest.skip(f"{one.package} is not installed: {contenders.INSTALL}")
    return one
