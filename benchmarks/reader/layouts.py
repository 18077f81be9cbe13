"""Layouts of public code that the reader had not seen: each round's counts, the commands of its messages pasted.

    python -m benchmarks.reader.layouts [ROUND or NAME…]

A layout is

right      read, all numbers are those that were written, and no note calls anything a guess
guess      read right, and a note calls something a guess
refused    refused without a command, and it cannot be fused
command    refused with a command that, pasted, makes it right
nowhere    refused otherwise
mistaken   read wrong, by a pasted command or with a note that calls it a guess
WRONG      read wrong in silence, or it cannot be fused
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.reference.dialects import simulate
from tests.reference.layout_verdicts import ROUNDS, judge


def main() -> None:
    """Prints a line for each layout that is not right, and the counts of each round."""
    words, motion = sys.argv[1:], simulate("hand")
    for kind, layouts in ROUNDS.items():
        counts: Counter[str] = Counter()
        for name, write in layouts.items():
            if not words or {kind, name} & set(words):
                with tempfile.TemporaryDirectory() as folder:
                    verdict, why = judge(name, write, motion, Path(folder))
                counts[verdict] += 1
                if verdict != "right":
                    print(f"{name:32} {verdict:9} {why[:300]}")
        if counts:
            print(f"{kind}, {counts.total()}: {', '.join(f'{name} {count}' for name, count in counts.most_common())}")


if __name__ == "__main__":
    main()
