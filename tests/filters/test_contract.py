"""What every filter must do, one suite over the list of filters."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import filters
from levelhead.filters import health

G = 9.80665
FIELD = np.array([0.0, 19.0, -45.0])
EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
CORRECTING = pytest.mark.parametrize("flt", [f for f in filters.ALL if "acc" in f.uses], ids=lambda f: f.name)
WITH_HEADING = pytest.mark.parametrize("flt", [f for f in filters.ALL if "mag" in f.uses], ids=lambda f: f.name)


def still(attitude: Rotation, n=400, rate=100.0, mag=True):
    """A sensor at rest in an attitude."""
    body = attitude.inv()
    return lh.Recording(
        np.arange(n) / rate,
        np.zeros((n, 3)),
        np.tile(body.apply([0, 0, G]), (n, 1)),
        np.tile(body.apply(FIELD), (n, 1)) if mag else None,
    )


def tilt_error(track, attitude):
    error = track.as_rotation() * attitude.inv()
    up = error.apply([0.0, 0.0, 1.0])
    return np.degrees(np.arccos(np.clip(up[:, 2], -1, 1)))


def healthy(track):
    assert np.isfinite(track.quat).all()
    np.testing.assert_allclose(np.linalg.norm(track.quat, axis=1), 1.0, atol=1e-12)
    for extra in (track.bias, track.sigma):
        assert extra is None or np.isfinite(extra).all()


@EVERY
@pytest.mark.parametrize("mag", [False, True])
def test_perfect_alignment(flt, mag):
    track = lh.fuse(still(Rotation.identity(), mag=mag), flt.params())
    healthy(track)
    np.testing.assert_allclose(np.abs(track.quat), np.tile([1.0, 0, 0, 0], (400, 1)), atol=1e-12)


@EVERY
@pytest.mark.parametrize("zero", ["acc", "mag", "both"])
def test_zero_vectors(flt, zero):
    rec = still(Rotation.from_euler("ZYX", [20, 10, -30], degrees=True))
    acc = np.zeros((400, 3)) if zero in ("acc", "both") else rec.acc
    mag = np.zeros((400, 3)) if zero in ("mag", "both") else rec.mag
    healthy(lh.fuse(lh.Recording(rec.t, rec.gyr, acc, mag), flt.params()))


@EVERY
def test_level_sensor_reading_plus_g_is_level(flt):
    track = lh.fuse(still(Rotation.identity(), mag=False), flt.params())
    np.testing.assert_allclose(track.as_rotation().apply([0, 0, 1.0])[-1], [0, 0, 1], atol=1e-9)


@CORRECTING
def test_tilt_is_corrected_when_the_gyroscope_reads_exactly_zero(flt):
    """The first sample is 40° wrong, then the accelerometer tells the truth and nothing turns."""
    rec = still(Rotation.identity(), n=3000, mag=False)
    acc = rec.acc.copy()
    acc[0] = Rotation.from_euler("x", 40, degrees=True).apply([0, 0, G])
    track = lh.fuse(lh.Recording(rec.t, rec.gyr, acc), flt.params())
    assert tilt_error(track, Rotation.identity())[-1] < 1.0


@EVERY
@pytest.mark.parametrize("angles", [(100, 20, -50), (-170, -60, 140), (0, 75, 10), (30, 90, 0), (0, -90, 0)])
def test_the_start_honours_the_attitude(flt, angles):
    attitude = Rotation.from_euler("ZYX", angles, degrees=True)
    track = lh.fuse(still(attitude), flt.params())
    assert tilt_error(track, attitude).max() < 1e-5
    if "heading" in flt.estimates:
        assert np.degrees((track.as_rotation() * attitude.inv()).magnitude()).max() < 1e-5


@EVERY
def test_scaling_the_magnetometer_changes_nothing(flt):
    rec = still(Rotation.from_euler("ZYX", [50, 20, 10], degrees=True))
    a = lh.fuse(rec, flt.params())
    b = lh.fuse(lh.Recording(rec.t, rec.gyr, rec.acc, rec.mag / 64.0), flt.params())
    np.testing.assert_array_equal(a.quat, b.quat)


@WITH_HEADING
def test_rotating_the_world_rotates_the_answer(flt):
    rng = np.random.default_rng(5)
    n = 500
    gyr, acc = rng.normal(0, 0.3, (n, 3)), rng.normal(0, 0.5, (n, 3)) + [0, 0, G]
    mag = rng.normal(0, 0.5, (n, 3)) + FIELD
    t = np.arange(n) / 100
    turn = Rotation.from_euler("z", 70, degrees=True)
    a = lh.fuse(lh.Recording(t, gyr, acc, mag), flt.params())
    # The same sensor with its x and y axes turned by 70° reads the same vectors turned back.
    b = lh.fuse(lh.Recording(t, *(turn.inv().apply(v) for v in (gyr, acc, mag))), flt.params())
    difference = (b.as_rotation() * (a.as_rotation() * turn).inv()).magnitude()
    assert np.degrees(difference).max() < 2.5, "roll and pitch are not quite the same axes any more"


@WITH_HEADING
def test_heading_converges_to_the_magnetometer(flt):
    rec = still(Rotation.from_euler("z", 30, degrees=True), n=6000)
    mag = rec.mag.copy()
    mag[0] = Rotation.from_euler("z", 60, degrees=True).apply(mag[0])
    track = lh.fuse(lh.Recording(rec.t, rec.gyr, rec.acc, mag), flt.params())
    assert track.euler()[-1, 2] == pytest.approx(30.0, abs=2.0)


@pytest.mark.parametrize("flt", [f for f in filters.ALL if "gyr" in f.uses], ids=lambda f: f.name)
def test_a_rate_that_rises_is_integrated_across_lost_samples(flt):
    """From one rate to the next the mean of both is right if it changes linearly: 5° more than the last rate alone."""
    t = np.arange(150) / 100
    t = t[(t < 0.9) | (t > 1.2)]
    gyr = np.outer(t, [0.0, 0.0, 2.0])
    track = lh.fuse(lh.Recording(t, gyr, np.tile([0.0, 0.0, G], (len(t), 1))), flt.params())
    angle = np.degrees(np.unwrap(np.radians(track.euler()[:, 2])))
    assert angle[-1] - angle[0] == pytest.approx(np.degrees(t[-1] ** 2), abs=1.5)  # 0.9° is the rectangles' error


@EVERY
def test_varying_dt_is_honoured(flt):
    """A constant turn sampled at uneven instants ends at the right angle."""
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.002, 0.03, 500))
    true = Rotation.from_rotvec(np.outer(t - t[0], [0.2, 0.0, 0.0]))
    acc = true.inv().apply([0, 0, G])
    gyr = np.tile([0.2, 0.0, 0.0], (500, 1))
    track = lh.fuse(lh.Recording(t, gyr, acc), flt.params())
    assert np.degrees((track.as_rotation() * true.inv()).magnitude()).max() < 0.5


@EVERY
def test_coasts_through_a_gap_and_says_so(flt):
    rec = still(Rotation.from_euler("x", 20, degrees=True), mag=False)
    t = rec.t.copy()
    t[200:] += 10.0
    gyr = rec.gyr.copy()
    gyr[200] = [3.0, 0.0, 0.0]  # what it read just after the gap says nothing about the gap
    track = lh.fuse(lh.Recording(t, gyr, rec.acc), flt.params())
    healthy(track)
    assert tilt_error(track, Rotation.from_euler("x", 20, degrees=True))[200:].max() < 1.0
    assert track.health[200] & health.GAP and not (track.health[:200] & health.GAP).any()
    if track.sigma is not None:
        assert track.sigma[200, 2] > track.sigma[199, 2], "nothing corrects heading: its doubt grows with time"


@pytest.mark.slow
@CORRECTING
@pytest.mark.parametrize("jump", [2.0, 60.0, 3e7], ids=["2 s", "a minute", "a year"])
def test_a_jump_in_time_teaches_nothing_and_is_left_behind(flt, jump):
    """The sensor was turned over while nobody looked; a second later tilt is right, and the bias is still the bias."""
    rng = np.random.default_rng(8)
    n = 4000
    bias = np.radians([0.5, -0.4, 0.3])
    gyr = bias + rng.normal(0, 0.002, (n, 3))
    before, after = Rotation.identity(), Rotation.from_euler("ZYX", [0, 20, 40], degrees=True)
    acc = np.repeat([before.inv().apply([0, 0, G]), after.inv().apply([0, 0, G])], n // 2, axis=0)
    acc += rng.normal(0, 0.05, (n, 3))
    t = np.arange(n) / 100
    t[n // 2 :] += jump
    track = lh.fuse(lh.Recording(t, gyr, acc), flt.params())
    healthy(track)
    assert tilt_error(track, after)[n // 2 + 100 :].max() < (3.0 if jump > 10.0 else 12.0)
    assert tilt_error(track, after)[-1] < 1.5
    if track.bias is not None:
        wrong = np.degrees(np.abs(track.bias[n // 2 :, :2] - bias[:2])).max(axis=1)
        assert wrong.max() < 3.0, "no worse than the bias of a sensor just turned on"
        assert wrong[-1] < 0.4


@EVERY
@pytest.mark.parametrize("mag", [False, True], ids=["6-D", "9-D"])
def test_every_filter_has_a_doubt_that_grows_while_nothing_corrects(flt, mag):
    rec = still(Rotation.from_euler("ZYX", [30, 20, -10], degrees=True), n=1000, mag=mag)
    t, acc, field = rec.t.copy(), rec.acc.copy(), None if rec.mag is None else rec.mag.copy()
    t[900:] += 5.0  # a gap, after three seconds in which only the gyroscope said something
    acc[500:800] = np.nan
    if field is not None:
        field[500:800] = np.nan
    track = lh.fuse(lh.Recording(t, rec.gyr, acc, field), flt.params())
    assert (track.sigma[:, :2] > 0.0).all() and (track.sigma[6:, 2] > 0.0).all(), "a relative heading starts right"
    judged = 500 + round(100 * getattr(flt.params(), "block", 0.05))
    assert (track.sigma[799] > track.sigma[judged]).all(), "σ is judged 20 times a second, or at the end of a block"
    if flt.settles.tilt == 0.0:
        return  # without a memory: the sample after a gap is as good as any
    assert track.sigma[900, 2] > track.sigma[899, 2]
    if "acc" in flt.uses:
        assert (track.sigma[999, :2] < track.sigma[900, :2]).all()
    else:
        assert (track.sigma[999] >= track.sigma[900]).all()


WORST_STARTS = [
    Rotation.from_rotvec(np.pi * np.array(axis) / np.linalg.norm(axis))
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1])
] + list(Rotation.random(3, rng=4))


@pytest.mark.slow
@CORRECTING
def test_a_wrong_first_sample_is_forgotten_in_the_time_stated(flt):
    """The first sample 180° wrong about several axes, or anyhow; what comes after is the truth, with noise or without.

    A filter may say that it never corrects heading, but not that it needs longer than two minutes.
    """
    rate = 100.0
    true = Rotation.from_euler("ZYX", [100, 20, -30], degrees=True)
    assert flt.settles.tilt <= 120.0 and (flt.settles.heading <= 120.0) == ("mag" in flt.uses)
    seconds = flt.settles.heading if "mag" in flt.uses else flt.settles.tilt
    for k, wrong in enumerate(WORST_STARTS):
        rng = np.random.default_rng(k)
        rec = still(true, n=int(rate * seconds) + 500, rate=rate)
        noise = rng.normal(0, 1.0, (3, len(rec), 3)) * (k % 2)
        acc, mag = rec.acc + 0.05 * noise[0], rec.mag + 0.5 * noise[1]
        acc[0], mag[0] = (wrong * true).inv().apply([0, 0, G]), (wrong * true).inv().apply(FIELD)
        track = lh.fuse(lh.Recording(rec.t, 0.002 * noise[2], acc, mag), flt.params())
        assert tilt_error(track, true)[int(rate * flt.settles.tilt) + 1 :].max() < 2.0, k
        if "mag" in flt.uses and flt.settles.heading > 0.0:  # without a memory it has the noise of every sample
            x, y = (track.as_rotation() * true.inv()).apply([1.0, 0.0, 0.0])[:, :2].T
            heading = np.degrees(np.abs(np.arctan2(y, x)))
            assert heading[int(rate * flt.settles.heading) :].max() < 2.0, k


@EVERY
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_missing_readings_never_reach_the_output(flt, data):
    n = 120
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    arrays = [rng.normal(0, 1, (n, 3)), rng.normal(0, 1, (n, 3)) + [0, 0, G], rng.normal(0, 1, (n, 3)) + FIELD]
    for array in arrays:
        lost = rng.random(n) < data.draw(st.floats(0.0, 1.0))
        array[lost, rng.integers(0, 3)] = np.nan
    rec = lh.Recording(np.arange(n) / 100, *arrays)
    track = lh.fuse(rec, flt.params())
    healthy(track)
    for array, bit in zip(arrays, (health.GYR_MISSING, health.ACC_MISSING, health.MAG_MISSING), strict=True):
        np.testing.assert_array_equal((track.health & bit) != 0, np.isnan(array).any(axis=1))


@EVERY
def test_one_nan_sample_does_not_matter_a_second_later(flt):
    """One NaN accelerometer sample: imufusion 1.3.3 gives NaN for ever, vqf 2.1.2 is 49° off for the rest."""
    rec = still(Rotation.from_euler("ZYX", [10, 5, 20], degrees=True))
    acc = rec.acc.copy()
    acc[100] = np.nan
    a, b = lh.fuse(rec, flt.params()), lh.fuse(lh.Recording(rec.t, rec.gyr, acc, rec.mag), flt.params())
    np.testing.assert_allclose(np.abs((a.quat * b.quat).sum(1))[200:], 1.0, atol=1e-9)


@EVERY
def test_inputs_are_left_alone_and_any_real_dtype_is_taken(flt):
    t = np.arange(50, dtype=np.float32) / np.float32(64)
    gyr, acc = np.zeros((50, 3), np.int32), np.tile(np.float32([0, 0, 9.8]), (50, 1))
    before = acc.copy()
    track = lh.fuse(lh.Recording(t, gyr.tolist(), acc), flt.params())
    healthy(track)
    np.testing.assert_array_equal(acc, before)
    assert acc.flags.writeable


@pytest.mark.parametrize("name", ["Kalman", "RollPitchKalman", "BiasRateKalman"])
def test_the_bias_is_learned_and_its_error_fits_sigma(name):
    rng = np.random.default_rng(11)
    n = 6000
    bias = np.radians([0.4, -0.3, 0.2])
    gyr = bias + rng.normal(0, 0.002, (n, 3))
    acc = rng.normal(0, 0.1, (n, 3)) + [0, 0, G]
    params = filters.find(name).params(r_measure=0.35)  # (0.1 / g) rad in deg²
    track = lh.fuse(lh.Recording(np.arange(n) / 100, gyr, acc), params)
    np.testing.assert_allclose(track.bias[-1000:, :2].mean(0), bias[:2], atol=np.radians(0.05))
    error = track.euler(degrees=False)[3000:, :2]
    # error/σ near one: filters that doubt too much are as wrong as those that doubt too little
    ratio = np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(track.sigma[3000:, :2] ** 2))
    assert 0.3 < ratio < 1.5


def test_adaptive_complementary_trusts_the_gyroscope_while_the_body_accelerates():
    rec = still(Rotation.identity(), n=1000, mag=False)
    acc = rec.acc.copy()
    acc[300:500, 1] += 12.0  # two seconds of a sideways push
    pushed = lh.Recording(rec.t, rec.gyr, acc)
    fixed, adaptive = (tilt_error(lh.fuse(pushed, lh.Complementary(adaptive=a)), Rotation.identity()) for a in (0, 1))
    assert fixed.max() > 15.0
    assert adaptive.max() < 0.5 * fixed.max()


def test_adaptive_alpha_follows_the_stated_line():
    from levelhead.filters.complementary import alpha_of_tau, trust_time
    from levelhead.kernels.vec3 import Vec3

    params = lh.Complementary(adaptive=True)
    for excess, alpha in ((0.0, 0.98), (1.0, 0.985), (2.0, 0.99), (3.8, 0.999), (50.0, 0.999)):
        assert alpha_of_tau(trust_time(params, Vec3(0.0, 0.0, 9.80665 + excess))) == pytest.approx(alpha)


@pytest.mark.parametrize("name", ["Kalman", "RollPitchKalman", "BiasRateKalman"])
def test_near_vertical_is_said_and_survived(name):
    """Pitch swings through ±90°: angles are ambiguous there, but nothing breaks, and level is right again after."""
    t = np.arange(2000) / 100
    pitch = np.radians(120) * np.sin(2 * np.pi * t / 10)
    true = Rotation.from_euler("y", pitch[:, None])
    gyr = np.stack([np.zeros(2000), np.gradient(pitch, t), np.zeros(2000)], 1)
    track = lh.fuse(lh.Recording(t, gyr, true.inv().apply([0, 0, G])), filters.find(name).params())
    healthy(track)
    assert (track.health & health.NEAR_VERTICAL).any()
    up_error = np.degrees(np.arccos(np.clip((track.as_rotation() * true.inv()).apply([0, 0, 1.0])[:, 2], -1, 1)))
    assert up_error.max() < 3.0
