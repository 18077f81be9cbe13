"""A conclusion is data; a sentence is made from it in one place, and nothing searches sentences."""

import ast
import json
import string
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import levelhead
from levelhead import read
from levelhead.inspection import examine
from levelhead.recording import Recording
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.conclusions.sentences import SENTENCES, notes
from levelhead.sources.formats.npz import read_own, write_npz
from levelhead.sources.hints import Hints

ROOT = Path(levelhead.__file__).parent
SEARCHES = {
    "startswith",
    "endswith",
    "partition",
    "rpartition",
    "find",
    "index",
    "split",
    "removeprefix",
    "removesuffix",
}
ROOMS = ("sources", "inspection", "cli", "live", "corpora", "calibrate", "noise", "tune")
SPOKEN = {"note", "notes", "sentence", "sentences", "why"}
ALLOWED = {  # sentences of other packages, and a file name in front of one
    ("cli/corpus.py", "{name}: "),
    ("sources/formats/npz.py", "pickle"),
    ("live/zenoh_session.py", " at "),
}


def searches(code: str) -> Iterator[tuple[int, str]]:
    """Line and text of each search in a note, in an error, or in a sentence."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Compare) and any(isinstance(op, ast.In | ast.NotIn) for op in node.ops):
            if isinstance(node.left, ast.Constant | ast.JoinedStr) and any(map(is_spoken, node.comparators)):
                yield node.lineno, ast.unparse(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            by_method = node.func.attr in SEARCHES and node.args and is_spoken(node.func.value)
            by_pattern = ast.unparse(node.func) in ("re.search", "re.match", "re.fullmatch", "re.findall")
            if by_method or (by_pattern and any(map(is_spoken, node.args[1:]))):
                yield node.lineno, ast.unparse(node)


def is_spoken(node: ast.expr) -> bool:
    """Whether an expression is a sentence: str(error), note, found.notes, meta["notes"]."""
    match node:
        case ast.Call(func=ast.Name(id="str"), args=[ast.Name(id=name)]):
            return name.startswith("err")
        case ast.Call(func=func, args=inner):
            return any(map(is_spoken, [*inner, *([func.value] if isinstance(func, ast.Attribute) else [])]))
        case ast.Name(id=name) | ast.Attribute(attr=name) | ast.Subscript(slice=ast.Constant(value=str(name))):
            return name in SPOKEN
    return False


def test_nothing_searches_the_sentences_of_the_program() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
        for line, text in searches(path.read_text())
        if not any(path == ROOT / name and word in text for name, word in ALLOWED)
    ]
    assert not found


@pytest.mark.parametrize(
    "code",
    [
        'any("taken, not" in note for note in notes)',
        'name = "gravity removed" in str(error)',
        '"a guess" in found.why',
        'str(error).partition("; try:")[0]',
        're.search("slower than (.*) Hz", note)',
        'any(note.startswith("merged:") for note in notes)',
        '"window" in " | ".join(recording.meta["notes"])',
    ],
)
def test_each_search_of_old_would_be_found(code: str) -> None:
    assert list(searches(code))


class Anything(dict[str, object]):
    """Facts of every name."""

    def __missing__(self, name: str) -> object:
        return [1, 2] if name in ("sizes", "rows") else 1.5


def test_a_sentence_has_the_word_guess_where_its_basis_is_one() -> None:
    """What people search a note for is what programs ask of the basis."""
    guesses = {key for key in SENTENCES if "guess" in _text(*key)}
    code = "\n".join(path.read_text() for path in (ROOT / "sources").rglob("*.py"))
    made = {
        (node.args[0].value, node.args[1].value): ast.unparse(node.args[3])
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("Conclusion", "conclude"))
        if len(node.args) > 3 and all(isinstance(one, ast.Constant) for one in node.args[:2])
    }
    assert len(made) > 40
    for key, basis in made.items():
        if basis.startswith("Basis."):
            assert (basis == "Basis.GUESS") == (key in guesses), key


def _text(about: str, reason: str) -> str:
    facts = Anything()
    template = SENTENCES[about, reason]
    if callable(template):
        facts = Anything(column="t", columns="a", rest="b", other_sensor="c", first="line 3", listed="x", width=8)
        return template(Conclusion(about.replace("*", "gyr"), reason, 3, Basis.NUMBERS, facts))
    return string.Formatter().vformat(template, (), Anything(value=2.0, sensor="gyroscope"))


def test_every_sentence_can_be_made() -> None:
    for about, reason in SENTENCES:
        assert len(_text(about, reason)) > 8


def test_conclusions_survive_a_file(tmp_path: Path, hand: Recording) -> None:
    """The doctor finds in a saved recording what it found in the log."""
    log = tmp_path / "log.csv"
    rows = np.column_stack([1000.0 * hand.t, np.degrees(hand.gyr) * 131.0, hand.acc / 9.80665 * 16384.0])
    np.savetxt(log, np.rint(rows), "%d", ",", header="t,gx,gy,gz,ax,ay,az", comments="")
    before = read(log)
    write_npz(before, tmp_path / "log.npz")
    after = read_own(tmp_path / "log.npz", Hints())
    assert after is not None and before.meta["conclusions"]
    assert list(after.meta["conclusions"]) == list(before.meta["conclusions"])
    assert notes(after.meta["conclusions"]) == before.meta["notes"]
    names = [one.name for one in examine(before).findings]
    assert "raw_counts" in names and [one.name for one in examine(after).findings] == names
    json.dumps([one.to_dict() for one in before.meta["conclusions"]])


AXES = "xyz"


@pytest.mark.parametrize(
    ("order", "signs", "expected"),
    [((0, 1, 2), (1, 1, 1), False), ((0, 1, 2), (-1, 1, 1), True), ((0, 1, 2), (1, -1, 1), True),
     ((1, 0, 2), (1, 1, 1), True)],
)  # fmt: skip
def test_any_axis_out_of_order_is_found(
    order: tuple[int, ...], signs: tuple[int, ...], expected: bool, hand: Recording, tmp_path: Path
) -> None:
    """Formerly a minus of the first axis alone was found. Data as in the archive of an analogue board."""
    from scipy.io import savemat

    counts = np.empty((len(hand), 6))
    counts[:, :3] = np.rint(hand.acc / 9.80665 * 100.0 + [510.0, 501.0, 505.0])
    counts[:, [3 + i for i in order]] = np.rint(np.degrees(hand.gyr) * signs * 2.0 + 370.0)
    path = tmp_path / "imu.mat"
    savemat(path, {"vals": counts.T, "ts": hand.t[None, :]})
    recording = read(path)
    for read_back, true in zip(recording.gyr.T, hand.gyr.T, strict=True):
        assert np.corrcoef(read_back, true)[0, 1] > 0.98
    assert ("axes_order" in {one.name for one in examine(recording).findings}) is expected
