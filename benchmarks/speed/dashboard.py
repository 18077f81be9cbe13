"""The live dashboard at 100 Hz: how old what the page shows is, what its server costs, and what it costs the node.

Three processes: `levelhead run --publish`, `levelhead view --live`, and headless Chromium. The page holds the stamp of
the sample that it shows; every 40 ms it is asked for it and for its own clock, the same machine's. The node runs
alone for a while before the page is opened, and its missed ticks are counted in both halves.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.measure import options, show

from levelhead.bench.timing import Table

ENDPOINT = "tcp/127.0.0.1:17448"
ASKED = "() => [Date.now(), Number(document.getElementById('status').dataset.stamp || 0)]"


def cpu_seconds(pid: int) -> float:
    """CPU time of a process, with its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def missed(lines: list[str]) -> int:
    """Ticks that the node said it missed, line by line."""
    return sum(int(found[1]) for line in lines if (found := re.search(r"missed (\d+)", line)))


def main() -> None:
    """Runs all three."""
    from playwright.sync_api import sync_playwright

    parser = options(__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each half (default 60)")
    given = parser.parse_args()
    program = [sys.executable, "-m", "levelhead"]
    run = [*program, "run", "--source", "emulated:mpu6050", "--rate", "100", "--publish", ENDPOINT, "--calibrate", "0"]
    node = subprocess.Popen([*run, "--duration", str(2 * given.seconds + 20)], stdout=subprocess.PIPE, text=True)
    time.sleep(given.seconds)
    view = subprocess.Popen(
        [*program, "view", "--live", "--endpoint", ENDPOINT, "--port", "18081"], stdout=subprocess.PIPE, text=True
    )
    assert view.stdout is not None and node.stdout is not None
    url = view.stdout.readline().split()[0]
    lags = []
    with sync_playwright() as one:
        browser = one.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1400, "height": 1000})
        page.goto(url)
        page.wait_for_function(f"() => ({ASKED})()[1] > 0", timeout=30_000)
        time.sleep(2.0)
        spent, began = cpu_seconds(view.pid), time.monotonic()
        while time.monotonic() - began < given.seconds:
            now, stamp = page.evaluate(ASKED)
            lags.append(now - int(stamp))
            time.sleep(0.04)
        share = (cpu_seconds(view.pid) - spent) / (time.monotonic() - began)
        browser.close()
    view.terminate()
    lines = [line for line in node.communicate()[0].splitlines() if " Hz  roll" in line]
    lags.sort()
    half = round(given.seconds)
    row = {
        "readings": len(lags),
        "stamp → page p50 [ms]": lags[len(lags) // 2],
        "p95 [ms]": lags[int(0.95 * len(lags))],
        "server, % of a core": 100.0 * share,
        "node missed before": missed(lines[:half]),
        "node missed with page": missed(lines[half:]),
    }
    show([Table("Dashboard at 100 Hz", {key: key for key in row}, [row])], given.json)


if __name__ == "__main__":
    main()
