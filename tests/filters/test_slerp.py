"""Complementary on an IMU: slerp as a textbook writes it, and what angles could not do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.reference import textbook

import levelhead as lh
from levelhead.filters import complementary
from levelhead.kernels import quat, slerp
from levelhead.kernels.quat import Euler
from levelhead.kernels.vec3 import ZERO, Vec3

G = 9.80665
FIELD = np.array([0.0, 19.0, -45.0])
UNITS = st.builds(Euler, *[st.floats(-3.0, 3.0)] * 3).map(quat.from_euler)
SHARES = st.floats(0.0, 1.0)


def scipy_of(q):
    return Rotation.from_quat(np.array(q), scalar_first=True)


def still(attitude, n, rate=100.0):
    body = attitude.inv()
    return (
        np.arange(n) / rate,
        np.zeros((n, 3)),
        np.tile(body.apply([0, 0, G]), (n, 1)),
        np.tile(body.apply(FIELD), (n, 1)),
    )


@given(UNITS, st.builds(Vec3, *[st.floats(-20.0, 20.0)] * 3), SHARES)
def test_level_is_shoemakes_slerp_along_the_shortest_turn(q, acc, share):
    force = scipy_of(q).apply(acc)
    if np.hypot(force[0], force[1]) > max(1e-6 * abs(force[2]), 1e-100):  # the filter calls nothing shorter a vector
        target = textbook.between(force, [0.0, 0.0, 1.0]) * scipy_of(q)
        expected = textbook.slerp(q, target.as_quat(scalar_first=True), share)
        got = slerp.level(q, acc, share)
        assert abs(np.dot(got, expected)) == pytest.approx(1.0, abs=1e-12)
        assert np.linalg.norm(got) == pytest.approx(1.0, abs=1e-14)
        assert scipy_of(slerp.level(q, acc, 1.0)).apply(acc)[2] == pytest.approx(np.linalg.norm(acc))


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("across", [0.0, 1e-170, 1e-9])
def test_upside_down_turns_about_some_horizontal_axis(share, across):
    got = slerp.level(quat.IDENTITY, Vec3(across, 0.0, -G), share)
    assert np.linalg.norm(got) == pytest.approx(1.0, abs=1e-15)
    assert np.degrees(np.arccos(np.clip(quat.up(got).z, -1, 1))) == pytest.approx(180.0 * share, abs=1e-5)
    assert got.z == pytest.approx(0.0, abs=1e-15)


@given(UNITS, SHARES)
def test_north_turns_about_the_vertical_only(q, share):
    mag = Vec3(*scipy_of(q).inv().apply(Rotation.from_euler("z", 1.2).apply(FIELD)).tolist())
    got = slerp.turn_north(q, mag, share)
    assert (scipy_of(got) * (Rotation.from_euler("z", -1.2 * share) * scipy_of(q)).inv()).magnitude() < 1e-12


@pytest.mark.slow
def test_the_filter_is_the_textbook_filter():
    rng = np.random.default_rng(6)
    n = 600
    t = np.cumsum(rng.uniform(0.008, 0.014, n))  # no sample is lost
    gyr = np.cumsum(rng.normal(0, 0.3, (n, 3)), axis=0) * 0.3
    acc, mag = rng.normal(0, 4, (n, 3)) + [0, 0, G], rng.normal(0, 5, (n, 3)) + FIELD
    expected = textbook.slerp_complementary(t, gyr, acc, mag, 0.3, 2.0)
    got = lh.fuse(lh.Recording(t, gyr, acc, mag), lh.Complementary(tau=0.3, tau_heading=2.0), guard=None).quat
    np.testing.assert_allclose(np.abs((got * expected).sum(1)), 1.0, atol=1e-12)


def test_through_the_vertical_nothing_happens():
    """Pitch swings through ±90° with a bias on all axes: the error is that of any other attitude, bias times τ."""
    t = np.arange(4000) / 100
    pitch = np.radians(120) * np.sin(2 * np.pi * t / 10)
    true = Rotation.from_euler("y", pitch[:, None])
    gyr = np.stack([np.zeros(4000), np.gradient(pitch, t), np.zeros(4000)], 1) + np.radians(1.0)
    recording = lh.Recording(t, gyr, true.inv().apply([0, 0, G]), true.inv().apply(FIELD))
    track = lh.fuse(recording, "Complementary", guard=None)  # which would call axes without noise stuck
    assert not track.health.any()
    up = (track.as_rotation() * true.inv()).apply([0, 0, 1.0])[:, 2]
    assert np.degrees(np.arccos(np.clip(up, -1, 1))).max() < 1.5


@pytest.mark.parametrize("wrong", [0, 1500], ids=["first sample", "knocked over"])
def test_settles_within_its_time_from_the_worst_case(wrong):
    """Upside down and facing south: within 2° after the seconds that the filter states."""
    n = 6000
    t, gyr, acc, mag = still(Rotation.identity(), n)
    flip = Rotation.from_euler("ZYX", [180.0, 0.0, 179.9], degrees=True)
    start = 1 if wrong == 0 else wrong
    acc[:start], mag[:start] = flip.inv().apply(acc[:start]), flip.inv().apply(mag[:start])
    track = lh.fuse(lh.Recording(t, gyr, acc, mag), lh.Complementary())
    up, ahead = (track.as_rotation().apply(v) for v in ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]))
    tilt = np.degrees(np.arccos(np.clip(up[:, 2], -1, 1)))
    heading = np.degrees(np.abs(np.arctan2(ahead[:, 0], ahead[:, 1])))
    settles = complementary.FILTER.settles
    assert tilt[start + int(100 * settles.tilt) :].max() < 2.0
    assert heading[start + int(100 * settles.heading) :].max() < 2.0


def test_a_magnetometer_that_comes_late_is_believed_at_once():
    t, gyr, acc, mag = still(Rotation.from_euler("z", 90, degrees=True), 400)
    mag[:200] = np.nan
    yaw = lh.fuse(lh.Recording(t, gyr, acc, mag), lh.Complementary()).euler()[:, 2]
    np.testing.assert_allclose(yaw[:200], 0.0, atol=1e-9)
    np.testing.assert_allclose(yaw[200:], 90.0, atol=1e-9)


def test_a_wrong_first_heading_is_averaged_away():
    t, gyr, acc, mag = still(Rotation.identity(), 400)
    mag[0] = Rotation.from_euler("z", 60, degrees=True).apply(mag[0])
    yaw = np.abs(lh.fuse(lh.Recording(t, gyr, acc, mag), lh.Complementary()).euler()[:, 2])
    np.testing.assert_allclose(yaw, 60.0 / np.arange(1, 401), rtol=1e-9)


def test_gains_are_the_weights_of_the_sample():
    params = lh.Complementary(tau=0.5, tau_heading=2.0)
    state = complementary.init(params, ZERO, Vec3(0.0, 0.0, G), Vec3(*FIELD.tolist()))
    for k in range(1, 4):
        state = complementary.step(params, state, ZERO, Vec3(0.0, 0.0, G), Vec3(*FIELD.tolist()), 0.01)
        said = complementary.gains(params, state, 0.01)
        assert said == pytest.approx((0.01 / 0.51, 0.0, 1.0 / (k + 1), 0.0))
    state = complementary.step(params, state, ZERO, Vec3(0.0, 0.0, G), Vec3(*FIELD.tolist()), 1e9)
    assert complementary.gains(params, state, 1e9) == (1.0, 0.0, 1.0, 0.0), "after a gap the next sample decides"
