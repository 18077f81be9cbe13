"""A batch takes the memory of its inputs and outputs and hardly more, however long it is."""

import tracemalloc

import numpy as np
import pytest

import levelhead as lh
from levelhead.compiler import lane_slots
from levelhead.engine import lanes, smoothing
from levelhead.engine.batch import fuse_axis
from levelhead.filters import eskf
from levelhead.tune.lane_score import SQUARES

pytestmark = pytest.mark.compiled

A_LITTLE = 200_000  # bytes: objects that do not grow with the recording
CHECKS = 1  # byte of a sample, while stamps are looked through
OUTPUTS = 8 * (4 + 3 + 3) + 4  # quat, bias, sigma, health of one sample
INPUTS = 8 * (1 + 3 + 3 + 3)  # t, gyr, acc, mag


def recording(n, with_mag):
    noise = np.random.default_rng(0)
    acc, mag = noise.normal(0, 0.1, (n, 3)) + [0, 0, 9.81], noise.normal(0, 1, (n, 3)) + [0, 19, -45]
    return lh.Recording(np.arange(n) * 0.01, noise.normal(0, 0.1, (n, 3)), acc, mag if with_mag else None)


def most(work):
    """The most memory that ``work`` has at a time beyond what was there before, in bytes."""
    tracemalloc.start()
    try:
        kept = work()
        now, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    del kept
    return now, peak


@pytest.mark.parametrize("with_mag", [False, True], ids=["6-D", "9-D"])
@pytest.mark.parametrize("progress", [None, lambda done: None], ids=["whole", "in stretches"])
def test_a_batch_needs_its_outputs(with_mag, progress):
    lh.fuse(recording(2000, with_mag), lh.Complementary(), engine="compiled", progress=progress)  # compiles
    n = 400_000
    given = recording(n, with_mag)
    kept, peak = most(lambda: lh.fuse(given, lh.Complementary(), engine="compiled", progress=progress))
    assert OUTPUTS * n <= kept <= peak < (OUTPUTS + CHECKS) * n + A_LITTLE


def test_one_axis_needs_its_report():
    n = 400_000
    t, level, rate = np.arange(n) * 0.01, np.zeros(n), np.zeros(n)
    fuse_axis(t[:2000], level[:2000], rate[:2000], lh.Kalman(), engine="compiled")
    kept, peak = most(lambda: fuse_axis(t, level, rate, lh.Kalman(), engine="compiled"))
    assert 8 * 9 * n <= kept
    assert peak < (8 * 9 + CHECKS) * n + A_LITTLE


@pytest.mark.full
def test_lanes_that_keep_no_tracks_need_next_to_nothing_more_for_any_length():
    sets = [lh.Complementary(tau=0.1 * (k + 1)) for k in range(lane_slots.LANES)]

    def run(n):
        given = recording(n, False)
        truth, start = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), np.tile(SQUARES.start, (len(sets), 1))
        return lambda: lanes.observe_lanes(given, lh.filters.of(sets[0]), sets, SQUARES, truth, start, workers=1)

    def peak(n):
        """The least of three runs: Python's own 0.1 MB comes and goes."""
        return min(most(run(n))[1] for _ in range(3))

    run(2000)()  # compiles, where no allocation is followed
    shorter, longer = 3000, 60_000
    assert peak(longer) - peak(shorter) < 2 * (longer - shorter), "a track has 84 bytes for each sample, of each of 64"


def test_the_smoother_keeps_the_blocks_of_one_stretch():
    """Beside outputs and a copy of the inputs; all blocks of this recording would take three times as much."""
    lh.smooth(recording(2000, True))  # compiles
    n = 60_000
    given = recording(n, True)
    kept, peak = most(lambda: lh.smooth(given))
    width = eskf.FILTER.smoothing.width + 1  # numbers of a block that is kept, and its last sample
    stretch, blocks = (8 * width * count for count in (smoothing.MOST_BLOCKS, n // 20))
    assert OUTPUTS * n <= kept <= peak < 1.2 * (INPUTS + OUTPUTS) * n + stretch + A_LITTLE < 0.4 * blocks
