"""True north: the sign by closed form, the doubt by Monte Carlo, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh

N = 50


def still(field) -> lh.Recording:
    zeros, up = np.zeros((N, 3)), np.tile([0.0, 0.0, 9.81], (N, 1))
    return lh.Recording(0.01 * np.arange(N), zeros, up, np.tile(field, (N, 1)))


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
