"""The examples in the docs do what their pictures show."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def example(monkeypatch):
    """Loads an example by its name."""

    def load(name: str):
        spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        return module

    return load


def test_the_node_balances_what_the_accelerometer_lets_fall(example):
    pendulum = example("pendulum")
    node = pendulum.balance("node")
    assert node["t"][-1] > 14.0 and np.degrees(np.abs(node["angle"])).max() < 5.0
    late = node["t"] > 5.0
    assert np.degrees(np.abs(node["said"] - node["angle"])[late]).max() < 1.5
    assert np.sqrt(np.mean(((node["said"] - node["angle"]) / node["sigma"])[late] ** 2)) < 2.0
    assert np.abs(node["place"]).max() < 1.0
    assert np.degrees(np.abs(pendulum.balance("accelerometer")["angle"][-1])) > 45.0


@pytest.mark.slow
def test_height_is_held_through_gusts(example):
    altitude = example("altitude_hold")
    flight = altitude.fly("filter", seed=1)
    assert altitude.error(flight) < 0.25 and altitude.error(altitude.fly("barometer", seed=1)) > 0.45
    late = flight["t"] > 5.0
    assert np.sqrt(np.mean((flight["estimate"] - flight["height"])[late] ** 2)) < 0.2


def test_the_camera_stays_level_on_a_base_that_sways(example):
    gimbal = example("gimbal")
    assert gimbal.error(gimbal.run("filter", seed=1)) < 2.0 and gimbal.error(gimbal.run("accelerometer", seed=1)) > 8.0


def test_every_step_and_shake_is_counted_however_the_phone_is_held(example):
    steps = example("steps")
    recording = steps.walk(1)
    earth = steps.features(recording)
    assert abs(len(steps.count_steps(earth[:, 2])) - steps.STEPS) <= 1
    shakes = (recording.t - recording.t[0])[steps.count_shakes(earth[:, :2])]
    np.testing.assert_allclose(shakes, np.array(steps.SHAKES) + 0.5, atol=0.2)
    assert abs(len(steps.count_steps(recording.acc[:, 2] - steps.GRAVITY)) - steps.STEPS) > 10


def test_a_compass_with_tilt_taken_out(example):
    compass = example("compass")
    errors = compass.errors(compass.bearings(compass.carry(1)))
    assert errors["filtered"] < 2.0 and errors["tilt-compensated"] < 4.0 and errors["x and y alone"] > 30.0
