"""Exported C takes the thermometer's reading: biases by temperature have the bits of ``lh.fuse``."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.calibrations import WRONG

import levelhead as lh
from levelhead.axis_map import AxisMap
from levelhead.calibration import TemperatureCurve
from levelhead.export import ExportConfig, files

GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
CURVES = {
    "gyr": TemperatureCurve(25.0, 10.0, 50.0, np.array([[1e-3, 2e-5, -1e-6], [-2e-3, 1e-5, 3e-7], [5e-4, 0.0, 0.0]])),
    "acc": TemperatureCurve(20.0, 15.0, 40.0, np.array([[4e-3, -1e-4, 2e-6], [1e-3, 2e-4, 0.0], [-6e-3, 0.0, 1e-6]])),
}


def warmed(calibration):
    """The calibration with curves of both biases."""
    parts = {name: part for name, part in vars(calibration).items() if name != "temperature"}
    return lh.Calibration(CURVES, **parts)


def warming(n_silent=0):
    """A recording whose sensor warms from below the range to above it, with a thermometer that misses readings."""
    rec = lh.simulate.recording("ICM-20948", "hand", duration=6.0, rate=100.0, seed=5, mag="AK09916")
    celsius = np.linspace(5.0, 60.0, len(rec)).round(2)
    acc = rec.acc.copy()
    acc[200:203] = 0.0
    return replace(rec, acc=acc, temperature=celsius)


def fused_in_c(config, rec):
    """(n, 4) orientations of the C, which is given the temperature before each sample."""
    c = c_engine.built(config)
    memory, found = c.start(), []
    one = np.zeros((len(rec), 4))
    for i in range(len(rec)):
        c.function("update_temperature")(memory, ctypes.c_double(rec.temperature[i]))
        if i % 7 == 0:
            c.function("update_temperature")(memory, ctypes.c_double(np.nan))  # no reading
        at = [ctypes.c_void_p(np.ascontiguousarray(a[i]).ctypes.data) for a in (rec.gyr, rec.acc, rec.mag)]
        dt = 1.0 if i == 0 else rec.t[i] - rec.t[i - 1]
        step = np.array([dt])
        found.append(at)
        rows = c.function("update_rows")
        rows(memory, 1, *at, ctypes.c_void_p(step.ctypes.data), ctypes.c_void_p(one[i].ctypes.data))
    return one


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("axes", [AxisMap.parse("x,y,z"), AxisMap.parse("ZYX:30,-50,20")], ids=["plain", "mounted"])
def test_the_bits_of_fuse_with_a_thermometer(axes):
    """A calibration for any filter; the stream gives the same, the silent accelerometer included."""
    known, rec = warmed(WRONG), warming()
    turned = [np.array([axes.turn(row) for row in rows]) for rows in (rec.gyr, rec.acc, rec.mag)]
    body = lh.Recording(rec.t, *turned, temperature=rec.temperature)
    expected = lh.fuse(known.apply(body), lh.Mahony()).quat
    found = fused_in_c(ExportConfig(lh.Mahony(), axes=axes, calibration=known), rec)
    np.testing.assert_array_equal(found, expected)
    cold = c_engine.built(ExportConfig(lh.Mahony(), axes=axes, calibration=known)).fuse(rec).quat
    assert np.abs(cold - found).max() > 1e-3, "without the call it is the reference's bias"
    stream = lh.Stream(lh.Mahony(), calibration=known)
    for i in range(len(rec)):
        stream.update_temperature(rec.temperature[i])
        dt = 1.0 if i == 0 else rec.t[i] - rec.t[i - 1]
        quat = stream.update(*(tuple(rows[i]) for rows in turned), dt=dt)
        assert quat == tuple(expected[i])


@pytest.mark.compiled
@GCC
def test_a_prior_with_temperature():
    rec = warming()
    learned = warmed(lh.fuse(rec, lh.ESKF()).calibration)
    expected = lh.fuse(rec, lh.ESKF(), prior=learned).quat
    np.testing.assert_array_equal(fused_in_c(ExportConfig(lh.ESKF(), prior=learned), rec), expected)


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("real", ["double", "float"])
def test_the_self_test_runs_warm(real, tmp_path):
    config = ExportConfig(lh.Mahony(), real=real, calibration=warmed(WRONG), frame="NED")
    for path, text in files(config, arduino=True).items():
        (tmp_path / path.rpartition("/")[2]).write_text(text, encoding="utf-8")
    test = (tmp_path / "lh_mahony_selftest.c").read_text()
    assert "lh_mahony_update_temperature(&filter, 42.0" in test
    code, said = c_engine.run_selftest(tmp_path, config.name, "-O1")
    assert code == 0, said
    header = (tmp_path / "lh_mahony.h").read_text()
    assert "within 10.0 to 50.0 °C (gyroscope; at the start 25.0 °C) and 15.0 to 40.0 °C (accelerometer" in header
    assert "void updateTemperature(" in (tmp_path / "LhMahony.h").read_text()


def test_without_curves_there_is_no_such_call():
    written = files(ExportConfig(lh.Mahony(), calibration=WRONG))
    assert not any("_update_temperature" in text for text in written.values())
