"""How long the page of `levelhead view` takes for an hour at 100 Hz: to open, to seek, to zoom.

``python -m benchmarks.speed.page [LOG] [--seconds 3600]``: the command, its server and a headless Chromium that draws
on the processor. "open" begins with the command and ends with the charts on the screen, "with body" with the body in
space. Without a log it simulates one. Each figure stands beside a fixed amount of work of one core, timed in the same
turn: where others use the machine, the ratio holds.
"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, run_script, show

import levelhead as lh
from levelhead.bench.timing import Table

# Byte code is written by the first start, as at home.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
# Two frames: the second begins when the first is on the screen. The page's own clock: its main thread is busy.
DRAWN = (
    "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - began))))"
)
AFTER_FRAME = f"() => {{ const began = 0; return {DRAWN}; }}"
BODY = ".scene[data-state]"
CHARTED = """new MutationObserver((_, seen) => {
  if (document.body?.dataset.ready === undefined) return;
  seen.disconnect();
  const now = () => performance.timeOrigin + performance.now();
  requestAnimationFrame(() => requestAnimationFrame(() => { window.charted = now(); }));
}).observe(document, { attributes: true, subtree: true, attributeFilter: ["data-ready"] });"""
WHEN = """() => new Promise((done) => {
  const look = () => (window.charted ? done(window.charted) : setTimeout(look, 20)); look(); })"""
SEEK = f"""(share) => {{ const bar = document.querySelector('.seek'), began = performance.now();
  bar.value = share * bar.max; bar.dispatchEvent(new Event('input')); return {DRAWN}; }}"""
ZOOM = f"""(key) => {{ const began = performance.now();
  document.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true }})); return {DRAWN}; }}"""


def write_log(path: Path, seconds: float) -> None:
    """A hand's motion at 100 Hz as a CSV of six columns."""
    made = lh.simulate.recording("MPU-6050", "hand", duration=seconds, rate=100.0)
    names = ["t [s]", *(f"gyr_{axis} [rad/s]" for axis in "xyz"), *(f"acc_{axis} [m/s²]" for axis in "xyz")]
    rows = np.column_stack([made.t, made.gyr, made.acc])
    np.savetxt(path, rows, "%.6f", ",", header=",".join(names), comments="", encoding="utf-8")


def work() -> float:
    """Seconds of a fixed amount of work."""
    began, total = time.perf_counter(), 0
    for number in range(2_000_000):
        total += number
    return time.perf_counter() - began


def turn(log: Path, browser: Any) -> dict[str, float]:
    """One start of the command, and one look at its page; seconds."""
    fixed, began = work(), time.perf_counter()
    command = [sys.executable, "-m", "levelhead", "view", str(log), "--port", "18181"]
    view = subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
    assert view.stdout is not None
    try:
        url = view.stdout.readline().split()[0]
        served, page = time.perf_counter(), browser.new_page(viewport={"width": 1400, "height": 1000})
        page.add_init_script(CHARTED)
        asked, since_epoch = time.perf_counter(), time.time()
        page.goto(url)
        page.wait_for_selector("body[data-ready]")
        opened = page.evaluate(WHEN) / 1000.0 - since_epoch
        page.wait_for_selector(BODY)
        page.evaluate(AFTER_FRAME)
        whole = time.perf_counter() - asked
        seeks = [page.evaluate(SEEK, share) / 1000.0 for share in np.linspace(0.1, 0.9, 9)]
        zooms = [page.evaluate(ZOOM, key) / 1000.0 for key in ("+", "+", "-", "-")]
        page.close()
    finally:
        view.terminate()
        view.wait()
    return {
        "work": fixed, "address": served - began, "page": opened, "open": served - began + opened,
        "with body": served - began + whole,
        "seek": max(seeks), "zoom": max(zooms),
    }  # fmt: skip


def main() -> None:
    """Some turns."""
    from playwright.sync_api import sync_playwright

    parser = options(__doc__)
    parser.add_argument("log", type=Path, nargs="?", help="a recording (default: a simulated one)")
    parser.add_argument("--seconds", type=float, default=3600.0, help="length of the simulated one (default 3600)")
    parser.add_argument("--turns", type=int, default=5, help="starts of the command (default 5)")
    given = parser.parse_args()
    if given.log is not None:
        lh.read(given.log)  # refuses it before a browser starts
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as one:
        log = given.log
        if log is None:
            log = Path(folder) / "hour.csv"
            write_log(log, given.seconds)
        browser = one.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        turns = [turn(log, browser) for _ in range(given.turns)]
        browser.close()
    columns = {"what": "part", "seconds": "median [s]", "least": "least [s]", "work": "by a fixed work"}

    def row(name: str) -> dict[str, Any]:
        spent = [one[name] for one in turns]
        by_work = [one[name] / one["work"] for one in turns]
        return {
            "what": name,
            "seconds": statistics.median(spent),
            "least": min(spent),
            "work": statistics.median(by_work),
        }

    show([Table("A recording in the page", columns, [row(name) for name in turns[0]])], given.json)


if __name__ == "__main__":
    run_script(main)
