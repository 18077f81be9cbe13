"""The rooms: every module has a name of its own, and none is longer than a reader can hold."""

from collections import defaultdict
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src" / "levelhead"
LONGEST = 400  # lines
SHARED = {  # names that stand in several rooms, and why
    "compare": "a verb of the command line has the name of the function that it calls",
    "sweep": "the same",
    "doctor": "the same; and its picture",
    "bench": "the same",
    "export": "the same",
    "simulate": "the same",
    "smooth": "the same",
    "noise": "the same; and the random processes of a simulation",
    "filter": "the packages of the two large filters have the same parts",
    "params": "the same",
    "covariance": "the same",
    "measurements": "the same",
    "triad": "a kernel, and the filter made of it",
    "calibration": "the record, and the ESKF's estimate of it",
    "rest": "detected in front of a filter, and searched in a whole recording",
    "timing": "of benchmarks, and of a recording's stamps",
    "arrays": "rows of numbers in kernels, and recordings from arrays in memory",
    "quaternions": "algebra of series, and columns of a log",
    "layout": "of structs in C, and of columns in a log",
    "source": "C code, and where samples come from",
    "bus": "messages between processes, and I²C",
    "native": "compiled with the package: its use, and its making",
    "board": "a sensor board, and its emulation",
}


def modules() -> list[Path]:
    """All modules but the first page of each package."""
    return [path for path in SOURCE.rglob("*.py") if not path.stem.startswith("__")]


def test_a_name_stands_in_one_room_only():
    places = defaultdict(set)
    for path in modules():
        places[path.stem].add(path.parent.relative_to(SOURCE).as_posix())
    twice = {name: sorted(rooms) for name, rooms in places.items() if len(rooms) > 1 and name not in SHARED}
    assert twice == {}


def test_files_are_short():
    long = {path.name: count for path in modules() if (count := len(path.read_text("utf-8").splitlines())) > LONGEST}
    assert long == {}
