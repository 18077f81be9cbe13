"""``levelhead joint UPPER LOWER``: the angles of a joint between two segments."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from levelhead.cli.options import (
    OUT_FOLDER,
    Reading,
    can_draw,
    folder,
    print_json,
    print_line,
    print_written,
    require_writable,
)
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject

if TYPE_CHECKING:
    from levelhead.joints import Joint


def joint(
    upper: Annotated[Path, Parameter(name="UPPER")],
    lower: Annotated[Path, Parameter(name="LOWER")],
    /,
    *,
    axes: Literal[1, 2, 3] = 1,
    zero: Annotated[float | None, Parameter(metavar="S")] = None,
    format: Literal["csv", "mot", "c3d"] = "csv",
    out: Annotated[Path, OUT_FOLDER] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> int:
    """Find the angles of a joint, such as a knee, from a sensor on each segment, in any mounting.

    One and two axes use no magnetometer. The exit code is 1 if the motion does not show the joint.

    Args:
        upper: Log of the sensor on the segment that counts as fixed; of OpenSim's orientations, FILE.sto:SENSOR; of
            motion capture, FILE.c3d:MARKER,MARKER,MARKER of a rigid body.
        lower: Log of the sensor on the other segment, on the same clock (`levelhead sync`).
        axes: Axes of the joint: 1 for a hinge; 2 for an elbow; 3 for flexion, adduction and rotation from a neutral
            pose at --zero.
        zero: Time stamp at which the angles are zero; by default the first common one.
        format: Format of the angles: csv with angle and σ; mot, which OpenSim reads; or c3d.
        out: Folder for UPPER-joint.csv and UPPER-joint.png.
        plot: Draw the picture (needs the extra levelhead[plot]).
        json: Print the figures as JSON.
    """
    from levelhead.joints import joint as find
    from levelhead.publish.joint_files import write_joint
    from levelhead.publish.progress import progress
    from levelhead.sources.tracks.named_track import named_track, split_name

    if upper == lower:
        raise LevelheadError(f"{upper} is given for both segments; give the log of each")
    require_writable(out)
    with progress("smoothing both logs"):
        sensors = [named_track(log) or reading.read(log) for log in (upper, lower)]
        found = find(*sensors, axes=axes, zero=zero)
    file, segment = split_name(upper)
    name = segment.replace(",", "-") or file.stem
    written = [folder(out) / f"{name}-joint.{format}"]
    write_joint(found, written[0])
    if plot and can_draw():
        from levelhead.publish.plots.joint_picture import joint_picture

        written.append(out / f"{name}-joint.png")
        joint_picture(found, written[1])
    if json:
        print_json(_facts(found) | {"written": [str(path) for path in written]})
    else:
        print_line(str(found))
        print_written(written, plot)
    return int(bool(found.fault))


def _facts(found: "Joint") -> JsonObject:
    return {
        "axis_upper": found.axis_upper.tolist(),
        "axis_lower": found.axis_lower.tolist(),
        "sigma_axes_deg": list(found.sigma_axes),
        "residual_deg": found.residual,
        "angle_deg": [found.angle.min(axis=0).tolist(), found.angle.max(axis=0).tolist()],
        "fault": found.fault,
    }
