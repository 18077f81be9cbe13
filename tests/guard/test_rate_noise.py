"""A gyroscope that hangs within a digit is found by the noise that it has no more; one with noise never is."""

import math

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate import evaluate
from levelhead.filters.health import GYR_STUCK
from levelhead.guard.rate_noise import NO_NOISE, SURE, is_silent, update_noise
from levelhead.kernels.vec3 import Vec3
from levelhead.recording import Recording, Truth
from levelhead.units import DEGREE, GRAVITY

DT = 0.01
DIGIT = 0.9 * DEGREE  # of a coarse analogue-to-digital converter


def after_rest(rates):
    """What is known after these rates at rest."""
    noise = NO_NOISE
    for rate in rates:
        noise = update_noise(noise, Vec3(*rate), True, DT)
    return noise


def changes_until_silent(noise, most=10_000):
    """How many rates that repeat the last one it takes in motion."""
    for count in range(1, most):
        noise = update_noise(noise, noise.last, False, DT)
        if is_silent(noise):
            return count
    return most


@pytest.mark.parametrize("share", [0.9, 0.25, 0.05])
def test_a_run_lasts_until_chance_is_excluded(share):
    """An axis that changes in every n-th sample at rest needs n times the samples that one needs which always does."""
    random = np.random.default_rng(1)
    steps = DIGIT * (random.random((20_000, 3)) < share)
    noise = after_rest(steps * (-1.0) ** np.arange(len(steps))[:, None])
    changed = np.mean([noise.share.x, noise.share.y, noise.share.z])
    assert changed == pytest.approx(1.0 - (1.0 - share) ** 2, abs=0.06)  # a step after a zero, or a zero after a step
    largest = max(noise.share)
    assert changes_until_silent(noise) == math.ceil(SURE / largest + 1e-9)


@pytest.mark.parametrize("digit", [0.0, 0.0175 * DEGREE, 0.06 * DEGREE, DIGIT])
def test_noise_alone_is_never_silent(digit):
    """Whatever the digit: coarse ones stay at one value for long, at rest as in motion."""
    random = np.random.default_rng(2)
    rates = random.normal(0.0, 0.05 * DEGREE, (200_000, 3))
    if digit > 0.0:
        rates = digit * np.round(rates / digit)
    noise = after_rest(rates[:1000])
    for rate in rates[1000:]:
        noise = update_noise(noise, Vec3(*rate), False, DT)
        assert not is_silent(noise)


def test_without_rest_nothing_is_known_of_the_noise():
    assert changes_until_silent(NO_NOISE, 1000) == 1000
    assert changes_until_silent(after_rest([(DIGIT, 0.0, 0.0), (0.0, 0.0, 0.0)] * 20), 1000) == 1000


def test_a_rate_at_full_scale_has_no_noise_and_is_not_silent():
    noise = after_rest(np.random.default_rng(4).normal(0.0, DIGIT, (1000, 3)))
    for k in range(1000):
        noise = update_noise(noise, Vec3(math.radians(125.0), 0.1 * math.sin(k), 0.1 * math.cos(k)), False, DT)
        assert not is_silent(noise)


def hung_flight():
    """30 s: 4 s of rest, then turns and pushes; for 1.5 s the rate stays at (8, 8, 12) °/s, two axes within a digit."""
    random = np.random.default_rng(3)
    t = np.arange(3000) * DT
    moving = np.clip((t - 4.0) / 2.0, 0.0, 1.0)
    yaw = 0.6 * moving * np.sin(1.3 * (t - 4.0))
    rate = np.gradient(yaw, DT)
    gyr = np.stack((np.zeros_like(t), np.zeros_like(t), rate), axis=1)
    gyr = DIGIT * np.round((gyr + random.normal(0.0, 0.6 * DEGREE, gyr.shape)) / DIGIT)
    gyr += random.normal(0.0, 0.004 * DEGREE, gyr.shape)  # what calibration over temperature adds
    hung = (t > 12.0) & (t < 13.5)
    gyr[hung] = DEGREE * np.array((8.0, 8.0, 12.0)) + random.normal(0.0, 0.004 * DEGREE, (hung.sum(), 3))
    gyr[hung, :2] += DIGIT * random.integers(0, 2, (hung.sum(), 2))
    acc = np.array((0.0, 0.0, GRAVITY)) + random.normal(0.0, 0.03, gyr.shape)
    acc += moving[:, None] * 1.5 * np.sin(t[:, None] * (7.0, 9.0, 11.0))
    quat = np.stack((np.cos(0.5 * yaw), 0.0 * yaw, 0.0 * yaw, np.sin(0.5 * yaw)), axis=1)
    truth = Truth(quat, north=False)
    return Recording(t=t, gyr=gyr, acc=acc, truth=truth), hung


def test_a_hung_gyroscope_is_said_and_not_integrated():
    recording, hung = hung_flight()
    track = lh.fuse(recording)
    said = track.health & GYR_STUCK != 0
    assert not said[~hung].any()
    first = np.flatnonzero(said)[0] - np.flatnonzero(hung)[0]
    assert first < 40
    assert said[hung][first:].all()
    assert np.degrees(track.sigma[said, 2].max()) > 45.0
    alone = lh.fuse(recording, guard=None)
    assert evaluate(recording, track).tilt < 0.5 * evaluate(recording, alone).tilt
