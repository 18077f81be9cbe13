"""How long the pages that run in the browser alone take: a log of a million rows, and a step of the lesson's slider.

``python -m benchmarks.speed.try_page SITE [--rows 1000000]``: SITE is the folder that ``make try`` wrote. A headless
Chromium draws on the processor. "read" begins with the file, when Python runs already, and ends with the answer of the
worker; "open" ends with the charts on the screen. "slider" is a step of a drag in the lesson until it is on the screen;
the first one compiles. Each figure stands beside a fixed amount of work of one core, timed in the same turn: where
others use the machine, the ratio holds. A site without the page that needs Python (``index.html``) is measured without
it.
"""

import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, run_script, show
from benchmarks.speed.page import AFTER_FRAME, DRAWN, work
from tests.reference.folder_server import serve_folder

import levelhead as lh
from levelhead.bench.timing import Table
from levelhead.errors import LevelheadError

READ = "() => document.getElementById('state').textContent.startsWith('The filter runs')"
SHOWN = "() => document.body.dataset.ready === 'true'"
DRAG = f"""(share) => {{ const bar = document.querySelector('#parameter-gyr_noise'), began = performance.now();
  bar.value = share * bar.max; bar.dispatchEvent(new Event('input')); return {DRAWN}; }}"""
PAGES = {"Python": "index.html", "plain columns": "plain.html"}
PIECE = 10_000  # rows that are simulated, and repeated


def write_log(path: Path, rows: int) -> None:
    """A hand's motion at 100 Hz, again and again, as a CSV of six columns."""
    made = lh.simulate.recording("MPU-6050", "hand", duration=PIECE / 100.0, rate=100.0)
    names = ["t [s]", *(f"gyr_{axis} [rad/s]" for axis in "xyz"), *(f"acc_{axis} [m/s²]" for axis in "xyz")]
    texts = [",".join(f"{value:.6f}" for value in row) for row in np.column_stack([made.gyr, made.acc]).tolist()]
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(names) + "\n")
        file.writelines(f"{0.01 * row:.2f},{texts[row % len(texts)]}\n" for row in range(rows))


def open_log(browser: Any, url: str, log: Path, small: Path) -> dict[str, float]:
    """A log in a page that has opened another one before; seconds."""
    page = browser.new_page(viewport={"width": 1400, "height": 1000})
    page.set_default_timeout(600_000)
    page.goto(url)
    page.set_input_files("#file", small)
    page.wait_for_function(SHOWN)
    page.click("#another")
    page.evaluate("() => { delete document.body.dataset.ready; }")
    began = time.perf_counter()
    page.set_input_files("#file", log)
    page.wait_for_function(READ, polling=10)
    read = time.perf_counter()
    page.wait_for_function(SHOWN, polling=10)
    page.evaluate(AFTER_FRAME)
    opened = time.perf_counter()
    page.close()
    return {"read": read - began, "open": opened - began}


def drag(browser: Any, url: str) -> dict[str, float]:
    """The first step of a drag in the lesson, and the slowest but that; seconds."""
    page = browser.new_page(viewport={"width": 1400, "height": 1000})
    page.goto(f"{url}lesson.html")
    page.wait_for_function(SHOWN)
    steps = [page.evaluate(DRAG, share) / 1000.0 for share in np.linspace(0.1, 0.9, 17)]
    page.close()
    return {"slider, first step": steps[0], "slider, slowest other": max(steps[1:])}


def turn(browser: Any, url: str, pages: dict[str, str], log: Path, small: Path) -> dict[str, float]:
    """One look at each page; seconds."""
    found = {"work": work()}
    for name, page in pages.items():
        found |= {f"{part}, {name}": spent for part, spent in open_log(browser, url + page, log, small).items()}
    return found | drag(browser, url)


def main() -> None:
    """Some turns."""
    from playwright.sync_api import sync_playwright

    parser = options(__doc__)
    parser.add_argument("site", type=Path, help="what make try wrote, such as build/site/try")
    parser.add_argument("--rows", type=int, default=1_000_000, help="of the log (default 1,000,000)")
    parser.add_argument("--turns", type=int, default=3, help="looks at each page (default 3)")
    given = parser.parse_args()
    if not (given.site / "plain.html").is_file():
        raise LevelheadError(f"{given.site} holds no plain.html; expected the folder that make try wrote")
    pages = {name: page for name, page in PAGES.items() if (given.site / page).is_file()}
    with (
        tempfile.TemporaryDirectory() as folder,
        serve_folder(given.site) as url,
        sync_playwright() as one,
    ):
        log, small = Path(folder) / "log.csv", Path(folder) / "small.csv"
        write_log(log, given.rows)
        write_log(small, PIECE)
        browser = one.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        turns = [turn(browser, url, pages, log, small) for _ in range(given.turns)]
        browser.close()
    columns = {"what": "part", "seconds": "median [s]", "least": "least [s]", "work": "by a fixed work"}
    rows = [
        {
            "what": name,
            "seconds": statistics.median(one[name] for one in turns),
            "least": min(one[name] for one in turns),
            "work": statistics.median(one[name] / one["work"] for one in turns),
        }
        for name in turns[0]
    ]
    show([Table("The pages that run in the browser alone", columns, rows)], given.json)


if __name__ == "__main__":
    run_script(main)
