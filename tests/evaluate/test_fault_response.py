"""The figures of a response, from tracks whose errors are known because they were made."""

import numpy as np
import pytest

from levelhead import simulate
from levelhead.evaluate.fault_response import measure_response
from levelhead.filters import health
from levelhead.recording import Recording
from levelhead.rotations import about_up, product
from levelhead.track import Track

SIGMA = np.radians(1.0)


@pytest.fixture(scope="module")
def faulted():
    sound = simulate.recording("BMI160", "hand", 60, seed=4, mag="HMC5883L")
    return sound, simulate.apply_fault(sound, simulate.parse_fault("gyr_stuck@20+10"))


def track_of(recording, degrees=None, sigma=SIGMA, bits=None):
    """The truth turned about the vertical by so many degrees at each row."""
    quat = recording.truth.quat
    if degrees is not None:
        quat = np.vstack([product(about_up(np.radians(a)), q) for a, q in zip(degrees, quat, strict=True)])
    n = len(recording)
    return Track(
        recording.t, quat, sigma=np.full((n, 3), sigma), health=np.zeros(n, np.uint32) if bits is None else bits
    )


def test_error_recovery_health_and_honesty(faulted):
    sound, made = faulted
    off = np.zeros(6000)
    off[2000:3500] = 10.0  # from the start of the fault until 5 s after its end
    bits = np.zeros(6000, np.uint32)
    bits[2150:3000] = health.GYR_STUCK | health.AT_REST
    bits[100] = health.GAP  # before the fault: nothing that it did
    one = measure_response(made, track_of(made.recording, off, bits=bits), sound, track_of(sound), "made")
    assert one.heading == pytest.approx(10.0) and one.tilt == pytest.approx(0.0, abs=1e-6)
    assert (one.usual_heading, one.tilt_recovery) == (pytest.approx(0.0, abs=1e-6), 0.0)
    assert one.heading_recovery == pytest.approx(4.99, abs=1e-6)
    assert (list(one.said), one.said_after) == (["gyr_stuck"], pytest.approx(1.5, abs=1e-6))
    assert one.beyond == pytest.approx(1500 / 4000) and one.usual_beyond == 0.0
    assert one.is_said and one.is_recovered and not one.harmless and one.growth == pytest.approx(1.0)


def test_a_larger_sigma_says_so_and_is_honest(faulted):
    sound, made = faulted
    sigma = np.full((6000, 3), SIGMA)
    sigma[2000:3500] *= 3.0
    off = np.zeros(6000)
    off[2000:3500] = 10.0
    one = measure_response(made, track_of(made.recording, off, sigma), sound, track_of(sound), "made")
    assert one.growth == pytest.approx(3.0) and one.is_said and one.said_after is None and one.beyond == 0.0


@pytest.mark.slow
def test_what_never_ends_what_is_lost_and_what_is_harmless(faulted):
    sound, made = faulted
    off = np.where(np.arange(6000) >= 2000, 10.0, 0.0)
    one = measure_response(made, track_of(made.recording, off), sound, track_of(sound), "made")
    assert one.heading_recovery is None and not one.is_recovered and one.to_dict()["heading_recovery_s"] is None
    track = track_of(made.recording)
    quat = np.array(track.quat)
    quat[2500:] = np.nan
    one = measure_response(made, Track(track.t, quat), sound, Track(sound.t, sound.truth.quat), "made")
    assert one.tilt == 180.0 and one.tilt_recovery is None and one.beyond is None and one.growth is None
    small = np.where(np.arange(6000) >= 2000, 1.9, 0.0)
    one = measure_response(made, track_of(made.recording, small), sound, track_of(sound), "made")
    assert one.harmless and one.is_recovered and not one.is_said


@pytest.mark.slow
def test_without_truth_the_run_without_the_fault_is_the_reference(faulted):
    sound, made = faulted
    blind = Recording(sound.t, sound.gyr, sound.acc, sound.mag)
    unseen = simulate.apply_fault(blind, made.fault)
    usual = track_of(sound, np.full(6000, 40.0))  # wrong by 40°, which nobody knows
    off = np.full(6000, 40.0)
    off[2000:3000] += 7.0
    one = measure_response(unseen, track_of(made.recording, off), blind, usual, "made")
    assert one.heading == pytest.approx(7.0) and one.usual_heading == pytest.approx(0.0, abs=1e-6)
    assert one.heading_recovery == 0.0
