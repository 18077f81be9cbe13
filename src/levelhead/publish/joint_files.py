"""A joint's angles as a file: CSV with σ, or a motion file that OpenSim reads."""

from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError, nearest
from levelhead.joints import Joint
from levelhead.recording import Array

NAMES = ("flexion", "adduction", "rotation")  # of a joint of three axes, in a motion file; of a hinge "joint_angle"


def write_joint(joint: Joint, path: Path) -> None:
    """Writes t, angles and σ as CSV, or t and angles as .mot; the file appears whole or not at all.

    Raises:
        LevelheadError: another suffix, or a folder that cannot be written.
    """
    if path.suffix not in (".csv", ".mot"):
        raise LevelheadError(f"'{path.name}' is not a joint file; {nearest(path.suffix, ['.csv', '.mot'])}")
    angles, sigmas = joint.angle.reshape(len(joint.t), -1), joint.sigma.reshape(len(joint.t), -1)
    names = ("joint_angle",) if joint.axes == 1 else NAMES
    if path.suffix == ".csv":
        short = ("angle",) if joint.axes == 1 else NAMES
        head = ",".join(["t [s]", *(f"{name} [deg],sigma_{name} [deg]" for name in short)])
        head = "t [s],angle [deg],sigma [deg]" if joint.axes == 1 else head
        both = np.stack([angles, sigmas], axis=2).reshape(len(joint.t), -1)
        lines = [head, *_lines(joint.t, both, ",")]
    else:
        head = f"{names[0] if joint.axes == 1 else 'joint_angles'}\nversion=1\nnRows={len(joint.t)}\n"
        head += f"nColumns={1 + len(names)}\ninDegrees=yes\nendheader\n" + "\t".join(["time", *names])
        lines = [head, *_lines(joint.t, angles, "\t")]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _lines(t: Array, values: Array, between: str) -> list[str]:
    return [between.join([repr(at), *(f"{x:.6f}" for x in row)]) for at, row in zip(t.tolist(), values, strict=True)]
