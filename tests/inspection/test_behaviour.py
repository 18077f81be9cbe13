"""Vibration, delay, a bias that runs or is taken off, and noise, put into a recording, are found with their size."""

import importlib
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.inspection import examine
from levelhead.inspection.findings import Finding
from levelhead.inspection.spectrum import lines, spectrum
from levelhead.inspection.unknown import unknown
from levelhead.inspection.verdict import tilt_between
from levelhead.recording import Recording

RATE = 200.0


@pytest.fixture(scope="module")
def hand() -> Recording:
    return lh.simulate.recording("MPU-6050", "hand", duration=60.0, seed=1)


def rest(bias: np.ndarray, seconds: float = 120.0, gyr: float = 0.0015, acc: float = 0.03) -> Recording:
    rng = np.random.default_rng(0)
    t = np.arange(int(seconds * RATE)) / RATE
    rates = np.broadcast_to(bias, (len(t), 3)) + rng.normal(0.0, gyr, (len(t), 3))
    return Recording(t, rates, np.array([0.0, 0.0, 9.80665]) + rng.normal(0.0, acc, (len(t), 3)))


def found(recording: Recording, name: str) -> Finding | None:
    return next((one for one in examine(recording).findings if one.name == name), None)


def test_a_line_has_its_frequency_and_its_rms() -> None:
    t = np.arange(20_000) / RATE
    values = np.random.default_rng(1).normal(0.0, 0.2, (len(t), 3))
    assert lines(spectrum(values, RATE), 0.0) == []
    values[:, 1] += 0.8 * np.sqrt(2.0) * np.sin(2 * np.pi * 63.0 * t)
    (one,) = lines(spectrum(values, RATE), 0.1)
    assert one.frequency == pytest.approx(63.0, abs=RATE / 512) and one.rms == pytest.approx(0.8, rel=0.05)


def test_a_motor_is_named(hand: Recording) -> None:
    shaken = hand.acc + 2.0 * np.sin(2 * np.pi * 31.0 * hand.t)[:, None]
    one = found(Recording(hand.t, hand.gyr, shaken), "vibration_acc")
    assert one is not None and re.search(r"at 3[01]\.\d Hz", one.what), one
    assert found(hand, "vibration_acc") is None and found(hand, "aliasing_acc") is None


def test_a_delay_has_its_sign_and_its_size(hand: Recording) -> None:
    assert hand.truth is not None
    gravity = Rotation.from_quat(hand.truth.quat, scalar_first=True).inv().apply([0.0, 0.0, 9.80665])
    acc = gravity + 0.3 * (hand.acc - gravity)  # a hand that hurries less
    late = Recording(hand.t[8:], hand.gyr[8:], acc[:-8])
    one = found(late, "sensor_delay")
    assert one is not None and "later" in one.what
    assert 50 <= float(re.search(r"(\d+) ms", one.what)[1]) <= 110  # type: ignore[index]
    assert found(hand, "sensor_delay") is None


@pytest.mark.slow
def test_a_bias_that_runs() -> None:
    t = np.arange(int(120 * RATE)) / RATE
    run = np.column_stack([np.radians(0.5) * (1.0 - np.exp(-t / 40.0)), 0 * t, 0 * t])
    one = found(rest(run), "bias_runs")
    assert one is not None and "(x)" in one.what
    assert found(rest(np.radians([0.5, -0.3, 0.2])), "bias_runs") is None


@pytest.mark.slow
def test_a_bias_that_is_taken_off() -> None:
    assert found(rest(np.zeros(3)), "corrected_gyro") is not None
    assert found(rest(np.radians([0.5, -0.3, 0.2])), "corrected_gyro") is None


@pytest.mark.slow
def test_noise_beside_chips() -> None:
    still = np.radians([0.5, -0.3, 0.2])
    assert found(rest(still), "noise_gyr") is None
    assert "noisier" in str(found(rest(still, gyr=0.02), "noise_gyr"))
    assert "quieter" in str(found(rest(still, gyr=0.00001), "noise_gyr"))


def test_what_is_not_known_and_which_motion_would_tell(hand: Recording) -> None:
    words = " | ".join(examine(rest(np.zeros(3))).unknown)
    assert "turn it slowly by 90° about each axis" in words and "six sides" in words and "leave it" not in words
    words = " | ".join(examine(hand).unknown)
    assert "about each axis" not in words and "no magnetometer" in words
    late = Recording(hand.t[24:], hand.gyr[:-24], hand.acc[24:])  # gravity's turn and the rate hardly correlate
    assert "about each axis" not in " | ".join(examine(late).unknown)


def test_the_lack_of_the_native_engine_is_named(hand: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    known = list(unknown(hand, set()))
    module = importlib.import_module("levelhead.inspection.unknown")  # the package has a function of that name
    monkeypatch.setattr(module, "has_imu", lambda *_, **__: False)
    more = set(unknown(hand, set())) - set(known)
    assert [sentence.partition(":")[0] for sentence in more] == [
        "jumps of the gyroscope's bias, and scale errors of some percent"
    ]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_expectation_is_near_the_true_tilt(seed: int) -> None:
    """At least the filter's σ, and more where the mean forces of its track show more."""
    hand = lh.simulate.recording("MPU-6050", "hand", duration=60.0, seed=seed)
    report = examine(hand)
    assert report.sigma_tilt is not None and report.heading_drift is not None and hand.truth is not None
    track = lh.fuse(hand)
    late = track.t > 5.0
    true = np.degrees(np.sqrt((tilt_between(track.quat, hand.truth.quat)[late] ** 2).mean()))
    assert track.sigma_tilt is not None
    assert report.sigma_tilt > 0.9 * np.degrees(np.median(track.sigma_tilt))
    assert 0.5 < true / report.sigma_tilt < 1.5
