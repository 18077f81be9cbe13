"""ESKF where bodies do what a laboratory does not: walks in circles, gyroscopes that clip; simulated."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.evaluate import evaluate
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.adaptation import adapt_field
from levelhead.filters.eskf.covariance import set_independent, state_variance
from levelhead.filters.eskf.filter import init, output, step
from levelhead.filters.eskf.measurements import set_force_columns
from levelhead.filters.eskf.north import north_variance
from levelhead.filters.eskf.predict import predict
from levelhead.filters.eskf.preintegration import reset_block
from levelhead.filters.health import GYR_SATURATED, TURN_MISSED
from levelhead.kernels import quat
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.recording import Recording


def heading_and_sigma(track: lh.Track, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Degrees: how far the heading error has moved since the start, and its σ."""
    assert recording.truth is not None and track.sigma is not None
    heading = np.unwrap(split_error(error_quaternion(track.quat, recording.truth.quat)).heading)
    return np.degrees(heading - heading[0]), np.degrees(track.sigma[:, 2])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_walk_in_circles_is_no_bias(seed):
    """Eq. 18: without travel the same walk makes heading run by tens of degrees a minute."""
    recording = simulate.observe(simulate.circles(90.0), simulate.imu("LSM6DSO32"), seed=seed)
    heading, sigma = heading_and_sigma(lh.fuse(recording, lh.ESKF()), recording)
    assert np.abs(heading).max() < 15.0
    assert (np.abs(heading[100:]) < 4.0 * sigma[100:] + 1.0).all()


def test_a_rate_beyond_full_scale_is_estimated_from_its_slope():
    """Swings whose peaks of 0.1 s are cut off at 7.4 rad/s: tilt survives, though each leaves up to 20° out."""
    rate, full = 100.0, np.radians(424.0)
    t = np.arange(3000) / rate
    angle = np.where(t > 5.0, 0.7 * (1.0 - np.cos(4.0 * np.pi * (t - 5.0))), 0.0)
    speed = np.where(t > 5.0, 0.7 * 4.0 * np.pi * np.sin(4.0 * np.pi * (t - 5.0)), 0.0)
    zero = np.zeros_like(t)
    quat = np.stack([np.cos(angle / 2), np.sin(angle / 2), zero, zero], axis=1)
    noise = np.random.default_rng(1)
    gyr = np.stack([np.clip(speed, -full, full), zero, zero], axis=1) + noise.normal(0.0, 1e-3, (len(t), 3))
    gyr = np.clip(gyr, -full, full)
    acc = 9.80665 * np.stack([zero, np.sin(angle), np.cos(angle)], axis=1) + noise.normal(0.0, 0.02, (len(t), 3))
    recording = Recording(t, gyr, acc, None, lh.Truth(quat, north=False))
    track = lh.fuse(recording, lh.ESKF())
    assert (track.health & GYR_SATURATED).any()
    tilt = np.degrees(split_error(error_quaternion(track.quat, quat)).tilt)
    assert tilt[1000:].max() < 8.0


