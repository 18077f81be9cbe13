"""Degrees, bearing, up and linear acceleration of the exported filter are those that Python's orientation gives."""

import shutil
import subprocess

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
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
        printf("%.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g\\n", e.roll, e.pitch, e.yaw,
               lh_mahony_bearing(&filter), up.x, up.y, up.z, free.x, free.y, free.z);
    }
    return 0;
}
"""


@pytest.mark.slow
def test_what_a_program_steers_by(tmp_path):
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    for name, text in files(ExportConfig(lh.Mahony())).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    source = next(tmp_path.rglob("lh_mahony.c"))
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{source.parent}", source]
    subprocess.run([*map(str, command), tmp_path / "main.c", "-lm", "-o", tmp_path / "run"], check=True)
    rec = lh.simulate.recording("ICM-20948", "hand", duration=10.0, rate=100.0)
    rows = np.hstack([rec.gyr, rec.acc, rec.mag])
    text = "\n".join(" ".join(f"{x:.17g}" for x in row) for row in rows)
    done = subprocess.run([tmp_path / "run"], input=text, capture_output=True, text=True, check=True)
    found = np.array([line.split() for line in done.stdout.splitlines()], float)
    stream = lh.Stream(lh.Mahony(), engine="python")
    quats = np.array([stream.update(*map(tuple, np.split(row, 3)), dt=0.01) for row in rows])
    euler = lh.Track(rec.t, quats).euler()
    up = Rotation.from_quat(quats[:, [1, 2, 3, 0]]).apply([0.0, 0.0, 1.0], inverse=True)
    np.testing.assert_allclose(found[:, :3], euler, atol=1e-8)
    np.testing.assert_allclose(found[:, 3], (90.0 - euler[:, 2]) % 360.0, atol=1e-8)
    np.testing.assert_allclose(found[:, 4:7], up, atol=1e-10)
    np.testing.assert_allclose(found[:, 7:], rec.acc - 9.80665 * up, atol=1e-9)
