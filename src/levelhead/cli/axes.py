"""``levelhead axes LOG``: how the sensor sits on its body."""

from pathlib import Path
from typing import Annotated

from levelhead.cli.options import OUT_FOLDER, Axes, Reading, folder, print_line, require_writable
from levelhead.errors import LevelheadError, require


def axes(
    log: Path | None = None,
    /,
    *,
    axes: Axes = "",
    out: Annotated[Path | None, OUT_FOLDER] = None,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Find the axis map from a log in which the body is still and level for a second, and then leans to its right side.

    Prints the value of the option --axes of `levelhead fuse`, `run` and `export`.

    Args:
        log: A recording, as for `levelhead fuse`, with a turn of 30° or more.
        axes: Draw this mounting, such as ZYX:90,0,10, instead of one from a log.
        out: Folder for LOG-axes.png, a picture of the sensor on its body (needs the extra levelhead[plot]).
    """
    from levelhead.axis_map import AxisMap, find_axes

    if (log is None) == (not axes):
        raise LevelheadError("give either a log or a mounting: levelhead axes LOG, or levelhead axes --axes -y,x,z")
    if out is not None:
        require_writable(out)
        require("matplotlib", "the picture", "plot")
    found = AxisMap.parse(axes) if log is None else find_axes(reading.read(log))
    print_line(str(found))
    if out is not None:
        from levelhead.publish.plots.axes_picture import mounting_picture

        target = folder(out) / f"{'mounting' if log is None else log.stem}-axes.png"
        mounting_picture(found, target)
        print_line(f"written: {target}")