@pytest.mark.parametrize("excess", [2.0, 6.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_first_turn_beyond_full_scale_is_estimated_too(excess, sign):
    """Nobody told the full scale, so the plateau is known for one only 20 ms later; the slope before it still counts.

    A parabola that is ``excess`` rad/s beyond the range at its peak: the driver's model is exact for it.
    """
    rate, full, peak = 200.0, 6.0, 6.0 + excess
    t = np.arange(1000) / rate
    speed = sign * np.maximum(peak - 400.0 * (t - 2.5) ** 2, 0.0)
    zero = np.zeros_like(t)
    gyr = np.stack([zero, zero, np.clip(speed, -full, full)], axis=1)
    acc = np.tile([0.0, 0.0, 9.80665], (len(t), 1))
    track = lh.fuse(Recording(t, gyr, acc, None), lh.Mahony())
    assert (track.health & GYR_SATURATED).any()
    angle = 2.0 * np.arctan2(track.quat[-1, 3], track.quat[-1, 0])
    error = abs((angle - np.sum(speed) / rate + np.pi) % (2.0 * np.pi) - np.pi)
    missed = (np.abs(speed) - full)[np.abs(speed) > full].sum() / rate
    assert error < 0.25 * missed


@pytest.mark.parametrize("motion", ["hand", "walking", "drone"])
def test_sigma_knows_of_samples_that_were_lost(motion):
    """Stretches of 0.05 to 0.45 s, a fifth of all: a held rate would be wrong by many degrees."""
    random, whole = np.random.default_rng(4), simulate.motion(3, 90.0, 100.0, style=motion)
    recording = simulate.observe(whole, simulate.imu("LSM6DSO32"), seed=2)
    kept = np.ones(len(recording), dtype=bool)
    for first in random.integers(1000, len(kept) - 100, 70):
        kept[first : first + random.integers(5, 45)] = False
    assert recording.truth is not None and 0.7 < kept.mean() < 0.9
    left = Recording(recording.t[kept], recording.gyr[kept], recording.acc[kept], None, recording.truth[kept])
    score = evaluate(left, lh.fuse(left, lh.ESKF()))
    assert score.tilt_error_ratio < 2.5


@pytest.mark.slow
def test_a_raw_sensor_keeps_what_earlier_runs_told_of_it():
    """A prior with a mean far from zero is widened about that mean: each run of the same raw sensor gains by it."""
    prior = None
    for number in range(4):
        motion = simulate.motion(1000 + number, 64.0, 100.0, style="hand")
        run = simulate.observe(motion, simulate.imu("MPU-6050", mag="HMC5883L"), seed=1)[400:]
        track = lh.fuse(run, lh.ESKF(), prior=prior)
        if prior is not None:
            assert evaluate(run, track).total_aligned < 0.8 * evaluate(run, lh.fuse(run, lh.ESKF())).total_aligned
            assert evaluate(run, track).total_aligned < 4.0
        prior = track.calibration


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["hand", "walking", "robot"])
def test_a_raw_gyroscope_that_never_rests_is_learned_within_seconds(motion):
    """Simulated MPU-6050 without a magnetometer: biases of up to 20 °/s, from the first sample in motion."""
    errors, ratios = [], []
    for seed in range(8):
        moved = simulate.motion(seed, 94.0, 100.0, style=motion)
        run = simulate.observe(moved, simulate.imu("MPU-6050"), seed)[400:]
        score = evaluate(run, lh.fuse(run, lh.ESKF()))
        errors.append(score.tilt)
        ratios.append(score.tilt_error_ratio)
    print(f"{motion}: tilt {np.round(errors, 2)}°, error/σ {np.round(ratios, 2)}")
    assert max(errors) < 8.0
    assert np.mean(errors) < 4.0
    assert np.sqrt(np.mean(np.square(ratios))) < 3.0


@pytest.mark.parametrize("motion", ["hand", "walking"])
def test_a_turn_that_the_gyroscope_missed_is_found_by_velocity(motion):
    """Eq. 26: in the steepest turn of a recording the rate reads as at rest, and nothing else tells of it."""
    moved = simulate.motion(3, 60.0, 100.0, style=motion)
    run = simulate.observe(moved, simulate.imu("LSM6DSO32"), seed=3)
    assert run.truth is not None
    real = run.truth.quat
    turned = np.degrees(split_error(error_quaternion(real[100:], real[:-100])).tilt)[1500:2500]
    first = 1500 + int(turned.argmax())
    gyr = run.gyr.copy()
    gyr[first : first + 100] = run.gyr[:100]
    track = lh.fuse(Recording(run.t, gyr, run.acc), lh.ESKF())
    assert track.sigma is not None
    tilt = np.degrees(split_error(error_quaternion(track.quat, real)).tilt)
    sigma = np.degrees(np.hypot(track.sigma[:, 0], track.sigma[:, 1]))
    later = tilt[first + np.array([600, 1100, 2100])].round(1)
    print(f"{motion}: {turned.max():.0f}° missed; after 5, 10 and 20 s {later}°")
    assert turned.max() > 20.0
    assert (track.health[first : first + 1000] & TURN_MISSED).any()
    assert not (track.health[:first] & TURN_MISSED).any()
    assert tilt[first + 2100 :].max() < 3.0
    assert (tilt[first + 600 :] < 4.0 * sigma[first + 600 :] + 1.0).all()


def test_a_gap_ends_what_velocity_says_of_a_missed_turn():
    """Velocity starts anew after a gap, and with it the mean of its innovations."""
    moved = simulate.motion(3, 60.0, 100.0, style="hand")
    run = simulate.observe(moved, simulate.imu("LSM6DSO32"), seed=3)
    assert run.truth is not None
    turned = split_error(error_quaternion(run.truth.quat[100:], run.truth.quat[:-100])).tilt[1500:2500]
    first = 1500 + int(turned.argmax())
    gyr = run.gyr.copy()
    gyr[first : first + 100] = run.gyr[:100]
    missed = np.flatnonzero(lh.fuse(Recording(run.t, gyr, run.acc), lh.ESKF()).health & TURN_MISSED)
    assert missed[0] > first
    before = missed[0] + 30
    kept = np.r_[0:before, before + 200 : len(run.t)]
    track = lh.fuse(Recording(run.t[kept], gyr[kept], run.acc[kept]), lh.ESKF())
    assert track.health[before - 1] & TURN_MISSED
    assert not (track.health[before + 15 : before + 50] & TURN_MISSED).any()


@pytest.mark.parametrize("motion", ["still", "walking", "drone"])
def test_no_attitude_is_stable_upside_down(motion):
    """The gyroscope misses half a turn in one sample; the filter is not sure of the wrong side of the world."""
    moved = simulate.motion(4, 60.0, 100.0, style=motion)
    run = simulate.observe(moved, simulate.imu("LSM6DSO32"), seed=4)
    assert run.truth is not None
    gyr, acc, real = run.gyr.copy(), run.acc.copy(), run.truth.quat.copy()
    gyr[2000:, 1:] *= -1.0  # the sensor is turned by 180° about its x
    acc[2000:, 1:] *= -1.0
    real[2000:] = real[2000:] @ np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, -1], [0, 0, 1, 0]], dtype=float)
    track = lh.fuse(Recording(run.t, gyr, acc), lh.ESKF())
    tilt = np.degrees(split_error(error_quaternion(track.quat, real)).tilt)
    print(f"{motion}: {tilt[1990]:.1f}° before, {tilt[2010]:.0f}° after, {tilt[2500:].max():.1f}° from 5 s later on")
    assert tilt[2010] > 120.0
    assert (track.health[2000:2500] & TURN_MISSED).any()
    assert tilt[2500:].max() < 15.0  # the sensor's biases have changed their signs with its axes


