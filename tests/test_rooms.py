"""The rooms: every public class has a name of its own, and no file is longer than a reader can hold."""

import ast
import re
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "levelhead"
LONGEST = 600  # lines
MOST_ANY = {  # by room; the names in open_types.py, compiler/borders.py, tree.py and mark.py stand for the rest
    "sources": 40,
    "publish": 30,
    "live": 22,
    "compiler": 22,
    "engine": 8,
    "filters": 8,
    "cli": 6,
    "open_types.py": 4,
    "bench": 2,
    "export": 2,
    "inspection": 2,
    "__init__.py": 1,
}
CLASSES = {  # that stand in several rooms, and why
    "Batch": "one fuse on its way through a recording, and one job of many recordings",
    "Chip": "a data sheet, and its emulation on a bus",
    "Header": "of a column's name, and of a message of ROS",
    "Imu": "the errors of a simulated sensor, and a message of ROS",
    "Gated": "what a gate lets through: of the guard, and of a filter with gates of its own",
    "Readings": "three vectors as a kernel takes them, and as arrays that faults are put into",
    "Layout": "of a text's columns, and of a message of MAVLink",
    "North": "of one sample as a kernel has it, and of a track as arrays",
    "Report": "what a filter on one axis reports, and what the doctor does",
    "Source": "of samples, of a kernel's C, and of a corpus",
    "Sums": "running sums of three different means",
    "Table": "of a log, and printed",
}


def modules() -> list[Path]:
    """All modules but the first page of each package."""
    return [path for path in SOURCE.rglob("*.py") if not path.stem.startswith("__")]


@cache
def top_level() -> list[tuple[str, ast.stmt]]:
    """(room, definition or other statement) of every module, in the order of the files."""
    return [
        (path.relative_to(SOURCE).parts[0], node)
        for path in SOURCE.rglob("*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
    ]


@pytest.mark.slow
def test_a_class_stands_in_one_room_only():
    """A reader who meets a name of a type knows which one it is, or finds the reason why there are two."""
    places = defaultdict(set)
    for room, node in top_level():
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            places[node.name].add(room)
    twice = {name: rooms for name, rooms in places.items() if len(rooms) > 1}
    assert {name: rooms for name, rooms in twice.items() if name not in CLASSES} == {}
    assert set(CLASSES) <= set(twice), "a reason that is no longer needed"


def test_files_are_short():
    long = {path.name: count for path in modules() if (count := len(path.read_text("utf-8").splitlines())) > LONGEST}
    assert long == {}


def test_any_stands_at_the_borders_only():
    counts = Counter()
    for path in SOURCE.rglob("*.py"):
        lines = path.read_text(encoding="utf-8").splitlines()
        code = "\n".join(line for line in lines if not line.lstrip().startswith(("import ", "from ")))
        counts[path.relative_to(SOURCE).parts[0]] += len(re.findall(r"\bAny\b", code))
    more = {room: count for room, count in counts.items() if count > MOST_ANY.get(room, 0)}
    assert more == {}, "name the type; or give it a name with its reason in open_types.py"
    assert sum(MOST_ANY.values()) < 150
