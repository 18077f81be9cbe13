"""Families of error messages: every module that raises belongs to one, and each has a page and a cure."""

import ast
import pickle
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.cli.help import pages
from levelhead.errors import FAMILIES, family_code, require
from levelhead.evaluate.score import evaluate

SOURCE = Path(__file__).resolve().parents[1] / "src" / "levelhead"
CODES = [family.code for family in FAMILIES]


def raising() -> dict[str, list[str]]:
    """Code of a family -> the modules that make a ``LevelheadError`` or one of its subclasses."""
    trees = {path: list(ast.walk(ast.parse(path.read_text(encoding="utf-8")))) for path in SOURCE.rglob("*.py")}
    known = {"LevelheadError"}
    for _ in range(3):  # subclasses of subclasses
        known |= {
            node.name
            for nodes in trees.values()
            for node in nodes
            if isinstance(node, ast.ClassDef) and any(isinstance(b, ast.Name) and b.id in known for b in node.bases)
        }
    found = defaultdict(list)
    for path, nodes in trees.items():
        called = {node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
        if called & known:
            parts = path.relative_to(SOURCE.parent).with_suffix("").parts
            module = ".".join(parts).removesuffix(".__init__")
            found[family_code(module)].append(module)
    return found


def test_every_module_that_raises_has_a_family_and_every_family_a_module():
    found = raising()
    assert found.pop("", []) == []
    assert sorted(found) == sorted(CODES)


def test_every_room_of_the_table_exists():
    for family in FAMILIES:
        for room in family.rooms:
            path = SOURCE.joinpath(*room.split("."))
            assert path.is_dir() or path.with_suffix(".py").exists(), room


def test_topics_of_help_are_distinct_and_pages_exist():
    assert len(set(CODES)) == len(CODES) and not set(CODES) & set(pages())
    assert {family.page for family in FAMILIES} <= set(pages())


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.code)
def test_help_prints_cause_and_cure(family, capsys):
    assert main(["help", family.code]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert family.cause.replace("`", "") in printed and family.cure.replace("`", "") in printed
    for sentence in re.split(r"(?<=[.;]) ", f"{family.cause} {family.cure}"):
        assert len(sentence.split()) <= 25, sentence


def hand() -> dict[str, np.ndarray]:
    return {"t": np.arange(5) / 100, "gyr": np.zeros((5, 3)), "acc": np.tile([0.0, 0.0, 9.81], (5, 1))}


def log(tmp_path, header: str, row: str) -> Path:
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *(row.format(t=0.01 * i) for i in range(50))]) + "\n", encoding="utf-8")
    return path


NAMED = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
CASES = {
    "file": lambda tmp: lh.read(tmp / "none.csv"),
    "column": lambda tmp: lh.read(log(tmp, "t [s],ax [g],ay [g],az [g]", "{t},0,0,1")),
    "unit": lambda tmp: lh.read(log(tmp, NAMED, "{t},0,0,0,0,0,9.8"), units={"gyr": "furlong"}),
    "clock": lambda tmp: lh.read(log(tmp, NAMED, "0,0,0,0,0,0,9.8")),
    "recording": lambda tmp: lh.Recording(**hand() | {"gyr": np.zeros((4, 3))}),
    "parameter": lambda tmp: lh.Kalman(r_mesure=0.1),
    "axes": lambda tmp: lh.fuse(lh.Recording(**hand())).to_frame("XYZ"),
    "place": lambda tmp: lh.earth_field(95.0, 0.0),
    "run": lambda tmp: lh.fuse(lh.Recording(**hand()), engine="steam"),
    "track": lambda tmp: lh.fuse(lh.Recording(**hand())).euler("ABC"),
    "truth": lambda tmp: evaluate(lh.Recording(**hand()), lh.fuse(lh.Recording(**hand()))),
    "simulated": lambda tmp: lh.simulate.recording("MPU-6050", "tango"),
    "package": lambda tmp: require("no_such_package", "a test", "test"),
}


def several_files(tmp_path) -> Path:
    """A folder whose files hold an accelerometer and a magnetometer."""
    for name in ("acc", "mag"):
        rows = (f"{0.01 * i:.2f},{i % 7},{i % 5},{9 + i % 3}" for i in range(200))
        (tmp_path / f"{name}.csv").write_text("\n".join([f"t [s],{name}_x,{name}_y,{name}_z", *rows]) + "\n")
    return tmp_path


@pytest.mark.parametrize("code", CASES)
def test_an_error_has_the_code_of_its_cause(code, tmp_path):
    with pytest.raises(lh.LevelheadError) as raised:
        CASES[code](tmp_path)
    assert raised.value.code == code, raised.value
    assert pickle.loads(pickle.dumps(raised.value)).code == code  # as a process of a corpus hands it over


def test_a_sensor_that_no_table_has_is_about_columns(tmp_path):
    with pytest.raises(lh.LevelheadError, match="no gyroscope among") as raised:
        lh.read(several_files(tmp_path))
    assert raised.value.code == "column"


def test_an_error_about_an_error_keeps_its_code_and_one_from_outside_has_none():
    assert lh.LevelheadError("made by a program of a user").code == ""
    try:
        lh.Kalman(r_mesure=0.1)
    except lh.LevelheadError as error:
        assert lh.LevelheadError(f"of row 7: {error}").code == "parameter"


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("fuse none.csv", "file"),
        ("fuse --colour", "option"),
        ("simulate hand -o no/a.csv", "output"),
        ("help x", "option"),
    ],
)
def test_the_command_line_leads_to_the_family(words, code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(words.split()) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("levelhead: ") and second == f"  more: levelhead help {code}"
