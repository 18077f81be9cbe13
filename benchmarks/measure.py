"""What every benchmark here shares: fair timing, the machine, tables for people and JSON for programs.

Absolute times depend on the machine and on who else is using it. So all cases of a comparison run in one process, in
turn within every repeat, on the clock of this thread's CPU time, and what counts is the median over the repeats of the
ratio of two cases.
"""

import argparse
import gc
import importlib.metadata
import json
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Case:
    """Something to be timed: ``work()`` handles ``samples`` samples."""

    name: str
    work: Callable[[], object]
    samples: int


@dataclass(frozen=True)
class Timing:
    """Nanoseconds of CPU time per sample, one value per repeat."""

    name: str
    ns: tuple[float, ...]

    @property
    def least(self) -> float:
        """The fastest repeat."""
        return min(self.ns)

    @property
    def median(self) -> float:
        """The middle repeat."""
        return statistics.median(self.ns)

    def over(self, other: "Timing") -> float:
        """Median of the ratios to another case, repeat by repeat."""
        return statistics.median(a / b for a, b in zip(self.ns, other.ns, strict=True))


def interleaved(cases: Sequence[Case], repeats: int) -> list[Timing]:
    """Time all cases in turn, ``repeats`` times over; a first run of each, which may compile, does not count."""
    for case in cases:
        case.work()
    spent: list[list[float]] = [[] for _ in cases]
    for _ in range(repeats):
        for case, mine in zip(cases, spent, strict=True):
            gc.collect()
            began = time.thread_time_ns()
            case.work()
            mine.append((time.thread_time_ns() - began) / case.samples)
    return [Timing(case.name, tuple(mine)) for case, mine in zip(cases, spent, strict=True)]


def once(command: Sequence[str], **options: Any) -> tuple[float, subprocess.CompletedProcess[str]]:
    """Wall seconds of a whole process, and what came out of it.

    Raises:
        SystemExit: it failed; with the end of what it said.
    """
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    seconds = time.perf_counter() - began
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed with {done.returncode}:\n{(done.stderr or done.stdout)[-2000:]}")
    return seconds, done


def machine() -> dict[str, str]:
    """What the figures were taken on."""
    from native import compiler

    facts = {"cpu": _cpu(), "system": platform.system(), "python": platform.python_version()}
    for package in ("levelhead", "numpy", "numba", "scipy", "pyarrow", "vqf", "imufusion"):
        try:
            facts[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            facts[package] = "not installed"
    try:
        facts["gcc"] = compiler()
    except SystemExit:
        facts["gcc"] = "not installed"
    return facts


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} logical CPUs" if names else platform.machine()


@dataclass
class Table:
    """A table of figures: heading by column key, and rows by the same keys."""

    title: str
    columns: dict[str, str]
    rows: list[dict[str, Any]] = field(default_factory=list)
    note: str = ""


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)


def show(tables: Sequence[Table], as_json: bool) -> None:
    """Print the machine and the tables, or all of it as JSON."""
    facts = machine()
    if as_json:
        found = [{"title": t.title, "rows": t.rows, "note": t.note} for t in tables]
        json.dump({"machine": facts, "tables": found}, sys.stdout, indent=2, ensure_ascii=False)
        print()
        return
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as Grid

    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(
        ", ".join(f"{name} {value}" for name, value in facts.items()), style="dim", highlight=False, soft_wrap=True
    )
    for table in tables:
        grid = Grid(title=table.title, caption=escape(table.note) or None, box=box.SIMPLE_HEAD, title_justify="left")
        grid.caption_justify = "left"
        for i, heading in enumerate(table.columns.values()):
            grid.add_column(heading, justify="right" if i else "left")
        for row in table.rows:
            grid.add_row(*(escape(_cell(row.get(key))) for key in table.columns))
        console.print(grid)


def options(doc: str | None, repeats: int = 9) -> argparse.ArgumentParser:
    """A parser with what every script here takes."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="figures as JSON instead of tables")
    parser.add_argument("--repeats", type=int, default=repeats, help=f"times that every case runs (default {repeats})")
    return parser
