"""Orientation, bias, σ, angles, bearing, up and acceleration of exported C are those of the Track in its frame."""

import ctypes
import subprocess

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference import c_engine
from tests.reference.calibrations import WRONG

import levelhead as lh
from levelhead.axis_map import AxisMap
from levelhead.export import ExportConfig, files

MAIN = """
#include <stdio.h>
#include "lh_mahony.h"

int main(void)
{
    static lh_mahony filter;
    double g[3], a[3], m[3];
    lh_mahony_init(&filter);
    while (scanf("%lf %lf %lf %lf %lf %lf %lf %lf %lf", g, g + 1, g + 2, a, a + 1, a + 2, m, m + 1, m + 2) == 9) {
        lh_mahony_update(&filter, g, a, m, 0.01);
        const lh_mahony_euler e = lh_mahony_degrees(&filter);
        const lh_mahony_vec3 up = lh_mahony_up(&filter), free = lh_mahony_linear_acceleration(&filter, a);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\\n", e.roll, e.pitch, e.yaw,
               lh_mahony_bearing(&filter), up.x, up.y, up.z, free.x, free.y, free.z);
    }
    return 0;
}
"""


AXES = AxisMap.parse("ZYX:30,-50,20")
GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")


def steered_by(folder, config, rec):
    """(n, 10) what a program with the exported C prints."""
    for name, text in files(config).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "main.c").write_text(MAIN, encoding="utf-8")
    source = next(folder.rglob("lh_mahony.c"))
    command = ["gcc", *c_engine.WARNINGS, "-Werror", "-O1", f"-I{source.parent}", source, folder / "main.c", "-lm"]
    subprocess.run([*map(str, command), "-o", folder / "run"], check=True)
    rows = np.hstack([rec.gyr, rec.acc, rec.mag])
    text = "\n".join(" ".join(f"{x:.17g}" for x in row) for row in rows)
    done = subprocess.run([folder / "run"], input=text, capture_output=True, text=True, check=True)
    return np.array([line.split() for line in done.stdout.splitlines()], float)


@pytest.mark.slow
@GCC
@pytest.mark.parametrize("frame, axes, known", [
    ("ENU", AxisMap.parse("x,y,z"), None), ("NED", AxisMap.parse("x,y,z"), None), ("NWU", AXES, WRONG),
    ("NED", AXES, WRONG),
])  # fmt: skip
def test_what_a_program_steers_by(tmp_path, frame, axes, known):
    """Angles, bearing, up, and the acceleration from a reading as the chip gives it: mounted, corrected and turned."""
    rec = lh.simulate.recording("ICM-20948", "hand", duration=10.0, rate=100.0)
    found = steered_by(tmp_path, ExportConfig(lh.Mahony(), axes=axes, frame=frame, calibration=known), rec)
    body = axes.rotate(rec)
    fed = body if known is None else known.apply(body)
    stream = lh.Stream(lh.Mahony(), engine="python")
    rows = np.hstack([fed.gyr, fed.acc, fed.mag])
    quats = np.array([stream.update(*map(tuple, np.split(row, 3)), dt=0.01) for row in rows])
    enu = lh.Track(rec.t, quats, readings=fed)
    track = enu.to_frame(frame)
    np.testing.assert_allclose(found[:, :3], track.euler(), atol=1e-8)
    np.testing.assert_allclose(found[:, 3] % 360.0, (90.0 - enu.euler()[:, 2]) % 360.0, atol=1e-8)
    assert (found[:, 3] >= 0.0).all() and (found[:, 3] <= 360.0).all()
    sky = [0.0, 0.0, -1.0 if frame == "NED" else 1.0]
    up = Rotation.from_quat(track.quat, scalar_first=True).apply(sky, inverse=True)
    np.testing.assert_allclose(found[:, 4:7], up, atol=1e-10)
    np.testing.assert_allclose(found[:, 7:], track.linear_acceleration().value, atol=1e-9)


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("params", [lh.ESKF(), lh.Mahony()], ids=["ESKF", "Mahony"])
@pytest.mark.parametrize("frame", ["NED", "NWU"])
def test_a_frame_to_the_bit(params, frame, tmp_path):
    """Orientation, bias and σ are those of ``Track.to_frame``; the self-test passes, in float too."""
    rec = lh.simulate.recording("ICM-20948", "hand", duration=6.0, rate=100.0, seed=5, mag="AK09916")
    found = c_engine.built(ExportConfig(params, axes=AXES, frame=frame)).fuse(rec)
    turned = [np.array([AXES.turn(row) for row in rows]) for rows in (rec.gyr, rec.acc, rec.mag)]
    expected = lh.fuse(lh.Recording(rec.t, *turned), params).to_frame(frame)
    for name in ("quat", "bias", "sigma", "health"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    for real in ("double", "float"):
        config = ExportConfig(params, real=real, axes=AXES, frame=frame)
        for path, text in files(config).items():
            (tmp_path / path).parent.mkdir(exist_ok=True)
            (tmp_path / path).write_text(text, encoding="utf-8")
        code, said = c_engine.run_selftest(tmp_path, config.name, "-O1")
        assert code == 0, said


class Nav(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double * 3) for name in ("position", "velocity", "sigma_position", "sigma_velocity")]


@pytest.mark.compiled
@GCC
def test_position_and_velocity_in_ned():
    """The same readings in both frames give the same state, each in its own axes."""
    rec = lh.simulate.recording("ICM-20948", "hand", duration=3.0, rate=100.0, seed=5, mag="AK09916")
    found = []
    for frame, place, pace in (
        ("ENU", (3.0, 20.0, -5.0), (1.0, 2.0, 0.5)),
        ("NED", (20.0, 3.0, 5.0), (2.0, 1.0, -0.5)),
    ):
        c = c_engine.built(ExportConfig(lh.ESKF(), frame=frame))
        memory = c.start()
        c.fuse(rec, memory)
        sigma = (1.0, 2.0, 3.0) if frame == "ENU" else (2.0, 1.0, 3.0)
        for name, value in (("position", place), ("velocity", pace)):
            three = [(ctypes.c_double * 3)(*one) for one in (value, sigma)]
            assert c.function(f"update_{name}")(memory, *three, ctypes.c_double(0.0))
        c.fuse(rec, memory)
        c.function("position").restype = Nav
        found.append({name: np.array(getattr(c.function("position")(memory), name)) for name, _ in Nav._fields_})
    enu, ned = found
    assert np.abs(enu["position"]).min() > 0.1
    for name, values in enu.items():
        down = values[2] if "sigma" in name else -values[2]
        np.testing.assert_array_equal(ned[name], [values[1], values[0], down], err_msg=name)


def test_no_such_frame():
    with pytest.raises(lh.LevelheadError, match="'SWU' is not an earth frame"):
        ExportConfig(lh.Mahony(), frame="SWU")
    with pytest.raises(lh.LevelheadError, match="no earth frame: leave the frame out"):
        ExportConfig(lh.Kalman(), axis=True, frame="NED")
    header = files(ExportConfig(lh.Mahony(), frame="ned"))["lh_mahony.h"]
    assert "body to earth (x north, y east, z down)" in header and "yaw is clockwise from north." in header
    assert "about north, east and down" in header