@pytest.mark.parametrize("motion", ["hand", "walking", "drone"])
def test_a_bias_that_warms_up_is_followed(motion):
    """By 1 deg/s in a minute; without (29) tilt is beyond 4 σ in a third of the samples, and 5° off at the end."""
    sound = simulate.recording("BMI160", motion, 200.0, seed=5)
    warm = simulate.apply_fault(sound, simulate.parse_fault("bias_ramp=1@80+60")).recording
    assert sound.truth is not None
    track = lh.fuse(warm, lh.ESKF())
    assert track.sigma is not None
    tilt = np.degrees(split_error(error_quaternion(track.quat, sound.truth.quat)).tilt)
    sigma = np.degrees(np.hypot(track.sigma[:, 0], track.sigma[:, 1]))
    beyond = np.mean(tilt[8000:] > 4.0 * sigma[8000:])
    print(f"{motion}: {100.0 * beyond:.1f} % beyond 4σ, {tilt[-1000:].max():.1f}° at the end")
    assert beyond < 0.15
    assert tilt[-1000:].max() < 4.0


def test_without_measurements_the_variance_of_a_bias_is_that_of_its_prior():
    """So κ of (25) is 0 then, however fast the bias walks, and no prior is exchanged for nothing."""
    params = lh.ESKF()
    m = init(params, ZERO, Vec3(0.0, 0.0, 9.81), ZERO).memory
    m[at.BIAS_WALK] = 1e-7
    for _ in range(1000):
        reset_block(m)
        m[at.BLOCK_TIME] = 0.1
        predict(params, m, False, at.N_INERTIAL)
    for i in range(at.GYR_BIAS, at.GYR_BIAS + 3):
        start = np.radians(params.bias_uncalibrated) ** 2
        walked = 100.0 * 1e-7
        assert m[at.PRIOR_VARIANCE + i] == pytest.approx(start + walked, rel=1e-12)
        assert state_variance(m, i) == pytest.approx(m[at.PRIOR_VARIANCE + i], rel=1e-3)  # rounding has its own share


