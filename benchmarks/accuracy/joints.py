"""Angles of DIODEM's hinges and of two knees beside references: `python benchmarks/accuracy/joints.py DATA`."""

import sys
from pathlib import Path

import numpy as np
from scipy.io import loadmat

import levelhead as lh
from levelhead.joints.axes_fit import tangents
from levelhead.joints.cardan import cardan_angles
from levelhead.recording import Array
from levelhead.rotations import matrix

HINGES = ((2, 3), (3, 4), (4, 5))


def reference_angle(upper: Array, lower: Array, axis: Array) -> Array:
    """(n,) degrees about the axis that (n, 3, 3) references share, with the sign of ``axis`` in the upper sensor."""
    left, _, right = np.linalg.svd(np.einsum("nji,njk->ik", upper, lower))
    sign = np.sign(axis @ left[:, 0])
    across = np.einsum("nji,nj->ni", upper, lower @ tangents(sign * right[0])[:, 0]) @ tangents(sign * left[:, 0])
    return np.degrees(np.arctan2(across[:, 1], across[:, 0]))


def row(name: str, joint: lh.Joint, true: Array, known: Array | slice) -> str:
    """A row of the table: errors after a constant, of angles in degrees."""
    turned = np.exp(1j * np.radians(joint.angle[known] - true))
    error = np.degrees(np.angle(turned / np.mean(turned)))
    return (
        f"| {name} | {np.sqrt(np.mean(error**2)):.2f}° | {np.median(np.abs(error)):.2f}° | "
        f"{np.abs(error).max():.1f}° | {np.median(joint.sigma):.2f}° |"
    )


def main(folder: Path) -> None:
    """Prints a row for each joint."""
    print("| joint | RMS error | median | largest | median σ |\n|---|--:|--:|--:|--:|")
    for pair in HINGES:
        arrays = [np.load(folder / f"truth/diodem/trial1_seg{segment}.npz") for segment in pair]
        joint = lh.joint(*(lh.Recording(one["t"], one["gyr"], one["acc"]) for one in arrays))
        known = arrays[0]["ref_ok"] & arrays[1]["ref_ok"]
        upper, lower = (matrix(one["q_ref_sensor"][known]) for one in arrays)
        true = reference_angle(upper, lower, joint.axis_upper)
        print(row(f"DIODEM, segments {pair[0]} and {pair[1]}", joint, true, known))
    whole = loadmat(folder / "joints/qmt_full_body.mat", simplify_cells=True)
    for side in ("left", "right"):
        segments = [whole[f"{part}_leg_{side}"] for part in ("upper", "lower")]
        joint = lh.joint(*(lh.Recording(whole["t"], one["gyr"], one["acc"]) for one in segments))
        true = np.degrees(cardan_angles(*(matrix(one["quat"]) for one in segments)))[:, 0]
        true *= np.sign(np.corrcoef(joint.angle, true)[0, 1])
        print(
            row(f"{side} knee, walking and running", joint, true[100:], slice(100, None))
        )  # 1 s in which the references begin


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "truth/diodem").is_dir():
        sys.exit("usage: python benchmarks/accuracy/joints.py DATA, the folder with truth/diodem and joints")
    main(Path(sys.argv[1]))
