"""The truth is consistent: what is a derivative of what is checked numerically, with another library's rotations."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.spatial.transform import Rotation

from levelhead import simulate
from levelhead.errors import LevelheadError

G = 9.80665
MOVING = [style for style in simulate.STYLES if style != "still"]


def rotation(motion):
    return Rotation.from_quat(motion.quat, scalar_first=True)


@pytest.mark.parametrize("style", MOVING)
def test_body_rate_is_the_derivative_of_attitude(style):
    motion = simulate.motion(3, 20, 400, style=style)
    r = rotation(motion)
    # Central difference over two samples: the rotation from k-1 to k+1, seen in the body frame at k.
    measured = (r[:-2].inv() * r[2:]).as_rotvec() * motion.rate / 2.0
    middle = (r[1:-1].inv() * r[:-2]).apply(measured)
    np.testing.assert_allclose(middle, motion.gyr[1:-1], atol=2e-3 * max(1.0, np.abs(motion.gyr).max()))


def test_body_rate_converges_with_the_square_of_the_step():
    errors = []
    for rate in (100, 200, 400):
        motion = simulate.motion(3, 20, rate)
        r = rotation(motion)
        half = (r[:-1].inv() * r[1:]).as_rotvec() * rate
        errors.append(np.abs(half - (motion.gyr[1:] + motion.gyr[:-1]) / 2.0).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("style", MOVING)
def test_specific_force_integrates_twice_to_position(style):
    motion = simulate.motion(5, 30, 400, style=style)
    acceleration = rotation(motion).apply(motion.specific_force) - [0.0, 0.0, G]
    velocity = cumulative_simpson(acceleration, x=motion.t, axis=0, initial=0.0)
    position = cumulative_simpson(velocity, x=motion.t, axis=0, initial=0.0)
    np.testing.assert_allclose(velocity, motion.velocity, atol=1e-5)
    np.testing.assert_allclose(position, motion.position, atol=1e-4)


def test_starts_at_rest_and_reads_exactly_g():
    motion = simulate.motion(1, 10, 100, still=3.0)
    rest = motion.t <= 3.0
    assert np.all(motion.specific_force[rest] == [0.0, 0.0, G])
    assert np.all(motion.quat[rest] == [1.0, 0.0, 0.0, 0.0])
    for name in ("gyr", "position", "velocity", "acceleration"):
        assert not getattr(motion, name)[rest].any()
    assert motion.gyr[~rest].any(axis=1).all()


def test_sets_off_smoothly():
    """No jump anywhere: at twice the rate the largest step of gyr and acceleration is half as large."""
    coarse, fine = simulate.motion(1, 10, 500), simulate.motion(1, 10, 1000)
    for name in ("gyr", "acceleration"):
        steps = [np.abs(np.diff(getattr(motion, name), axis=0)).max() for motion in (coarse, fine)]
        assert steps[0] / steps[1] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("style", list(simulate.STYLES))
def test_quaternions_are_unit(style):
    motion = simulate.motion(2, 30, style=style)
    np.testing.assert_allclose(np.linalg.norm(motion.quat, axis=1), 1.0, rtol=0, atol=1e-14)


def test_a_hand_reaches_every_attitude():
    up = np.concatenate([simulate.motion(seed, 120).to_body(np.array([0.0, 0.0, 1.0])) for seed in range(4)])
    for axis in range(3):
        assert up[:, axis].max() > 0.95
        assert up[:, axis].min() < -0.95


def test_rms_is_what_was_asked_for():
    motion = simulate.motion(
        4, 600, 50, rotation=(10.0, 0.0, 0.0), translation=(1.0, 2.0, 0.0), translation_band=(0.2, 1.0), still=0.0
    )
    assert np.degrees(np.sqrt(np.mean(motion.gyr[:, 0] ** 2))) == pytest.approx(10.0, rel=0.05)
    assert np.sqrt(np.mean(motion.acceleration**2, axis=0)) == pytest.approx([1.0, 2.0, 0.0], rel=0.05)


def test_same_seed_same_motion_at_every_rate():
    slow, fast = simulate.motion(9, 20, 100), simulate.motion(9, 20, 400)
    np.testing.assert_allclose(slow.quat, fast.quat[::4], atol=1e-12)
    np.testing.assert_array_equal(slow.quat, simulate.motion(9, 20, 100).quat)
    assert np.abs(slow.quat - simulate.motion(10, 20, 100).quat).max() > 0.1


def test_to_body_is_the_inverse_rotation():
    motion = simulate.motion(6, 20)
    vector = np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(motion.to_body(vector), rotation(motion).inv().apply(vector), atol=1e-13)


def test_unknown_style_names_the_nearest():
    with pytest.raises(LevelheadError, match="did you mean 'walking'"):
        simulate.motion(style="walkin")


@pytest.mark.parametrize(
    "arguments",
    [
        {"duration": 0.0},
        {"duration": 0.01},
        {"rate": -1.0},
        {"rate": np.nan},
        {"still": -1.0},
        {"rotation": -1.0},
        {"translation": (1.0, 2.0)},
        {"rotation_band": (1.0, 0.5)},
        {"translation_band": (0.0, 0.5)},
        {"seed": -1},
        {"seed": 0.5},
    ],
)
def test_bad_arguments(arguments):
    with pytest.raises(LevelheadError, match="expected"):
        simulate.motion(**arguments)


def test_uneven_time_is_refused():
    motion = simulate.motion(0, 1)
    t = motion.t.copy()
    t[5] += 0.004
    with pytest.raises(LevelheadError, match="evenly"):
        simulate.Motion(t, motion.quat, motion.gyr, motion.position, motion.velocity, motion.acceleration)
