"""Single wrong rates are not integrated; a rate that did jump is, to the last bit of its rotation."""

import math

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.bench.datasets import load_recording
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.filters.health import GYR_SPIKE
from levelhead.guard.detectors import GROUP_DELAY
from levelhead.guard.rate_jump import LEVER, MOST_SPIKES, first_rate, update_jump
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Recording

DT = 0.01


def accepted(rates, clipped=False, forces=None):
    """The rates about x that stand for these samples, and the samples that are known to follow a spike."""
    forces = np.full(len(rates), 9.81) if forces is None else forces
    jump, found, spikes = first_rate(Vec3(rates[0], 0.0, 0.0), Vec3(0.0, 0.0, forces[0])), [rates[0]], []
    for k, (rate, force) in enumerate(zip(rates[1:], forces[1:], strict=True), 1):
        jump = update_jump(jump, Vec3(rate, 0.0, 0.0), Vec3(0.0, 0.0, force), clipped, DT)
        found.append(jump.rate.x + jump.returned.x)
        if jump.spikes > 0:
            spikes.append(k)
    return np.array(found), spikes


def test_a_single_wrong_rate_is_replaced_by_the_one_before():
    rates = np.sin(np.arange(100) * DT)
    wrong = rates.copy()
    wrong[40] += 8.7
    found, spikes = accepted(wrong)
    assert spikes == [41]
    assert found[40] == rates[39]
    np.testing.assert_array_equal(np.delete(found, 40), np.delete(rates, 40))


def test_a_jump_that_lasts_is_integrated_whole():
    rates = np.r_[np.zeros(40), np.full(60, 8.7)]
    found, spikes = accepted(rates)
    assert spikes == []
    assert found[40] == 0.0
    assert found.sum() == pytest.approx(rates.sum(), rel=1e-15)
    np.testing.assert_array_equal(found[42:], rates[42:])


def test_a_body_that_shakes_is_believed_in_the_end():
    """Rates that jump to and fro are spikes a few times, then the motion of the body."""
    rates = np.r_[np.zeros(40), 8.7 * (-1.0) ** np.arange(40)]
    found, spikes = accepted(rates)
    assert len(spikes) <= MOST_SPIKES + 1
    np.testing.assert_array_equal(found[50:], rates[50:])


def test_small_jumps_and_a_known_full_scale_are_no_spikes():
    quiet = np.zeros(40)
    quiet[20] = 0.019 / DT
    assert accepted(quiet)[0][20] == quiet[20]
    quiet[20] = 8.7
    assert accepted(quiet, clipped=True)[0][20] == 8.7


@pytest.mark.parametrize("late", [0, 1])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_rate_that_the_accelerometer_feels_is_the_bodys(share, late):
    """A blow about an axis at ``LEVER``: the force that it needs, at the jump or one sample later, and a tenth less."""
    rates, forces = np.zeros(100), np.full(100, 9.81)
    rates[40] = 8.7
    forces[40 + late :] += share * LEVER * rates[40] / DT
    found, spikes = accepted(rates, forces=forces)
    assert spikes == ([41] if share < 1.0 else [])
    assert found.sum() == pytest.approx(rates.sum() if share > 1.0 else 0.0, abs=1e-15)


@pytest.mark.parametrize("filter_", [lh.Mahony(), lh.EKF(), lh.ESKF()])
def test_heel_strikes_are_integrated(filter_, data_dir):
    """A shoe in gaitmap's data set: eleven rates at heel strikes were held back as spikes, 6.8° of drift for 2.6°."""
    place = data_dir / "truth" / "gaitmap" / "gaitmap_foot_right.npz"
    if not place.is_file():
        pytest.skip("gaitmap is not here")
    track = lh.fuse(load_recording(place, with_mag=False), filter_)
    assert not np.any(track.health & GYR_SPIKE)


@pytest.mark.parametrize("filter_", [lh.Mahony(), lh.EKF(), lh.ESKF()])
def test_spikes_cost_no_filter_anything(filter_):
    """Two spikes of 500 deg/s a second for ten seconds; without the guard they turn every filter by 4° each."""
    sound = simulate.recording("BMI160", "walking", 60.0, seed=2, mag="HMC5883L")
    faulted = simulate.apply_fault(sound, simulate.parse_fault("gyr_spikes"))
    wrong = np.flatnonzero(np.any(faulted.recording.gyr != sound.gyr, axis=1))
    before, after = lh.fuse(sound, filter_), lh.fuse(faulted.recording, filter_)
    apart = np.degrees(split_error(error_quaternion(after.quat, before.quat)).total)
    unguarded = lh.fuse(faulted.recording, filter_, guard=None)
    worst = np.degrees(split_error(error_quaternion(unguarded.quat, before.quat)).total).max()
    print(f"{type(filter_).__name__}: {len(wrong)} spikes; {apart.max():.2f}° apart, {worst:.1f}° without the guard")
    assert apart.max() < 0.5
    assert worst > 4.0
    assert set(wrong + 1) == set(np.flatnonzero(after.health & GYR_SPIKE))


def test_a_sensor_that_is_hit_is_not_held_back():
    """Jumps from rest to a fast turn and back: the rotation of the held sample comes with the next."""
    gyr = np.zeros((400, 3))
    gyr[200:210, 2] = math.radians(500.0)
    rec = Recording(np.arange(400) * DT, gyr, np.tile([0.0, 0.0, 9.80665], (400, 1)))
    guarded = lh.fuse(rec, lh.Mahony(kp=1e-9, ki=0.0))
    share = 0.5 - GROUP_DELAY / DT
    yaw = np.cumsum(DT * (gyr - share * np.diff(gyr, axis=0, prepend=0.0))[:, 2])
    apart = np.degrees(np.unwrap(guarded.euler(degrees=False)[:, 2]) - yaw)
    assert apart[200] == pytest.approx(-5.0 * (1.0 - share), abs=1e-3)  # held back; the way back is no surprise
    assert np.abs(np.delete(apart, [200, 201])).max() < 1e-3
    assert not (guarded.health & GYR_SPIKE).any()
