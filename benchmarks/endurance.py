"""A node for hours, with everything around it and a fault every minute: is anything lost in silence, does memory grow?

    python benchmarks/endurance.py --minutes 120
    python benchmarks/endurance.py --minutes 1440    # 24 hours

An emulated MPU-6050 at 200 Hz, a black box that runs out of disk half-way, a dashboard process, and two readers in
other processes: one logs every raw sample, one reads orientations 20 times a second. Each minute one fault is injected:
the bus is unplugged for 2 s, its data line is held down, transfers are not acknowledged, the chip loses its settings,
the node's clock is set by an hour. At the end: samples that a reader did not get and nobody reported, memory and open
files of each process at the beginning and at the end, and MB per hour by a line through all of it.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from levelhead.live import Node, subscribe
from levelhead.live.box import BlackBox
from levelhead.live.open import closed_motion
from levelhead.live.zenoh_bus import ZenohBus
from levelhead.sources.sensors.board import assemble_board, parse_board
from levelhead.sources.sensors.emulated import World, emulate_board

ENDPOINT = "tcp/127.0.0.1:7529"
FAULTS = ("unplugged", "stuck", "nack", "reset", "clock")
WARM = 3.0  # minutes that are left out of the line through memory


def memory(pid: int) -> tuple[float, int]:
    """Resident memory in MB, and open files."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6, len(os.listdir(f"/proc/{pid}/fd"))


def read_raw() -> None:
    """Logs every raw sample; prints what is missing and what was reported, once a second."""
    gaps = got = 0
    last = None
    printed = time.monotonic()
    subscription = subscribe("imu/raw", ENDPOINT, history=4096)
    while True:
        message = subscription.get(timeout=1.0)
        if message is not None:
            got += 1
            if last is not None and message.seq > last + 1:
                gaps += message.seq - last - 1
            last = message.seq
        if time.monotonic() - printed > 1.0:
            printed = time.monotonic()
            print(json.dumps({"got": got, "gaps": gaps, "missed": subscription.missed}), flush=True)


def read_orientation() -> None:
    """Reads 20 times a second; prints how often an orientation was valid though it was old."""
    got = stale = invalid = 0
    printed = time.monotonic()
    subscription = subscribe("imu/orientation", ENDPOINT)
    while True:
        time.sleep(0.05)
        message = subscription.latest()
        if message is not None:
            got += 1
            invalid += not message.valid
            stale += message.valid and subscription.age > 0.25
        if time.monotonic() - printed > 1.0:
            printed = time.monotonic()
            print(json.dumps({"got": got, "invalid": invalid, "stale": stale}), flush=True)


class Reader:
    """A reader in another process, and the last line that it printed."""

    def __init__(self, kind: str) -> None:
        self.process = subprocess.Popen([sys.executable, __file__, "--reader", kind], stdout=subprocess.PIPE, text=True)
        self.counts: dict[str, int] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.counts = json.loads(line)


def inject(kind: str, wires, chip) -> None:
    """One fault, for two seconds."""
    if kind == "unplugged":
        wires.unplugged = True
    elif kind == "stuck":
        wires.stuck = "low"
    elif kind == "nack":
        wires.nack = 50
    elif kind == "reset":
        chip.reset()
    elif kind == "clock":
        real, offset = time.time_ns, 3_600_000_000_000
        time.time_ns = lambda: real() + offset
    time.sleep(2.0)
    wires.unplugged, wires.stuck, wires.nack = False, None, 0


def main(minutes: float) -> None:
    """The run."""
    wanted = parse_board("mpu6050")
    world = World(closed_motion(wanted, 200.0, "hand", 0))
    wires = emulate_board(wanted, world, drift=0.005)
    board = assemble_board(wanted, wires, rate=200.0)
    folder = Path(tempfile.mkdtemp())
    soft = int(minutes * 60 * 200 * 200 / 2)  # bytes: half of what the box would write
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, resource.RLIM_INFINITY))
    bus = ZenohBus(ENDPOINT)
    node = Node(board, rate=200.0, bus=bus, box=BlackBox(folder / "box.mcap"), give_up=60.0)
    running = threading.Thread(target=lambda: node.run(60.0 * minutes), name="node")
    running.start()
    readers = {kind: Reader(kind) for kind in ("raw", "orientation")}
    view = [sys.executable, "-m", "levelhead", "view", "--live", "--endpoint", ENDPOINT, "--port", "18290"]
    dashboard = subprocess.Popen(view, stdout=subprocess.DEVNULL)
    pids = {"node": os.getpid(), "dashboard": dashboard.pid} | {k: r.process.pid for k, r in readers.items()}
    history: dict[str, list[tuple[float, float, int]]] = {name: [] for name in pids}
    began = time.monotonic()
    chip = next(iter(wires.chips.values()))
    for count in range(10**9):
        time.sleep(max(0.0, began + 60.0 * (count + 1) - time.monotonic()))
        elapsed = (time.monotonic() - began) / 60.0
        if elapsed > minutes - 0.2 or not running.is_alive():
            break
        for name, pid in pids.items():
            history[name].append((elapsed, *memory(pid)))
        figures = node.figures()
        sizes = ", ".join(f"{name} {rows[-1][1]:.1f} MB {rows[-1][2]} files" for name, rows in history.items())
        print(f"{elapsed:6.1f} min  {figures['samples']} samples, {readers['raw'].counts}, "
              f"{readers['orientation'].counts}; {sizes}", flush=True)  # fmt: skip
        inject(FAULTS[count % len(FAULTS)], wires, chip)
    running.join()
    figures = node.figures()
    raw = readers["raw"].counts
    print(json.dumps(figures["events"]))
    print(f"{figures['samples']} samples; the log lacks {raw['gaps']}, of which {raw['missed']} it counted itself; "
          f"orientations that were old and valid: {readers['orientation'].counts['stale']}")  # fmt: skip
    for name, rows in history.items():
        late = np.array([row for row in rows if row[0] > WARM] or rows)
        slope = 60.0 * np.polyfit(late[:, 0], late[:, 1], 1)[0] if len(late) > 2 else float("nan")
        print(f"{name}: {late[0, 1]:.1f} to {late[-1, 1]:.1f} MB, {slope:+.1f} MB/h, files {late[0, 2]:.0f} to "
              f"{late[-1, 2]:.0f}")  # fmt: skip
    for process in (dashboard, *(reader.process for reader in readers.values())):
        process.terminate()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=120.0, help="length (default 120)")
    parser.add_argument("--reader", choices=("raw", "orientation"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.reader == "raw":
        read_raw()
    elif given.reader == "orientation":
        read_orientation()
    else:
        main(given.minutes)
