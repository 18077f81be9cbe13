"""Joints of two and three axes of known build, simulated from their rotations."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.publish.joint_files import write_joint
from levelhead.rotations import ONE
from levelhead.sources.formats.npz import load_arrays

DATA = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "truth" / "diodem"
UPPER = Rotation.from_euler("zyx", [20, -35, 50], degrees=True)  # of the sensors on the segments
LOWER = Rotation.from_euler("zyx", [-70, 15, 110], degrees=True)
CARRYING = 12.0  # degrees


def chain(first=50.0, second=60.0, middle=0.0, ahead=0.0, noise=0.0, seconds=40.0, seed=0, north=None):
    """Two tracks and the true angles (n, 3), degrees: α and γ move, β by ``middle`` about ``CARRYING``."""
    t = np.arange(0.0, seconds, 0.02)
    rng = np.random.default_rng(seed)
    angles = np.stack(
        [
            first * np.sin(1.9 * t),
            CARRYING + middle * np.sin(1.3 * t),
            second * np.sin(1.1 * t + 0.4) + 0.3 * second * np.sin(2.7 * t),
        ],
        axis=1,
    )
    whole = 40.0 * np.stack([np.sin(0.9 * t), np.cos(0.6 * t), np.sin(0.4 * t + 1.0)], axis=1)
    upper = Rotation.from_euler("zyx", whole, degrees=True)
    lower = Rotation.from_euler("z", ahead, degrees=True) * upper * Rotation.from_euler("ZXY", angles, degrees=True)
    tracks = []
    for segment, mounting in ((upper, UPPER), (lower, LOWER)):
        play = Rotation.from_rotvec(rng.normal(0.0, np.radians(noise), (len(t), 3)))
        quat = (segment * mounting * play).as_quat(scalar_first=True)
        sigma = None if north is None else np.full((len(t), 3), np.radians(north))
        tracks.append(lh.Track(t, quat, sigma=sigma, relative=north is None))
    return tracks, angles


def turn(values):
    return values - values[0]


def test_two_axes_without_noise_are_found_exactly():
    (upper, lower), angles = chain(ahead=130.0)
    found = lh.joint(upper, lower, axes=2)
    first, last = UPPER.inv().apply([0.0, 0.0, 1.0]), LOWER.inv().apply([0.0, 1.0, 0.0])
    signs = np.sign(found.axis_upper @ first), np.sign(found.axis_lower @ last)
    np.testing.assert_allclose(signs[0] * found.axis_upper, first, atol=1e-5)
    np.testing.assert_allclose(signs[1] * found.axis_lower, last, atol=1e-5)
    np.testing.assert_allclose((found.heading - 130.0 + 180.0) % 360.0 - 180.0, 0.0, atol=1e-3)
    np.testing.assert_allclose(signs[0] * found.angle[:, 0], turn(angles[:, 0]), atol=2e-3)
    np.testing.assert_allclose(signs[1] * found.angle[:, 2], turn(angles[:, 2]), atol=2e-3)
    np.testing.assert_allclose(signs[0] * signs[1] * found.angle[:, 1], CARRYING, atol=2e-3)
    assert found.fault == "" and found.sigma.shape == found.angle.shape


@pytest.mark.parametrize("seed", range(3))
def test_two_axes_with_noise_are_within_their_sigma(seed):
    (upper, lower), angles = chain(ahead=-60.0, noise=1.0, seed=seed)
    found = lh.joint(upper, lower, axes=2)
    first, last = UPPER.inv().apply([0.0, 0.0, 1.0]), LOWER.inv().apply([0.0, 1.0, 0.0])
    for axis, true, sigma in zip((found.axis_upper, found.axis_lower), (first, last), found.sigma_axes, strict=True):
        assert np.degrees(np.arccos(min(1.0, abs(axis @ true)))) < 4.0 * sigma < 10.0
    sign = np.sign(found.axis_upper @ first)
    assert np.std(found.angle[:, 0] - sign * angles[:, 0]) < 3.0


def test_three_axes_of_given_frames_and_north():
    (upper, lower), angles = chain(middle=20.0, north=1.0)
    frames = (UPPER.inv().as_quat(scalar_first=True), LOWER.inv().as_matrix())
    found = lh.joint(upper, lower, axes=3, frames=frames)
    np.testing.assert_allclose(found.angle, angles, atol=1e-6)
    assert found.fault == "" and 1.0 < np.median(found.sigma) < 4.0


def test_the_angles_are_those_of_scipy():
    (upper, lower), _ = chain(middle=30.0, north=1.0)
    one = (np.eye(3), ONE)
    found = lh.joint(upper, lower, axes=3, frames=one)
    relative = Rotation.from_quat(upper.quat, scalar_first=True).inv() * Rotation.from_quat(
        lower.quat, scalar_first=True
    )
    off = found.angle - relative.as_euler("ZXY", degrees=True)
    np.testing.assert_allclose((off + 180.0) % 360.0 - 180.0, 0.0, atol=1e-9)


def test_three_axes_of_a_neutral_pose_without_north():
    """A knee that bends by 50° and turns a little: frames by pose and main axis, heading by this axis."""
    t = np.arange(0.0, 40.0, 0.02)
    begun = np.clip((t - 3.0) / 2.0, 0.0, 1.0)[:, None]
    angles = begun * np.stack([-30.0 + 30.0 * np.cos(1.9 * t), 3.0 * np.sin(1.1 * t), 4.0 * np.sin(0.7 * t)], axis=1)
    whole = begun * 30.0 * np.stack([np.sin(0.9 * t), np.sin(0.6 * t), np.sin(0.4 * t)], axis=1)
    level = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # x forward, y up
    upper = Rotation.from_euler("zyx", whole, degrees=True) * level
    lower = Rotation.from_euler("z", 80.0, degrees=True) * upper * Rotation.from_euler("ZXY", angles, degrees=True)
    tracks = [lh.Track(t, (s * m).as_quat(scalar_first=True)) for s, m in ((upper, UPPER), (lower, LOWER))]
    found = lh.joint(*tracks, axes=3, zero=1.0)
    sign = np.sign(found.angle[:, 0] @ angles[:, 0])
    assert np.sqrt(np.mean((sign * found.angle[:, 0] - angles[:, 0]) ** 2)) < 2.0
    assert np.abs(found.angle[40]).max() < 1e-3
    assert found.fault == ""


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"second": 0.0, "first": 1.0}, "about its second axis"),
        ({"second": 1.0, "noise": 0.3}, "the angles are known to"),
        ({"middle": 60.0}, "direction of the axis is known to"),
    ],
    ids=["stiff", "one axis", "three axes"],
)
def test_a_motion_that_does_not_show_two_axes_is_not_trusted(options, words):
    (upper, lower), _ = chain(**options)
    assert words in lh.joint(upper, lower, axes=2).fault


def test_wrong_axes_and_frames_are_named():
    (upper, lower), _ = chain()
    for options, message in (
        ({"axes": 4}, "axes is 4; expected 1, 2 or 3"),
        ({"axes": 1, "frames": (ONE, ONE)}, "3 with frames"),
        ({"axes": 3, "frames": (ONE, [1.0, 2.0])}, "frame of the lower segment"),
    ):
        with pytest.raises(lh.LevelheadError, match=message):
            lh.joint(upper, lower, **options)


def test_files_of_three_angles_are_read_back(tmp_path):
    """By the rules of OpenSim's storage files: a header that counts rows and columns, then names and numbers."""
    (upper, lower), angles = chain(middle=20.0, north=1.0)
    found = lh.joint(upper, lower, axes=3, frames=(UPPER.inv().as_matrix(), LOWER.inv().as_matrix()))
    for suffix, columns in ((".mot", [1, 2, 3]), (".csv", [1, 3, 5])):
        write_joint(found, tmp_path / f"hip{suffix}")
        head, _, body = (tmp_path / f"hip{suffix}").read_text().rpartition("endheader\n")
        names, *rows = body.splitlines()
        values = np.array([[float(x) for x in row.replace("\t", ",").split(",")] for row in rows])
        np.testing.assert_allclose(values[:, columns], angles, atol=1e-6)
        assert len(names.replace("\t", ",").split(",")) == values.shape[1]
        if suffix == ".mot":
            assert f"nRows={len(values)}" in head and "nColumns=4" in head and "inDegrees=yes" in head


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings in {DATA}; LEVELHEAD_DATA names their folder")
def test_a_real_hinge_has_no_adduction_and_no_second_axis():
    arrays = [load_arrays(DATA / f"trial1_seg{segment}.npz") for segment in (3, 4)]
    pair = [lh.Recording(one["t"], one["gyr"], one["acc"]) for one in arrays]
    three = lh.joint(*pair, axes=3)
    assert np.ptp(three.angle, axis=0)[0] > 150.0 and np.ptp(three.angle, axis=0)[1:].max() < 3.0
    assert "the angles are known to" in lh.joint(*pair, axes=2).fault


def test_a_pose_with_the_axis_upright_is_refused():
    (upper, lower), _ = chain(second=0.0)
    with pytest.raises(lh.LevelheadError, match="from the vertical; expected a neutral pose"):
        lh.joint(upper, lower, axes=3, zero=2.5)
