"""The walk of a foot beside its truth: simulated in closed form, a loop that closes, strides with motion capture."""

import csv
import os
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.gaits.stance import find_stances
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.simulate.foot import PERIOD

WALKS = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "walks"
needs_walks = pytest.mark.skipif(
    not WALKS.is_dir(), reason=f"no recordings in {WALKS}; LEVELHEAD_DATA names their folder"
)
RATE = 204.8  # Hz, of the strides with motion capture
TURN_ON_PLACE = 13  # the stride in which the left foot turns: its markers move by 0.27 to 0.47 m


def walk(climb=0.0, seed=1, chip="LSM6DSO32"):
    motion = simulate.foot(20, 200.0, climb=climb)
    return motion, simulate.observe(motion, simulate.imu(chip), seed)


def rows_of(name):
    return list(csv.reader((WALKS / f"gaitmap_{name}_sample.csv").read_text().splitlines()))


def test_the_motion_of_a_foot_agrees_with_itself():
    motion = simulate.foot(5, 1000.0, climb=0.1)
    inner, step = slice(5, -5), 1e-3
    for value, rate in ((motion.position, motion.velocity), (motion.velocity, motion.acceleration)):
        np.testing.assert_allclose(np.gradient(value, step, axis=0)[inner], rate[inner], atol=0.02)
    turned = lh.fuse(simulate.observe(motion, simulate.Imu()), lh.GyroIntegration(), guard=None)
    assert np.abs(np.einsum("ni,ni->n", turned.quat, motion.quat)).min() > np.cos(np.radians(0.2))
    np.testing.assert_allclose(motion.position[-1], [0.0, 0.0, 0.5], atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_strides_and_loop_of_a_simulated_walk(seed):
    _, recording = walk(seed=seed)
    found = lh.gait(recording)
    assert len(found.strides.length) == 20
    np.testing.assert_allclose(found.strides.length, 1.3, rtol=0.015)
    assert found.gap < 0.005 * found.distance
    assert found.strides.level.all()
    assert np.all(np.abs(found.track.position[-1]) < 3.0 * found.track.sigma_position[-1] + 0.01)
    standing = np.linalg.norm(recording.truth.velocity[found.standing], axis=1)
    assert np.mean(standing < 0.1) > 0.97


@pytest.mark.parametrize("climb", [0.17, 0.06])
def test_stairs_and_ramps_stay(climb):
    _, recording = walk(climb)
    found = lh.gait(recording)
    np.testing.assert_allclose(found.strides.rise, climb, atol=0.02)
    assert not found.strides.level.any()


def test_the_height_of_a_level_floor_is_inferred_unless_forbidden():
    _, recording = walk()
    free = lh.gait(recording, level=False)
    assert not free.strides.level.any() and free.track.position[-1, 2] != 0.0
    assert abs(free.track.position[-1, 2]) < 3.0 * free.track.sigma_position[-1, 2]


def test_zero_velocity_has_no_direction():
    """A velocity of a receiver makes a relative heading unknown, that of a standing foot leaves it as it is."""
    _, recording = walk()
    found = lh.gait(recording).track
    assert found.relative and np.degrees(found.sigma_heading[-1]) < 3.0


def test_a_stream_takes_zero_velocities_like_a_recording():
    _, recording = walk()
    recording = recording[:2000]
    stood = find_stances(recording).standing
    live = lh.Stream(lh.ESKF())
    for i in range(len(recording)):
        live.update(gyr=recording.gyr[i], acc=recording.acc[i], dt=0.005)
        if stood[i]:
            live.update_zero_velocity(0.1)
    assert live.nav_state is not None
    np.testing.assert_allclose(live.nav_state.position, recording.truth.position[-1], atol=0.3)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: simulate.recording("ICM-20948", "walking", duration=20), "needs a sensor on a foot"),
        (lambda: simulate.recording("ICM-20948", "still", duration=10), "never stands between two movements"),
        (lambda: walk()[1][800:2000:5], "40 samples a second; a stance shows from 50"),
        (lambda: "walk.csv", "takes a Recording, not str"),
    ],
    ids=["pocket", "table", "slow", "path"],
)
def test_position_that_nothing_bounds_is_refused(wrong, message):
    with pytest.raises(lh.LevelheadError, match=message):
        lh.gait(wrong())


@pytest.mark.parametrize(
    ("options", "message"),
    [({"sigma": 0.0}, r"zero_velocity.sigma is 0"), ({"t": [1.0, 1.0]}, "zero_velocity.t does not increase")],
)
def test_wrong_instants_are_named(options, message):
    with pytest.raises(lh.LevelheadError, match=message):
        lh.ZeroVelocity(**({"t": [0.0, 1.0]} | options))


