"""Fair timing: all cases of a comparison in one process, in turn, on one clock.

Absolute times depend on the machine and on who else is using it. So all cases run in turn within every repeat, on the
clock of this thread's CPU time, and the result is the median over the repeats of the ratio of two cases.
"""

import gc
import importlib.metadata
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from levelhead.evaluate.text_table import Cell

Progress = Callable[[float], None]  # takes the fraction done, 0 to 1
PACKAGES = ("levelhead", "numpy", "numba", "scipy", "pyarrow", "vqf", "imufusion", "ahrs", "riann")


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


@dataclass
class Table:
    """A table of figures: heading by column key, and rows by the same keys."""

    title: str
    columns: dict[str, str]
    rows: list[dict[str, Cell]] = field(default_factory=list)
    note: str = ""

    def to_dict(self) -> dict[str, object]:
        """Ready for JSON."""
        return {"title": self.title, "rows": self.rows, "note": self.note}


def time_interleaved(cases: Sequence[Case], repeats: int, progress: Progress | None = None) -> list[Timing]:
    """Time all cases in turn, ``repeats`` times over; a first run of each, which may compile, does not count."""
    spent: list[list[float]] = [[] for _ in cases]
    gc.collect()
    gc.freeze()  # earlier objects are not examined again: with a compiler loaded that takes seconds a time
    try:
        for repeat in range(repeats + 1):
            for i, (case, mine) in enumerate(zip(cases, spent, strict=True)):
                gc.collect()
                began = time.thread_time_ns()
                case.work()
                if repeat:
                    mine.append((time.thread_time_ns() - began) / case.samples)
                if progress is not None:
                    progress((repeat + (i + 1) / len(cases)) / (repeats + 1))
    finally:
        gc.unfreeze()
    return [Timing(case.name, tuple(mine)) for case, mine in zip(cases, spent, strict=True)]


def machine() -> dict[str, str]:
    """The machine of a measurement: processor, system, and the versions of all packages that took part."""
    facts = {"cpu": _cpu(), "system": platform.system(), "python": platform.python_version()}
    for package in PACKAGES:
        try:
            facts[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            facts[package] = "not installed"
    return facts


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} logical CPUs" if names else platform.machine()
