"""What lasts, and what is over at once: warming, an hour without a magnetometer, blows, a magnet on its way past.

What is asked of ``ESKF`` is what ``EKF`` does with the same simulated readings (``lasting.py`` of the benchmarks
prints both beside VQF), and that σ says how wrong it is.
"""

from dataclasses import replace

import numpy as np
import pytest
from tests.reference import lasting

import levelhead as lh
from levelhead import simulate
from levelhead.evaluate import evaluate
from levelhead.evaluate.score import error_angles
from levelhead.filters import ESKF, health

pytestmark = pytest.mark.slow
FULL = pytest.mark.full


def fused(recording, params=None):
    return lh.fuse(recording, params or ESKF())


@pytest.mark.parametrize(
    "motion", ["hand", *(pytest.param(m, marks=pytest.mark.full) for m in ("walking", "robot", "drone"))]
)
def test_a_bias_that_runs_by_half_a_degree_a_second_in_ten_minutes(motion):
    _, warming = lasting.warming(motion, seed=1)
    track = fused(warming)
    found, other = evaluate(warming, track), evaluate(warming, fused(warming, lh.EKF()))
    print(
        f"{motion}: tilt {found.tilt:.2f}° (EKF {other.tilt:.2f}°), heading {found.heading:.2f}° ({other.heading:.2f}°)"
    )
    assert found.tilt < other.tilt
    assert found.heading < 1.2 * other.heading
    assert 0.5 < found.tilt_error_ratio < 2.5
    assert found.heading_error_ratio < 1.5
    late = slice(len(track) // 2, None)
    behind = np.degrees(np.abs(track.bias[late] - warming.truth.bias[late]))
    assert behind.max() < 0.15, "it lags, and does not lose it: 0.5 °/s is what it would be without following"


@pytest.fixture(scope="module")
def hours():
    """Motion -> what was found of a recording whose magnetometer was gone for an hour."""
    found = {}

    def of(motion):
        if motion not in found:
            found[motion] = lasting.gone(*lasting.hidden(motion, seed=1), ESKF())
        return found[motion]

    return of


@pytest.mark.full
@pytest.mark.parametrize("motion", ["hand", "walking", "robot", "drone"])
def test_an_hour_without_a_magnetometer_is_doubted(motion, hours):
    """σ of heading grows, and is no smaller than half the error."""
    found = hours(motion)
    print(f"{motion}: heading {found.error:.1f}° off, σ {found.sigma:.1f}°")
    assert found.sigma > 2.0
    assert found.error < 2.0 * found.sigma


@pytest.mark.full
@pytest.mark.parametrize("motion", ["hand", "walking"])
def test_heading_is_back_soon_after_the_magnetometer(motion, hours):
    assert hours(motion).back < 5.0


@pytest.mark.full
@pytest.mark.parametrize(
    "motion",
    [
        "hand",
        "walking",
        "robot",
        pytest.param(
            "drone",
            marks=pytest.mark.xfail(
                strict=True,
                reason="1.9 times the other's since north is of the field: a heading "
                "that was lost is not taken from the field, and the travel of a drone turns with it",
            ),
        ),
    ],
)
def test_neither_the_hour_nor_its_end_moves_the_tilt(motion, hours):
    """Whatever heading does: a magnetometer never tilts the horizon.

    A drone whose heading is lost knows its travel less well; with a travel of 16 s its tilt is 1.28 times the other's,
    with 8 s it was 1.17 times.
    """
    found = hours(motion)
    assert found.step < 0.1
    assert found.tilt < 1.3 * found.tilt_with


@pytest.fixture(scope="module")
def plain():
    return simulate.recording("LSM6DSO32", "hand", 60.0, seed=2, mag="HMC5883L")


def test_bursts_of_100_g(plain):
    """Half-sine blows of 20 ms, one every three seconds, each followed by a ringing of a tenth of it."""
    imu = simulate.imu("LSM6DSO32", mag="HMC5883L")
    shaken = replace(imu, acc=replace(imu.acc, full_scale=np.inf, bumps=simulate.Bumps(20.0, 100.0 * 9.80665, 0.02)))
    hit = simulate.observe(simulate.motion(2, 60.0, 100.0, style="hand"), shaken, seed=2)
    assert np.linalg.norm(hit.acc, axis=1).max() > 90.0 * 9.8
    track = fused(hit)
    tilt, tilt_without = (np.degrees(error_angles(one, fused(one)).tilt) for one in (hit, plain))
    assert np.isfinite(track.quat).all() and np.isfinite(track.sigma).all()
    assert np.sqrt(np.mean(tilt**2)) < np.sqrt(np.mean(tilt_without**2)) + 0.5
    assert tilt.max() < tilt_without.max() + 2.0
    assert 0.45 < evaluate(hit, track).tilt_error_ratio < 2.0


def test_a_magnet_that_passes_by_in_two_seconds(plain):
    """A dipole on its way past a sensor in a moving hand: 100 µT where it is nearest, as it comes and goes."""
    along = np.linspace(-3.0, 3.0, 200)[:, None] * [1.0, 0.0, 0.0] + [0.0, 0.6, 0.8]  # of its least distance
    distance = np.linalg.norm(along, axis=1)[:, None]
    moment = np.array([0.8, 0.6, 0.0])
    field = 3.0 * along * (along @ moment)[:, None] / distance**5 - moment / distance**3
    near = slice(3000, 3200)
    mag = np.array(plain.mag)
    back = lh.Track(plain.t[near], plain.truth.quat[near]).as_rotation().inv()
    mag[near] += back.apply(100.0 * field / np.linalg.norm(field, axis=1).max())
    passed = replace(plain, mag=mag)
    track, without = fused(passed), fused(plain)
    (tilt, heading), (tilt0, heading0) = (
        (np.degrees(e.tilt), np.degrees(np.abs(e.heading)))
        for e in (error_angles(plain, track), error_angles(plain, without))
    )
    assert (track.health[3080:3120] & health.MAG_REJECTED).mean() > 0.5
    assert np.abs(tilt - tilt0).max() < 0.1, "a magnetometer never tilts the horizon"
    assert heading[3000:].max() < heading0[3000:].max() + 1.5
    assert np.abs(heading - heading0)[3700:].max() < 0.7
