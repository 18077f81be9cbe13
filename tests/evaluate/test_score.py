"""Scores of hand-made tracks whose errors are known."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead.errors import LevelheadError
from levelhead.evaluate import error_angles, evaluate
from levelhead.filters import Complementary, GyroIntegration, Kalman
from levelhead.recording import Recording, Truth
from levelhead.track import Track


def motion(t: np.ndarray) -> Rotation:
    angles = np.stack([0.7 * np.sin(1.1 * t), 0.4 * np.sin(1.7 * t + 1), 0.5 * np.sin(0.9 * t + 2)], axis=1)
    return Rotation.from_euler("ZYX", angles)


def quats(rotation: Rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


def record(truth: Truth | None, n: int = 2000, mag: bool = True) -> Recording:
    t = np.arange(n) * 0.01
    up = np.tile([0.0, 0.0, 9.8], (n, 1))
    return Recording(t, np.zeros((n, 3)), up, np.tile([0.0, 20.0, -40.0], (n, 1)) if mag else None, truth)


T = np.arange(2000) * 0.01


def test_a_constant_tilt_error_is_that_error():
    truth = motion(T)
    off = Rotation.from_euler("X", 2.0, degrees=True)
    score = evaluate(record(Truth(quats(truth))), Track(T, quats(off * truth)))
    assert score.tilt == pytest.approx(2.0)
    assert score.total == pytest.approx(2.0)
    assert score.worst == pytest.approx(2.0)
    assert score.heading == pytest.approx(0.0, abs=1e-6)
    assert score.heading_offset is None
    assert score.samples == 2000


@pytest.mark.parametrize(
    ("mag", "north", "params"),
    [
        pytest.param(False, True, None, id="no magnetometer"),
        pytest.param(True, False, None, id="truth without north"),
        pytest.param(True, True, GyroIntegration(), id="filter without heading"),
    ],
)
def test_relative_heading_loses_its_constant_offset_and_the_score_says_so(mag, north, params):
    truth = motion(T)
    off = Rotation.from_euler("Z", 170.0, degrees=True)
    score = evaluate(record(Truth(quats(truth), north=north), mag=mag), Track(T, quats(off * truth), params=params))
    assert score.heading_offset == pytest.approx(170.0)
    assert score.total == pytest.approx(0.0, abs=1e-6)
    assert "170" in str(score)


def test_absolute_heading_keeps_its_error():
    truth = motion(T)
    off = Rotation.from_euler("Z", 20.0, degrees=True)
    score = evaluate(record(Truth(quats(truth))), Track(T, quats(off * truth), params=Complementary()))
    assert score.heading == pytest.approx(20.0)
    assert score.heading_offset is None
    assert score.total_aligned == pytest.approx(0.0, abs=1e-6)
    assert "with the best constant heading removed" in str(score)


def test_what_a_constant_heading_explains_is_that_of_the_best_offset():
    """Tilt stays when heading is taken away, and a relative track has nothing more to give."""
    truth = motion(T)
    off = Rotation.from_euler("Z", 20.0, degrees=True) * Rotation.from_euler("X", 3.0, degrees=True)
    score = evaluate(record(Truth(quats(truth))), Track(T, quats(off * truth)))
    assert score.total_aligned == pytest.approx(3.0, abs=1e-6) and score.total > 20.0
    relative = evaluate(record(Truth(quats(truth))), Track(T, quats(off * truth)), relative=True)
    assert relative.total == relative.total_aligned == score.total_aligned
    assert relative.heading_offset == pytest.approx(20.0, abs=1e-6)


def test_a_track_with_holes_counts_where_it_is_known_if_asked():
    truth = quats(motion(T))
    holes = truth.copy()
    holes[:500] = np.nan
    score = evaluate(record(Truth(truth)), Track(T, holes), partial=True)
    assert score.samples == 1500 and score.total == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(LevelheadError, match="never known at the same sample"):
        evaluate(record(Truth(truth)), Track(T, np.full_like(truth, np.nan)), partial=True)


def test_only_movement_with_known_truth_counts():
    truth = quats(motion(T))
    estimate = truth.copy()
    estimate[:500] = quats(Rotation.from_euler("X", 1.0))  # at rest
    estimate[500:600] = quats(Rotation.from_euler("X", -1.0))  # reference blind
    blind = truth.copy()
    blind[500:600] = np.nan
    score = evaluate(record(Truth(blind, moving=T >= 5.0)), Track(T, estimate))
    assert score.total == pytest.approx(0.0, abs=1e-6)
    assert score.samples == 1400
    every = error_angles(record(Truth(blind, moving=T >= 5.0)), Track(T, estimate))
    assert np.isnan(every.total[500:600]).all()
    assert not np.isnan(every.total[:500]).any()


def test_bias_error_per_axis_and_as_a_length():
    truth = Truth(quats(motion(T)), bias=np.radians(np.tile([1.0, 2.0, 3.0], (2000, 1))))
    bias = np.radians(np.tile([1.3, 1.6, 0.0], (2000, 1)))
    score = evaluate(record(truth), Track(T, truth.quat, bias=bias))
    assert score.bias_axes is not None
    assert score.bias_axes[:2] == pytest.approx((0.3, 0.4))
    assert score.bias_axes[2] is None  # never estimated
    assert score.bias == pytest.approx(0.5)
    assert evaluate(record(Truth(truth.quat)), Track(T, truth.quat, bias=bias)).bias is None
    assert evaluate(record(truth), Track(T, truth.quat)).bias is None


@pytest.mark.slow
def test_doubt_is_one_when_sigma_tells_the_truth():
    rng = np.random.default_rng(3)
    n = 20_000
    t = np.arange(n) * 0.01
    sigma = np.radians([0.5, 1.0, 2.0])
    truth = motion(t)
    estimate = Rotation.from_rotvec(sigma * rng.standard_normal((n, 3))) * truth
    track = Track(t, quats(estimate), sigma=np.tile(sigma, (n, 1)))
    score = evaluate(record(Truth(quats(truth)), n), track)
    assert score.tilt_error_ratio == pytest.approx(1.0, abs=0.03)
    assert score.heading_error_ratio == pytest.approx(1.0, abs=0.03)
    without = evaluate(record(Truth(quats(truth)), n), Track(t, quats(estimate), sigma=np.zeros((n, 3))))
    assert without.tilt_error_ratio is None
    assert without.heading_error_ratio is None


@pytest.mark.parametrize("mag", [True, False])
@pytest.mark.parametrize("delay", [-0.2, -0.0137, 0.0, 0.003, 0.0481, 0.35])
def test_a_delay_is_found_below_the_sample_interval(delay, mag):
    rng = np.random.default_rng(5)
    noise = Rotation.from_rotvec(np.radians(0.5) * rng.standard_normal((2000, 3)))
    estimate = noise * Rotation.from_euler("X", 1.0, degrees=True) * motion(T - delay)
    score = evaluate(record(Truth(quats(motion(T))), mag=mag), Track(T, quats(estimate)))
    assert score.lag == pytest.approx(1e3 * delay, abs=2.0)


def test_no_lag_is_made_up_where_nothing_moves():
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2000, 1))
    noise = Rotation.from_rotvec(np.radians(0.5) * np.random.default_rng(1).standard_normal((2000, 3)))
    assert evaluate(record(Truth(still)), Track(T, quats(noise))).lag is None
    turning = quats(Rotation.from_euler("Z", np.sin(T)[:, None]))  # heading only, and heading is relative
    assert evaluate(record(Truth(turning), mag=False), Track(T, turning)).lag is None
    short = record(Truth(still[:3]), 3)
    assert evaluate(short, Track(T[:3], still[:3])).lag is None


def test_a_lag_survives_missing_truth():
    truth = quats(motion(T))
    truth[300:900] = np.nan
    score = evaluate(record(Truth(truth)), Track(T, quats(motion(T - 0.03))))
    assert score.lag == pytest.approx(30.0, abs=0.5)


def test_score_goes_to_json():
    truth = Truth(quats(motion(T)))
    text = json.dumps(evaluate(record(truth), Track(T, truth.quat, params=Kalman())).to_dict(), allow_nan=False)
    assert json.loads(text)["bias"] is None


def test_what_cannot_be_compared_is_refused_in_one_sentence():
    truth = Truth(quats(motion(T)))
    good = Track(T, truth.quat)
    with pytest.raises(LevelheadError, match="no true orientation"):
        evaluate(record(None), good)
    with pytest.raises(LevelheadError, match="same times"):
        evaluate(record(truth), Track(T + 1.0, truth.quat))
    with pytest.raises(LevelheadError, match="same times"):
        evaluate(record(truth), Track(T[:10], truth.quat[:10]))
    with pytest.raises(LevelheadError, match="nothing to compare"):
        evaluate(record(Truth(truth.quat, moving=np.zeros(2000, bool))), good)
    lost = truth.quat.copy()
    lost[7] = np.nan
    with pytest.raises(LevelheadError, match="NaN at row 7"):
        evaluate(record(truth), Track(T, lost))