@needs_walks
def test_a_loop_of_a_real_walk_closes():
    """23.5 m; the program that came with the recording closes it to 0.35 %."""
    found = lh.gait(lh.read(WALKS / "short_walk.csv"))
    assert found.gap < 0.003 * 23.5
    assert len(found.strides.length) == 16


@needs_walks
@pytest.mark.parametrize("foot", ["left", "right"])
def test_strides_beside_motion_capture(foot):
    sensors, axes = rows_of("imu")[:2]
    table = np.genfromtxt(WALKS / "gaitmap_imu_sample.csv", delimiter=",", skip_header=2)
    column = {axis: i for i, (sensor, axis) in enumerate(zip(sensors, axes, strict=True)) if sensor.startswith(foot)}
    acc, gyr = (table[:, [column[f"{kind}_{axis}"] for axis in "xyz"]] for kind in ("acc", "gyr"))
    found = lh.gait(lh.Recording(np.arange(len(table)) / RATE, np.radians(gyr), acc))
    head = rows_of("mocap")[0][1:]
    markers = np.genfromtxt(WALKS / "gaitmap_mocap_sample.csv", delimiter=",", skip_header=2)[:, 1:] / 1000.0
    errors = []
    for number, side, start, end, *_ in rows_of("stride_events")[1:]:
        if side != foot or int(number) == TURN_ON_PLACE:
            continue
        rows = np.array([float(start), float(end)])
        true = []
        for marker in ("FCC", "FM5"):
            level = markers[:, [i for i, name in enumerate(head) if name == f"{foot[0].upper()}_{marker}"][:2]]
            at = np.stack([np.interp(rows / RATE * 100.0, np.arange(len(level)), one) for one in level.T], axis=1)
            true.append(np.hypot(*(at[1] - at[0])))
        estimate = np.diff(found.track.position[rows.astype(int)], axis=0)[0]
        errors.append(np.hypot(*estimate[:2]) / np.mean(true) - 1.0)
    assert len(errors) >= 27
    assert np.sqrt(np.mean(np.square(errors))) < 0.03


def test_a_sensor_without_noise_has_stances_too():
    motion = simulate.foot(20, 200.0)
    found = lh.gait(simulate.observe(motion, simulate.Imu()))
    np.testing.assert_allclose(found.strides.length, 1.3, rtol=0.01)


def test_a_walk_while_it_happens():
    motion, recording = walk()
    live, standing, now = lh.GaitStream(), [], None
    for gyr, acc in zip(recording.gyr, recording.acc, strict=True):
        now = live.update(gyr=gyr, acc=acc, dt=0.005)
        standing.append(live.standing)
    assert now is not None
    assert np.linalg.norm(now.position - motion.position[-1]) < 0.015 * 26.0
    assert np.mean(standing == find_stances(recording).standing) > 0.9
    assert np.linalg.norm(motion.velocity[standing], axis=1).max() < 0.15


def test_a_pocket_has_no_stance_live():
    recording = simulate.recording("ICM-20948", "walking", duration=10)[400:]
    live = lh.GaitStream()
    for gyr, acc in zip(recording.gyr, recording.acc, strict=True):
        live.update(gyr=gyr, acc=acc, dt=0.01)
        assert not live.standing


@needs_walks
def test_a_real_loop_live():
    """By its stamps: the log lost 1.5 % of its samples, which a constant interval would take from the way."""
    recording = lh.read(WALKS / "short_walk.csv")
    live, first, now = lh.GaitStream(), None, None
    for t, gyr, acc in zip(recording.t, recording.gyr, recording.acc, strict=True):
        now = live.update(gyr, acc, t=t)
        first = first or now
    off = np.subtract(now.position, first.position)
    assert np.linalg.norm(off) < 0.008 * 23.5
    assert np.all(np.abs(off) < 2.0 * np.array(now.sigma_position))


@pytest.mark.parametrize("delay", [0.0, GROUP_DELAY])
def test_strides_are_long_by_a_delay_of_the_gyroscope_alone(delay):
    """A gyroscope is taken to be late by its low-pass filter; a perfect one is not, so its strides are 0.25 % long."""
    fine = simulate.foot(20, 10000.0)
    late = round(delay * 10000.0)
    rows = np.arange(100, len(fine.t), 50)
    recording = lh.Recording(fine.t[rows], fine.gyr[rows - late], fine.specific_force[rows])
    position = lh.gait(recording).track.position
    middles = np.searchsorted(recording.t, 4.0 + PERIOD * np.arange(21))
    ways = [np.hypot(*np.diff(p[middles], axis=0)[:, :2].T) for p in (position, fine.position[rows])]
    assert np.mean(ways[0] / ways[1]) - 1.0 == pytest.approx(0.0 if delay else 0.0025, abs=0.0008)
