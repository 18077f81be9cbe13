"""The offset of a raw magnetometer, found in a stream: against simulated iron of known size, and on real recordings."""

from dataclasses import replace

import numpy as np
import pytest
from tests.reference.engines import EVERY_ENGINE

import levelhead as lh
from levelhead import simulate
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.reference import align_sensor
from levelhead.filters.health import IRON_FOUND
from levelhead.guard import Guard, iron
from levelhead.kernels import quat
from levelhead.kernels.vec3 import Vec3
from levelhead.rotations import from_rotvec, to_scipy

KEPT = Guard(iron=0.0)
FIELD = np.array([0.0, 19.0, -45.0])


def second_half(recording, track):
    """Total error in ° without the best constant rotation, by which the offset is known where the motion shows one."""
    half = len(recording) // 2
    return measure_errors(recording[half:], track.quat[half:], False, None, align_sensor(recording)).rotated


def found(track):
    return np.flatnonzero(track.health & np.uint32(IRON_FOUND))


def test_the_offset_of_a_perfect_sensor():
    """Without noise the least squares give the offset; a turn of 90° about an axis of its own ends each pair."""
    rng, offset, state = np.random.default_rng(1), np.array([30.0, -80.0, 55.0]), iron.NO_IRON
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(60):
        axis = rng.normal(size=3)
        rate = axis / np.linalg.norm(axis) * np.pi / 2.0
        for _ in range(100):
            attitude = np.array(quat.multiply(quat.Quat(*attitude), quat.Quat(*from_rotvec(0.01 * rate))))
            mag = Vec3(*(to_scipy(attitude).apply(FIELD, inverse=True) + offset))
            up = Vec3(*to_scipy(attitude).apply([0.0, 0.0, 1.0], inverse=True))
            state = iron.update_iron(Guard(), state, up, Vec3(*rate), mag, 0.01)
    assert state.known
    np.testing.assert_allclose(state.offset, offset, atol=0.1)  # the prior pulls by a part in a thousand


@pytest.mark.parametrize("name", ["EKF", "Mahony", "Madgwick", "Complementary"])
def test_heading_heals_itself(name):
    """Two minutes in the hand with a raw chip: found once, and from then on heading is by the field again."""
    recording = simulate.recording("ICM-20948", "hand", 120.0, seed=3)
    kept, taken = (lh.fuse(recording, name, guard=guard) for guard in (KEPT, Guard()))
    (row,) = found(taken)
    assert 5.0 < recording.t[row] - recording.t[0] < 60.0
    np.testing.assert_array_equal(taken.quat[:row], kept.quat[:row])
    assert second_half(recording, taken) < 0.5 * second_half(recording, kept)


def test_a_calibrated_magnetometer_is_left_as_it_is():
    for style in ("hand", "walking", "drone", "robot"):
        board = simulate.imu("ICM-20948")
        board = replace(board, mag=replace(board.mag, turn_on_bias=(0.0, 0.0, 0.0)))
        recording = simulate.observe(simulate.motion(2, 60.0, 100.0, style=style), board, 2)
        kept, taken = (lh.fuse(recording, "EKF", guard=guard) for guard in (KEPT, Guard()))
        np.testing.assert_array_equal(taken.quat, kept.quat)


def test_a_filter_that_learns_iron_keeps_it():
    recording = simulate.recording("ICM-20948", "hand", 60.0, seed=3)
    assert not len(found(lh.fuse(recording)))


@EVERY_ENGINE
def test_a_stream_is_a_recording(engine):
    recording = simulate.recording("ICM-20948", "hand", 40.0, seed=3)
    live = lh.Stream("Mahony")
    for t, gyr, acc, mag in zip(recording.t, recording.gyr, recording.acc, recording.mag, strict=True):
        live.update(gyr, acc, mag, t=t)
    track = lh.fuse(recording, "Mahony", engine=engine)
    assert len(found(track)) == 1
    np.testing.assert_array_equal(live.quat, track.quat[-1])


def test_real_recordings_with_three_fields_of_iron(data_dir):
    """Of the second half of each recording, by which the offset is known where the motion shows one."""
    gains = []
    for path in sorted((data_dir / "broad").glob("*undisturbed*"))[:8]:
        recording = load_recording(path, True)
        strength = float(np.nanmedian(np.linalg.norm(recording.mag, axis=1)))
        recording = replace(recording, mag=recording.mag + 3.0 * strength * np.array([0.6, -0.64, 0.48]))
        kept, taken = (second_half(recording, lh.fuse(recording, "EKF", guard=guard)) for guard in (KEPT, Guard()))
        gains.append(taken / kept)
    assert np.exp(np.mean(np.log(gains))) < 0.7


def test_turns_about_one_axis_leave_the_offset_along_it_alone():
    """An hour about one axis with noise: the prior stays, so that nothing walks where nothing is measured."""
    rng, state, angle, axis = np.random.default_rng(2), iron.NO_IRON, 0.0, np.array([0.6, 0.64, 0.48])
    for _ in range(36_000):
        angle += 0.1
        mag = to_scipy(from_rotvec(angle * axis)).apply(FIELD, inverse=True) + 0.3 * rng.normal(size=3)
        state = iron.update_iron(Guard(), state, Vec3(*axis), Vec3(*axis), Vec3(*mag), 0.1)
    assert not state.known
    assert np.linalg.norm(state.offset) < 2.0
