"""The picture of a joint: its angle with ±2σ."""

from pathlib import Path

from levelhead.joints import Joint
from levelhead.publish.plots import style


def joint_picture(joint: Joint, path: str | Path) -> None:
    """Draws the angle over time; the title is the verdict.

    Raises:
        LevelheadError: another suffix than PNG, SVG or PDF, or matplotlib is not installed.
    """
    span = f"Hinge: {joint.angle.min():.0f}° to {joint.angle.max():.0f}°".replace("-", "−")
    figure = style.figure(9.0, 3.6, f"Not trusted: {joint.fault}" if joint.fault else span)
    axes = figure.subplots()
    low, high = joint.angle - 2.0 * joint.sigma, joint.angle + 2.0 * joint.sigma
    axes.fill_between(joint.t, low, high, color=style.BLUE, alpha=0.2, linewidth=0.0, label="±2σ")
    axes.plot(joint.t, joint.angle, color=style.BLUE, linewidth=1.2, label="angle")
    residual = f"the sensors disagree on the axis by {joint.residual:.2g}° RMS"
    style.format_axes(axes, residual, "angle [°]", "time [s]")
    style.legend(axes)
    style.save(figure, path)
