"""What help(), editors and mypy show of the public face: each parameter with type, unit, range and default."""

import inspect
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import levelhead as lh
from levelhead import filters
from levelhead.filters.parameters import derived_table, param_table

ROOT = Path(__file__).resolve().parents[1]
CLASSES = [*(flt.params for flt in filters.ALL), lh.Guard]

WRONG = {  # a line -> the words of mypy's complaint
    'lh.EKF(acc_tau="x")': 'Argument "acc_tau" to "EKF" has incompatible type "str"',
    "lh.EKF(acc_tua=1.0)": 'Unexpected keyword argument "acc_tua" for "EKF"',
    "lh.Guard(rest_time=None)": 'Argument "rest_time" to "Guard" has incompatible type "None"',
    "lh.fuse(rec, 3.0)": 'Argument 2 to "fuse" has incompatible type "float"',
    "lh.smooth(rec, rec)": 'Argument 2 to "smooth" has incompatible type "Recording"',
    "lh.Stream([1.0])": 'Argument 1 to "Stream" has incompatible type',
}
RIGHT = """
lh.fuse(rec)
lh.fuse(rec, "EKF")
lh.fuse(rec, lh.EKF)
lh.fuse(rec, lh.EKF(acc_tau=1.0))
lh.fuse(rec, lh.Complementary(alpha=0.98, dt=0.005))
lh.smooth(rec, lh.ESKF())
lh.Stream(lh.Kalman(r_measure=4))
lh.compare(rec, [lh.EKF(), "Mahony", lh.Triad])
lh.sweep(rec, lh.Complementary(), "alpha")
"""


@pytest.mark.parametrize("params", CLASSES, ids=lambda params: params.__name__)
def test_help_shows_every_parameter_with_unit_range_and_default(params):
    text = pydoc.plain(pydoc.render_doc(params))
    for name, param in param_table(params).items():
        line = next(line for line in params.__doc__.splitlines() if line.strip().startswith(f"{name} ("))
        default = params._field_defaults[name]
        kind = "bool" if isinstance(default, bool) else "float"
        assert line.strip().startswith(f"{name} ({kind}{f', {param.unit}' if param.unit else ''}): {param.doc}")
        assert line.endswith(f"default {default}." if kind == "bool" else f"default {default:g}.")
        assert kind == "bool" or param.range in line
        assert line.strip() in text
    for name in derived_table(params):
        assert f"    {name} (float): sets " in params.__doc__


@pytest.mark.parametrize("params", CLASSES, ids=lambda params: params.__name__)
def test_the_signature_is_the_call(params):
    signature = inspect.signature(params)
    fields = {name: entry for name, entry in signature.parameters.items() if entry.kind is not entry.KEYWORD_ONLY}
    assert tuple(fields) == params._fields
    assert {name: entry.default for name, entry in fields.items()} == params._field_defaults
    assert {entry.annotation for entry in fields.values()} <= {float, bool}
    bound = signature.bind(**params._field_defaults)
    assert params(*bound.args, **bound.kwargs) == params()
    for name in derived_table(params):
        assert signature.parameters[name].kind is inspect.Parameter.KEYWORD_ONLY


@pytest.mark.slow
def test_mypy_knows_the_face(tmp_path):
    pytest.importorskip("mypy")
    head = "import levelhead as lh\n\nrec = lh.read('a.csv')\n"
    program = tmp_path / "program.py"
    program.write_text(head + "\n".join(WRONG) + RIGHT, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--no-error-summary", "--no-pretty", str(program)]  # with lint's own cache
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    said = [line for line in done.stdout.splitlines() if "error:" in line and program.name in line]
    first = head.count("\n") + 1
    for i, words in enumerate(WRONG.values()):
        assert [line for line in said if f":{first + i}: error: {words}" in line], (words, done.stdout + done.stderr)
    assert len(said) == len(WRONG), done.stdout
