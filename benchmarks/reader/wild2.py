"""The second collection of logs: what the reader makes of each without a hint, and the command of its message.

    python -m benchmarks.reader.wild2 [FOLDER] [NAME…]

FOLDER is shared/data/wild2. Its INDEX.json holds for each log whether it can be fused, and what its owner knows: units,
columns and rate. A log is

right       read, and units and columns are those that its owner knows
command     refused with a command that, executed, makes it right; a rate that only its owner knows counts
refused     refused without a command, and it cannot be fused
dead end    refused otherwise
trap        refused with a command that fuses what cannot be fused
WRONG       read, and not as its owner knows it, or it cannot be fused
"""

import json
import sys
from collections import Counter
from pathlib import Path

from benchmarks.measure import DATA
from tests.reference.wild2 import judge


def main() -> None:
    """Prints the table."""
    words = sys.argv[1:]
    folder = Path(words.pop(0) if words and Path(words[0]).is_dir() else DATA / "wild2")
    counts: Counter[str] = Counter()
    for entry in json.loads((folder / "INDEX.json").read_text()):
        if not words or entry["file"] in words:
            verdict, why = judge(folder / entry["file"], entry)
            counts[verdict] += 1
            print(f"{entry['file']:30} {verdict:9} {why[:200]}")
    print(", ".join(f"{name} {count}" for name, count in counts.most_common()))


if __name__ == "__main__":
    main()
