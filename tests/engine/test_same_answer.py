"""One answer on any clock: what differs by rounding alone must not move an orientation.

Stamps that run a billionth faster or slower or began 10⁶ s earlier, rates whose last digit differs, and the exported C
in single precision. Where a block of samples ended on a tie, these moved recordings at 50, 100, 200 and 250 Hz by up to
13°. ``benchmarks/accuracy/same_answer.py`` prints the table over all recordings.
"""

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.same_answer import ALIKE, change_answers, compare_answers

import levelhead as lh
from levelhead import filters
from levelhead.bench.datasets import load_recording
from levelhead.export import ExportConfig
from levelhead.kernels.elapsed import SLACK, has_elapsed

RATES = (50, 100, 125, 200, 250, 400)  # Hz
USUAL_RATES = (10, 12.5, 20, 25, 26, 30, 31.25, 40, 50, 52, 60, 62.5, 64, 75, 80, 100, 104, 119, 120, 125, 128, 200,
               204.8, 208, 240, 250, 256, 400, 416, 500, 512, 800, 833, 1000, 1024, 1125, 1600, 2000, 4000)  # fmt: skip
LENGTHS = (0.02, 0.05, 0.12, 1.0, 1.5, 2.0, 3.0, 20.0, 30.0)  # s, as in docs/explanation/architecture.md
REAL = (  # at 40, 200, 286, 100 and about 94 samples in a second
    "truth/diodem/trial1_seg1.npz",
    "truth/euroc/V1_03_difficult.npz",
    "broad/21_undisturbed_fast_combined.mat",
    "repoimu/TStick_Test05_Trial1.csv",
    "truth/tyrex/Guillaume_iPhone5_NoDist_RunningHand.npz",
)
MOST_SAMPLES = 5000
EVERY_FILTER = pytest.mark.parametrize("flt", filters.ALL, ids=lambda flt: flt.name)


def test_no_usual_rate_ends_a_block_on_a_tie():
    """A block of any usual length ends at least a thousandth of an interval from a tie, at any usual rate."""
    for rate in USUAL_RATES:
        for length in LENGTHS:
            off = (rate * length + (1.0 - SLACK)) % 1.0
            assert min(off, 1.0 - off) > 0.001, (rate, length)


def test_a_sum_of_intervals_reaches_its_length_at_the_right_sample():
    assert [has_elapsed(0.005 * k, 0.005, 0.02) for k in range(1, 5)] == [False, False, False, True]
    assert [has_elapsed(0.0035 * k, 0.0035, 0.02) for k in range(1, 7)] == [False] * 5 + [True]


@EVERY_FILTER
@pytest.mark.parametrize("rate", RATES)
def test_rounding_moves_no_answer(flt, rate):
    """Rest, then motion, so that the guard finds a bias and every clock begins anew."""
    still = lh.simulate.recording("ICM-20948", "still", 4.0, rate=rate, seed=1, mag="AK09916")
    moved = lh.simulate.recording("ICM-20948", "hand", 8.0, rate=rate, seed=1, mag="AK09916")
    t = np.arange(len(still) + len(moved)) / rate
    both = [np.vstack(pair) for pair in ((still.gyr, moved.gyr), (still.acc, moved.acc), (still.mag, moved.mag))]
    recording = lh.Recording(t, *both)
    for name, apart in change_answers(recording, flt.params()).items():
        assert apart.angle < 1e-4, name


@EVERY_FILTER
@pytest.mark.parametrize("name", REAL)
def test_rounding_moves_no_answer_on_real_recordings(flt, name, data_dir):
    """The whole of each set is the benchmark's; of what float moves it lists six recordings, each with its branch."""
    recording = load_recording(data_dir / name, with_mag=True)[:MOST_SAMPLES]
    for change, apart in change_answers(recording, flt.params()).items():
        assert apart.angle < 1e-3, change


@pytest.mark.slow
@pytest.mark.skipif(not c_engine.COMPILERS, reason="no C compiler (gcc or clang) on the PATH")
@pytest.mark.parametrize("params", [lh.Mahony(), lh.EKF(), lh.ESKF()])
def test_single_precision_gives_the_same_answer(params):
    recording = lh.simulate.recording("ICM-20948", "hand", 12.0, rate=200.0, seed=2, mag="AK09916")
    single = c_engine.built(ExportConfig(params, real="float")).fuse(recording)
    assert compare_answers(lh.fuse(recording, params), single).angle < ALIKE
