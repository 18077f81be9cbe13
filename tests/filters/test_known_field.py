"""The earth's field of a place as a prior of ESKF: what it tells of north, its σ, and that it never tilts anything."""

import numpy as np
import pytest
from tests.reference.engines import COMPILED_LATE, NATIVE, PYTHON

import levelhead as lh
from levelhead import filters, simulate
from levelhead.evaluate import evaluate
from levelhead.rotations import to_scipy

STRENGTH, DIP = 48.85, 67.1  # µT and degrees, of simulations
PLACE = lh.ESKF(field_strength=STRENGTH, field_dip=DIP)


def robot(seed, iron, off, seconds):
    """A robot that turns on the level, with iron of so many fields on its board, in a room whose field is off."""
    direction = np.random.default_rng(seed).normal(size=3)
    hard = iron * STRENGTH * direction / np.linalg.norm(direction)
    field = (0.0, 19.0 + off[0] * STRENGTH, -45.0 + off[1] * STRENGTH)
    board = simulate.imu("ICM-20948", iron=simulate.Iron(hard=tuple(hard)))
    return simulate.observe(simulate.motion(seed, seconds, 100.0, style="robot"), board, seed, field=field)


def north_error(recording, params):
    """° of north at the end, and its σ."""
    track = lh.fuse(recording, params)
    turn = to_scipy(track.quat[-1]) * to_scipy(recording.truth.quat[-1]).inv()
    east, north, _ = turn.apply([0.0, 1.0, 0.0])
    off = (track.north.azimuth - np.arctan2(east, north) + np.pi) % (2.0 * np.pi) - np.pi
    return np.degrees(off), np.degrees(track.north.sigma)


def test_north_of_a_robot_with_iron_is_known_sooner():
    """Five fields of iron; the room's field is off by 12 % of the strength in either part, as buildings have it."""
    rng, errors = np.random.default_rng(5), []
    for seed in range(8):
        recording = robot(seed, 5.0, rng.normal(0.0, 0.12, 2), 10.0)
        errors.append([north_error(recording, params) for params in (lh.ESKF(), PLACE)])
    off, sigma = np.moveaxis(np.array(errors), 2, 0)
    without, with_place = np.sqrt(np.mean(off**2, axis=0))
    assert with_place < 0.4 * without
    assert np.median(sigma[:, 1]) < 0.6 * np.median(sigma[:, 0])
    assert np.abs(off[:, 1] / sigma[:, 1]).max() < 2.0


@pytest.mark.parametrize("style", ["hand", "drone"])
def test_a_room_that_is_off_by_two_sigma_does_little_harm(style):
    """What the motion tells of the field counts more than the prior."""
    field = (0.0, 19.0 - 0.3 * STRENGTH, -45.0 + 0.3 * STRENGTH)
    board = simulate.imu("ICM-20948")
    recording = simulate.observe(simulate.motion(3, 60.0, 100.0, style=style), board, 3, field=field)
    for params in (lh.ESKF(), PLACE):
        found = lh.fuse(recording, params)
        assert abs(north_error(recording, params)[0]) < 3.0
        level, up = found.calibration.field.value
        assert level == pytest.approx(field[1], abs=3.0) and up == pytest.approx(field[2], abs=3.0)
    known = filters.offline()._replace(field_strength=STRENGTH, field_dip=DIP)
    with_place, without = (evaluate(recording, lh.smooth(recording, one)) for one in (known, filters.offline()))
    assert with_place.tilt < 1.05 * without.tilt and with_place.total_aligned < 1.1 * without.total_aligned


def test_the_prior_is_taken_once():
    """A still sensor learns for a minute, and the prior counts as much as at the start."""
    still = simulate.recording("ICM-20948", "still", duration=60.0, seed=2)
    field = lh.fuse(still, PLACE).calibration.field
    assert field.sigma[1] == pytest.approx(PLACE.field_sigma * STRENGTH, rel=0.15)
    assert field.value[1] == pytest.approx(-45.0, abs=2.0)


def test_the_horizon_is_left_to_the_gyroscope():
    """Iron of three fields, and a dip of the other hemisphere: the horizon moves by 0.2° at most."""
    recording = robot(1, 3.0, (0.0, 0.0), 60.0)
    wrong = lh.ESKF(field_strength=60.0, field_dip=-60.0)
    plain, odd = (lh.fuse(recording, params) for params in (lh.ESKF(), wrong))
    assert np.abs(odd.sigma[-1, :2] / plain.sigma[-1, :2] - 1.0).max() < 0.1
    tilt = [to_scipy(track.quat).apply([0.0, 0.0, 1.0], inverse=True) for track in (plain, odd)]
    assert np.degrees(np.linalg.norm(tilt[1] - tilt[0], axis=1)).max() < 0.2


@pytest.mark.parametrize("engine", [PYTHON, NATIVE, COMPILED_LATE])
def test_a_stream_is_a_recording(engine):
    recording = robot(0, 1.0, (0.1, -0.1), 12.0)
    live = lh.Stream(PLACE)
    for t, gyr, acc, mag in zip(recording.t, recording.gyr, recording.acc, recording.mag, strict=True):
        live.update(gyr, acc, mag, t=t)
    np.testing.assert_array_equal(live.quat, lh.fuse(recording, PLACE, engine=engine).quat[-1])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"field_strength": -1.0}, "field_strength = -1 is not allowed"),
        ({"field_dip": 91.0}, "field_dip = 91 is not allowed"),
        ({"field_sigma": 0.0}, "field_sigma = 0 is not allowed"),
    ],
)
def test_no_field_of_the_earth(wrong, message):
    with pytest.raises(lh.LevelheadError, match=message):
        lh.ESKF(**wrong)
