"""The picture of a walk: its path from above, its height, and the lengths of its strides."""

from pathlib import Path

import numpy as np

from levelhead.gaits import Gait
from levelhead.publish.plots import style


def gait_picture(gait: Gait, path: str | Path) -> None:
    """Draws path, height with ±2σ, and stride lengths.

    Raises:
        LevelheadError: another suffix than PNG, SVG or PDF, or matplotlib is not installed.
    """
    track, strides = gait.track, gait.strides
    assert track.position is not None and track.sigma_position is not None
    count = len(strides.length)
    figure = style.figure(10.0, 4.6, f"{count} strides, {gait.distance:.1f} m; from start to end {gait.gap:.2f} m")
    panels = figure.subplot_mosaic([["path", "height"], ["path", "length"]], width_ratios=[1.1, 1.0])
    east, north, up = track.position.T
    above = panels["path"]
    above.plot(east, north, color=style.BLUE, linewidth=1.0)
    at = np.searchsorted(track.t, np.append(strides.start, strides.end[-1:]))
    above.plot(east[at], north[at], ".", color=style.VERMILION, label="stances")
    above.set_aspect("equal", adjustable="datalim")
    compass = "frame of the start" if track.relative else "magnetic north up"
    style.format_axes(above, f"from above, {compass}; a dot is a stance", "north [m]", "east [m]")
    sigma = track.sigma_position[:, 2]
    height = panels["height"]
    height.fill_between(track.t, up - 2.0 * sigma, up + 2.0 * sigma, color=style.BLUE, alpha=0.2, linewidth=0.0)
    height.plot(track.t, up, color=style.BLUE, linewidth=1.0)
    style.format_axes(height, "height ±2σ", "[m]")
    length = panels["length"]
    length.vlines(0.5 * (strides.start + strides.end), 0.0, strides.length, color=style.GREEN, linewidth=3.0)
    style.format_axes(length, "length of strides", "[m]", "time [s]")
    style.save(figure, path)
