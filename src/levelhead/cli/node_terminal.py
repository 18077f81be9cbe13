"""``levelhead run`` at the terminal: signals, a status line per second, events as they come."""

import math
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

from levelhead.cli.options import print_line
from levelhead.live.events import EXPECTED
from levelhead.open_types import Untyped

if TYPE_CHECKING:
    from levelhead.live.node import Node

COUNTED = frozenset({"late", "over_budget"})  # printed once; the status line counts them
NAMED = frozenset({"acceleration"})  # printed once; the status line names it while it holds: any motion brings it


class SignalHandlers:
    """SIGTERM and Ctrl-C end the node in order: safe state, black box closed."""

    def __init__(self, node: "Node") -> None:
        self._node = node
        self._before: dict[signal.Signals, Untyped] = {}

    def __enter__(self) -> None:
        if threading.current_thread() is threading.main_thread():
            for one in (signal.SIGTERM, signal.SIGINT):
                self._before[one] = signal.signal(one, lambda *_: self._node.stop())

    def __exit__(self, *_: object) -> None:
        for one, before in self._before.items():
            signal.signal(one, before)


class StatusLines:
    """A line per second, and each event, from a thread that the node does not wait for."""

    def __init__(self, node: "Node", quiet: bool, frame: str = "ENU") -> None:
        self._node, self._quiet, self._frame = node, quiet, frame
        self._printed: set[str] = set()
        self._thread = threading.Thread(target=self._run, name="terminal", daemon=True)

    def __enter__(self) -> None:
        self._events = self._node.bus.subscribe("imu/health")
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._events.close()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        samples, last, started = 0, time.monotonic(), False
        while True:
            event = self._events.get(timeout=max(0.0, last + 1.0 - time.monotonic()))
            if event is not None:
                started = True
                self._print_event(event)
            elif self._events.closed:
                return
            now = time.monotonic()
            if now - last >= 1.0:
                if started:  # a source that takes long to fail leaves one sentence, its error
                    self._print(status_line(self._node, (self._node.samples - samples) / (now - last), self._frame))
                samples, last = self._node.samples, now

    def _print_event(self, event: Untyped) -> None:
        if event.name in self._printed or not (event.on or event.name not in ("invalid", "calibrating")):
            return
        warning, more = event.on and event.name not in EXPECTED, ""
        if event.name in COUNTED | NAMED:
            self._printed.add(event.name)
            more = " (counted from here on)" if event.name in COUNTED else " (from here on in the status line)"
        self._print(f"  {'!' if warning else ' '} {event.name}: {event.text}{more}")
        if event.name == "started" and hasattr(self._node.source, "instructions"):
            self._print(self._node.source.instructions())

    def _print(self, text: str) -> None:
        if not self._quiet:
            print_line(text)
            sys.stdout.flush()


def status_line(node: "Node", rate: float, frame: str = "ENU") -> str:
    """Samples per second; roll, pitch and yaw in degrees, 1σ of tilt and heading, how late ticks are, warnings."""
    orientation = node.last
    warnings = ", ".join(name for name in list(node.journal.active) if name != "calibrating")
    if orientation is None:
        return f"{rate:6.1f} Hz  no orientation yet{f'  [{warnings}]' if warnings else ''}"
    roll, pitch, yaw = (math.degrees(angle) for angle in orientation.euler)
    if frame == "NED":
        pitch, yaw = -pitch, 90.0 - yaw
    elif frame == "NWU":
        yaw -= 90.0
    yaw = (yaw + 180.0) % 360.0 - 180.0
    tilt, heading = math.degrees(math.hypot(*orientation.sigma[:2])), math.degrees(orientation.sigma[2])
    late = 1e3 * node.loop.lateness.quantile(0.99)
    over_budget = f"  over budget {node.over_budget}" if node.over_budget else ""
    return (
        f"{rate:6.1f} Hz  roll {roll:+7.2f}°  pitch {pitch:+7.2f}°  yaw {yaw:+7.2f}°  "
        f"σ {tilt:.2f}° / {heading:.2f}°  late p99 {late:.2f} ms  missed {node.loop.missed}{over_budget}"
        + ("" if frame == "ENU" else f"  {frame}")
        + (f"  [{warnings}]" if warnings else "")
    )
