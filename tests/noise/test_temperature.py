"""Bias against temperature: what was put into a sensor that warms up is found within its σ."""

import dataclasses
import math

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.calibration import TemperatureCurve
from levelhead.live.node import Node
from levelhead.noise import calibrate_temperature
from levelhead.noise.assessment import noise_verdict
from levelhead.noise.temperature import temperature_drift
from levelhead.publish.noise_table import noise_facts, noise_table
from levelhead.sources.devices.replay import Replay
from levelhead.sources.formats import npz
from levelhead.sources.formats.csv_writer import write_csv

pytest.importorskip("scipy")
SLOPE, BEND = np.array([2e-4, -1e-4, 0.0]), np.array([5e-6, 0.0, 0.0])  # rad/s per K and K², about 35 °C


def warming(seed, span=20.0, seconds=300.0, rate=20.0):
    """A sensor at rest that nears its final temperature exponentially, and its readings a little late and in steps."""
    still = simulate.recording("LSM6DSO32", "still", duration=seconds, rate=rate, seed=seed)
    warm = 25.0 + span * (1.0 - np.exp(-3.0 * still.t / seconds))
    off = warm[:, None] - 35.0
    gyr = still.gyr + SLOPE * off + BEND * off**2
    read = np.where(np.arange(len(still)) % 4 == 0, np.round(warm * 16.0) / 16.0, np.nan)
    return dataclasses.replace(still, gyr=gyr, temperature=read)


@pytest.mark.slow
def test_what_was_put_in_is_found_within_its_sigma():
    over = []
    for seed in range(100, 140):  # none of them was looked at when the fit was made
        recording = warming(seed)
        drift = temperature_drift(recording.gyr, recording.temperature)
        off = drift.reference - 35.0
        over.append((drift.value[:, 1] - (SLOPE + 2.0 * BEND * off)) / drift.sigma[:, 1])
        assert drift.value[0, 2] == pytest.approx(BEND[0], abs=5.0 * drift.sigma[0, 2])
        assert drift.after[0] < 0.1 * drift.before[0]
    every = np.abs(np.array(over))
    assert (every < 2.0).mean() > 0.95
    assert np.sqrt(np.mean(every**2)) > 0.45  # and σ is not far too large


def test_a_touch_does_not_count():
    """Robust: a part in twenty that is off by ten times the whole drift."""
    recording = warming(1)
    gyr = recording.gyr.copy()
    gyr[1000:1300] += 0.05
    drift = temperature_drift(gyr, recording.temperature)
    low, high = drift.bias(np.array([30.0, 40.0]))
    np.testing.assert_allclose(high - low, 10.0 * SLOPE, atol=4e-4)  # BEND is even about 35 °C


@pytest.mark.slow
def test_table_verdict_and_file(tmp_path):
    model = lh.measure_noise(warming(2))
    assert "gyroscope bias per K at" in noise_table(model)
    (line,) = [line for line in noise_verdict(model) if line.startswith("gyroscope: with temperature")]
    assert "weak" not in line
    assert any("random walk K is of the temperature, which changed by" in line for line in noise_verdict(model))
    assert noise_facts(model)["gyr"]["temperature"]["high_C"] == pytest.approx(44.0, abs=0.3)
    model.save(tmp_path / "noise.json")
    again = lh.NoiseModel.read(tmp_path / "noise.json")
    assert again.to_dict() == model.to_dict()


@pytest.mark.slow
def test_a_small_span_gets_a_weak_verdict_and_none_gets_none():
    weak = lh.measure_noise(warming(3, span=2.0))
    assert any("weak, for it is 1.9 K only" in line for line in noise_verdict(weak))
    constant = warming(3, span=0.0)
    assert lh.measure_noise(constant).gyr.drift is None


@pytest.mark.parametrize("suffix", ["csv", "npz"])
def test_a_log_keeps_its_temperature(tmp_path, suffix):
    recording = warming(4, seconds=10.0)
    path = tmp_path / f"warm.{suffix}"
    (write_csv if suffix == "csv" else npz.write_npz)(recording, path)
    again = lh.read(path)
    np.testing.assert_array_equal(again.temperature, recording.temperature)
    np.testing.assert_array_equal(again[3:7].temperature, recording.temperature[3:7])


