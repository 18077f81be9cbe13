"""Exported C keeps over a restart what it has learned, names it, and takes position and height: as Python does."""

import ctypes

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.c_engine import built

import levelhead as lh
from levelhead.export import ExportConfig
from levelhead.filters.contract import NavState
from levelhead.filters.eskf import state as at

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(not c_engine.COMPILERS, reason="no C compiler (gcc or clang) on the PATH"),
]
DT = 0.01
CONFIGS = [ExportConfig(lh.ESKF()), ExportConfig(lh.EKF(), real="float"), ExportConfig(lh.Mahony())]
CALIBRATION = [block for block in at.BLOCKS if block.calibration]


@pytest.fixture(scope="module")
def recording():
    return lh.simulate.recording("ICM-20948", "hand", 6.0, rate=100.0, seed=5, mag="AK09916")


def numbers(values, real="double"):
    return np.ascontiguousarray(values, c_engine.REALS[real]).ctypes.data_as(ctypes.c_void_p)


def feed(c, memory, recording, first, last):
    """Samples into a filter in C; the three readings are held until they were used."""
    real = c.config.real
    scalar = ctypes.c_double if real == "double" else ctypes.c_float
    for i in range(first, last):
        kept = [np.ascontiguousarray(a[i], c_engine.REALS[real]) for a in (recording.gyr, recording.acc, recording.mag)]
        assert c.function("update")(memory, *(ctypes.c_void_p(a.ctypes.data) for a in kept), scalar(DT))


def sizes(c):
    """A buffer that is larger than what is saved of any filter."""
    return ctypes.create_string_buffer(c.size + 64)


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.name)
def test_a_filter_goes_on_after_a_restart(config, recording):
    """At another address, and with the bytes that one without a restart has; other bytes are refused."""
    c = built(config)
    whole, first, second, saved = c.start(), c.start(), c.start(), sizes(c)
    feed(c, whole, recording, 0, 400)
    feed(c, first, recording, 0, 300)
    c.function("get_carry")(first, saved)
    ctypes.memset(first, 0xA5, c.size)
    kept = ctypes.create_string_buffer(saved.raw)
    ctypes.memset(saved, 0xA5, len(saved))
    assert c.function("set_carry")(second, kept)
    feed(c, second, recording, 300, 400)
    again, expected = sizes(c), sizes(c)
    c.function("get_carry")(second, again)
    c.function("get_carry")(whole, expected)
    assert again.raw == expected.raw
    before = second.raw
    kept[0] = bytes([kept.raw[0] ^ 1])
    assert not c.function("set_carry")(second, kept) and second.raw == before


class Learned(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_double * block.size) for block in CALIBRATION for name in (block.name, f"{block.name}_sigma")
    ]


class Nav(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double * 3) for name in NavState._fields[:4]] + [("aided", ctypes.c_bool)]


def test_position_height_and_what_was_learned_are_those_of_python(recording):
    """To the bit: readings of position, velocity and height between samples, at two ages."""
    c, stream = built(ExportConfig(lh.ESKF())), lh.Stream(lh.ESKF(), engine="python")
    memory = c.start()
    for i in range(300):
        feed(c, memory, recording, i, i + 1)
        stream.update(gyr=recording.gyr[i], acc=recording.acc[i], mag=recording.mag[i], dt=DT)
        if i % 40 == 20:
            where, speed, sigma = (0.1, -0.2, 0.3), (0.0, 0.1, 0.0), (0.5, 0.5, 1.0)
            stream.update_position(where, sigma, age=0.05)
            stream.update_velocity(speed, sigma)
            given = [np.array(a) for a in (where, speed, sigma)]
            at_ = [ctypes.c_void_p(a.ctypes.data) for a in given]
            assert c.function("update_position")(memory, at_[0], at_[2], ctypes.c_double(0.05))
            assert c.function("update_velocity")(memory, at_[1], at_[2], ctypes.c_double(0.0))
        if i % 25 == 3:
            stream.update_height(0.4, 0.3)
            assert c.function("update_height")(memory, *map(ctypes.c_double, (0.4, 0.3, 0.0)))
    assert not c.function("update_height")(memory, *map(ctypes.c_double, (float("nan"), 0.3, 0.0)))
    assert not c.function("update_height")(memory, *map(ctypes.c_double, (0.4, 0.0, 0.0)))
    function = c.function("position")
    function.restype = Nav
    found, expected = function(memory), stream.nav_state
    assert found.aided and expected is not None
    for name in Nav._fields_[:4]:
        assert tuple(getattr(found, name[0])) == tuple(getattr(expected, name[0])), name
    function = c.function("learned_errors")
    function.restype = Learned
    learned, calibration = function(memory), stream.calibration
    for block in CALIBRATION:
        quantity = getattr(calibration, block.name)
        if quantity is not None and block.name != "soft_iron":
            assert np.array_equal(np.ravel(quantity.value), np.array(getattr(learned, block.name))), block.name
            np.testing.assert_allclose(
                np.array(getattr(learned, f"{block.name}_sigma")), np.ravel(quantity.sigma), rtol=1e-14
            )


def test_the_walk_of_a_foot_is_that_of_a_gait_stream():
    """To the bit: a walk's stances, σ, and position by their zero velocities; a sample is lost."""
    c = built(CONFIGS[0])
    walk = lh.simulate.observe(lh.simulate.foot(6), lh.simulate.imu("LSM6DSO32"), seed=3)
    gyr, acc, dt = walk.gyr.copy(), walk.acc.copy(), float(np.median(np.diff(walk.t)))
    gyr[500] = np.nan
    filter, stance, expected = c.start(), ctypes.create_string_buffer(1024), lh.GaitStream()
    c.function("begin_stance")(stance)
    update, stand = c.function("update"), c.function("update_stance")
    stand.restype = ctypes.c_double
    stood = 0
    for rate, force in zip(gyr, acc, strict=True):
        kept = [np.ascontiguousarray(row) for row in (rate, force)]
        readings = [ctypes.c_void_p(row.ctypes.data) for row in kept]
        assert update(filter, *readings, None, ctypes.c_double(dt))
        sigma = stand(stance, *readings, ctypes.c_double(dt))
        if sigma > 0.0:
            assert c.function("update_zero_velocity")(filter, ctypes.c_double(sigma), ctypes.c_double(0.0))
        nav = expected.update(rate, force, dt=dt)
        assert (sigma > 0.0) == expected.standing
        stood += sigma > 0.0
    assert stood > 100
    place = c.function("position")
    place.restype = Nav
    found = place(filter)
    for name in NavState._fields[:4]:
        assert list(getattr(found, name)) == list(getattr(nav, name)), name
