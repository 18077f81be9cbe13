"""The self-calibrating filter: its Jacobians by finite differences, its algebra by a dense twin, what it learns."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.engine.batch import Batch
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.filters import health
from levelhead.filters.eskf import covariance, measurements, predict, reinitialise
from levelhead.filters.eskf import filter as eskf
from levelhead.filters.eskf import state as at
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3
from levelhead.units import GRAVITY

DT = 0.01


def square(m):
    """The covariance as a matrix, without what only fills up its rows."""
    whole = np.reshape(m[at.P : at.P + at.ROW * at.ROW], (at.ROW, at.ROW))
    np.testing.assert_array_equal(whole[at.N :], 0.0)
    np.testing.assert_array_equal(whole[:, at.N :], 0.0)
    return whole[: at.N, : at.N]


def couplings(m):
    """F − 1 of the driven states."""
    return -np.reshape(m[at.F : at.F + at.DRIVEN * at.ROW], (at.DRIVEN, at.ROW))[:, : at.N]


def prepared(rng, mag=True):
    """A state with everything different from zero, in the middle of a recording."""
    params = lh.ESKF(block=0.1)
    field = Vec3(0.0, 19.0, -45.0) if mag else Vec3(0.0, 0.0, 0.0)
    state = eskf.init(params, Vec3(0.0, 0.0, 0.0), Vec3(0.3, -0.2, 9.7), field)
    m = state.memory
    root = rng.normal(0, 0.01, (at.N, at.N))
    if not mag:
        root[at.FIELD :] = 0.0
    rest = at.ROW - at.N
    m[at.P : at.P + at.ROW**2] = np.pad(root @ root.T, ((0, rest), (0, rest))).ravel().tolist()
    for first, count, size in (
        (at.ACC_BIAS, 3, 0.05),
        (at.GYR_BIAS, 3, 0.01),
        (at.GYR_MATRIX, 9, 0.01),
        (at.MAG_OFFSET, 3, 0.05),
    ):
        for i in range(first, first + count):
            m[at.MEAN + i] = rng.normal(0, size)
    m[at.MEAN + at.MAG_DELAY] = 0.01
    return params, state._replace(quat=Quat(*Rotation.random(rng=rng).as_quat(scalar_first=True)))


def through_a_block(params, state, readings):
    for gyr, acc, mag in readings:
        state = eskf.step(params, state, Vec3(*gyr), Vec3(*acc), Vec3(*mag), DT)
    return state


def readings_of(rng, n=10):
    return [(rng.normal(0, 2, 3), rng.normal(0, 2, 3) + [0, 0, 9.8], rng.normal(0, 20, 3)) for _ in range(n)]


def moved(state, index, by):
    """The state with one error state added: θ turns from the left, the others are added."""
    memory = list(state.memory)
    if at.ATTITUDE <= index < at.ATTITUDE + 3:
        turn = Rotation.from_rotvec(by * np.eye(3)[index - at.ATTITUDE])
        quat = (turn * Rotation.from_quat(state.quat, scalar_first=True)).as_quat(scalar_first=True)
        return state._replace(quat=Quat(*quat), memory=memory)
    memory[at.MEAN + index] += by
    return state._replace(memory=memory)


def driven(state):
    """Velocity and attitude at the end of a block."""
    return np.array(state.memory[at.MEAN + at.VELOCITY : at.MEAN + at.VELOCITY + 3]), Rotation.from_quat(
        state.quat, scalar_first=True
    )


def test_the_couplings_of_a_block_are_the_derivatives_of_what_the_samples_do():
    rng = np.random.default_rng(3)
    params, state = prepared(rng)
    readings = readings_of(rng)
    base = through_a_block(params, moved(state, 0, 0.0), readings)
    predict.set_transition(base.memory)
    f = couplings(base.memory)
    f[:, at.VELOCITY : at.VELOCITY + at.DRIVEN] += np.eye(at.DRIVEN)
    small = 1e-6
    for index in range(at.FIELD):
        ends = [driven(through_a_block(params, moved(state, index, by), readings)) for by in (small, -small)]
        speeds, turns = zip(*ends, strict=True)
        dv = (speeds[0] - speeds[1]) / (2 * small)
        dtheta = (turns[0] * turns[1].inv()).as_rotvec() / (2 * small)
        expected = f[:, index].copy()
        if index >= at.GYR_BIAS:  # F is of first order in the block's length: of v it leaves out what θ does in it
            expected[:3] += 0.5 * f[:3, at.ATTITUDE : at.ATTITUDE + 3] @ f[3:, index]
        np.testing.assert_allclose(dv, expected[:3], atol=0.03 if index >= at.GYR_BIAS else 5e-3)
        np.testing.assert_allclose(dtheta, expected[3:], atol=5e-3)


def test_the_rows_of_the_field_are_its_derivatives(monkeypatch):
    rng = np.random.default_rng(4)
    params, state = prepared(rng)
    readings = readings_of(rng, 4)

    def field(state):
        m = through_a_block(params, state, readings).memory
        return np.array(m[at.SUM_FIELD : at.SUM_FIELD + 3]) / m[at.MAG_COUNT]

    seen = []
    base = through_a_block(params, moved(state, 0, 0.0), readings)

    def add_partial(m, n, k, share, innovation, noise, bound):
        seen.append((share, list(m[at.H : at.H + at.N])))
        m[at.H : at.H + at.N] = [0.0] * at.N
        return 0.0

    monkeypatch.setattr(measurements, "add_partial", add_partial)
    measurements.update_field(params, base.memory, False, at.ROW)
    small = 1e-6
    for index in (at.ATTITUDE, at.ATTITUDE + 1, at.HEADING, *range(at.MAG_OFFSET, at.MAG_DELAY + 1)):
        change = (field(moved(state, index, small)) - field(moved(state, index, -small))) / (2 * small)
        # what an offset does to the part that comes of the delay, d ω × o, is left out: 2 % of it at 2 rad/s
        atol = 0.05 if at.MAG_OFFSET <= index < at.MAG_DELAY else 1e-5
        np.testing.assert_allclose([row[index] for _, row in seen], change, atol=atol)
    for axis, index in itertools.product(range(3), (at.FIELD, at.PLACE)):
        assert [row[index + axis] for _, row in seen] == [-1.0 if k == axis else 0.0 for k in range(3)]


def joseph_form(p, x, h, innovation, share):
    """Covariance and x after one measurement, by the textbook."""
    gain = p @ h / (h @ p @ h + 0.02)
    if share is not None:
        gain[: at.HEADING] = 0.0  # a magnetometer never tilts the horizon
        gain[at.HEADING : at.FIELD] *= share
    kept = np.eye(at.N) - np.outer(gain, h)
    return kept @ p @ kept.T + 0.02 * np.outer(gain, gain), x + gain * (innovation - h @ x)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("share", [None, 0.0, 0.3, 1.0])
def test_measurements_in_one_pass_are_josephs_form_with_the_gains_that_are_left(share, count):
    rng = np.random.default_rng(5)
    _, state = prepared(rng)
    m = list(state.memory)
    p, x = square(m), rng.normal(size=at.N)
    m[at.X : at.X + at.N] = x.tolist()
    for k in range(count):
        h = rng.normal(size=at.N)
        if share is not None:  # a field has no element of other states
            h[: at.ATTITUDE] = h[at.GYR_BIAS : at.FIELD] = 0.0
        m[at.H : at.H + at.N] = h.tolist()
        if share is None:
            assert covariance.variance_after(m, at.HEADING, k) == pytest.approx(p[at.HEADING, at.HEADING])
            covariance.add_scalar(m, at.ROW, k, 0.3, 0.02)
        else:
            explained = covariance.add_partial(m, at.ROW, k, share, 0.3, 0.02, 1e9)
            assert explained == pytest.approx(h @ p @ h)
        p, x = joseph_form(p, x, h, 0.3, share)
        np.testing.assert_allclose(m[at.X : at.X + at.N], x, rtol=1e-9)
        assert not any(m[at.H : at.H + at.N])
    if share is None:
        covariance.subtract_products(m, at.ROW, count)
    else:
        covariance.subtract_partial_products(m, at.ROW, count)
    after = square(m)
    np.testing.assert_allclose(after, p, atol=1e-12)
    np.testing.assert_array_equal(after, after.T)


def test_the_share_falls_with_the_variance_of_the_level_part_of_the_offset():
    rng = np.random.default_rng(7)
    params, state = prepared(rng)
    m = through_a_block(params, state, readings_of(rng)).memory
    turn = np.array(m[at.SUM_R : at.SUM_R + 9]).reshape(3, 3) / m[at.MAG_COUNT]
    offset = slice(at.MAG_OFFSET, at.MAG_OFFSET + 3)
    level = np.diag(turn @ square(m)[offset, offset] @ turn.T)[:2].mean()
    for size in (0.1, 1.0, 10.0):
        expected = 1.0 / (1.0 + (16.0 * level / size**2) ** 2)
        assert measurements.known_share(m, size**2, 1.0 / m[at.MAG_COUNT]) == pytest.approx(expected)


def test_a_heading_about_a_wrong_vertical_has_the_variance_of_the_order_of_level_rotations():
    rng = np.random.default_rng(8)
    for sigma_x, sigma_y in ((0.05, 0.05), (0.02, 0.2)):
        x, y = sigma_x * rng.normal(size=20_000), sigma_y * rng.normal(size=20_000)
        zero = np.zeros_like(x)
        first = Rotation.from_rotvec(np.column_stack([x, zero, zero]))
        second = Rotation.from_rotvec(np.column_stack([zero, y, zero]))
        apart = (first * second * (second * first).inv()).as_rotvec()[:, 2]
        assert apart.var() == pytest.approx(sigma_x**2 * sigma_y**2, rel=0.1)


def test_prediction_is_the_dense_product():
    rng = np.random.default_rng(6)
    params, state = prepared(rng)
    base = through_a_block(params, state, readings_of(rng))
    m = list(base.memory)
    p = square(m)
    predict.set_transition(m)
    f = np.eye(at.N)
    f[at.VELOCITY : at.VELOCITY + at.DRIVEN] += couplings(m)
    covariance.propagate(m, at.ROW)
    after = square(m)
    np.testing.assert_allclose(after, f @ p @ f.T, atol=1e-12)
    np.testing.assert_array_equal(after, after.T)


def test_a_corrected_velocity_is_taken_along_by_heading():
    rng = np.random.default_rng(7)
    _, state = prepared(rng)
    m = list(state.memory)
    p = square(m)
    shear = np.eye(at.N)
    shear[at.VELOCITY, at.HEADING], shear[at.VELOCITY + 1, at.HEADING] = -0.7, 0.4  # θ_z × (0.4, 0.7)
    covariance.rotate_velocity_error(m, at.P, at.ROW, 0.4, 0.7)
    np.testing.assert_allclose(square(m), shear @ p @ shear.T, atol=1e-12)
    np.testing.assert_array_equal(square(m), square(m).T)


@pytest.mark.parametrize("known", [0.4, 1.0])
def test_a_tilt_that_was_lost_moves_by_its_share_and_no_block_counts_twice(known):
    """Eq. 38 over three blocks of a shaken body beside its closed form from the sums over all of them."""
    rng = np.random.default_rng(11)
    params, state = prepared(rng, mag=False)
    readings = readings_of(rng, 30)
    m = state.memory
    m[at.MEAN + at.ACC_BIAS : at.MEAN + at.ACC_BIAS + 3] = [0.0, 0.0, 0.0]
    covariance.set_independent(m, at.ATTITUDE, 2, known)
    quat, total, square_sum, rotations = state.quat, np.zeros(3), 0.0, Rotation.identity()
    for block in range(3):
        state = through_a_block(params, state._replace(quat=quat, block_end=block > 0), readings[10 * block :][:10])
        total += rotations.inv().apply(m[at.INT_FORCE : at.INT_FORCE + 3])
        square_sum += sum(DT * acc @ acc for _, acc, _ in readings[10 * block :][:10])
        turn = Rotation.from_quat(reinitialise.reinitialise_tilt(params, m, False), scalar_first=True)
        rotations = turn * rotations
        quat = Quat(*(turn * driven(state)[1]).as_quat(scalar_first=True))
        time = DT * 10 * (block + 1)
        mean = np.linalg.norm(total) / time
        shake = 0.3**2 * (square_sum / time - mean**2 + 0.5 * (mean - GRAVITY) ** 2)
        swing = (0.7 / GRAVITY) ** 2 * m[at.INT_RATE2] / m[at.BLOCK_TIME]
        r = np.radians(params.tilt_start) ** 2 + swing + 2.0 * shake / (GRAVITY * time) ** 2
        k = 1.0 / known**2 - 1.0
        up = total / np.linalg.norm(total)
        axis = np.array([up[1], -up[0], 0.0]) / np.hypot(up[0], up[1])
        expected = Rotation.from_rotvec(axis * np.arccos(up[2]) / (1.0 + r * k))
        np.testing.assert_allclose((rotations * expected.inv()).magnitude(), 0.0, atol=1e-9)
        np.testing.assert_allclose(covariance.state_variance(m, at.ATTITUDE), min(r / (1.0 + r * k), 1.0), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["robot", "drone"])
def test_nothing_but_a_magnetometer_tells_of_heading(motion):
    """σ of a relative heading never falls where the gyroscope has nothing to learn: velocity zero has no direction."""
    recording = simulate.recording("MPU-6050", motion, seed=3, duration=120.0)
    perfect = lh.ESKF(bias_start=0.0, bias_uncalibrated=0.0, bias_walk=0.0, scale_start=0.0, scale_walk=0.0)
    track = lh.fuse(recording, perfect)
    rate = recording.gyr - (0.5 - GROUP_DELAY / 0.01) * np.diff(recording.gyr, axis=0, prepend=recording.gyr[:1])
    half_turn = 0.01 / 12.0**0.5 * track.as_rotation().apply(rate - track.bias)
    x, y, z = (track.sigma[1:] ** 2 - half_turn[1:] ** 2).T  # without the time of a reading, eq. 40
    sigma = np.sqrt(z - x * y)  # and without the wrong vertical, eq. 42
    assert sigma[-1] > 2.0 * sigma[1000]
    sigma = sigma[: int((track.sigma[1:, 2] < 1.8).argmin() or len(sigma))]  # until heading is as good as unknown
    assert len(sigma) > 2000
    assert (np.diff(sigma) > -1e-5 * sigma[:-1]).all()


def learned(recording, **values):
    """The end of a run: means and deviations of the error states."""
    run = Batch(recording, lh.ESKF(**values), lh.Guard(), "auto", None)
    run.advance(len(recording))
    m = run.carry.run.state.memory
    p = square(m)
    return np.array(m[at.MEAN : at.MEAN + at.N]), np.sqrt(np.diag(p)), p


@pytest.mark.slow
def test_a_late_magnetometer_is_found_out():
    """Everything else perfect, the magnetometer's readings are those of 20 ms ago."""
    motion = simulate.motion(5, 60.0, 200.0, style="hand")
    clean = simulate.observe(motion, simulate.imu("LSM6DSO32", mag="HMC5883L"), seed=5)
    late = np.array(clean.mag)
    late[4:] = clean.mag[:-4]
    mean, sigma, _ = learned(lh.Recording(clean.t, clean.gyr, clean.acc, late, truth=clean.truth))
    assert mean[at.MAG_DELAY] == pytest.approx(0.020, abs=0.003)
    assert sigma[at.MAG_DELAY] < 0.006


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_gyroscope_that_was_turned_on_with_a_large_bias_is_right_without_any_rest(seed):
    """An MPU-6050's zero rate is within ±20 °/s; nobody holds it still."""
    recording = simulate.recording("MPU-6050", "walking", seed=seed, mag="HMC5883L", duration=60.0)
    moving = recording[400:]
    mean, _, p = learned(moving)
    wrong = mean[at.GYR_BIAS : at.GYR_BIAS + 3] - moving.truth.bias[-1]
    assert np.degrees(np.abs(moving.truth.bias[-1])).max() > 2.0
    assert np.degrees(np.abs(wrong)).max() < 0.5
    assert np.linalg.eigvalsh(p).min() > -1e-12 * np.linalg.eigvalsh(p).max()


