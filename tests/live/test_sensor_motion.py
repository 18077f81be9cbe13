"""Rate, specific force and accelerations of a node's messages are those of the track, with their σ."""

import json
from dataclasses import replace

import numpy as np
import pytest

import levelhead as lh
from levelhead.calibration import TemperatureCurve
from levelhead.live import Node
from levelhead.live.messages import ORIENTATION, Orientation
from levelhead.live.sensor_motion import SensorMotion
from levelhead.live.viewer_messages import viewer_messages
from levelhead.sources.devices.replay import Replay


def still_then_flown():
    """Three seconds of rest, then a flight: the node measures its noise at the start."""
    return lh.simulate.recording("ICM-20948", "drone", duration=20.0, rate=100.0, seed=2)


def said_by_a_node(recording, params, known=None):
    node = Node(Replay(recording, speed=np.inf), params, calibrate=0, known=known)
    heard = node.bus.subscribe(ORIENTATION, history=len(recording) + 10, max_age=np.inf)
    node.run()
    found = []
    while (one := heard.get(timeout=0.0)) is not None:
        found.append(one)
    return [one for one in found if one.valid]


@pytest.mark.slow
def test_a_node_has_the_accelerations_of_the_track():
    rec = still_then_flown()
    said = said_by_a_node(rec, lh.Mahony())
    track = lh.fuse(replace(rec, truth=None, mag=rec.mag), lh.Mahony())
    rows = [one.seq for one in said]
    found = [one.accelerations for one in said]
    for name, series in (("body", track.linear_acceleration()), ("earth", track.earth_acceleration())):
        np.testing.assert_allclose([getattr(one, name) for one in found], series.value[rows], atol=1e-12, err_msg=name)
        sigma = np.array([getattr(one, f"sigma_{name}") for one in found])
        known = np.isfinite(sigma).all(axis=1)
        assert known[-1000:].all()
        np.testing.assert_allclose(sigma[-500:], series.sigma[rows][-500:], rtol=0.2)
    np.testing.assert_allclose([one.rate for one in said], track.angular_rate().value[rows], atol=1e-12)
    np.testing.assert_allclose(said[-1].sigma_rate, track.angular_rate().sigma[-1], rtol=0.25)
    np.testing.assert_array_equal([one.force for one in said], rec.acc[rows])


def test_learned_errors_are_taken_off():
    """As ``Stream.linear_acceleration`` after a look at what the filter has learned."""
    rec = lh.simulate.recording("LSM6DSO32", "hand", duration=20.0, rate=100.0, seed=3)
    stream = lh.Stream(lh.ESKF())
    motion = SensorMotion(stream, None)
    for i in range(len(rec)):
        stream.update(tuple(rec.gyr[i]), tuple(rec.acc[i]), dt=0.01)
    motion.refresh()
    gyr, acc, bias = tuple(rec.gyr[-1]), tuple(rec.acc[-1]), tuple(stream.bias)
    rate, _, force, sigma = motion.measure(gyr, acc, bias, False)
    said = Orientation(1, 0, 0.0, 0, tuple(stream.quat), tuple(stream.sigma), bias, 0, True, rate, rate, force, sigma)
    np.testing.assert_allclose(said.accelerations.body, stream.linear_acceleration(acc), atol=1e-12)
    np.testing.assert_allclose(said.accelerations.earth, stream.earth_acceleration(acc), atol=1e-12)
    learned = stream.calibration
    expected = rec.gyr[-1] - learned.gyr_matrix.value @ rec.gyr[-1] - stream.bias
    np.testing.assert_allclose(rate, expected, atol=1e-12)
    assert np.abs(np.array(force) - acc).max() > 1e-3


def test_a_known_sensor_follows_its_thermometer():
    from tests.reference.calibrations import WRONG

    curve = TemperatureCurve(25.0, 10.0, 50.0, np.array([[1e-2, 0.0, 0.0]] * 3))
    parts = {name: part for name, part in vars(WRONG).items() if name != "temperature"}
    known = lh.Calibration({"acc": curve}, **parts)
    motion = SensorMotion(lh.Stream(lh.Mahony(), calibration=known), known)
    motion.set_temperature(45.0)
    gyr, acc = np.array([[0.1, 0.2, -0.3]]), np.array([[1.0, 2.0, 9.0]])
    rec = known.apply(lh.Recording([0.0], gyr, acc, temperature=np.array([45.0])))
    rate, _, force, _ = motion.measure(tuple(gyr[0]), tuple(acc[0]), (0.0, 0.0, 0.0), False)
    np.testing.assert_array_equal(rate, rec.gyr[0])
    np.testing.assert_array_equal(force, rec.acc[0])
    missing = motion.measure(tuple(gyr[0]), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False)[2]
    assert np.isnan(missing).all(), "a silent accelerometer has no force"


def test_viewers_get_null_where_nothing_is_known():
    said = Orientation(7, 3, 1.5, 5, (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (0.0,) * 3, 0, rate=(0.1, 0.2, 0.3))
    said = said._replace(force=(1.0, 2.0, 9.80665), sigma_force=(0.1, 0.1, 0.1))
    found = {topic: json.loads(data) for topic, data in viewer_messages(said)}["/imu/motion"]
    assert found["rate"] == {"x": 0.1, "y": 0.2, "z": 0.3} and found["sigma"]["rate"]["x"] is None
    assert found["linear_acceleration"] == pytest.approx({"x": 1.0, "y": 2.0, "z": 0.0})
    assert found["sigma"]["linear_acceleration"]["x"] == pytest.approx(np.hypot(0.2 * 9.80665, 0.1))