@pytest.mark.parametrize("shake", [2.0, 10.0, 20.0])
def test_a_start_while_shaken_finds_the_vertical(shake):
    """So many m/s² along each axis at 1.5 Hz: no block of 0.1 s has its mean along the vertical."""
    t = np.arange(0.0, 20.0, 0.01)
    phase = 2.0 * np.pi * 1.5 * t[:, None] + np.array([0.3, 1.9, 4.0])
    noise = np.random.default_rng(3)
    gyr = noise.normal(0.0, 1e-3, (len(t), 3))
    acc = np.array([0.0, 0.0, 9.80665]) + shake * np.sin(phase) + noise.normal(0.0, 0.02, (len(t), 3))
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))
    track = lh.fuse(Recording(t, gyr, acc, None, lh.Truth(quat, north=False)), lh.ESKF())
    tilt = np.degrees(split_error(error_quaternion(track.quat, quat)).tilt)
    sigma = np.degrees(np.hypot(track.sigma[:, 0], track.sigma[:, 1]))
    assert tilt[500:].max() < 10.0
    assert np.abs(track.bias).max() < 3.0
    assert (tilt[20:] < 4.0 * sigma[20:]).mean() > 0.99


def beside_a_laptop(seed: int, seconds: float) -> Recording:
    """A hand whose first seconds are beside a laptop: a field of half the earth's, fixed in the room, on top of it."""
    motion = simulate.motion(seed, 60.0, 100.0, style="hand")
    run = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed=seed)[400:]
    beside = run.t - run.t[0] < seconds
    mag = np.array(run.mag)
    mag[beside] += Rotation.from_quat(run.truth.quat[beside], scalar_first=True).inv().apply([18.0, -14.0, 8.0])
    return replace(run, mag=mag)


def test_a_magnet_at_the_start_turns_no_heading():
    """The field of the first seconds is taken for north, and is not: the gyroscope's heading stays."""
    run = beside_a_laptop(7, 3.0)
    track = lh.fuse(run, lh.ESKF())
    heading = np.degrees(split_error(error_quaternion(track.quat, run.truth.quat)).heading)
    assert abs(heading[0]) > 5.0  # the magnet does something
    assert np.abs(heading - heading[0]).max() < 15.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 9])
def test_the_smoother_turns_no_heading_beside_a_magnet(seed):
    """Ten seconds beside it: heading is that of the gyroscope there and later, but for one constant."""
    run = beside_a_laptop(seed, 10.0)
    track = lh.smooth(run)
    heading = split_error(error_quaternion(track.quat, run.truth.quat)).heading
    heading = np.angle(np.exp(1j * (heading - heading[3000])))
    assert np.degrees(np.abs(heading[200:]).max()) < 6.0


def test_sigma_of_north_is_that_of_the_difference_to_heading():
    """Eq. 18 beside the covariance of many drawn fields and headings."""
    random = np.random.default_rng(3)
    square = random.normal(0.0, 0.004, (4, 4))
    covariance = square @ square.T
    m = init(lh.ESKF(), ZERO, Vec3(0.0, 0.0, 9.81), Vec3(0.0, 20.0, -40.0)).memory
    places = (at.FIELD, at.FIELD + 1, at.FIELD + 2, at.HEADING)
    for i, one in enumerate(places):
        for j, other in enumerate(places):
            m[at.P + one * at.ROW + other] = covariance[i, j]
    x, y = 0.2, -0.35
    drawn = random.multivariate_normal([x, y, 0.6, 0.0], covariance, 200_000)
    azimuth = np.arctan2(drawn[:, 0], drawn[:, 1]) + drawn[:, 3]
    spread = np.angle(np.exp(1j * (azimuth - np.arctan2(x, y))))
    assert np.sqrt(north_variance(m, at.P, x, y)) == pytest.approx(np.std(spread), rel=0.01)


