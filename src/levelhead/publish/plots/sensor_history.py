"""What was learned of each sensor, recording after recording."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from math import degrees
from pathlib import Path

from levelhead.open_types import Fields
from levelhead.publish.plots import style

MOST = 8  # sensors with a panel of their own, those that change most


def sensor_picture(histories: Mapping[str, Sequence[Fields]], path: str | Path) -> None:
    """Draw the gyroscope's bias of each sensor, over the date where all recordings have one.

    Args:
        histories: sensor -> its rows of results in order of time.
        path: a PNG, SVG or PDF.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    shown = sorted(histories, key=lambda sensor: -_change(histories[sensor]))[:MOST]
    made = style.figure(
        9.0, 2.4 * len(shown) + 0.8, f"Gyroscope bias of {len(histories)} sensors over their recordings"
    )
    for axes, sensor in zip(made.subplots(len(shown), 1, squeeze=False)[:, 0], shown, strict=True):
        rows = histories[sensor]
        dated = all(row["start_s"] is not None for row in rows)
        for axis, color in zip("xyz", style.AXES, strict=True):
            column = f"gyr_bias_{axis}_rad_s"
            known = [i for i, row in enumerate(rows) if row[column] is not None]
            x = [datetime.fromtimestamp(rows[i]["start_s"], UTC) if dated else i for i in known]
            y = [degrees(rows[i][column]) for i in known]
            axes.plot(x, y, "o-", color=color, markersize=3, linewidth=1.0, label=axis)
        style.format_axes(axes, sensor, "bias [°/s]", "" if dated else "recording")
        style.legend(axes)
    style.save(made, path)


def _change(rows: Sequence[Fields]) -> float:
    """The largest distance of an axis between two recordings, rad/s."""
    values = [[row[f"gyr_bias_{axis}_rad_s"] for row in rows] for axis in "xyz"]
    known = [[value for value in axis if value is not None] for axis in values]
    return max((max(axis) - min(axis) for axis in known if axis), default=0.0)
