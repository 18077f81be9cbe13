"""The picture of a joint: its angles with ±2σ."""

from pathlib import Path

from levelhead.joints import Joint
from levelhead.publish.plots import style


def joint_picture(joint: Joint, path: str | Path) -> None:
    """Draws the angles over time; the title is the verdict.

    Raises:
        LevelheadError: another suffix than PNG, SVG or PDF, or matplotlib is not installed.
    """
    count = joint.angle.reshape(len(joint.t), -1).shape[1]
    names = ("angle",) if count == 1 else ("flexion", "adduction", "rotation")
    title = {1: "A joint of one axis", 2: "A joint of two axes", 3: "A joint of three axes"}[joint.axes]
    figure = style.figure(9.0, 3.6, f"Not trusted: {joint.fault}" if joint.fault else title)
    axes = figure.subplots()
    for i, name in enumerate(names):
        angle, sigma = (values.reshape(len(joint.t), -1)[:, i] for values in (joint.angle, joint.sigma))
        color = style.BLUE if count == 1 else style.AXES[i]
        axes.fill_between(
            joint.t, angle - 2.0 * sigma, angle + 2.0 * sigma, color=color, alpha=0.2, linewidth=0.0, label=None
        )
        axes.plot(joint.t, angle, color=color, linewidth=1.2, label=f"{name} ±2σ")
    residual = f"the sensors disagree on the axis by {joint.residual:.2g}° RMS"
    style.format_axes(axes, residual, "angle [°]", "time [s]")
    style.legend(axes)
    style.save(figure, path)
