"""A joint's angles as a file: CSV with σ, a motion file that OpenSim reads, or C3D."""

from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError, nearest
from levelhead.joints import Joint
from levelhead.recording import Array

NAMES = ("flexion", "adduction", "rotation")  # of a joint of three axes, in a motion file; of a hinge "joint_angle"


def write_joint(joint: Joint, path: Path) -> None:
    """Writes t, angles and σ as CSV, or the angles as .mot or .c3d; the file appears whole or not at all.

    Raises:
        LevelheadError: another suffix, a folder that cannot be written, or .c3d without ezc3d.
    """
    if path.suffix == ".c3d":
        return _write_c3d(joint, path)
    if path.suffix not in (".csv", ".mot"):
        raise LevelheadError(f"'{path.name}' is not a joint file; {nearest(path.suffix, ['.csv', '.mot', '.c3d'])}")
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


def _write_c3d(joint: Joint, path: Path) -> None:
    """The angles as a point of the ANGLES group in degrees, as motion capture has them, at one rate."""
    try:
        from ezc3d import c3d
    except ImportError:
        raise LevelheadError(f"writing {path.name} needs ezc3d: pip install 'levelhead[c3d]'") from None
    span = float(joint.t[-1] - joint.t[0])
    t = np.linspace(joint.t[0], joint.t[-1], round(span / float(np.median(np.diff(joint.t)))) + 1)
    points = np.zeros((4, 1, len(t)))
    for i, column in enumerate(joint.angle.reshape(len(joint.t), -1).T):
        points[i, 0] = np.interp(t, joint.t, column)
    file = c3d()
    group = file["parameters"]["POINT"]
    group["RATE"]["value"], group["LABELS"]["value"], group["UNITS"]["value"] = (
        [(len(t) - 1) / span],
        ["joint_angles"],
        ["deg"],
    )
    file.add_parameter("POINT", "ANGLES", ["joint_angles"])
    file.add_parameter("POINT", "ANGLE_UNITS", ["deg"])
    file["data"]["points"] = points
    with atomic_path(path) as temporary:
        file.write(str(temporary))


def _lines(t: Array, values: Array, between: str) -> list[str]:
    return [between.join([repr(at), *(f"{x:.6f}" for x in row)]) for at, row in zip(t.tolist(), values, strict=True)]
