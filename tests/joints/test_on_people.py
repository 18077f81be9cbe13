"""Joints of real chains and people beside orientations that come with the recordings."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import levelhead as lh
from levelhead.joints.axes_fit import tangents
from levelhead.joints.cardan import cardan_angles, frames_of_pose
from levelhead.recording import Array
from levelhead.rotations import matrix
from levelhead.sources.formats.npz import load_arrays

DATA = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
CHAIN, PEOPLE = DATA / "truth" / "diodem", DATA / "joints"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PEOPLE.is_dir(), reason=f"no recordings in {PEOPLE}; LEVELHEAD_DATA names their folder"),
]


def rms(angle: Array, true: Array) -> Array:
    """Degrees after a constant, of angles in degrees."""
    turned = np.exp(1j * np.radians(angle - true))
    error = np.degrees(np.angle(turned / turned.mean(axis=0)))
    return np.asarray(np.sqrt(np.mean(error**2, axis=0)))


@pytest.mark.parametrize("pair", [(2, 3), (3, 4), (4, 5)], ids=str)
def test_three_angles_of_a_chain_are_those_of_its_optical_references(pair):
    """The hinge of segments 2 and 3 has play: its references leave the axis by 12°, and so do the angles found."""
    arrays = [load_arrays(CHAIN / f"trial1_seg{segment}.npz") for segment in pair]
    known = arrays[0]["ref_ok"] & arrays[1]["ref_ok"]
    upper, lower = (matrix(one["q_ref_sensor"][known]) for one in arrays)
    recordings = [lh.Recording(one["t"], one["gyr"], one["acc"]) for one in arrays]
    pose = next(i for i in range(0, len(upper), 100) if abs(upper[i, 2] @ lh.joint(*recordings).axis_upper) < 0.6)
    found = lh.joint(*recordings, axes=3, zero=float(arrays[0]["t"][known][pose]))
    on_upper, on_lower = frames_of_pose(found.axis_upper, upper[pose], lower[pose])
    true = np.degrees(cardan_angles(upper @ on_upper, lower @ on_lower))
    assert rms(found.angle[known], true).max() < 0.7
    if pair == (2, 3):
        assert np.ptp(true[:, 1]) > 11.0 and np.ptp(found.angle[known][:, 1]) == pytest.approx(
            np.ptp(true[:, 1]), abs=1
        )


@pytest.mark.parametrize("side", ["left", "right"])
def test_knees_that_walk_and_run_beside_calibrated_segments(side):
    """The orientations beside the readings used a magnetometer and a calibration of the segments; the angles do not.

    The axis of the right knee stays so level that its other sign, 41° RMS off, fits as well but for the acceleration of
    the knee's centre.
    """
    whole = loadmat(PEOPLE / "qmt_full_body.mat", simplify_cells=True)
    segments = [whole[f"{part}_leg_{side}"] for part in ("upper", "lower")]
    found = lh.joint(*(lh.Recording(whole["t"], one["gyr"], one["acc"]) for one in segments))
    flexion = np.degrees(cardan_angles(*(matrix(one["quat"]) for one in segments)))[:, 0]
    sign = np.sign(np.corrcoef(found.angle, flexion)[0, 1])
    begun = whole["t"] > whole["t"][0] + 1.0  # the orientations beside the readings turn at 1600 °/s before, at rest
    assert found.fault == "" and rms(sign * found.angle[begun], flexion[begun]) < 3.2


@pytest.mark.parametrize(
    ("upper", "lower", "bound"), [(("41", 10), ("55", 9), 2.2), (("5B", 7), ("48", 6), 5.5)], ids=["elbow", "knee"]
)
def test_joints_beside_the_orientations_of_the_sensors_themselves(upper, lower, bound):
    """Each sensor's own filter had a magnetometer indoors, and its heading errs, most at the knee."""
    logs = [lh.read(PEOPLE / f"MT_01200651-000-000_00B429{number}.txt") for number, _ in (upper, lower)]
    found = lh.joint(*logs)
    text = (PEOPLE / "MT_01200651-000-000_orientations.sto").read_text().partition("endheader\n")[2]
    names, *rows = (line.split("\t")[1:] for line in text.splitlines())
    assert [names[i] for _, i in (upper, lower)] in (["humerus_l_imu", "radius_l_imu"], ["femur_r_imu", "tibia_r_imu"])
    own = [matrix(np.array([row[i].split(",") for row in rows], float)) for _, i in (upper, lower)]
    across = np.einsum("nji,nj->ni", own[0], own[1] @ tangents(found.axis_lower)[:, 0]) @ tangents(found.axis_upper)
    assert found.fault == "" and rms(found.angle, np.degrees(np.arctan2(*across.T[::-1]))) < bound
