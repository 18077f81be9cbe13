"""A small corpus: six recordings of two groups, one file that is none."""

from pathlib import Path

import levelhead as lh
from levelhead.sources.formats.csv_writer import write_csv

GOOD = 6


def write_corpus(folder: Path, seconds: float = 4.0) -> Path:
    for i in range(GOOD):
        group = folder / ("walk" if i % 2 else "hand")
        group.mkdir(parents=True, exist_ok=True)
        motion = "walking" if i % 2 else "hand"
        write_csv(
            lh.simulate.recording("MPU-6050", motion, duration=seconds, rate=100.0, seed=i), group / f"unit1_day{i}.csv"
        )
    (folder / "walk" / "broken.csv").write_text("this is no recording\n")
    return folder