@pytest.mark.slow
def test_a_blow_of_100_g_moves_nothing():
    recording = simulate.recording("LSM6DSO32", "hand", seed=2, mag="HMC5883L", duration=40.0)
    acc = np.array(recording.acc)
    acc[2000:2003] = [[900.0, -300.0, 500.0], [-700.0, 200.0, -400.0], [300.0, 100.0, 200.0]]
    hit = lh.Recording(recording.t, recording.gyr, acc, recording.mag, truth=recording.truth)
    plain, struck = (lh.fuse(one, lh.ESKF()) for one in (recording, hit))
    turn = (plain.as_rotation() * struck.as_rotation().inv()).magnitude()
    assert np.degrees(turn[2000:]).max() < 3.0
    assert np.degrees(turn[-1]) < 0.5


@pytest.mark.slow
def test_covariance_stays_symmetric_and_positive():
    """Half an hour at 100 Hz, most of it at rest, where rows of the same direction come again and again."""
    rng = np.random.default_rng(9)
    n = 180_000
    gyr = rng.normal(0, 0.002, (n, 3))
    moving = (np.arange(n) // 3000) % 5 == 0
    gyr[moving] += np.sin(np.arange(n)[moving, None] / 50.0) * [1.0, 0.5, -0.7]
    t = np.arange(n) / 100.0
    true = Rotation.from_rotvec(np.cumsum(np.where(moving[:, None], gyr, 0.0) * 0.01, axis=0))
    up, north = true.inv().apply([0.0, 0.0, 9.8]), true.inv().apply([0.0, 19.0, -45.0])
    acc, mag = up + rng.normal(0, 0.05, (n, 3)), north + rng.normal(0, 0.3, (n, 3))
    _, _, p = learned(lh.Recording(t, gyr, acc, mag))
    np.testing.assert_array_equal(p, p.T)
    p = p[: at.POSITION, : at.POSITION]  # without aiding there is no more
    values = np.linalg.eigvalsh(p / np.sqrt(np.outer(np.diag(p), np.diag(p))))
    assert values.min() > -1e-9


@pytest.mark.slow
def test_a_magnet_on_the_sensor_turns_no_heading():
    """A screw is fastened on the way: the field is refused, and heading stays the gyroscope's."""
    recording = simulate.recording("LSM6DSO32", "hand", seed=4, mag="HMC5883L", duration=120.0)
    mag = np.array(recording.mag)
    mag[4000:] += [90.0, -60.0, 40.0]
    track = lh.fuse(lh.Recording(recording.t, recording.gyr, recording.acc, mag), lh.ESKF())
    heading = np.degrees(split_error(error_quaternion(track.quat, recording.truth.quat)).heading)
    assert (track.health[4000:4100] & health.MAG_REJECTED != 0).mean() > 0.5
    assert np.abs(heading[4000:] - heading[3999]).max() < 6.0
