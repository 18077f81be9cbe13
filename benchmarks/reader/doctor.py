"""The doctor on logs whose problems are known: which of PROBLEMS.json in shared/data/wild the report names, which not.

    python -m benchmarks.reader.doctor [NAME…]

What it says of clean recordings is in clean_logs.py.
"""

import json
import sys
from collections import Counter

from benchmarks.measure import DATA

import levelhead as lh


def known(names: list[str]) -> None:
    """Coverage of PROBLEMS.json."""
    key = json.loads((DATA / "wild" / "PROBLEMS.json").read_text())
    total = found = 0
    missed: Counter[str] = Counter()
    for file, problems in key.items():
        if names and file not in names:
            continue
        report = lh.inspect(DATA / "wild" / file)
        wanted = {one["problem"] for one in problems}
        total += len(wanted)
        found += len(wanted & report.names())
        missed.update(wanted - report.names())
        more = sorted(one.name for one in report.findings if one.name not in wanted and one.severity != "note")
        print(
            f"{file:28} {len(wanted & report.names())}/{len(wanted)} missed "
            f"{sorted(wanted - report.names())} more {more}"
        )
    print(f"{found} of {total} ({100 * found / max(1, total):.0f} %); missed {dict(missed)}")


if __name__ == "__main__":
    known(sys.argv[1:])
