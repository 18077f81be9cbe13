"""For tests of the page in Chromium: patience, its numbers and its time, and its controls for everybody."""

import time
from collections.abc import Callable
from pathlib import Path

WEB = Path(__file__).resolve().parents[2] / "web"
PATIENCE = 120.0  # s for what happens at once on a machine that is not busy: the browser draws 3-D on its CPU
CONTROLS = "button, input, select, textarea, summary, a[href], [tabindex='0']"
REACH = "window.reached = new Set(); addEventListener('focusin', ({ target }) => window.reached.add(target));"
TOP = """document.activeElement?.blur();
for (const one of document.querySelectorAll("#charts, #side")) one.scrollTop = 0;"""
MISSED = """(controls) => [...(document.querySelector("dialog[open]") ?? document).querySelectorAll(controls)]
  .filter((one) => one.checkVisibility() && !one.disabled && !window.reached.has(one))
  .map((one) => one.outerHTML.slice(0, 120))"""


def eventually(what: Callable[[], object], seconds: float = PATIENCE) -> None:
    """Waits until it holds."""
    until = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < until, "it never happened"
        time.sleep(0.05)


def numbers(page, *names: str) -> list[float]:
    """The angles that the page shows, in degrees."""
    return [float(page.inner_text(f"#{name}").rstrip("°").replace("−", "-")) for name in names]


def seek(page, seconds: float) -> None:
    """Moves the cursor of the page."""
    page.evaluate(
        "t => { const bar = document.querySelector('.seek'); bar.value = t; bar.dispatchEvent(new Event('input')); }",
        seconds,
    )


def check_accessibility(page) -> None:
    """No serious finding of axe-core, to which a control without a name belongs; Tab reaches every control."""
    page.evaluate((WEB / "node_modules" / "axe-core" / "axe.min.js").read_text())
    found = page.evaluate(
        "axe.run().then(({violations}) => violations.map(one => [one.impact, one.id, one.nodes[0].html]))"
    )
    serious = [one for one in found if one[0] in ("serious", "critical")]
    assert not serious, serious
    page.evaluate(REACH)
    for _ in range(page.locator(CONTROLS).count() + 5):
        page.keyboard.press("Tab")
    missed = page.evaluate(MISSED, CONTROLS)
    assert not missed, missed
    page.evaluate(TOP)
