"""The doctor on logs whose problems are known, and on clean ones.

    python benchmarks/doctor.py [NAME…] [--clean]

For each log of shared/data/wild: which problems of PROBLEMS.json the report names, which not. With --clean: findings
that are no notes on recordings with truth (BROAD without disturbance, EuRoC, TUM VI, phones carried about), where there
should be none but what is true.
"""

import json
import os
import sys
from collections import Counter
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead.inspection import examine
from levelhead.recording import Recording

DATA = Path(os.environ["LEVELHEAD_DATA"])


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


def clean() -> None:
    """Findings on recordings that are known to be good."""
    paths = [path for path in sorted((DATA / "broad").glob("*.mat")) if "undisturbed" in path.name]
    paths += sorted((DATA / "truth").glob("*/*.npz"))
    alarms = 0
    for path in paths:
        report = examine(recording(path), path.stem)
        bad = [one for one in report.findings if one.severity != "note"]
        alarms += bool(bad)
        print(f"{path.parent.name}/{path.stem:44} {'; '.join(str(one)[:150] for one in bad)}")
    print(f"{alarms} of {len(paths)} with a finding")


def recording(path: Path) -> Recording:
    """A recording with truth, as benchmarks read it."""
    if path.suffix == ".mat":
        return lh.read(path)
    with np.load(path) as data:
        mag = data.get("mag")
        return Recording(data["t"], data["gyr"], data["acc"], mag)


if __name__ == "__main__":
    if "--clean" in sys.argv:
        clean()
    else:
        known([word for word in sys.argv[1:] if not word.startswith("--")])
