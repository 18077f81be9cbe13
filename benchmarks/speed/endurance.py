"""A node for hours, with everything around it and a fault every minute: is anything lost in silence, does memory grow?

    python -m benchmarks.speed.endurance --minutes 120
    python -m benchmarks.speed.endurance --minutes 1440    # 24 hours

An emulated MPU-6050 at 200 Hz, a black box that runs out of disk half-way, a dashboard process with a page that is
open, and two readers in other processes: one logs every raw sample, one reads orientations 20 times a second. Each
minute one fault is injected: the bus is unplugged for 2 s, its data line is held down, transfers are not acknowledged,
the chip loses its settings, the node's clock is set by an hour. At the end: samples that a reader did not get and that
reported; of each process resident memory, what of it malloc has given out, Python's objects and open files, in the
middle and at the end; and MB per hour by lines through the second half.
"""

import argparse
import ctypes
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.request import urlopen

import numpy as np

from levelhead.cli import main as levelhead
from levelhead.live import Node, subscribe
from levelhead.live.box import BlackBox
from levelhead.live.open import closed_motion
from levelhead.live.zenoh_bus import ZenohBus
from levelhead.sources.sensors.board import assemble_board, parse_board
from levelhead.sources.sensors.emulated import World, emulate_board

ENDPOINT = "tcp/127.0.0.1:7529"
FAULTS = ("unplugged", "stuck", "nack", "reset", "clock")
PAGE = 18290  # port of the dashboard


Row = tuple[float, float, int, float, float]  # minutes, resident MB, files, MB given out by malloc, Python's blocks


SIZES = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")


class Mallinfo(ctypes.Structure):
    """mallinfo2 of glibc: sizes in bytes, summed over its arenas."""

    _fields_ = tuple((name, ctypes.c_size_t) for name in SIZES)


def heap() -> dict[str, float]:
    """What this process has given out: by malloc in MB, and blocks of Python's objects. What grows leaks; what the
    resident memory grows by beyond it, the allocators keep."""
    mallinfo2 = ctypes.CDLL(None).mallinfo2
    mallinfo2.restype = Mallinfo
    info = mallinfo2()
    return {"malloc": round((info.uordblks + info.hblkhd) / 1e6, 2), "blocks": sys.getallocatedblocks()}


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
            print(json.dumps({"got": got, "gaps": gaps, "missed": subscription.missed, **heap()}), flush=True)


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
            print(json.dumps({"got": got, "invalid": invalid, "stale": stale, **heap()}), flush=True)


def show_dashboard() -> None:
    """The dashboard, as `levelhead view --live`; prints its heap once a second."""

    def report() -> None:
        while True:
            time.sleep(1.0)
            print(json.dumps(heap()), flush=True)

    threading.Thread(target=report, daemon=True).start()
    levelhead(["view", "--live", "--endpoint", ENDPOINT, "--port", str(PAGE)])


def open_page() -> None:
    """A page that takes all that the dashboard sends, without drawing it; prints how much, once a second."""
    bytes_ = opened = 0
    printed = time.monotonic()
    while True:
        try:
            with urlopen(f"http://127.0.0.1:{PAGE}/stream") as stream:
                opened += 1
                while part := stream.read1():
                    bytes_ += len(part)
                    if time.monotonic() - printed > 1.0:
                        printed = time.monotonic()
                        print(json.dumps({"MB": round(bytes_ / 1e6, 1), "opened": opened}), flush=True)
        except OSError:
            time.sleep(1.0)


class Reader:
    """Another process, and the last line that it printed."""

    def __init__(self, kind: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", __spec__.name, "--reader", kind], stdout=subprocess.PIPE, text=True
        )
        self.counts: dict[str, float] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("{"):
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
    readers = {kind: Reader(kind) for kind in READERS}
    pids = {"node": os.getpid()} | {kind: reader.process.pid for kind, reader in readers.items()}
    history: dict[str, list[Row]] = {name: [] for name in pids}
    began = time.monotonic()
    chip = next(iter(wires.chips.values()))
    for count in range(10**9):
        time.sleep(max(0.0, began + 60.0 * (count + 1) - time.monotonic()))
        elapsed = (time.monotonic() - began) / 60.0
        if elapsed > minutes - 0.2 or not running.is_alive():
            break
        for name, pid in pids.items():
            known = heap() if name == "node" else readers[name].counts
            history[name].append(
                (elapsed, *memory(pid), known.get("malloc", float("nan")), known.get("blocks", float("nan")))
            )
        print(f"{elapsed:6.1f} min  {node.figures()['samples']} samples, "
              f"{ {name: reader.counts for name, reader in readers.items()} }", flush=True)  # fmt: skip
        print("           " + ", ".join(row_text(name, rows[-1]) for name, rows in history.items()), flush=True)
        inject(FAULTS[count % len(FAULTS)], wires, chip)
    running.join()
    figures = node.figures()
    raw = readers["raw"].counts
    print(json.dumps(figures["events"]))
    print(f"{figures['samples']} samples; the log lacks {raw['gaps']}, of which {raw['missed']} it counted itself; "
          f"orientations that were old and valid: {readers['orientation'].counts['stale']}")  # fmt: skip
    for name, rows in history.items():
        late = rows[len(rows) // 2 :]
        print(f"{row_text(name, late[0])}; {row_text('at the end', late[-1])}; an hour: {slopes(late)}")
    for reader in readers.values():
        reader.process.terminate()


def row_text(name: str, row: Row) -> str:
    """Memory of a process, as it is printed."""
    _, resident, files, malloc, blocks = row
    return f"{name} {resident:.1f} MB, malloc {malloc:.1f} MB, {blocks:.0f} blocks, {files} files"


def slopes(rows: list[Row]) -> str:
    """What grows in an hour, by lines through the rows."""
    table = np.array(rows)
    if len(table) < 3:
        return "too short"
    resident, malloc, blocks = (60.0 * np.polyfit(table[:, 0], table[:, k], 1)[0] for k in (1, 3, 4))
    return f"{resident:+.2f} MB, malloc {malloc:+.2f} MB, {blocks:+.0f} blocks"


READERS = {
    "raw": read_raw,
    "orientation": read_orientation,
    "dashboard": show_dashboard,
    "page": open_page,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=120.0, help="length (default 120)")
    parser.add_argument("--reader", choices=tuple(READERS), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.reader:
        READERS[given.reader]()
    else:
        main(given.minutes)
