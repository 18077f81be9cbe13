"""The black box: samples a second that it takes, and what twenty kills leave of a node at 200 Hz.

A kill is SIGKILL at a random moment between the third and the sixth second; lost is the time between the kill and the
stamp of the last sample in the file. Each file is then run again, and must give the node's orientations to the bit.
"""

import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, show

from levelhead.bench.timing import Table
from levelhead.live.box import WAITING, BlackBox
from levelhead.live.messages import Orientation
from levelhead.live.rerun import rerun
from levelhead.sample import Sample
from levelhead.sources.formats.blackbox import read_box

SAMPLES = 1_000_000
SAID = Orientation(1, 0, 0.0, 0, (1.0, 0.0, 0.0, 0.0), (0.1, 0.1, 0.1), (0.0, 0.0, 0.0), 0)


def throughput(folder: Path) -> dict[str, Any]:
    """A million samples through the box, from the call to the closed file."""
    box = BlackBox(folder / "speed.mcap")
    box.begin({"version": "benchmark"})
    sample = Sample(0.0, (0.1, 0.2, 0.3), (0.0, 0.1, 9.8), (1.0, 19.0, -45.0))
    began = time.perf_counter()
    for seq in range(SAMPLES):
        box.sample(seq, seq, sample, SAID)
        while seq % 1000 == 0 and seq - box.written > WAITING // 2:
            time.sleep(0.001)
    handed = time.perf_counter() - began
    box.close()
    whole = time.perf_counter() - began
    found = len(read_box(folder / "speed.mcap").rows)
    size = (folder / "speed.mcap").stat().st_size
    return {"samples": found, "handed over a second": round(SAMPLES / handed), "written a second": round(found / whole),
            "bytes a sample": round(size / max(1, found))}  # fmt: skip


def killed(folder: Path, number: int) -> dict[str, Any]:
    """One node that is killed."""
    path = folder / f"{number}.mcap"
    command = [sys.executable, "-m", "levelhead", "run", "--source", "emulated:mpu6050", "--calibrate", "0"]
    process = subprocess.Popen([*command, "--box", str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if "Hz  roll" in line:
            break
    time.sleep(random.uniform(2.0, 5.0))
    process.send_signal(signal.SIGKILL)
    at = time.time()
    process.wait()
    box = read_box(path)
    said, again = rerun(path)
    lost = at - float(box.rows["stamp"][-1]) * 1e-9
    return {
        "kill": number,
        "samples": len(box.rows),
        "lost [s]": lost,
        "same bits": np.array_equal(said.quat, again.quat),
    }


def main() -> None:
    """Runs both."""
    parser = options(__doc__)
    parser.add_argument("--kills", type=int, default=20, help="nodes that are killed (default 20)")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        speed = throughput(folder)
        kills = [killed(folder, number) for number in range(1, given.kills + 1)]
    lost = [row["lost [s]"] for row in kills]
    summary = {
        "kills": len(kills), "files that open": sum(row["samples"] > 0 for row in kills),
        "lost, median [s]": float(np.median(lost)), "lost, most [s]": max(lost),
        "same bits": sum(row["same bits"] for row in kills),
    }  # fmt: skip
    tables = [
        Table("Black box, samples a second", {key: key for key in speed}, [speed]),
        Table("Killed at 200 Hz", {key: key for key in summary}, [summary]),
    ]
    show(tables, given.json)


if __name__ == "__main__":
    main()
