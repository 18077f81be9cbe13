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

from tests.reference import (  # noqa: F401  (each registers its layouts)
    layouts_of_apps,
    layouts_of_firmware,
    layouts_of_laboratories,
    layouts_of_robots,
)
from tests.reference.dialects import Dialect, Motion, off, simulate
from tests.reference.layouts import ROUNDS, UNFUSABLE

import levelhead as lh
from levelhead.sources.hints import NeedsHints


def judge(name: str, write: Dialect, motion: Motion, folder: Path) -> tuple[str, str]:
    """(verdict, why)."""
    path = write(folder, motion)
    fusable = name not in UNFUSABLE
    try:
        recording = lh.read(path)
    except lh.LevelheadError as error:
        if not (isinstance(error, NeedsHints) and error.path):
            return ("nowhere" if fusable else "refused"), str(error)
        if not fusable:
            return "mistaken", f"{error} reads what cannot be fused"
        wrong = off(lh.read(error.path, **error.suggested), motion)
        return ("mistaken", f"{error} -> {wrong}") if wrong else ("command", str(error))
    guesses = [note for note in recording.meta["notes"] if "a guess" in note]
    wrong = off(recording, motion) if fusable else "cannot be fused"
    if wrong:
        return "mistaken" if guesses else "WRONG", f"{wrong}; {'; '.join(recording.meta['notes'])}"
    return ("guess", "; ".join(guesses)) if guesses else ("right", "")


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
