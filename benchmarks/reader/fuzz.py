"""Mutated logs of all formats: a recording or a sentence, never a traceback, a hang, NaN, or a unit wrong in silence.

    python -m benchmarks.reader.fuzz [--count 10000] [--seed 0]
    python -m benchmarks.reader.fuzz --replay 0:4711 [--keep FOLDER]    # one of them again, and its file

Seeds are small logs made here, one per format, and the smaller ones of shared/data/wild where there are any. A mutation
flips bytes, tears lines, swaps columns, changes units in the header, translates it, cuts the file off or repeats a
part. A reading of a mutated log is wrong in silence if rows of its sensors are rows of the seed times a factor
between units, or its time runs 30 times as fast, while no note holds "a guess" and the mutation did not touch the
numbers.
"""

import argparse
import sys
from pathlib import Path

from tests.reference.fuzz import run


def main() -> None:
    """Prints the outcomes; exit code 1 if any must not be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--replay", metavar="SEED:NUMBER", help="this one only")
    parser.add_argument("--keep", type=Path, help="where the mutated file of --replay is left")
    options = parser.parse_args()
    if options.replay:
        seed, number = (int(word) for word in options.replay.split(":"))
        outcomes = run(seed, [number], options.keep or Path())
    else:
        outcomes = run(options.seed, range(options.count))
    print(dict(outcomes))
    sys.exit(int(any(name.split()[0].isupper() for name in outcomes)))


if __name__ == "__main__":
    main()
