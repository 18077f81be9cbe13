"""The angles of DIODEM's three hinges beside their optical references: `python benchmarks/accuracy/joints.py DIR`."""

import sys
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead.joints.hinge import tangents
from levelhead.recording import Array
from levelhead.rotations import matrix

HINGES = ((2, 3), (3, 4), (4, 5))


def reference_angle(upper: Array, lower: Array, axis: Array) -> Array:
    """(n,) degrees about the axis that (n, 3, 3) references share, with the sign of ``axis`` in the upper sensor."""
    left, _, right = np.linalg.svd(np.einsum("nji,njk->ik", upper, lower))
    sign = np.sign(axis @ left[:, 0])
    across = np.einsum("nji,nj->ni", upper, lower @ tangents(sign * right[0])[:, 0]) @ tangents(sign * left[:, 0])
    return np.degrees(np.arctan2(across[:, 1], across[:, 0]))


def main(folder: Path) -> None:
    """Prints a row for each hinge."""
    print("| hinge | RMS error | largest | median σ |\n|---|--:|--:|--:|")
    for pair in HINGES:
        arrays = [np.load(folder / f"trial1_seg{segment}.npz") for segment in pair]
        joint = lh.joint(*(lh.Recording(one["t"], one["gyr"], one["acc"]) for one in arrays))
        known = arrays[0]["ref_ok"] & arrays[1]["ref_ok"]
        upper, lower = (matrix(one["q_ref_sensor"][known]) for one in arrays)
        turned = np.exp(1j * np.radians(joint.angle[known] - reference_angle(upper, lower, joint.axis_upper)))
        error = np.degrees(np.angle(turned / np.mean(turned)))
        print(
            f"| segments {pair[0]} and {pair[1]} | {np.sqrt(np.mean(error**2)):.2f}° | {np.abs(error).max():.1f}° | "
            f"{np.median(joint.sigma):.2f}° |"
        )


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "trial1_seg5.npz").is_file():
        sys.exit("usage: python benchmarks/accuracy/joints.py DIR, the folder with trial1_seg1.npz to trial1_seg5.npz")
    main(Path(sys.argv[1]))
