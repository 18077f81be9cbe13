"""The examples in the docs do what their pictures show."""

import importlib.util
import os
import re
import socket
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "applications.md"
DATA = Path(os.environ.get("LEVELHEAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
BODY = DATA / "joints" / "qmt_full_body.mat"
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


def said(before: str, value: float, after: str) -> None:
    """The page has the number, to a tenth of it, between these words."""
    words = rf"{re.escape(before)}\D*?([\d.]+) ?{re.escape(after)}"
    found = re.search(words.replace("\\ ", r"\s+"), PAGE.read_text(encoding="utf-8"))
    assert found, words
    assert value == pytest.approx(float(found[1]), rel=0.1), before


@pytest.mark.slow
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
    flight = altitude.fly("filter")
    said("holds a drone's height", altitude.error(flight), "m RMS")
    said("the same PID swings with", altitude.error(altitude.fly("barometer")), "m")
    late = flight["t"] > 5.0
    assert np.sqrt(np.mean((flight["estimate"] - flight["height"])[late] ** 2)) < 0.2


@pytest.mark.slow
def test_the_camera_stays_level_on_a_base_that_sways(example):
    gimbal = example("gimbal")
    said("keeps a camera level on a base that swings and sways", gimbal.error(gimbal.run("filter")), "° RMS")
    said("by the filter", gimbal.error(gimbal.run("accelerometer")), "° by the accelerometer")


def test_every_step_and_shake_is_counted_however_the_phone_is_held(example):
    steps = example("steps")
    recording = steps.walk()
    earth = steps.features(recording)
    assert len(steps.count_steps(earth[:, 2])) == steps.STEPS == 60
    shakes = (recording.t - recording.t[0])[steps.count_shakes(earth[:, :2])]
    np.testing.assert_allclose(shakes, np.array(steps.SHAKES) + 0.5, atol=0.2)
    said("the phone's own z axis shows", len(steps.count_steps(recording.acc[:, 2] - steps.GRAVITY)), "peaks")


def test_gestures_are_recognised_however_the_hand_is_turned(example):
    gesture = example("gesture")
    counts = gesture.count_right()
    said("however the hand is turned about it", counts[0], "of 30")
    said("the gyroscope's own axes give", counts[1], "of them")
    assert gesture.count_right(seed=2)[0] == gesture.COUNT


def test_a_compass_with_tilt_taken_out(example):
    compass = example("compass")
    errors = compass.errors(compass.bearings(compass.carry()))
    said("may be held askew", errors["x and y alone"], "° RMS by x and y alone")
    said("by x and y alone", errors["tilt-compensated"], "° with tilt taken out")
    said("(`Triad`)", errors["filtered"], "° filtered")


def test_the_path_of_a_foot_closes_and_stairs_stay(example):
    walk = example("walk")
    level = walk.walk()
    found = walk.lh.gait(level)
    assert found.gap < 0.1
    assert np.linalg.norm(walk.dead_reckoning(level)[-1]) > 5.0
    climb = walk.lh.gait(walk.walk(walk.STAIR)).track.position[-1, 2]
    assert climb == pytest.approx(walk.STRIDES * walk.STAIR, rel=0.05)


def test_an_elbow_is_found_from_two_sensors(example):
    found, errors = example("elbow").angles_of()
    assert found.fault == ""
    assert np.sqrt(np.mean(errors**2, axis=0)).max() < 0.5


def test_a_knee_that_walks_is_right_but_for_the_skin(example):
    knee = example("knee")
    joint, angle, true = knee.flexion_of()
    assert joint.fault == ""
    assert np.sqrt(np.mean((angle - true) ** 2)) < 1.3 * 2.0**0.5 * knee.SKIN


@pytest.mark.skipif(not BODY.is_file(), reason=f"no recording {BODY}; LEVELHEAD_DATA names the folder")
def test_the_knee_of_a_person(example):
    joint, angle, reference = example("knee").recorded(BODY)
    assert joint.fault == ""
    assert np.sqrt(np.mean((angle - reference)[100:] ** 2)) < 3.0


def test_a_head_tracker_sends_its_view_as_osc(example):
    """Each message by the rules of OSC 1.0: strings end in zeros at four bytes, floats are big-endian."""
    tracker = example("head_tracker")
    tracker.DURATION = 8.0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver, socket.socket(type=socket.SOCK_DGRAM) as sender:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        sender.connect(receiver.getsockname())
        found, true = tracker.track(tracker.wear(), sender, real_time=False)
        messages = [receiver.recv(100) for _ in found]
    assert np.abs((found - true + 180.0) % 360.0 - 180.0).max() < 2.0
    for message, angles in zip(messages, found, strict=True):
        assert message[:36] == b"/SceneRotator/quaternions\0\0\0,ffff\0\0\0" and len(message) == 52
        quat = struct.unpack(">4f", message[36:])
        sent = Rotation.from_quat(quat, scalar_first=True).as_euler("ZYX", degrees=True)
        np.testing.assert_allclose(sent, angles, atol=1e-3)
