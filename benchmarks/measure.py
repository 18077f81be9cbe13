"""What every script here shares: whole processes, the machine, tables for people and JSON for programs.

The fair timing itself is levelhead's own: ``levelhead.bench.timing``.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from levelhead.bench import timing
from levelhead.bench.datasets import list_logs
from levelhead.bench.processes import run_parallel
from levelhead.bench.timing import Progress, Table
from levelhead.errors import LevelheadError
from levelhead.recording import Recording
from levelhead.sources import read

DATA = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[2] / "shared" / "data"))  # the real recordings
T = TypeVar("T")
R = TypeVar("R")


def run_script(main: Callable[[], object]) -> None:
    """A script from its start to its end; recordings that cannot be used are told in one sentence, as levelhead does.

    Raises:
        SystemExit: 2, after that sentence.
    """
    try:
        main()
    except LevelheadError as error:
        words = str(error)
    except OSError as error:
        words = f"{error.filename}: {error.strerror}" if error.filename else str(error)
    else:
        return
    sys.stderr.write(f"{Path(sys.argv[0]).name}: {' '.join(words.split())}\n")
    raise SystemExit(2)


def read_reference(path: Path) -> Recording:
    """A recording with a reference.

    Raises:
        LevelheadError: it cannot be read, or has none.
    """
    recording = read(path)
    if recording.truth is None:
        raise LevelheadError(f"{path} holds no true orientation; expected a reference to compare with")
    return recording


def read_references(places: Sequence[Path]) -> list[tuple[Path, Recording]]:
    """Those recordings in some folders that have a reference.

    Raises:
        LevelheadError: one cannot be read, or none has a reference.
    """
    found = [(path, read(path)) for path in list_logs(places)]
    found = [(path, recording) for path, recording in found if recording.truth is not None]
    if not found:
        listed = ", ".join(map(str, places))
        raise LevelheadError(f"no recording in {listed} holds a true orientation; expected a reference to compare with")
    return found


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
    """What the figures were taken on, the C compiler included."""
    from tests.reference.c_library import compiler

    try:
        gcc = compiler()
    except SystemExit:
        gcc = "not installed"
    return timing.machine() | {"gcc": gcc}


def show(tables: Sequence[Table], as_json: bool) -> None:
    """Print the machine and the tables, or all of it as JSON."""
    from levelhead.publish.bench_tables import print_figures

    if not as_json:
        print_figures(tables, machine())
        return
    json.dump({"machine": machine(), "tables": [t.to_dict() for t in tables]}, sys.stdout, indent=2, ensure_ascii=False)
    print()


def part_of(report: Progress, start: float, share: float) -> Progress:
    """Progress of a part that begins at ``start`` and is ``share`` of the whole, 0 to 1."""
    return lambda fraction: report(start + share * fraction)


def run_tasks(work: Callable[[T], R], tasks: Sequence[T], jobs: int, report: Progress) -> dict[T, R]:
    """What ``work`` makes of each task, in so many processes."""
    found = {}
    for done, (task, result) in enumerate(run_parallel(work, tasks, jobs), 1):
        found[task] = result
        report(done / len(tasks))
    return found


def options(doc: str | None, repeats: int = 9) -> argparse.ArgumentParser:
    """A parser with what every script here takes."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="figures as JSON instead of tables")
    parser.add_argument("--repeats", type=int, default=repeats, help=f"times that every case runs (default {repeats})")
    return parser
