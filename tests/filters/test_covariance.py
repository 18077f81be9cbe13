"""P stays a covariance: 300,000 samples of everything that is hard, in double and in float.

``benchmarks/accuracy/covariance.py`` does the same with ten million.
"""

import itertools

import numpy as np
import pytest
from tests.reference import c_engine, covariance
from tests.reference.engines import NATIVE

import levelhead as lh
from levelhead import simulate
from levelhead.engine import serialization
from levelhead.filters import ESKF
from levelhead.filters.eskf import state
from levelhead.filters.eskf.state import RELATIVE_HEADING
from levelhead.filters.health import GAP, GYR_MISSING, GYR_SATURATED, MAG_REJECTED
from levelhead.kernels.tilt import UNIFORM

pytestmark = pytest.mark.compiled

NEEDS_C = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
ENGINES = [
    pytest.param(covariance.Native, id="double", marks=NATIVE.marks),
    pytest.param(covariance.Exported, id="float", marks=NEEDS_C),
]


@pytest.fixture(scope="module")
def pieces():
    return [covariance.piece(k) for k in range(6)]


def test_the_pieces_are_hard(pieces):
    """They have what the name says: else the test below would prove nothing."""
    seen = 0
    for one in pieces:
        recording = lh.Recording(np.cumsum(one.dt), *one[1:])
        seen |= int(np.bitwise_or.reduce(lh.fuse(recording, ESKF()).health))
    wanted = GAP | GYR_MISSING | GYR_SATURATED | MAG_REJECTED
    assert seen & wanted == wanted
    assert any(np.isnan(one.mag).all() for one in pieces)
    assert max(np.nanmax(np.abs(one.acc)) for one in pieces) > 50.0 * 9.8
    assert max(one.dt.max() for one in pieces) > 600.0


@pytest.mark.full
@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize("block", [0.1, 0.0], ids=["blocks", "every sample"])
def test_hard_readings(kind, block, pieces):
    found = covariance.watch(kind(ESKF(block=block)), iter(pieces if block else pieces[:2]))
    assert found.crooked == 0.0
    assert found.least > 1e-6, "float resolves 1.2e-7"
    assert found.zero == 0
    assert found.smallest > 0.99 * RELATIVE_HEADING, "a heading that is right by definition"
    assert found.largest <= np.float32(UNIFORM)


CONSTANT = {"bias_walk": 0.0, "scale_walk": 0.0, "acc_walk": 0.0, "offset_walk": 0.0}
ANYTHING = {"bias_start": 20.0, "scale_start": 0.05, "acc_bias": 0.5, "mag_offset": 1.0, "mag_delay": 100.0}
CERTAIN = {"gyr_noise": 1e-3, "gyr_noise_per_rate": 0.0, "acc_noise": 1e-4, "mag_noise": 1e-3, "velocity_density": 0.05}


@pytest.mark.parametrize("kind", ENGINES)
def test_constants_that_are_learned_for_ever_at_rest(kind):
    """No walk at all, next to no noise, wide starts, and nothing but rest: P only shrinks, in ever fewer directions."""
    calm = simulate.recording("LSM6DSO32", "still", duration=600.0, seed=1, mag="HMC5883L")
    at_rest = covariance.Readings(np.full(len(calm), 0.01), calm.gyr, calm.acc, calm.mag)
    found = covariance.watch(kind(ESKF(**CONSTANT, **ANYTHING, **CERTAIN)), iter([at_rest]))
    assert found.least > 0.0
    assert found.zero == 0


def test_with_position_and_height():
    """All states: five minutes of a drone, of which GNSS and barometer fall silent after two."""
    motion = simulate.motion(2, 300.0, 50.0, style="drone")
    recording = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed=2)
    fixes, pressure = simulate.gnss(motion, seed=2), simulate.pressure(motion, seed=2)
    live = lh.Stream(ESKF())
    events = sorted(
        [(t, 0, i) for i, t in enumerate(recording.t.tolist())]
        + [(t, 1, i) for i, t in enumerate(fixes.t.tolist()) if t < 120.0]
        + [(t, 2, i) for i, t in enumerate(pressure.t.tolist()) if t < 120.0]
    )
    for k, (t, which, i) in enumerate(itertools.dropwhile(lambda event: event[1] > 0, events)):
        if which == 0:
            live.update(recording.gyr[i], recording.acc[i], recording.mag[i], t=t)
        elif which == 1:
            live.update_position(fixes.position[i], 2.0)
            live.update_velocity(fixes.velocity[i], 0.2)
        else:
            live.update_pressure(pressure.values[i])
        if k % 100 == 99:
            memory = serialization.from_bytes(live.save()).carry.run.state.memory
            p = np.reshape(memory[state.P : state.P + state.ROW**2], (state.ROW, state.ROW))
            np.testing.assert_array_equal(p, p.T)
            assert covariance.least_eigenvalue(p) > 1e-9
    assert (np.diag(p)[: state.N] > 0.0).all()
