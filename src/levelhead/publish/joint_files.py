"""A joint's angle as a file: CSV with σ, or a motion file that OpenSim reads."""

from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError, nearest
from levelhead.joints import Joint

NAME = "joint_angle"  # the name of the coordinate in a motion file


def write_joint(joint: Joint, path: Path) -> None:
    """Writes t, angle and σ as CSV, or t and angle as .mot; the file appears whole or not at all.

    Raises:
        LevelheadError: another suffix, or a folder that cannot be written.
    """
    if path.suffix not in (".csv", ".mot"):
        raise LevelheadError(f"'{path.name}' is no file of a joint; {nearest(path.suffix, ['.csv', '.mot'])}")
    rows = zip(joint.t.tolist(), joint.angle.tolist(), joint.sigma.tolist(), strict=True)
    if path.suffix == ".csv":
        lines = ["t [s],angle [deg],sigma [deg]", *(f"{t!r},{angle:.6f},{sigma:.6f}" for t, angle, sigma in rows)]
    else:
        head = f"{NAME}\nversion=1\nnRows={len(joint.t)}\nnColumns=2\ninDegrees=yes\nendheader\ntime\t{NAME}"
        lines = [head, *(f"{t!r}\t{angle:.6f}" for t, angle, _ in rows)]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
