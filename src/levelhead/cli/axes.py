"""``levelhead axes LOG``: how the sensor sits on its body."""

from pathlib import Path

from levelhead.cli.options import Reading, print_line


def axes(log: Path, /, *, reading: Reading = Reading()) -> None:  # noqa: B008
    """Find the axis map from a log in which the body is still and level for a second, and then leans to its right side.

    Prints the value of the option --axes of `levelhead run` and `levelhead export`: the sensor's axes that are the
    body's x (forward), y (left) and z (up).

    Args:
        log: a recording, as for fuse; a turn of 30° or more.
    """
    from levelhead.axis_map import find_axes

    print_line(str(find_axes(reading.read(log))))
