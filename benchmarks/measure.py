"""What every script here shares: whole processes, the machine, tables for people and JSON for programs.

The fair timing itself is levelhead's own: ``levelhead.bench.timing``.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

from levelhead.bench import timing
from levelhead.bench.timing import Table


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
    from native import compiler

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


def show_markdown(table: Table) -> None:
    """Print a table as it stands on a page of the docs, with its note below."""
    from levelhead.publish.bench_tables import format_cell

    numbers = [any(isinstance(row.get(key), int | float) for row in table.rows) for key in table.columns]
    lines = [list(table.columns.values()), ["--:" if right else "---" for right in numbers]]
    lines += [[format_cell(row.get(key)) for key in table.columns] for row in table.rows]
    print(*("| " + " | ".join(line) + " |" for line in lines), sep="\n")
    if table.note:
        print(f"\n{table.note}")


def options(doc: str | None, repeats: int = 9) -> argparse.ArgumentParser:
    """A parser with what every script here takes."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="figures as JSON instead of tables")
    parser.add_argument("--repeats", type=int, default=repeats, help=f"times that every case runs (default {repeats})")
    return parser
