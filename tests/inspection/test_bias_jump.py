"""The gyroscope's bias in windows that the filter learns, and its steps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference.moved_sensor import RATE, observe_motion

import levelhead as lh
from levelhead.inspection.bias_jump import find_jump, learn_windows
from levelhead.inspection.findings import Finding
from levelhead.inspection.turns import examine_turns
from levelhead.recording import Array, Recording


def found(recording: Recording) -> set[str]:
    return {one.name for one in examine_turns(recording) if isinstance(one, Finding)}


def walk(seconds: float = 60.0, seed: int = 0) -> Recording:
    """A sensor at a hip: steps of 3 m/s², turns of 0.2 rad, and slow curves."""
    t = np.arange(0.0, seconds, 1.0 / RATE)[:, None]
    phase = np.random.default_rng(seed).uniform(0.0, 6.0, 3)
    angles = 0.2 * np.sin(2.0 * np.pi * np.array([1.9, 0.95, 0.07]) * t + phase) * [1.0, 1.0, 3.0]
    return observe_motion(
        angles, np.sin(2.0 * np.pi * np.array([0.95, 1.9, 1.9]) * t + phase[::-1]) * [1.5, 2.0, 3.0], seed
    )


def with_jump(recording: Recording, change: Array, at: float) -> Recording:
    return replace(recording, gyr=recording.gyr + (recording.t >= at)[:, None] * change)


@pytest.mark.parametrize("seed", range(3))
def test_a_step_in_a_walk_is_found_to_within_its_sigma(seed: int) -> None:
    change, at = np.radians([3.0, -2.0, 0.0]), 27.0 + seed
    found = find_jump(with_jump(walk(seed=seed), change, at), [])
    assert found is not None and found.axis == 0
    assert abs(found.change[0] - change[0]) < 3.5 * found.sigma[0] < np.radians(2.5)
    assert found.at == pytest.approx(at, abs=5.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_walk_without_a_step_has_none(seed: int) -> None:
    assert find_jump(walk(seed=seed), []) is None


def test_the_vertical_is_not_known_from_forces() -> None:
    """A body that keeps upright: its bias about the vertical turns no force."""
    t = np.arange(0.0, 60.0, 1.0 / RATE)[:, None]
    upright = observe_motion(np.sin(0.8 * t) * [0.0, 0.0, 1.0], np.zeros((len(t), 3)))
    found = learn_windows(with_jump(upright, np.radians([0.0, 0.0, 4.0]), 30.0))
    assert found is not None
    sigma = np.degrees(np.sqrt(np.linalg.inv(found.weight).diagonal(axis1=1, axis2=2)[:, :3]))
    assert sigma[:, :2].max() < 0.6 and sigma[:, 2].min() > 5.0
    assert find_jump(with_jump(upright, np.radians([0.0, 0.0, 4.0]), 30.0), []) is None


def test_a_bias_that_drifts_is_no_step() -> None:
    still = walk(240.0)
    drift = np.radians(2.0) * (still.t / still.t[-1])[:, None] * [1.0, 0.0, 0.0]
    jump = find_jump(replace(still, gyr=still.gyr + drift), [])
    assert jump is None or abs(jump.change[0]) < np.radians(2.0)  # the drift itself, between two halves


def test_a_recording_too_short_for_four_windows_has_no_biases() -> None:
    assert learn_windows(walk(12.0)) is None
    assert learn_windows(walk(24.0)) is not None


@pytest.mark.parametrize("scale", [0.85, 1.15])
@pytest.mark.parametrize("seed", range(3))
def test_a_scale_is_no_step(seed: int, scale: float) -> None:
    """A walker who turns round in the second half only: a scale, or an axis askew, shows there alone."""
    t = np.arange(0.0, 60.0, 1.0 / RATE)[:, None]
    phase = np.random.default_rng(seed).uniform(0.0, 6.0, 3)
    curve = np.where(t < 30.0, 0.0, t - 30.0) * [0.0, 0.0, 1.0]
    walker = observe_motion(
        curve + 0.2 * np.sin(6.0 * t + phase) * [1.0, 1.0, 0.5], np.sin(6.0 * t + phase) * 2.0, seed
    )
    askew = walker.gyr @ Rotation.from_rotvec([0.1, 0.0, 0.0]).as_matrix().T
    assert find_jump(replace(walker, gyr=scale * askew), []) is None


@pytest.mark.parametrize("scale", [0.85, 1.15])
def test_a_scale_hides_no_step(scale: float) -> None:
    still = replace(walk(), gyr=scale * walk().gyr)
    found = find_jump(with_jump(still, np.radians([0.0, 4.0, 0.0]), 30.0), [])
    assert found is not None and found.axis == 1
    assert abs(np.degrees(found.change[1]) - 4.0) < 3.5 * np.degrees(found.sigma[1]) < 2.0


def test_a_reversed_axis_is_no_step() -> None:
    assert find_jump(replace(walk(), gyr=walk().gyr * [1.0, -1.0, 1.0]), []) is None


@pytest.mark.full
def test_a_step_that_explains_nothing_is_none(data_dir: Path) -> None:
    """Real logs in which segments show a step of 6 σ: one that grows with each refinement, and one beside a scale."""
    walk = data_dir / "joints" / "MT_01200651-000-000_00B42955.txt"
    stick = data_dir / "repoimu" / "TStick_Test04_Trial2.csv"
    if not (walk.exists() and stick.exists()):
        pytest.skip("no recordings of joints and of a T-Stick here: $LEVELHEAD_DATA holds neither")
    assert "bias_jumps" not in found(lh.read(walk))
    whole = lh.read(stick)
    middle = whole[(len(whole) - int(60 * whole.rate)) // 2 :][: int(60 * whole.rate)]
    fast = replace(middle, t=0.5 * middle.t, truth=None)
    assert found(fast) == {"gyro_scale"}
