"""The example of a format in CONTRIBUTING.md is one file of less than 100 lines and one entry."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.sources import pipeline
from levelhead.sources.formats import Format

PAGE = Path(__file__).parents[2] / "CONTRIBUTING.md"


@pytest.fixture
def my_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    source = next(block for block in blocks if "def tables(" in block)
    path = tmp_path / "my_format.py"
    path.write_text(source, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("levelhead.sources.formats.my_format", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "levelhead.sources.formats.my_format", module)
    spec.loader.exec_module(module)
    entry = Format("my format", (".mine",), module.tables)
    monkeypatch.setitem(pipeline.BY_SUFFIX, ".mine", entry)
    monkeypatch.setattr(pipeline, "_READ", frozenset(pipeline.BY_SUFFIX))
    return source


def mine(path: Path, recording: lh.Recording) -> Path:
    """The example's format, written with struct."""
    import struct

    lines = zip(recording.t, recording.gyr, recording.acc, strict=True)
    path.write_bytes(b"".join(struct.pack("<q6f", round(1000 * t), *gyr, *acc) for t, gyr, acc in lines))
    return path


def test_the_example_is_read_as_a_file_a_folder_and_by_the_doctor(my_format: str, tmp_path: Path) -> None:
    assert len(my_format.splitlines()) < 100
    made = lh.simulate.recording("MPU-6050", "hand", duration=20, seed=1)
    folder = tmp_path / "logs"
    folder.mkdir()
    path = mine(folder / "flight.mine", made)
    for source in (path, folder):
        found = lh.read(source)
        np.testing.assert_allclose(found.gyr, made.gyr, rtol=1e-6)
        np.testing.assert_allclose(found.acc, made.acc, rtol=1e-6)
        np.testing.assert_allclose(found.t, made.t, atol=1e-9)
    assert lh.inspect(path).exit_code == 0
    path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(lh.LevelheadError, match="is cut off"):
        lh.read(path)
