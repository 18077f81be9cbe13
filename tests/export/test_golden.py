"""The generated files are those in golden/; `pytest tests/export/test_golden.py --update` writes them anew."""

from pathlib import Path

import pytest

import levelhead as lh
from levelhead.axis_map import AxisMap
from levelhead.export import ExportConfig, files

GOLDEN = Path(__file__).parent / "golden"
EXPORTS = {
    "kalman-axis": (ExportConfig(lh.Kalman(r_measure=0.1), axis=True, command="levelhead export Kalman --axis"), False),
    "mahony-library": (
        ExportConfig(
            lh.Mahony(),
            real="float",
            axes=AxisMap.parse("-y,x,z"),
            command="levelhead export Mahony --axes -y,x,z --float --arduino",
        ),
        True,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPORTS)
def test_generated_files(name, request):
    wanted = files(*EXPORTS[name])
    folder = GOLDEN / name
    if request.config.getoption("--update"):
        for path, text in wanted.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert found == set(wanted)
    for path, text in wanted.items():
        assert (folder / path).read_text(encoding="utf-8") == text, f"{path} changed; if it should, run with --update"