@pytest.mark.parametrize(
    ("head", "values", "celsius"),
    [
        ("imu_temp", (20.0, 30.0), (20.0, 30.0)),
        ("Temperature [K]", (293.15, 303.15), (20.0, 30.0)),
        ("temp (°F)", (68.0, 86.0), (20.0, 30.0)),
        ("baro_temp", (20.0, 30.0), None),
        ("temp_raw", (-3100.0, -3000.0), None),
    ],
)
def test_names_and_units(tmp_path, head, values, celsius):
    recording = simulate.recording("LSM6DSO32", "still", duration=5.0, rate=20.0)
    warm = np.linspace(*values, len(recording))
    table = np.column_stack([recording.t, recording.gyr, recording.acc, warm])
    names = f"t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²],{head}"
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=names, comments="", encoding="utf-8")
    read = lh.read(tmp_path / "log.csv")
    if celsius is None:
        assert read.temperature is None
        assert head in read.meta["ignored"]
    else:
        np.testing.assert_allclose(read.temperature[[0, -1]], celsius, atol=1e-9)
        assert head not in read.meta["ignored"]


@pytest.mark.slow
def test_a_warming_sensor_is_corrected(tmp_path):
    """Of another run: the rate at rest that is left is a tenth, by ``apply``, a file and a prior alike."""
    found = calibrate_temperature(lh.measure_noise(warming(3)))
    found.save(tmp_path / "warm.json")
    again = lh.Calibration.read(tmp_path / "warm.json")
    assert again.to_dict() == found.to_dict()
    assert "gyroscope bias by temperature, 25." in str(again)
    other = warming(4, span=15.0)
    change = again.at_reference(other).gyr - np.asarray(other.gyr)
    warm = 25.0 + 15.0 * (1.0 - np.exp(-3.0 * other.t / other.duration))
    off = warm[:, None] - 35.0
    put_in = SLOPE * off + BEND * off**2
    left = put_in + change
    assert (np.ptp(left, axis=0) < 0.1 * np.ptp(put_in[:, 0])).all()
    kept = lh.fuse(other, prior=again).calibration
    assert kept.temperature.keys() == again.temperature.keys()
    bare = dataclasses.replace(other, temperature=None)
    assert "the log has no temperature" in again.apply(bare).meta["notes"][-1]


def test_without_a_change_there_is_no_model():
    still = simulate.recording("LSM6DSO32", "still", duration=30.0, rate=50.0, seed=1)
    with pytest.raises(lh.LevelheadError, match="no temperature that changes by"):
        calibrate_temperature(lh.measure_noise(still))


@pytest.mark.parametrize(("params", "role"), [(lh.filters.EKF(), "calibration"), (lh.filters.ESKF(), "prior")])
def test_a_stream_and_a_node_follow_the_temperature_as_fuse_does(params, role):
    """The same bits for a temperature beside each sample; without curves it changes nothing."""
    curves = {"gyr": np.array([SLOPE, BEND, 1e-8 * SLOPE]).T, "acc": np.array([SLOPE, BEND, BEND]).T * 10.0}
    known = lh.Calibration.of_nothing()
    warm = known.with_temperature(
        {name: TemperatureCurve(35.0, 20.0, 60.0, value) for name, value in curves.items()}, known.gyr_bias
    )
    recording = simulate.recording("LSM6DSO32", "hand", duration=4.0, rate=100.0, seed=3)
    recording = dataclasses.replace(recording, temperature=np.linspace(15.0, 50.0, len(recording)))

    def fuse(one, celsius):
        part = dataclasses.replace(recording, temperature=celsius)
        if role == "calibration":
            return lh.fuse(one.apply(part), params, engine="python").quat
        return lh.fuse(part, params, prior=one, engine="python").quat

    fused, cold = fuse(warm, recording.temperature), fuse(known, None)
    assert (fused != cold).any()
    live, plain = (lh.Stream(params, engine="python", **{role: one}) for one in (warm, known))
    for i, celsius in enumerate(recording.temperature.tolist()):
        for one in (live, plain):
            one.update_temperature(celsius)
            one.update(recording.gyr[i], recording.acc[i], t=float(recording.t[i]))
        np.testing.assert_array_equal(live.quat, fused[i])
    np.testing.assert_array_equal(plain.quat, cold[-1])
    with Node(Replay(recording, math.inf), params, calibrate=0, known=warm) as node:
        node.run(60.0)
    np.testing.assert_array_equal(node.last.quat, fused[-1])
    with pytest.raises(lh.LevelheadError, match="a number, or NaN in °C"):
        live.update_temperature("warm")
    with pytest.raises(lh.LevelheadError, match="corrected cannot be saved"):
        live.save()
