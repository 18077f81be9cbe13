"""The example in CONTRIBUTING.md is a filter: one file, and everything else follows."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead import filters

pytestmark = pytest.mark.compiled


@pytest.fixture
def leaky(tmp_path, monkeypatch):
    text = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text()
    source = next(block for block in re.findall(r"```python\n(.*?)```", text, re.S) if "FILTER = " in block)
    path = tmp_path / "leaky_filter.py"
    path.write_text(source)
    spec = importlib.util.spec_from_file_location("leaky_filter", path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "leaky_filter", module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(filters, "ALL", (*filters.ALL, module.FILTER))
    return module


def test_the_example_runs_on_every_engine(leaky):
    recording = lh.simulate.lesson()[:500]
    plain = lh.fuse(recording, leaky.Leaky(tau=0.49), engine="python")
    np.testing.assert_array_equal(lh.fuse(recording, "leaky", engine="python").t, recording.t)
    np.testing.assert_array_equal(lh.fuse(recording, leaky.Leaky(tau=0.49), engine="compiled").quat, plain.quat)
    live = lh.Stream(leaky.Leaky(tau=0.49), engine="compiled")
    for i in range(500):
        quat = live.update(recording.gyr[i], recording.acc[i], t=float(recording.t[i]))
    assert quat == tuple(plain.quat[-1])
    np.testing.assert_allclose(plain.quat, lh.fuse(recording, lh.Complementary(tau=0.49)).quat, atol=1e-12)
    with pytest.raises(lh.LevelheadError, match="tau = -1 is not allowed"):
        leaky.Leaky(tau=-1.0)
