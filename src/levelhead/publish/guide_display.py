"""The display of a guided calibration at the terminal: on standard error, drawn anew, or in a pipe line by line."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from levelhead.calibrate.next_pose import HOLD, Instruction

if TYPE_CHECKING:
    from rich.console import Group

SIDES = ("+x", "−x", "+y", "−y", "+z", "−z")
REDRAWN = 10.0  # times a second


@contextmanager
def guide_display(note: str = "") -> Iterator[Callable[[Instruction], None]]:
    """Gives a function that shows an instruction, on a terminal with a note below.

    On a terminal: the instruction, its time, the progress, the sides that were up, and the numbers that are missing.
    Elsewhere a line for each instruction that is new.
    """
    if not sys.stderr.isatty():
        yield _Lines().show
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), refresh_per_second=REDRAWN, transient=True) as live:
        drawn: list[Instruction] = []

        def show(now: Instruction) -> None:
            if not drawn or now is not drawn[-1]:
                drawn[:] = [now]
                live.update(_group(now, note))

        yield show


class _Lines:
    """A line when there is something else to do."""

    def __init__(self) -> None:
        self._last = ""

    def show(self, now: Instruction) -> None:
        """Writes it, but for the countdown of a pose."""
        line = "hold still" if now.hold > 0.0 else now.words
        if line != self._last:
            self._last = line
            sys.stderr.write(f"{now.words}\n")
            sys.stderr.flush()


def _group(now: Instruction, note: str) -> "Group":
    """The instruction, two bars and three lines."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

    bars = Table.grid(padding=(0, 2))
    bars.add_row("this pose", ProgressBar(HOLD, HOLD - now.hold if now.hold > 0.0 else 0.0, width=40))
    bars.add_row(f"{now.poses} pose{'' if now.poses == 1 else 's'}", ProgressBar(1.0, now.fraction, width=40))
    sides = Text("sides that were up: ")
    for side in SIDES:
        was_up = side in now.sides
        sides.append(f" {side} {'✓' if was_up else '·'} ", style="bold green" if was_up else "dim")
    told = f"not known yet: {now.unobservable_words()}" if now.unknown else "every number is known"
    style = "bold green" if now.done else "bold yellow" if now.hold > 0.0 else "bold"
    up = f"up now: {now.up}" if now.up else ""
    return Group(
        Text(now.words, style=style),
        bars,
        sides,
        Text(told, style="dim"),
        Text(up, style="dim"),
        Text(note, style="dim italic"),
    )
