"""``levelhead calibrate --live``: poses from a source, with what to do next at the terminal and in the browser."""

from contextlib import ExitStack

from levelhead.axis_map import AxisMap
from levelhead.calibrate.live_session import record_poses
from levelhead.calibrate.next_pose import POSES, Instruction
from levelhead.cli.options import Reading, print_line
from levelhead.live.open import open_source
from levelhead.publish.guide_display import guide_display
from levelhead.recording import Recording
from levelhead.sources import parse_counts, parse_map, parse_units

LIVE_RATE = 200.0  # Hz
EMULATED = "an emulated sensor puts itself down, in an order of its own"


def record_live_poses(
    source: str,
    poses: int | None,
    view: bool,
    speed: float,
    axes: str,
    gyr_range: float,
    acc_range: float,
    gravity: float,
    reading: Reading,
) -> Recording:
    """The readings of a guided calibration, until every number is known; options as for ``calibrate``.

    Raises:
        LevelheadError: a source that there is not or that fails, or an option that does not fit it.
    """
    opened = open_source(
        source,
        rate=reading.rate or LIVE_RATE,
        speed=speed,
        gyr_range=gyr_range,
        acc_range=acc_range,
        axes=AxisMap.parse(axes),
        motion="poses",
        map=parse_map(reading.map),
        units=parse_units(reading.units),
        counts=parse_counts(reading.counts),
    )
    with ExitStack() as held:
        shown = [held.enter_context(guide_display(EMULATED if source.startswith("emulated") else ""))]
        if view:
            from levelhead.publish.dashboard.guide_view import GuideView
            from levelhead.publish.dashboard.server import PageServer

            page = GuideView(f"calibration of {opened.name}")
            server = PageServer(page)
            held.callback(server.close)
            print_line(server.url)
            shown.append(page.show)

        def show(now: Instruction) -> None:
            for one in shown:
                one(now)

        return record_poses(opened, show, gravity=gravity, poses=POSES if poses is None else poses)
