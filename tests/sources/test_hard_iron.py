"""A magnetometer that was never calibrated is found out by its sphere, and only where it was turned enough to tell."""

from dataclasses import replace

import numpy as np
import pytest

import levelhead as lh
from levelhead.evaluate import evaluate
from levelhead.publish import summary
from levelhead.signals.hard_iron import hard_iron

OFFSET = np.array([9.0, -6.0, 4.0])


@pytest.fixture(scope="module")
def hand():
    return lh.simulate.recording("LSM6DSO32", "hand", 120.0, seed=3, mag="HMC5883L")


def test_the_middle_of_the_sphere(hand):
    plain, off = hard_iron(hand), hard_iron(replace(hand, mag=hand.mag + OFFSET))
    assert not plain.clear and off.clear
    np.testing.assert_allclose(off.offset - plain.offset, OFFSET, atol=1e-6)
    np.testing.assert_allclose(off.offset, OFFSET, atol=4.0 * off.sigma + 1.0)
    assert off.field == pytest.approx(np.linalg.norm(hand.mag, axis=1).mean(), rel=0.03)
    assert off.explained(OFFSET) and not off.explained(np.zeros(3))


def test_turns_about_one_axis_tell_nothing():
    for motion in ("robot", "walking"):
        assert hard_iron(lh.simulate.recording("LSM6DSO32", motion, 120.0, mag="HMC5883L")) is None


def test_holes_and_a_silent_magnetometer(hand):
    mag = np.array(hand.mag) + OFFSET
    mag[::3] = np.nan
    np.testing.assert_allclose(hard_iron(replace(hand, mag=mag)).offset, OFFSET, atol=1.5)
    for nothing in (None, np.zeros_like(mag), np.full_like(mag, np.nan), np.tile([0.0, 20.0, -40.0], (len(hand), 1))):
        assert hard_iron(replace(hand, mag=nothing)) is None


def test_what_the_summary_advises_helps(hand):
    """Once with a wide offset, and from then on with what was learned."""
    bent = replace(hand, mag=hand.mag + OFFSET)
    as_it_is = lh.fuse(bent, lh.ESKF())
    assert "not calibrated: offset 2" in summary(bent, as_it_is)
    assert "learn it with ESKF: --save-calibration FILE" in summary(bent, lh.fuse(bent, lh.EKF()))
    assert "not calibrated" not in summary(hand, lh.fuse(hand, lh.ESKF()))
    learned = lh.fuse(bent, lh.ESKF(mag_offset=0.3)).calibration
    again = lh.fuse(bent, lh.ESKF(), prior=learned)
    assert evaluate(bent, again).heading < 0.25 * evaluate(bent, as_it_is).heading
    assert "learned by the end" in summary(bent, again)
