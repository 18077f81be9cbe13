"""Triad: the tilt-compensated compass without its angles, and the field believed first."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference import textbook

import levelhead as lh
from levelhead.filters import triad

G, DIP = 9.80665, 67.0
FIELD = 49.0 * np.array([0.0, np.cos(np.radians(DIP)), -np.sin(np.radians(DIP))])


@pytest.fixture(scope="module")
def noisy():
    rng = np.random.default_rng(2)
    n = 500
    true = Rotation.random(n, rng)
    acc = true.inv().apply([0, 0, G]) + rng.normal(0, 1, (n, 3))
    mag = true.inv().apply(FIELD) + rng.normal(0, 1, (n, 3))
    return true, lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), acc, mag)


def angle(a, b):
    return (a * b.inv()).magnitude()


def test_gravity_first_is_the_tilt_compensated_compass(noisy):
    _, rec = noisy
    track = lh.fuse(rec, lh.Triad())
    expected = Rotation.concatenate([textbook.compass(a, m) for a, m in zip(rec.acc, rec.mag, strict=True)])
    assert angle(track.as_rotation(), expected).max() < 1e-12


def test_without_a_field_it_is_the_accelerometers_tilt(noisy):
    _, rec = noisy
    six = lh.Recording(rec.t, rec.gyr, rec.acc)
    np.testing.assert_array_equal(lh.fuse(six, lh.Triad()).quat, lh.fuse(six, lh.AccelTilt()).quat)


def test_the_first_vector_comes_out_exactly_the_second_as_far_as_it_can(noisy):
    _, rec = noisy
    gravity = lh.fuse(rec, lh.Triad()).as_rotation()
    field = lh.fuse(rec, lh.Triad(field_first=True, dip=DIP)).as_rotation()
    up, north = np.array([0.0, 0.0, 1.0]), FIELD / np.linalg.norm(FIELD)
    acc, mag = (v / np.linalg.norm(v, axis=1)[:, None] for v in (rec.acc, rec.mag))
    np.testing.assert_allclose(gravity.apply(acc) - up, 0.0, atol=1e-14)
    np.testing.assert_allclose(field.apply(mag) - north, 0.0, atol=1e-14)
    np.testing.assert_allclose(field.apply(acc)[:, 0], 0.0, atol=1e-14)
    np.testing.assert_allclose(gravity.apply(mag)[:, 0], 0.0, atol=1e-14)


def test_who_accelerates_does_better_with_the_field_first():
    """Noise of the accelerometer along all axes, none of the field: only one angle suffers instead of two."""
    rng = np.random.default_rng(5)
    n = 500
    acc = rng.normal(0, 2, (n, 3)) + [0, 0, G]
    rec = lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), acc, np.tile(FIELD, (n, 1)))
    rms = [np.sqrt(np.mean(lh.fuse(rec, p).as_rotation().magnitude() ** 2))
           for p in (lh.Triad(), lh.Triad(field_first=True, dip=DIP))]  # fmt: skip
    assert rms[1] < rms[0]


@pytest.mark.parametrize("params", [lh.Triad(), lh.Triad(field_first=True, dip=DIP)], ids=str)
def test_a_missing_reading_keeps_the_last_attitude(noisy, params):
    true, rec = noisy
    acc, mag = rec.acc.copy(), rec.mag.copy()
    acc[100], mag[200:202] = np.nan, np.nan
    track = lh.fuse(lh.Recording(rec.t, rec.gyr, acc, mag), params)
    for row, kept in ((100, 99), (200, 199), (201, 199)):
        np.testing.assert_array_equal(track.quat[row], track.quat[kept])
    assert np.degrees(angle(track.as_rotation(), true))[[99, 101, 202]].max() < 60.0


def test_it_is_settled_at_once():
    assert triad.FILTER.settles == (0.0, 0.0)
    assert triad.gains(lh.Triad(), None, 0.01) == (1.0, 0.0, 1.0, 0.0)