@pytest.mark.parametrize("iron", [0.0, 0.3, 3.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_north_is_found_and_covered_whatever_the_iron(seed, iron):
    """Hard iron of a share of the field: heading stays, and north is right within its σ from the first sample."""
    hard = iron * 48.0 * np.array([0.6, -0.48, 0.64])
    run = simulate.recording(
        "LSM6DSO32", "hand", 60.0, seed=seed, mag="HMC5883L", iron=simulate.Iron(tuple(hard.tolist()))
    )
    plain, at_once = lh.fuse(run, lh.ESKF()), lh.fuse(run, lh.ESKF(north_rate=1e6))
    heading, _ = heading_and_sigma(plain, run)
    assert np.abs(heading).max() < 6.0
    error = np.abs(split_error(error_quaternion(at_once.quat, run.truth.quat)).heading)
    assert np.degrees(error[-1]) < 8.0
    assert (error < 4.0 * at_once.sigma[:, 2]).mean() > 0.99


def test_a_bounded_rate_turns_to_north_without_a_jump():
    """5 deg/s at most, and as far as to within σ."""
    run = simulate.recording("LSM6DSO32", "hand", 60.0, seed=2, mag="HMC5883L", iron=simulate.Iron((30.0, 20.0, -9.0)))
    plain, turned = lh.fuse(run, lh.ESKF()), lh.fuse(run, lh.ESKF(north_rate=5.0))
    turn = np.unwrap(split_error(error_quaternion(turned.quat, plain.quat)).heading)
    block = 0.13  # s
    assert np.degrees(np.abs(np.diff(turn)).max()) < 5.0 * block
    error = np.abs(split_error(error_quaternion(turned.quat, run.truth.quat)).heading)
    start = np.abs(split_error(error_quaternion(plain.quat, run.truth.quat)).heading[-1])
    assert start > np.radians(20.0) and error[-1] < np.radians(12.0)
    assert (error < 4.0 * turned.sigma[:, 2]).all()


def test_sigma_knows_when_a_reading_was_to_half_an_interval():
    """Eq. 36: a rate that is an instant's, or the mean of the interval before it, makes two of σ at most."""
    dt, count = 0.02, 500
    t = dt * np.arange(count)
    fine = np.arange(0.0, t[-1] + 1e-9, dt / 50.0)
    angle = np.radians(100.0) * np.sin(2.0 * np.pi * 0.7 * fine)
    rate = np.gradient(angle, fine)
    means = np.diff(angle[::50], prepend=angle[0]) / dt
    force = Rotation.from_euler("x", angle[::50, None]).inv().apply([0.0, 0.0, 9.80665])
    zeros = np.zeros(count)
    tracks = []
    for values in (rate[::50], means):
        recording = Recording(t, np.stack([values, zeros, zeros], axis=1), force)
        tracks.append(lh.fuse(recording, lh.ESKF()))
    apart = split_error(error_quaternion(tracks[0].quat, tracks[1].quat)).total[100:]
    assert np.degrees(apart.max()) > 2.0
    sigma = np.linalg.norm(tracks[1].sigma[100:], axis=1)
    assert (apart < 2.0 * sigma).all()
    still = np.abs(rate[::50][100:]) < np.radians(20.0)
    assert np.degrees(np.median(tracks[1].sigma[100:, 0][still])) < 0.7 * np.degrees(np.median(sigma))


def test_half_a_turn_is_part_of_sigma():
    params = lh.ESKF()
    state = step(params, init(params, ZERO, Vec3(0.0, 0.0, 9.81), ZERO), Vec3(0.3, -0.8, 2.0), ZERO, ZERO, 0.04)
    m = state.memory
    turn = quat.rotate(state.quat, Vec3(0.3, -0.8, 2.0))
    x, y = (state_variance(m, at.ATTITUDE + i) for i in range(2))
    for i, variance in enumerate((x, y, state_variance(m, at.HEADING) + x * y)):  # eq. 42
        expected = np.sqrt(variance + (0.04 * turn[i]) ** 2 / 12.0)
        assert output(params, state).sigma[i] == pytest.approx(expected, rel=1e-12)


def test_sigma_of_heading_is_that_of_a_bias_as_large_as_the_widest():
    """Eq. 37: as if the prior about the vertical had been that of the others, by conditioning a Gaussian anew."""
    narrow, wide, seconds, measured = np.radians(0.3) ** 2, np.radians(3.0) ** 2, 20.0, np.radians(0.6) ** 2
    state = init(lh.ESKF(), ZERO, Vec3(0.0, 0.0, 9.81), ZERO)
    m = state.memory
    first = at.PRIOR_VARIANCE + at.GYR_BIAS
    m[at.P + at.ATTITUDE * at.ROW + at.ATTITUDE] = 0.0  # the vertical is known, eq. 42

    def heading_and_bias(prior):
        bias = 1.0 / (1.0 / prior + 1.0 / measured)
        return seconds * seconds * bias + 1e-4, -seconds * bias, bias

    heading, covariance, bias = heading_and_bias(narrow)
    m[first], m[first + 1], m[first + 2] = wide, narrow, narrow
    z = at.GYR_BIAS + 2
    m[at.P + at.HEADING * at.ROW + at.HEADING], m[at.P + z * at.ROW + z] = heading, bias
    m[at.P + at.HEADING * at.ROW + z] = m[at.P + z * at.ROW + at.HEADING] = covariance
    expected = np.sqrt(heading_and_bias(wide)[0])
    assert output(lh.ESKF(), state).sigma.z == pytest.approx(expected, rel=1e-12)
    m[at.PRIOR_SIGMA + at.GYR_BIAS] = 1.0
    assert output(lh.ESKF(), state).sigma.z == pytest.approx(np.sqrt(heading), rel=1e-12)


def test_both_time_scales_of_a_field_are_found():
    """Eqs. 33 and 34: white noise of a known density and a place of a known variance, drawn."""
    params = lh.ESKF()
    m = init(params, ZERO, Vec3(0.0, 0.0, 9.81), Vec3(0.0, 20.0, -40.0)).memory
    random, time, density, sigma = np.random.default_rng(1), 0.12, 0.03, 0.15
    left = params.place_time / (params.place_time + time)
    h = np.array([0.1, 0.4, -0.9])
    m[at.BLOCK_TIME] = time
    m[at.MEAN + at.FIELD : at.MEAN + at.FIELD + 3] = h.tolist()
    for known in (at.FIELD, at.PLACE):
        set_independent(m, known, 3, 0.0)
    place, found = sigma * random.normal(size=3), []
    for _ in range(60_000):
        place = left * place + sigma * np.sqrt(1.0 - left * left) * random.normal(size=3)
        m[at.MEAN + at.PLACE : at.MEAN + at.PLACE + 3] = place.tolist()
        field = h + place + np.sqrt(density / time) * random.normal(size=3)
        adapt_field(params, m, Vec3(*field.tolist()), 0.0, False)
        found.append((m[at.MEAN_FIELD_DENSITY], m[at.PLACE_VARIANCE]))
    mean = np.mean(found[2000:], axis=0)
    assert mean[0] == pytest.approx(density, rel=0.2)
    assert mean[1] == pytest.approx(sigma * sigma / (h @ h), rel=0.4)


def test_sigma_of_north_covers_an_uneven_field():
    """Where the field varies from place to place σ of north covers what that does; it is smaller in an even one."""
    motion = simulate.motion(5, 60.0, 100.0, style="hand")
    clean = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed=5)
    random = np.random.default_rng(5)
    knots = random.normal(0.0, 12.0, (31, 3))  # µT, of iron every two seconds, fixed in the room
    iron = np.stack([np.interp(clean.t - clean.t[0], np.arange(31) * 2.0, knots[:, k]) for k in range(3)], axis=1)
    rotation = Rotation.from_quat(clean.truth.quat, scalar_first=True).inv()
    params = lh.ESKF(north_rate=1e6)
    beside, even = lh.fuse(replace(clean, mag=clean.mag + rotation.apply(iron)), params), lh.fuse(clean, params)
    for track in (even, beside):
        heading = np.abs(split_error(error_quaternion(track.quat, clean.truth.quat)).heading[500:])
        assert (heading > 4.0 * track.sigma[500:, 2]).mean() < 0.01
    assert np.median(beside.sigma[500:, 2]) > 2.0 * np.median(even.sigma[500:, 2])


def test_the_mean_velocity_of_a_block_moves_with_tilt_as_its_row_says():
    """Eq. 20: w × θ by finite differences, in a block with a force that changes."""
    params, tilt = lh.ESKF(), np.array([2e-6, -3e-6, 0.0])

    def block(turn):
        state = init(params, ZERO, Vec3(0.5, 0.3, 9.7), ZERO)
        state = state._replace(quat=quat.compose(quat.exp(Vec3(*turn)), state.quat))
        for k in range(12):
            state = step(params, state, Vec3(0.3, -0.5, 0.8), Vec3(3.0 * np.sin(k), 2.0 - 0.4 * k, 9.0 + k), ZERO, 0.01)
        m = state.memory
        end = np.array(m[at.MEAN + at.VELOCITY : at.MEAN + at.VELOCITY + 3])
        return m, end, np.array(m[at.INT_VELOCITY : at.INT_VELOCITY + 3]) / m[at.BLOCK_TIME]

    m, end, mean = block(np.zeros(3))
    _, other_end, other_mean = block(tilt)
    expected = (other_mean - mean) - (other_end - end)
    for i in range(3):
        set_force_columns(m, i)
        row = np.array(m[at.H + at.ATTITUDE : at.H + at.ATTITUDE + 2])
        m[at.H + at.ATTITUDE] = m[at.H + at.ATTITUDE + 1] = 0.0
        assert row @ tilt[:2] == pytest.approx(expected[i], abs=2e-9)
        assert abs(expected[i]) > 1e-8
