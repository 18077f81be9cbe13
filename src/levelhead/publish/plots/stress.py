"""The errors of filters under faults: a panel for each fault, in which time goes on after it."""

from pathlib import Path

import numpy as np

from levelhead.bench.stress import Stress
from levelhead.evaluate.fault_response import FaultResponse
from levelhead.publish.plots import style
from levelhead.publish.plots.chart import draw
from levelhead.publish.plots.picture import Band, Line, Panel, Picture

COLUMNS = 3
MIN_RANGE, ROOM = 5.0, 1.15  # deg that an axis shows at least; times the first filter's largest error, at most
BEFORE = 5.0  # s of the time before the first fault
PANEL_HEIGHT = 1.55  # inches
MAX_LABEL = 16  # letters of a label beside a panel


def stress_picture(result: Stress, path: str | Path) -> None:
    """Draw the error of every filter through every fault; curves beyond a panel go along its upper edge.

    Raises:
        LevelheadError: nothing to draw with, or a path that cannot be written.
    """
    begin = float(result.recording.t[0])
    faults = list(dict.fromkeys(one.fault for one in result.responses))
    panels = [
        _panel([one for one in result.responses if one.fault is fault], begin, result.recording.duration, i == 0)
        for i, fault in enumerate(faults)
    ]
    starts = [one.fault.start or 0.0 for one in result.responses]
    limits = (max(0.0, min(starts) - BEFORE), result.recording.duration)
    rows = -(-len(panels) // COLUMNS)
    title = f"{result.finding[0].upper()}{result.finding[1:]}"
    draw(Picture(title, panels, limits, 12.5, PANEL_HEIGHT * rows + 1.0, min(COLUMNS, len(panels))), path)


def short(method: str) -> str:
    """The name of a filter for a label beside panels, without its parameters where they have no room."""
    return method if len(method) <= MAX_LABEL else f"{method.partition('(')[0]}(…)"


def _panel(responses: list[FaultResponse], begin: float, duration: float, labelled: bool) -> Panel:
    fault, first = responses[0].fault, responses[0]
    top = max(MIN_RANGE, ROOM * float(np.nanmax(first.error, initial=0.0)))
    start, length = fault.start or 0.0, fault.length or 0.0
    span = np.array([start, min(start + length, duration)])
    lasting = Band(span, np.zeros(2), np.full(2, top), style.GREY, 0.2, "fault" if labelled else "")
    lines = [
        Line(one.t - begin, np.minimum(one.error, top), style.FILTERS[i % len(style.FILTERS)], 1.6 if i == 0 else 1.1,
             short(one.method) if labelled else "", dashed=i >= len(style.FILTERS))
        for i, one in enumerate(responses)
    ]  # fmt: skip
    size = f"{fault.size:.3g}" if fault.size is not None else ""
    return Panel(f"{fault.name}, {size} {fault.kind.unit}", "error [°]", [lasting, *reversed(lines)], (0.0, top))
