"""Logs as the world has them: what the reader makes of each without a hint, number by number against a decoder.

    python -m benchmarks.reader.wild [FOLDER] [NAME…] [--details]

FOLDER is shared/data/wild, with INDEX.json as the key. A log is

right       all numbers of gyroscope and accelerometer are those of the decoder, and time runs as it does
guess       so, and a note says that something of it is a guess; or not so, and the note said that it is a guess
refused     refused, and nothing can be made of it (INDEX.json: fusable)
command     refused with a command line that, executed, makes it right
dead end    refused otherwise
WRONG       read, not right, and nothing said
"""

import json
import sys
from collections import Counter
from pathlib import Path

from benchmarks.measure import DATA
from tests.reference.wild import judge


def main() -> None:
    """Prints the table."""
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    folder = Path(words.pop(0) if words and Path(words[0]).is_dir() else DATA / "wild")
    key = [entry for entry in json.loads((folder / "INDEX.json").read_text()) if not words or entry["file"] in words]
    counts: Counter[str] = Counter()
    for entry in key:
        verdict, why = judge(folder / entry["file"], entry)
        counts[verdict] += 1
        print(
            f"{entry['file']:30} {verdict:9} "
            f"{why if '--details' in sys.argv or verdict in ('WRONG', 'dead end') else why[:110]}"
        )
    print(", ".join(f"{name} {count}" for name, count in counts.most_common()))


if __name__ == "__main__":
    main()
