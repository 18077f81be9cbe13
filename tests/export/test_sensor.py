"""What is known of a sensor goes to the board: its mounting, its errors, and what an earlier run learned."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.calibrations import WRONG, sure
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.axis_map import IDENTITY, AxisMap
from levelhead.engine import native
from levelhead.export import ExportConfig, files, write

GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
AXES = AxisMap.parse("-y,-z,x")
# As in Python: the native engine has its bits (tests/engine/test_same_bits.py) in a thousandth of the time.
PYTHON = "native" if native.up_to_date() else "python"


@pytest.fixture(scope="module")
def learned():
    """What ESKF learns of a sensor with a magnetometer."""
    return lh.fuse(
        lh.simulate.recording("LSM6DSO32", "hand", duration=30.0, seed=3, mag="HMC5883L"), lh.ESKF()
    ).calibration


SIX = WRONG.without("mag_offset", "mag_delay")


def mounted(recording, axes):
    """The recording of a sensor that sits so, in the axes of its body."""
    gyr, acc, mag = (
        None if rows is None else np.array([axes.turn(row) for row in rows])
        for rows in (recording.gyr, recording.acc, recording.mag)
    )
    return replace(recording, gyr=gyr, acc=acc, mag=mag)


def silent(recording):
    """The same with spells in which accelerometer and magnetometer say nothing, and a rate that is missing."""
    gyr, acc, mag = recording.gyr.copy(), recording.acc.copy(), recording.mag
    gyr[250, 1], acc[210:215] = np.nan, 0.0
    if mag is not None:
        mag = mag.copy()
        mag[330:335] = 0.0
    return replace(recording, gyr=gyr, acc=acc, mag=mag)


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_mounted_and_corrected_as_in_python(flt):
    program = c_engine.built(ExportConfig(flt.params(), axes=AXES, calibration=WRONG))
    for mag in (False, True):
        recording = silent(hard_recording(mag))
        better = WRONG.apply(mounted(recording, AXES))
        assert np.abs(better.gyr - mounted(recording, AXES).gyr)[:50].max() > 0.01
        assert_same(lh.fuse(better, flt.params(), engine=PYTHON), program.fuse(recording))


@pytest.mark.compiled
@c_engine.EVERY_COMPILER
@pytest.mark.parametrize("axes", ["x,y,z", "y,z,x", "-x,y,-z", "ZYX:30,-50,20"])
@pytest.mark.parametrize("found", [None, SIX], ids=["as it reads", "no magnetometer"])
def test_mounted_any_way(compiler, axes, found):
    axes, recording = AxisMap.parse(axes), silent(hard_recording(True))
    body = mounted(recording, axes)
    body = body if found is None else found.apply(body)
    program = c_engine.built(ExportConfig(lh.Mahony(), axes=axes, calibration=found), compiler)
    assert_same(lh.fuse(body, lh.Mahony(), engine=PYTHON), program.fuse(recording))


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("guard", [lh.Guard(), None], ids=["guarded", "alone"])
@pytest.mark.parametrize("mag", [False, True], ids=["6-D", "9-D"])
def test_a_prior_as_in_python(learned, guard, mag):
    program = c_engine.built(ExportConfig(lh.ESKF(), guard, prior=learned, axes=AXES))
    assert c_engine.built(ExportConfig(lh.ESKF(), guard)).size == program.size, "the prior takes no RAM"
    for recording in (hard_recording(mag), lh.simulate.recording("MPU-6050", "hand", duration=8.0, seed=4)):
        body = mounted(recording, AXES)
        found = program.fuse(recording)
        assert_same(lh.fuse(body, lh.ESKF(), guard=guard, prior=learned, engine=PYTHON), found)
        without = lh.fuse(body, lh.ESKF(), guard=guard, engine=PYTHON)
        assert np.abs(found.quat - without.quat).max() > 1e-6


@pytest.mark.compiled
@GCC
def test_a_reset_keeps_the_prior(learned):
    """What was learned since is forgotten; what it was told is not."""
    program = c_engine.built(ExportConfig(lh.ESKF(), prior=learned))
    used = program.start()
    program.fuse(lh.simulate.recording("MPU-6050", "hand", duration=8.0, seed=4), used)
    program.function("reset")(used)
    recording = hard_recording(False)
    assert_same(program.fuse(recording), program.fuse(recording, used))
    assert_same(lh.fuse(recording, lh.ESKF(), prior=learned, engine=PYTHON), program.fuse(recording))


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("real", ["double", "float"])
def test_the_self_test_passes(learned, real, tmp_path):
    for config in (
        ExportConfig(lh.ESKF(), real=real, prior=learned, axes=AXES),
        ExportConfig(lh.EKF(), real=real, calibration=WRONG, axes=AXES),
    ):
        write(config, tmp_path)
        code, said = c_engine.run_selftest(tmp_path, config.name, "-O1")
        assert code == 0 and said.startswith(f"{config.name}: all 96 samples are right"), said


@pytest.mark.slow
def test_what_the_header_says(learned):
    header = files(ExportConfig(lh.ESKF(), prior=learned, axes=AXES))["lh_eskf.h"]
    for words in (
        " * Readings are turned first: the body's x (forward), y (left), z (up) are the sensor's -y, -z, x.",
        " * It starts with the calibration of this sensor by an earlier run:",
        f" *     {learned.words()[0]}",
        "mag µT, dt s;\n * q turns body into earth",
        "/* Orientation, body to earth",
    ):
        assert words in header, words
    assert "field of the place" not in header, "it belongs to another place"
    plain = files(ExportConfig(lh.ESKF()))["lh_eskf.h"]
    assert "mag any one unit, dt s;\n * q turns sensor into earth" in plain and "earlier run" not in plain
    assert "mag any one unit" in files(ExportConfig(lh.EKF(), calibration=SIX))["lh_ekf.h"]


@pytest.mark.slow
def test_how_a_prior_is_written(learned):
    source = files(ExportConfig(lh.ESKF(), real="float", prior=learned))["lh_eskf.c"]
    table = source[source.index("} prior[] = {") : source.index("void lh_eskf_init(")]
    assert re.findall(r"/\* (.*) \*/", table) == [
        "acc_bias, m/s²", "gyr_bias, rad/s", "gyr_matrix", "mag_offset, µT", "soft_iron", "mag_delay, s",
    ]  # fmt: skip
    assert table.count("f}") == 2 * (9 + 3 + 3 + 3 + 5 + 1)
    value = learned.prior()["gyr_bias"].value[0]
    assert any(float(text) == pytest.approx(value, rel=1e-6) for text in re.findall(r", ([^,]+)f\}", table))


def test_refused(learned):
    with pytest.raises(lh.LevelheadError, match="EKF learns no calibration, so it has no prior; ESKF does"):
        ExportConfig(lh.EKF(), prior=learned)
    with pytest.raises(lh.LevelheadError, match="would take the same errors off twice"):
        ExportConfig(lh.ESKF(), prior=learned, calibration=learned)
    with pytest.raises(lh.LevelheadError, match="no three axes"):
        ExportConfig(lh.Kalman(), axis=True, calibration=learned)
    tiny = lh.Calibration(
        **{name: value for name, value in vars(WRONG).items() if name != "temperature"} | {"mag_delay": sure(1e-60)}
    )
    with pytest.raises(lh.LevelheadError, match="calibration, mag_delay: 1e-60 is out of the range of single"):
        files(ExportConfig(lh.EKF(), real="float", calibration=tiny))
    assert ExportConfig(lh.Kalman(), axis=True, axes=IDENTITY).axes == IDENTITY
