"""The learned errors of each sensor, recording after recording."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from math import degrees
from pathlib import Path

from levelhead.open_types import JsonObject
from levelhead.publish.plots import style

MAX_PANELS = 8  # sensors with a panel of their own, those that change most
DATE = re.compile(r"(?<!\d)(\d{4})-?(\d\d)-?(\d\d)(?!\d)")  # in the name of a recording: 2026-01-31 or 20260131


def sensor_picture(histories: Mapping[str, Sequence[JsonObject]], path: str | Path) -> None:
    """Draw by how much the gyroscope's bias of each sensor has changed since its first recording, with its σ.

    Axes differ by far more than one of them drifts. The time is the date of the recordings, from their clock or their
    names, where all of a sensor have one.

    Args:
        histories: sensor -> its rows of results in order of time.
        path: a PNG, SVG or PDF.

    Raises:
        LevelheadError: no matplotlib, or a path that cannot be written.
    """
    shown = sorted(histories, key=lambda sensor: -_change(histories[sensor]))[:MAX_PANELS]
    sensors = f"{len(histories)} sensor{'' if len(histories) == 1 else 's'}"
    made = style.figure(9.0, 2.4 * len(shown) + 0.8, f"Gyroscope bias of {sensors} since the first recording, with σ")
    for axes, sensor in zip(made.subplots(len(shown), 1, squeeze=False)[:, 0], shown, strict=True):
        rows = histories[sensor]
        dates = [_date(row) for row in rows]
        dated = None not in dates
        for axis, color in zip("xyz", style.AXES, strict=True):
            column = f"gyr_bias_{axis}_rad_s"
            known = [i for i, row in enumerate(rows) if row[column] is not None]
            x = [dates[i] if dated else i + 1 for i in known]
            y = [degrees(rows[i][column] - rows[known[0]][column]) for i in known]
            sigma = [degrees(rows[i].get(f"{column}_sigma") or 0.0) for i in known]
            axes.errorbar(x, y, sigma, fmt="o-", color=color, markersize=3, linewidth=1.0, elinewidth=0.8, label=axis)
        style.format_axes(axes, sensor, "change [°/s]", "" if dated else "recording")
        style.legend(axes)
    style.save(made, path)


def _date(row: JsonObject) -> datetime | None:
    """When a recording was made, by its clock or its name; None: neither has it."""
    if row["start_s"] is not None:
        return datetime.fromtimestamp(row["start_s"], UTC)
    for found in DATE.finditer(row["recording"]):
        with suppress(ValueError):  # eight digits that are not a date
            year, month, day = map(int, found.groups())
            return datetime(year, month, day, tzinfo=UTC)
    return None


def _change(rows: Sequence[JsonObject]) -> float:
    """The largest distance of an axis between two recordings, rad/s."""
    values = [[row[f"gyr_bias_{axis}_rad_s"] for row in rows] for axis in "xyz"]
    known = [[value for value in axis if value is not None] for axis in values]
    return max((max(axis) - min(axis) for axis in known if axis), default=0.0)
