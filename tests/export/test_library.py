"""The library for Arduino and PlatformIO: what describes it, its class, and the boards that hold its sketch."""

import json
import shutil
import subprocess

import numpy as np
import pytest

import levelhead as lh
from levelhead.cli import main
from levelhead.errors import LevelheadError
from levelhead.export import ExportConfig, files, write
from levelhead.export.config import LEAN

GPP = pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on the PATH")
IMU_MAIN = """
#include <cstdio>
#include "LhMahony.h"
int main() {
  LhMahony filter;
  double v[9];
  filter.begin(100);
  while (std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf %lf", v, v+1, v+2, v+3, v+4, v+5, v+6, v+7, v+8) == 9) {
    filter.update(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]);
    std::printf("%.9g %.9g %.9g\\n", filter.getRoll(), filter.getPitch(), filter.getYaw());
  }
}
"""
AXIS_MAIN = """
#include <cstdio>
#include "LhKalmanAxis.h"
int main() {
  LhKalmanAxis filter;
  double angle, rate;
  while (std::scanf("%lf %lf", &angle, &rate) == 2) std::printf("%.12g\\n", filter.getAngle(angle, rate, 0.01));
}
"""


def output_of(folder, name, main_text, rows):
    """What a program in C++ says, whose filter was compiled as C++ too."""
    (folder / "main.cpp").write_text(main_text, encoding="utf-8")
    source = folder / name / "src"
    command = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{source}", "main.cpp", "-x", "c++"]
    subprocess.run([*command, str(source / f"{name}.c"), "-lm", "-o", "main"], cwd=folder, check=True)
    text = "\n".join(" ".join(f"{x:.17g}" for x in row) for row in rows)
    done = subprocess.run(["./main"], cwd=folder, input=text, capture_output=True, text=True, check=True)
    return np.array([line.split() for line in done.stdout.splitlines()], float)


@GPP
@pytest.mark.compiled
def test_the_class_in_degrees_and_g(tmp_path):
    write(ExportConfig(lh.Mahony()), tmp_path, arduino=True)
    rec = lh.simulate.recording("ICM-20948", "hand", duration=5.0, rate=100.0)
    rows = np.hstack([np.degrees(rec.gyr), rec.acc / 9.80665, rec.mag])
    found = output_of(tmp_path, "lh_mahony", IMU_MAIN, rows)
    stream = lh.Stream(lh.Mahony(), engine="python")
    vectors = np.hstack([rec.gyr, rec.acc, rec.mag])
    quats = np.array([stream.update(*map(tuple, np.split(row, 3)), dt=0.01) for row in vectors])
    apart = found - lh.Track(rec.t, quats).euler()
    np.testing.assert_allclose((apart + 180.0) % 360.0 - 180.0, 0.0, atol=1e-6)


@GPP
@pytest.mark.compiled
def test_the_class_of_the_lesson(tmp_path):
    write(ExportConfig(lh.Kalman(), axis=True), tmp_path, arduino=True)
    rng = np.random.default_rng(2)
    level, rate = 40.0 * np.sin(np.arange(300) * 0.03) + rng.normal(0, 2, 300), rng.normal(0, 30, 300)
    found = output_of(tmp_path, "lh_kalman_axis", AXIS_MAIN, np.column_stack([level, rate]))[:, 0]
    twin = lh.fuse_axis(np.arange(301) * 0.01, np.r_[level[0], level], np.r_[0.0, rate], lh.Kalman(), period=360.0)
    np.testing.assert_allclose(found, twin.level[1:], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("axis", [False, True], ids=["imu", "axis"])
def test_what_describes_the_library(axis):
    made = files(ExportConfig(lh.Kalman(), axis=axis), arduino=True)
    name = "lh_kalman_axis" if axis else "lh_kalman"
    properties = dict(line.split("=", 1) for line in made[f"{name}/library.properties"].splitlines())
    assert {
        "name",
        "version",
        "author",
        "maintainer",
        "sentence",
        "paragraph",
        "category",
        "url",
        "architectures",
    } <= set(properties)
    assert properties["url"].startswith("https://") and f"{name}/src/{properties['includes']}" in made
    manifest = json.loads(made[f"{name}/library.json"])
    assert manifest["license"] == "MIT" and all(f"{name}/src/{header}" in made for header in manifest["headers"])
    words = [line.split("\t") for line in made[f"{name}/keywords.txt"].splitlines()]
    assert all(len(row) == 2 and row[1] in ("KEYWORD1", "KEYWORD2") for row in words)
    assert ["getAngle" if axis else "getRoll", "KEYWORD2"] in words and [f"{name}_update", "KEYWORD2"] in words
    code = {path: text for path, text in made.items() if path.endswith((".c", ".h", ".ino", "CMakeLists.txt"))}
    assert all("SPDX-License-Identifier: MIT" in text for text in code.values())


def test_a_board_that_is_too_small_is_refused_with_numbers(tmp_path, capsys):
    assert main(["export", "EKF", "--float", "--board", "uno", "-o", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "EKF does not fit a Uno (ATmega328P)" in said and "bytes of flash (of 32,256)" in said
    assert not list(tmp_path.iterdir())
    with pytest.raises(LevelheadError, match="there is no board 'unno'; did you mean 'uno'"):
        files(ExportConfig(lh.Mahony(), board="unno"))


@pytest.mark.slow
def test_the_sketch_names_the_boards_that_hold_it():
    lean = files(ExportConfig(lh.Mahony(), None, "float", without=LEAN | {"mag"}, board="uno"))
    assert "// Boards that hold it: Uno," in lean["lh_mahony_mpu6050/lh_mahony_mpu6050.ino"]
    whole = files(ExportConfig(lh.ESKF(), real="float"))
    assert "// Boards that hold it: Zero," in whole["lh_eskf_mpu6050/lh_eskf_mpu6050.ino"]
