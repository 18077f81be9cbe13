"""Magnetic north against truth; true north: the sign by closed form, the doubt by Monte Carlo, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.simulate import Imu, TriadErrors

N = 50


def still(field) -> lh.Recording:
    zeros, up = np.zeros((N, 3)), np.tile([0.0, 0.0, 9.81], (N, 1))
    return lh.Recording(0.01 * np.arange(N), zeros, up, np.tile(field, (N, 1)))


def heading_errors(track, truth) -> np.ndarray:
    turn = track.as_rotation() * Rotation.from_quat(truth.quat, scalar_first=True).inv()
    return turn.as_rotvec()[:, 2]


def clean(style: str, seed: int) -> lh.Recording:
    return lh.simulate.observe(lh.simulate.motion(seed, 60.0, style=style), Imu(mag=TriadErrors()))


def raw(style: str, seed: int) -> lh.Recording:
    return lh.simulate.recording("ICM-20948", style, duration=60.0, seed=seed)


@pytest.mark.parametrize("run", [lh.fuse, lh.smooth])
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("style", ["drone", "hand", "robot"])
@pytest.mark.parametrize("sensor", [raw, clean])
def test_the_turned_track_points_to_the_true_magnetic_north(sensor, style, seed, run):
    """Truth of the simulated motion; a raw magnetometer begins up to half a turn off."""
    recording = sensor(style, seed)
    track = run(recording, lh.filters.ESKF()).to_north()
    error = heading_errors(track, recording.truth)
    assert (np.abs(error) < 4.0 * track.sigma_heading).all() and np.degrees(np.abs(error)).max() < 6.0
    assert track.relative is False and track.north.azimuth == 0.0 and track.to_north() is track
    assert (track.sigma_heading >= track.north.sigma).all()


def test_one_turn_of_all_and_sigma_in_quadrature():
    recording = raw("drone", 2)
    track = lh.fuse(recording)
    turned = track.to_north()
    assert track.relative and abs(np.degrees(heading_errors(track, recording.truth)[-1])) > 100.0
    turns = (turned.as_rotation() * track.as_rotation().inv()).as_rotvec()
    np.testing.assert_allclose(turns, np.tile([0.0, 0.0, track.north.azimuth], (len(track), 1)), atol=1e-9)
    np.testing.assert_allclose(turned.sigma_heading**2, track.sigma_heading**2 + track.north.sigma**2)
    np.testing.assert_allclose(turned.sigma_tilt, track.sigma_tilt)
    ned = track.mount("-y,x,z").to_frame("NED").to_north()
    np.testing.assert_allclose(ned.quat, turned.mount("-y,x,z").to_frame("NED").quat, atol=1e-12)
    true, again = track.to_true_north(4.0), turned.to_true_north(4.0)
    np.testing.assert_array_equal(true.quat, again.quat)
    assert np.degrees(true.north.azimuth) == pytest.approx(4.0) and true.north.sigma == track.north.sigma


def test_a_heading_that_was_given_stays_and_its_north_turns_along():
    track = lh.fuse(raw("drone", 2))
    given = track.with_heading(10.0)
    assert given.to_north() is given and not given.relative
    turn = np.radians(10.0 - track.euler()[0, 2])
    assert np.sin(given.north.azimuth - track.north.azimuth + turn) == pytest.approx(0.0, abs=1e-9)


def test_no_north():
    standing = raw("still", 1)
    with pytest.raises(
        lh.LevelheadError, match=r"σ is \d+°, and the sensor turned by [01]° .*turn it all the way round"
    ):
        lh.fuse(standing).to_north()
    for track in (lh.fuse(replace(standing, mag=None)), lh.fuse(standing, "AccelTilt")):
        assert track.relative
        for turn in (track.to_north, lambda track=track: track.to_true_north(3.0)):
            with pytest.raises(
                lh.LevelheadError, match="found no north: there was no magnetometer, or the filter does"
            ):
                turn()


def test_filters_that_follow_the_field_point_north_already():
    for params in ("Mahony", "EKF", lh.filters.ESKF(north_rate=2.0)):
        track = lh.fuse(raw("hand", 1), params)
        assert not track.relative and track.to_north() is track


@pytest.mark.parametrize("declination", [0.0, 12.5, -7.0, 179.0])
def test_a_sensor_that_points_to_magnetic_north_has_true_azimuth_d(declination):
    track = lh.fuse(still([19.0, 0.0, -45.0]), "Complementary")  # the field lies along the sensor's x axis
    assert track.euler()[-1, 2] == pytest.approx(90.0, abs=1e-6)
    true = track.to_true_north(declination)
    east, north, up = true.as_rotation().apply([1.0, 0.0, 0.0])[-1]
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(declination, abs=1e-6)
    assert up == pytest.approx(0.0, abs=1e-9)
    assert true.euler()[-1, 2] == pytest.approx((90.0 - declination + 180.0) % 360.0 - 180.0, abs=1e-6)
    assert true.declination == pytest.approx(np.radians(declination)) and track.declination is None


def test_ned_bearing_grows_by_the_declination():
    track = lh.fuse(lh.simulate.recording("ICM-20948", "drone", duration=5.0), "Complementary")
    before, after = (t.as_rotation("NED").as_euler("ZYX", degrees=True) for t in (track, track.to_true_north(4.25)))
    np.testing.assert_allclose((after[:, 0] - before[:, 0] + 180.0) % 360.0 - 180.0, 4.25, atol=1e-9)
    np.testing.assert_allclose(after[:, 1:], before[:, 1:], atol=1e-9)


@pytest.mark.slow
def test_sigma_is_that_of_the_turned_axes():
    """A cloud of independent errors about the old axes, seen about the new ones."""
    random = np.random.default_rng(5)
    sigma = np.array([0.01, 0.03, 0.02])
    middle = Rotation.from_euler("ZYX", [0.4, 0.2, -0.7])
    old = lh.Track([0.0], [middle.as_quat(scalar_first=True)], sigma=[sigma])
    true = old.to_true_north(0.6, degrees=False)
    cloud = Rotation.from_rotvec(sigma * random.standard_normal((200_000, 3))) * middle
    turned = lh.Track(np.arange(200_000.0), cloud.as_quat(scalar_first=True)).to_true_north(0.6, degrees=False)
    errors = (turned.as_rotation() * true.as_rotation()[0].inv()).as_rotvec()
    np.testing.assert_allclose(true.sigma[0], errors.std(axis=0), rtol=0.01)
    assert true.sigma_tilt == pytest.approx(old.sigma_tilt) and true.sigma_heading == old.sigma_heading


@pytest.mark.parametrize("declination", [181.0, float("nan"), float("inf"), "east", None])
def test_no_declination(declination):
    with pytest.raises(lh.LevelheadError, match="positive east, within ±180"):
        lh.Track([0.0], [[1.0, 0.0, 0.0, 0.0]]).to_true_north(declination)


def test_not_twice():
    track = lh.Track([0.0], [[1.0, 0.0, 0.0, 0.0]]).to_true_north(3.5)
    with pytest.raises(lh.LevelheadError, match=r"true north already, by a declination of 3.5°"):
        track.to_true_north(3.5)
