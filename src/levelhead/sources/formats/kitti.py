"""KITTI's oxts: a folder with a file of 30 numbers for each sample, and a file with their stamps.

The order of the numbers is that of dataformat.txt in KITTI's raw data (Geiger et al., IJRR 2013).
"""

from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.dates import nanoseconds
from levelhead.sources.place import satellite_place
from levelhead.sources.table import ArrayTable

_FORCE, _RATE = slice(11, 14), slice(17, 20)  # ax ay az, wx wy wz: forward, left, up
_WIDTH = 30
_MAX_SAMPLES = 1_000_000  # samples


def is_oxts(folder: Path) -> bool:
    """Whether a folder is laid out like KITTI's oxts."""
    return (folder / "timestamps.txt").is_file() and any((folder / "data").glob("*.txt"))


def oxts_table(folder: Path) -> ArrayTable:
    """The samples of a folder in the order of their names.

    Raises:
        LevelheadError: a file without its 30 numbers, or another number of stamps than of files.
    """
    files = sorted((folder / "data").glob("*.txt"))[:_MAX_SAMPLES]
    stamps = [line for line in (folder / "timestamps.txt").read_text("utf-8", "replace").split("\n") if line.strip()]
    if len(stamps) != len(files):
        raise LevelheadError(f"{folder}: timestamps.txt has {len(stamps)} lines, but data has {len(files)} files")
    rows = []
    for file in files:
        cells = file.read_text("utf-8", "replace").split()
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            rows.append([])
        if len(rows[-1]) != _WIDTH:
            raise LevelheadError(f"{file} holds {len(cells)} cells; expected the {_WIDTH} numbers of an oxts sample")
    values = np.array(rows)
    arrays = {"time": np.array([_stamp(folder, line) for line in stamps], dtype=np.int64)}
    arrays |= {f"gyr_{axis} [rad/s]": column for axis, column in zip("xyz", values[:, _RATE].T, strict=True)}
    arrays |= {f"acc_{axis} [m/s^2]": column for axis, column in zip("xyz", values[:, _FORCE].T, strict=True)}
    place = satellite_place(values[:, 0], values[:, 1], values[:, 2], source="oxts")
    return ArrayTable(
        str(folder),
        arrays,
        conclusions=[
            Conclusion("file.kind", "kitti", "oxts", Basis.HEADER, {"files": len(files)}),
            *([] if place is None else [place]),
        ],
        column_units={0: "ns"},
    )


def _stamp(folder: Path, line: str) -> int:
    try:
        return nanoseconds(line)
    except ValueError:
        raise LevelheadError(f"{folder}/timestamps.txt: '{line[:40]}' is not a date with a clock time") from None
