"""Alignment against streams whose convention, rotations and clock were changed by scipy, hence are known."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead import read
from levelhead.errors import LevelheadError
from levelhead.evaluate import align
from levelhead.evaluate.align.quaternion_convention import Convention
from levelhead.evaluate.align.time_shift import correlation
from levelhead.track import Track

T = np.arange(0.0, 40.0, 0.02)
NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FRD = Rotation.from_matrix(np.diag([1, -1, -1]))
ONE = Rotation.identity()


def turned(axis: str, degrees: float) -> Rotation:
    return Rotation.from_euler(axis, degrees, degrees=True)


def motion(t: np.ndarray) -> Rotation:
    """A hand's motion in closed form: three angles that never repeat together."""
    angles = [1.2 * np.sin(0.53 * t), 0.6 * np.sin(1.31 * t + 1.0), 0.9 * np.sin(0.97 * t + 2.0)]
    return Rotation.from_euler("ZYX", np.stack(angles, axis=1))


def quats(rotation: Rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


def noisy(rotation: Rotation, degrees: float, seed: int = 0) -> Rotation:
    rng = np.random.default_rng(seed)
    return Rotation.from_rotvec(np.radians(degrees) * rng.standard_normal((len(rotation), 3))) * rotation


def written(rotation: Rotation, order: str = "wxyz", inverse: bool = False, seed: int = 1) -> np.ndarray:
    """As some system would write it, with random signs."""
    found = (rotation.inv() if inverse else rotation).as_quat(scalar_first=order == "wxyz")
    return found * np.random.default_rng(seed).choice([-1.0, 1.0], (len(found), 1))


def off(one: Rotation, other: Rotation) -> float:
    return float(np.degrees((one.inv() * other).magnitude()).max())


# what the estimate's frames are: earth side, sensor side, and the frames that should be named
FRAMES = {
    "same": (ONE, ONE, "ENU", "as the reference"),
    "NED": (NED, FRD, "NED", "forward-right-down"),
    "NED earth": (NED, ONE, "NED", "as the reference"),
    "NWU": (turned("Z", -90.0), ONE, "NWU", "as the reference"),
    "heading": (turned("Z", 30.0), ONE, "ENU", "as the reference"),
    "NED and heading": (NED * turned("Z", 50.0), FRD, "NED", "forward-right-down"),
    "mounting": (ONE, turned("Z", 90.0), "ENU", "as the reference"),
    "heading and mounting": (turned("Z", -70.0), turned("X", 40.0), "ENU", "as the reference"),
}


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("frames", FRAMES)
def test_the_convention_is_found(order, inverse, frames):
    left, right, earth, sensor = FRAMES[frames]
    truth = motion(T)
    estimate = left * noisy(truth, 0.5) * right
    found = align(T, written(estimate, order, inverse), T, quats(truth), shift=False)
    assert found.convention == Convention(order, inverse, earth, sensor)
    assert not found.ambiguities, found
    assert found.after < 1.0 and (found.before > 20.0 or found.convention == Convention())
    back = found.apply(Track(T, written(estimate, order, inverse)))
    assert off(Rotation.from_quat(back.quat, scalar_first=True), noisy(truth, 0.5)) < 0.1


@pytest.mark.slow
def test_both_rotations_are_those_of_the_truth():
    left, right = Rotation.random(2, rng=np.random.default_rng(4))
    truth = motion(T)
    found = align(T, quats(left * truth * right), T, quats(truth), shift=False)
    assert found.freedom == ("any", "any")
    frames = {"ENU": ONE, "NED": NED}, {"as the reference": ONE, "forward-right-down": FRD}
    earth = Rotation.from_quat(found.earth, scalar_first=True) * frames[0][found.convention.earth]
    sensor = frames[1][found.convention.sensor] * Rotation.from_quat(found.sensor, scalar_first=True)
    assert off(earth, left.inv()) < 1e-5
    assert off(sensor, right.inv()) < 1e-5


def test_a_wrong_order_is_an_inverse_with_two_constant_rotations():
    """p and r of the sentence that the search rests on."""
    q = quats(Rotation.random(50, rng=np.random.default_rng(2)))
    misread = q[:, [3, 0, 1, 2]]
    p, r = (Rotation.from_quat(constant, scalar_first=True) for constant in ([1, 0, 1, 0], [0, 1, 0, 1]))
    same = p * Rotation.from_quat(q, scalar_first=True).inv() * r
    assert off(Rotation.from_quat(misread, scalar_first=True), same) < 1e-5
    found = align(np.arange(50.0), misread.take([2, 3, 0, 1], axis=1), np.arange(50.0), q, shift=False)
    assert found.after < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("shift", [-0.2, 0.0, 0.0123, 0.35, 1234.5678])
@pytest.mark.parametrize("rate", [30.0, 50.0, 173.0])
def test_a_shift_is_found_below_the_sample_interval(shift, rate):
    t = np.arange(3.0, 33.0, 1.0 / rate)
    truth = motion(T)
    found = align(t + shift, written(noisy(turned("Z", 20.0) * motion(t), 0.3), "xyzw"), T, quats(truth))
    assert found.shift == pytest.approx(shift, abs=1e-3)
    assert found.shift_error is not None and found.shift_error < 1e-3
    assert found.order == "xyzw" and found.heading == pytest.approx(-20.0, abs=0.2)
    back = found.apply(Track(t + shift, written(motion(t), "xyzw")))
    np.testing.assert_allclose(back.t, t, atol=1e-3)
    late = "late" if shift > 0 else "early"
    assert (late in str(found)) == (shift != 0.0)


@pytest.mark.slow
def test_gaps_outliers_and_drift_do_not_mislead():
    rng = np.random.default_rng(3)
    truth = quats(motion(T))
    truth[200:500] = np.nan
    truth[900:950] = 0.0
    drift = Rotation.from_rotvec(np.outer(T, [0.0, 0.0, np.radians(0.3)]))  # 12° in all
    estimate = quats(drift * noisy(motion(T - 0.05), 0.5) * turned("X", 90.0))
    wild = rng.choice(len(T), 100, replace=False)  # 5 %
    estimate[wild] = quats(Rotation.random(100, rng=rng))
    estimate[1200:1300] = np.nan
    found = align(T, estimate, T, truth)
    assert found.convention == Convention() and found.freedom.sensor == "any"
    sensor = Rotation.from_quat(found.sensor, scalar_first=True)
    assert off(sensor, turned("X", -90.0)) < 2.0
    assert found.shift == pytest.approx(0.05, abs=5e-3)
    assert found.trimmed < 5.0 < found.after  # the outliers are still there, and counted
    assert found.samples < 1600


@pytest.mark.slow
def test_freedom_alone_wins_nothing():
    truth = motion(T)
    found = align(T, quats(noisy(turned("Z", 0.3) * truth * turned("Y", 0.3), 1.0)), T, quats(truth), shift=False)
    assert found.convention == Convention() and found.freedom == ("none", "none")
    assert str(found).startswith("the same convention; ")
    forced = align(
        T, quats(turned("Z", 0.3) * truth), T, quats(truth), earth="heading", sensor="none", convention="same",
        shift=False, simplest=False,
    )  # fmt: skip
    assert forced.heading == pytest.approx(-0.3, abs=1e-6) and forced.second_best is None


def test_what_is_not_allowed_is_not_corrected():
    truth = motion(T)
    estimate = quats(turned("Z", 40.0) * truth * turned("X", 10.0))
    found = align(T, estimate, T, quats(truth), earth="heading", sensor="none", shift=False)
    assert found.freedom == ("heading", "none") and found.sensor == (1.0, 0.0, 0.0, 0.0)
    assert found.after == pytest.approx(10.0, abs=0.5)
    assert found.shift == 0.0 and found.shift_error is None
    assert align(T, estimate, T, quats(truth), earth="none", sensor="none", shift=False).freedom == ("none", "none")


@pytest.mark.slow
def test_a_still_recording_tells_nothing_and_it_says_so():
    still = noisy(Rotation.from_rotvec(np.zeros((2000, 3))), 0.1)
    found = align(T, quats(still), T, quats(noisy(still, 0.1, 7)))
    assert found.axes == 0 and found.ambiguities
    assert "hardly turns" in str(found) and "does not determine the shift" in str(found)


def test_one_axis_leaves_the_mounting_open_and_it_says_so():
    truth = Rotation.from_euler("Z", np.sin(T)[:, None])
    found = align(T, quats(turned("Z", 25.0) * truth), T, quats(truth), shift=False)
    assert found.axes == 1 and found.freedom == ("heading", "none")
    assert "one axis only" in str(found)


@pytest.mark.slow
def test_with_both_sides_free_an_inverse_may_be_a_wrong_order():
    left, right = Rotation.random(2, rng=np.random.default_rng(9))
    found = align(T, quats((left * motion(T) * right).inv()), T, quats(motion(T)), shift=False)
    assert found.inverse and found.after < 1e-5
    assert "order xyzw with other rotations" in str(found)


def test_two_motions_that_have_nothing_in_common():
    found = align(T, quats(motion(1.7 * T + 9.0)), T, quats(motion(T)), sensor="none", earth="heading", shift=False)
    assert found.ambiguities and "may not show the same motion" in str(found)


def test_bias_and_sigma_turn_with_their_frames():
    truth = motion(T)
    estimate = NED * truth * FRD
    found = align(T, quats(estimate), T, quats(truth), shift=False)
    track = Track(T, quats(estimate), np.tile([0.1, 0.2, 0.3], (len(T), 1)), np.tile([1.0, 2.0, 3.0], (len(T), 1)))
    back = found.apply(track)
    np.testing.assert_allclose(back.bias[0], [0.1, -0.2, -0.3], atol=1e-12)  # x stays, y and z are negated
    np.testing.assert_allclose(back.sigma[0], [2.0, 1.0, 3.0], atol=1e-12)  # NED's north is ENU's y
    held = found.apply(track, constant=False, clock=False)
    np.testing.assert_array_equal(held.t, T)


def test_only_the_convention_is_applied_if_asked():
    truth = motion(T)
    found = align(T + 0.5, quats(turned("Z", 30.0) * truth).take([1, 2, 3, 0], axis=1), T, quats(truth))
    back = found.apply(Track(T + 0.5, quats(truth).take([1, 2, 3, 0], axis=1)), constant=False, clock=False)
    np.testing.assert_array_equal(back.t, T + 0.5)
    assert off(Rotation.from_quat(back.quat, scalar_first=True), truth) < 1e-6


@pytest.mark.slow
def test_words_and_json():
    truth = motion(T)
    found = align(T + 0.0123, written(truth * turned("Z", -90.0), "xyzw", True), T, quats(truth))
    line = str(found)
    assert line.startswith("order xyzw, inverse (earth to sensor); sensor turned by 90.0° about z; 12.3 ms late; ")
    assert line.endswith("° before, " + line.rpartition(" before, ")[2])
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["order"] == "xyzw" and plain["inverse"] is True
    assert plain["shift_ms"] == pytest.approx(12.3, abs=0.2)
    assert plain["sensor_turn_deg"] == pytest.approx(90.0, abs=0.1)


def test_the_masked_correlation_is_numpys_coefficient():
    rng = np.random.default_rng(5)
    a, b = rng.standard_normal(80), rng.standard_normal(60)
    a[10:20] = np.nan
    b[33] = np.nan
    found = correlation(a, b)
    for lag in (-15, 0, 7, 25):
        i = np.arange(max(0, -lag), min(len(b), len(a) - lag))
        pair = np.stack([a[i + lag], b[i]])
        pair = pair[:, np.isfinite(pair).all(axis=0)]
        assert found[lag + len(b) - 1] == pytest.approx(np.corrcoef(pair)[0, 1], abs=1e-9)
    assert found[0] == 0.0  # one sample in common is none


def test_bad_input_is_refused_in_one_sentence():
    good = quats(motion(T))
    with pytest.raises(LevelheadError, match="the estimate: quat has shape"):
        align(T, good[:, :3], T, good)
    with pytest.raises(LevelheadError, match="the reference: t does not increase at row 1"):
        align(T, good, T[::-1], good)
    with pytest.raises(LevelheadError, match="the estimate has 0 samples with an orientation; expected at least"):
        align(T, np.full_like(good, np.nan), T, good)
    with pytest.raises(LevelheadError, match="earth is 'headin'.*did you mean 'heading'"):
        align(T, good, T, good, earth="headin")
    with pytest.raises(LevelheadError, match="share 0 instants"):
        align(T, good, T + 1000.0, good, shift=False)


@pytest.mark.slow
@pytest.mark.parametrize("trial", ["01_undisturbed_slow_rotation_A", "21_undisturbed_fast_combined"])
def test_a_real_reference_in_a_vendors_habit(data_dir, trial):
    """BROAD's optical truth, as a phone would write it: NED, xyzw, late, slower, with gaps where the cameras were
    blind.
    """
    truth = read(data_dir / "broad" / f"{trial}.mat")
    seen = truth.truth.quat.copy()
    known = ~np.isnan(seen[:, 0])
    vendor = np.full_like(seen, np.nan)
    real = Rotation.from_quat(seen[known], scalar_first=True)
    vendor[known] = (NED * turned("Z", 3.0) * noisy(real, 0.3) * FRD).as_quat()
    found = align(truth.t[::3] + 50.0417, vendor[::3], truth.t, seen, sensor="none")
    assert found.convention == Convention("xyzw", False, "NED", "forward-right-down")
    assert found.shift == pytest.approx(50.0417, abs=1e-3) and found.heading == pytest.approx(-3.0, abs=0.1)
    assert not found.ambiguities and found.after < 1.0


def test_the_correlation_of_each_shift_is_that_of_the_common_part():
    """NumPy's coefficient over the samples that both have, at shifts that leave half of them and more."""
    rng = np.random.default_rng(5)
    a, b = np.cumsum(rng.normal(size=60)) + 5.0, np.cumsum(rng.normal(size=50)) - 3.0  # walks: parts have other means
    a[20:24] = np.nan
    found = correlation(a, b)
    for k in (-20, -3, 0, 7, 20):
        i = np.arange(max(0, -k), min(len(b), len(a) - k))
        known = np.isfinite(a[i + k])
        wanted = np.corrcoef(a[i + k][known], b[i][known])[0, 1]
        assert found[k + len(b) - 1] == pytest.approx(wanted, abs=1e-9), k
