"""The example in the docs does what its picture shows."""

import importlib.util
from pathlib import Path

import numpy as np

PATH = Path(__file__).resolve().parents[2] / "examples" / "pendulum.py"


def test_the_node_balances_what_the_accelerometer_lets_fall(monkeypatch):
    spec = importlib.util.spec_from_file_location("pendulum", PATH)
    pendulum = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(__import__("sys").modules, "pendulum", pendulum)
    spec.loader.exec_module(pendulum)
    node = pendulum.balance("node")
    assert node["t"][-1] > 14.0 and np.degrees(np.abs(node["angle"])).max() < 5.0
    late = node["t"] > 5.0
    assert np.degrees(np.abs(node["said"] - node["angle"])[late]).max() < 1.5
    assert np.sqrt(np.mean(((node["said"] - node["angle"]) / node["sigma"])[late] ** 2)) < 2.0
    assert np.abs(node["place"]).max() < 1.0
    assert np.degrees(np.abs(pendulum.balance("accelerometer")["angle"][-1])) > 45.0
