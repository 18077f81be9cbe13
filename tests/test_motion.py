"""Specific force, accelerations and rates of a track against the motion that was simulated."""

import numpy as np
import pytest

import levelhead as lh
from levelhead.motion import white_noise
from levelhead.rotations import rotate


@pytest.fixture(scope="module")
def seen():
    """A recording with truth, its track, and the acceleration in the sensor's axes by differences of its velocity."""
    rec = lh.simulate.recording("ICM-20948", "drone", duration=30.0, seed=2)
    earth = np.gradient(rec.truth.velocity, rec.t, axis=0)
    return rec, lh.fuse(rec), rotate(rec.truth.quat * [1.0, -1.0, -1.0, -1.0], earth)


def test_an_attitude_without_error_leaves_the_acceleration():
    t = 0.01 * np.arange(500)
    random = np.random.default_rng(0)
    quat = random.normal(size=(500, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    earth = random.normal(size=(500, 3))
    force = rotate(quat * [1.0, -1.0, -1.0, -1.0], earth + [0.0, 0.0, 9.80665])
    rec = lh.Recording(t, np.zeros((500, 3)), force)
    track = lh.Track(t, quat, readings=rec)
    np.testing.assert_allclose(track.earth_acceleration().value, earth, atol=1e-12)
    np.testing.assert_allclose(rotate(quat, track.linear_acceleration().value), earth, atol=1e-12)
    np.testing.assert_array_equal(track.specific_force().value, force)
    assert track.earth_acceleration().sigma is None
    ned = track.to_frame("NED")
    np.testing.assert_allclose(ned.earth_acceleration().value, earth[:, [1, 0, 2]] * [1, 1, -1], atol=1e-12)
    np.testing.assert_allclose(
        rotate(ned.quat, ned.linear_acceleration().value), ned.earth_acceleration().value, atol=1e-12
    )
    body = track.mount("ZYX:30,20,10")
    np.testing.assert_allclose(rotate(body.quat, body.linear_acceleration().value), earth, atol=1e-12)


def test_sigma_by_monte_carlo():
    """Errors of attitude and sensor, drawn as the σ says, scatter the accelerations as the σ of these says."""
    n = 40_000
    random = np.random.default_rng(1)
    quat = np.tile([0.5, -0.1, 0.7, 0.5], (n, 1)) / np.linalg.norm([0.5, -0.1, 0.7, 0.5])
    force, sigma = np.array([2.0, -4.0, 9.0]), np.array([0.02, 0.01, 0.05])
    from scipy.spatial.transform import Rotation

    wrong = Rotation.from_rotvec(sigma * random.standard_normal((n, 3))) * Rotation.from_quat(quat, scalar_first=True)
    acc = force + [0.1, 0.05, 0.2] * random.standard_normal((n, 3))
    rec = lh.Recording(0.01 * np.arange(n), np.zeros((n, 3)), acc)
    track = lh.Track(rec.t, wrong.as_quat(scalar_first=True), sigma=np.broadcast_to(sigma, (n, 3)), readings=rec)
    for series in (track.earth_acceleration(), track.linear_acceleration()):
        np.testing.assert_allclose(np.median(series.sigma, axis=0), series.value.std(axis=0), rtol=0.08)


def test_of_a_simulated_flight(seen):
    rec, track, true = seen
    found = track.linear_acceleration()
    rows = slice(500, None)
    error = found.value[rows] - true[rows]
    ratio = np.sqrt(np.mean((error / found.sigma[rows]) ** 2))
    assert np.sqrt(np.mean(error**2)) < 0.3 and 0.5 < ratio < 2.2, "σ of this tilt is half of its error"
    rate = track.angular_rate()
    true_rate = rec.gyr - rec.truth.bias
    assert np.sqrt(np.mean((rate.value - true_rate)[rows] ** 2)) < np.sqrt(np.mean(rec.truth.bias[rows] ** 2))


def test_white_noise_is_found_in_what_moves():
    random = np.random.default_rng(3)
    t = 0.01 * np.arange(4000)
    slow = np.stack([np.sin(t), np.cos(0.7 * t), t], axis=1)
    sigma = np.array([0.1, 0.2, 0.05])
    np.testing.assert_allclose(white_noise(slow + sigma * random.standard_normal((4000, 3))), sigma, rtol=0.25)


def test_a_track_without_readings_needs_them(seen):
    rec, track, _ = seen
    bare = lh.Track(track.t, track.quat)
    with pytest.raises(lh.LevelheadError, match="does not hold its readings"):
        bare.linear_acceleration()
    assert bare.linear_acceleration(rec).value.shape == (len(rec), 3)
    with pytest.raises(lh.LevelheadError, match="other stamps"):
        bare.linear_acceleration(rec[:50])


def test_smoothed_tracks_hold_their_readings_too():
    rec = lh.simulate.recording("ICM-20948", "hand", duration=6.0)
    assert lh.smooth(rec).linear_acceleration().sigma.shape == (len(rec), 3)


def test_a_stream_gives_the_same(seen):
    rec, _, _ = seen
    live = lh.Stream("Mahony")
    track = lh.fuse(rec, "Mahony")
    for i in range(300):
        live.update(rec.gyr[i], rec.acc[i], rec.mag[i], t=rec.t[i])
    np.testing.assert_allclose(live.linear_acceleration(rec.acc[299]), track.linear_acceleration().value[299])
    np.testing.assert_allclose(live.earth_acceleration(rec.acc[299]), track.earth_acceleration().value[299])
    with pytest.raises(lh.LevelheadError, match="three numbers in m/s²"):
        live.linear_acceleration("up")
