"""The sketch for each chip on a board made of C++: what it logs is read back, and fuses to what the board said."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.reference.calibrations import WRONG

import levelhead as lh
from levelhead.axis_map import AxisMap
from levelhead.calibration import Quantity
from levelhead.cli import main
from levelhead.export import ExportConfig, write
from levelhead.rotations import matrix
from levelhead.units import GRAVITY

STUBS = Path(__file__).resolve().parents[1] / "reference" / "arduino"
MPU = {"ADDRESS": "0x68", "ID_REGISTER": "0x75", "IDENTITY": "0x68", "FIRST": "0x3B", "WORDS": "7", "LITTLE": "0",
       "GYR_WORD": "4", "ACC_WORD": "0", "AWAKE": "registers[0x6B] == 0x01",
       "GYR_LSB": "131.0 / (1 << (registers[0x1B] >> 3 & 3))",
       "ACC_LSB": "16384.0 / (1 << (registers[0x1C] >> 3 & 3))"}  # fmt: skip
CHIPS = {  # what a chip set to 500 deg/s and 4 g does, by its data sheet
    "MPU-6050": MPU,
    "MPU-9250": MPU | {"IDENTITY": "0x71"},
    "ICM-20948": MPU | {"ADDRESS": "0x69", "ID_REGISTER": "0x00", "IDENTITY": "0xEA", "FIRST": "0x2D", "GYR_WORD": "3",
                        "AWAKE": "registers[0x06] == 0x01", "GYR_LSB": "65.5", "ACC_LSB": "8192.0"},
    "LSM6DSO32": MPU | {"ADDRESS": "0x6A", "ID_REGISTER": "0x0F", "IDENTITY": "0x6C", "FIRST": "0x20", "LITTLE": "1",
                        "GYR_WORD": "1", "ACC_WORD": "4", "AWAKE": "registers[0x10] == 0x40 && registers[0x11] == 0x44",
                        "GYR_LSB": "1000.0 / 17.5", "ACC_LSB": "1000.0 / 0.122"},
    "LSM6DSOX": MPU | {"ADDRESS": "0x6A", "ID_REGISTER": "0x0F", "IDENTITY": "0x6C", "FIRST": "0x20", "LITTLE": "1",
                       "GYR_WORD": "1", "ACC_WORD": "4", "AWAKE": "registers[0x10] == 0x48 && registers[0x11] == 0x44",
                       "GYR_LSB": "1000.0 / 17.5", "ACC_LSB": "1000.0 / 0.122"},
    "LSM6DS3": MPU | {"ADDRESS": "0x6A", "ID_REGISTER": "0x0F", "IDENTITY": "0x69", "FIRST": "0x22", "LITTLE": "1",
                      "WORDS": "6", "GYR_WORD": "0", "ACC_WORD": "3",
                      "AWAKE": "registers[0x10] == 0x48 && registers[0x11] == 0x44",
                      "GYR_LSB": "1000.0 / 17.5", "ACC_LSB": "1000.0 / 0.122"},
    "BMI160": MPU | {"ID_REGISTER": "0x00", "IDENTITY": "0xD1", "FIRST": "0x0C", "LITTLE": "1", "WORDS": "6",
                     "GYR_WORD": "0", "ACC_WORD": "3",
                     "AWAKE": "registers[0x7E] == 0x15 && registers[0x41] == 5 && registers[0x43] == 2",
                     "GYR_LSB": "65.6", "ACC_LSB": "8192.0"},
    "BNO055": MPU | {"ADDRESS": "0x28", "ID_REGISTER": "0x00", "IDENTITY": "0xA0", "FIRST": "0x08", "LITTLE": "1",
                     "WORDS": "9", "GYR_WORD": "6", "ACC_WORD": "0",
                     "AWAKE": "registers[0x3D] == 0x07 && registers[0x0A] == 0x1A",
                     "GYR_LSB": "16.0", "ACC_LSB": "980.665"},
}  # fmt: skip
LIS3MDL = {"MAG_ADDRESS": "0x1C", "MAG_ID_REGISTER": "0x0F", "MAG_IDENTITY": "0x3D", "MAG_FIRST": "0xA7",
           "MAG_AWAKE": "others[0x20] == 0x7C && others[0x22] == 0x00",
           "MAG_COUNTS": "f[0] * 68.42, f[1] * 68.42, f[2] * 68.42"}  # fmt: skip
WITH_FIELD = {  # chips with a magnetometer, whose axes are not always theirs; 0.15 uT a count, and the factors sent
    "MPU-9250": {"MAG_ADDRESS": "0x0C", "MAG_ID_REGISTER": "0x00", "MAG_IDENTITY": "0x48", "MAG_FIRST": "0x02",
                 "MAG_AWAKE": "others[0x0A] == 0x16 && registers[0x37] == 0x02",
                 "MAG_COUNTS": "f[1] / 0.15 / 1.1875, f[0] / 0.15, -f[2] / 0.15 / 1.0625"},
    "ICM-20948": {"MAG_ADDRESS": "0x0C", "MAG_ID_REGISTER": "0x01", "MAG_IDENTITY": "0x09", "MAG_FIRST": "0x10",
                  "MAG_AWAKE": "others[0x31] == 0x08 && registers[0x0F] == 0x02",
                  "MAG_COUNTS": "f[0] / 0.15, -f[1] / 0.15, -f[2] / 0.15"},
    "LSM6DSOX+LIS3MDL": LIS3MDL,
    "LSM6DS3+LIS3MDL": LIS3MDL,
}  # fmt: skip
pytestmark = [pytest.mark.compiled, pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on the PATH")]


def log_of(folder, config, include=""):
    """What the sketch logs while it is carried about, after two seconds of rest with a bias of the gyroscope;
    ``include``: the filter of this name in place of its own.
    """
    write(config, folder)
    name = config.name
    stem = config.chip.lower().replace("-", "").replace("+", "")
    sketch = folder / f"{name}_{stem}" / f"{name}_{stem}.ino"
    if include:
        text = sketch.read_text(encoding="utf-8")
        assert text.count(f'#include "{name}.h"') == 1
        sketch.write_text(text.replace(f'#include "{name}.h"', f'#include "{include}.h"'), encoding="utf-8")
        name = include
    recording = lh.simulate.recording("MPU-6050", "hand", duration=10.0, seed=3)
    field = np.einsum("nij,i->nj", matrix(recording.truth.quat), [0.0, 20.0, -45.0])  # µT, in the sensor's axes
    moving = np.column_stack([np.degrees(recording.gyr), recording.acc / GRAVITY, field])
    rest = np.tile(moving[0], (350, 1))
    rest[:, :3] = [1.0, -2.0, 0.5]
    moving[:, :3] += [1.0, -2.0, 0.5]
    np.savetxt(folder / "readings.txt", np.concatenate([rest, moving]))
    subprocess.run(["gcc", "-std=c99", "-O1", "-c", f"{name}.c"], cwd=folder, check=True)
    command = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{STUBS}", "-I.", "-include", "Arduino.h"]
    board = CHIPS[config.chip.removesuffix("+LIS3MDL")] | WITH_FIELD.get(config.chip, {})
    command += [f"-D{word}={value}" for word, value in board.items()]
    command += ["-x", "c++", str(sketch), str(STUBS / "board.cpp"), "-x", "none", f"{name}.o", "-lm", "-o", "board"]
    subprocess.run(command, cwd=folder, check=True)
    said = subprocess.run(["./board", "readings.txt"], cwd=folder, capture_output=True, text=True, check=True).stdout
    (folder / "log.csv").write_text(said, encoding="utf-8")
    return folder / "log.csv"


@pytest.mark.parametrize("real", ["double", "float"])
def test_the_log_reads_back_and_says_what_the_board_said(tmp_path, real, capsys):
    config = ExportConfig(lh.Madgwick(beta=0.1), lh.Guard(gyr_range=1000.0), real)
    log = log_of(tmp_path, config)
    assert "0x1B, 0x10" in (tmp_path / "lh_madgwick_mpu6050" / "lh_madgwick_mpu6050.ino").read_text()
    recording = lh.read(log)
    assert recording.rate == pytest.approx(98.6, abs=2.0) and recording.mag is None and recording.truth is None
    missing = np.isnan(recording.gyr).any(axis=1)
    assert missing.sum() == 1 and np.isnan(recording.acc[missing]).all()
    board = np.genfromtxt(log, delimiter=",", comments="#", skip_header=2)
    assert np.abs(recording.gyr[:10]).max() < np.radians(0.2), "the bias was taken off"
    track = lh.fuse(recording, config.params, guard=config.guard)
    np.testing.assert_allclose(board[:, 7:11], track.quat, atol=2e-5)  # the log has 6 decimals
    np.testing.assert_array_equal(board[:, 11], track.health)
    assert main(["fuse", str(log), "--no-plot", "-o", str(tmp_path)]) == 0
    assert main(["compare", str(log), "--track", "board_q"]) == 0
    assert "board_q" in capsys.readouterr().out


@pytest.mark.parametrize("real", ["double", "float"])
def test_a_sensor_that_is_known_logs_what_the_filter_was_fed(tmp_path, real):
    """In the axes of the body and without its errors; nothing is read off at the start, the bias is known."""
    bias = np.radians([1.0, -2.0, 0.5])
    quantity = Quantity(*[np.array([bias[1], -bias[0], bias[2]])] * 4)
    found = lh.Calibration(gyr_matrix=WRONG.gyr_matrix, gyr_bias=quantity, acc_bias=WRONG.acc_bias)
    config = ExportConfig(lh.Madgwick(), real=real, axes=AxisMap.parse("y,-x,z"), calibration=found)
    log = log_of(tmp_path, config)
    sketch = (tmp_path / "lh_madgwick_mpu6050" / "lh_madgwick_mpu6050.ino").read_text(encoding="utf-8")
    assert "keep still" not in sketch and "are the sensor's y,-x,z; the log is in the body's axes." in sketch
    recording = lh.read(log)
    assert np.isfinite(recording.gyr[:10]).all()
    raw = np.genfromtxt(tmp_path / "readings.txt")[0]
    read = np.array([raw[1], -raw[0], raw[2]]) * np.pi / 180.0
    better = read - found.gyr_matrix.value @ read - found.gyr_bias.value
    np.testing.assert_allclose(recording.gyr[0], better, atol=3e-4)  # a count is 1.3e-4 rad/s
    board = np.genfromtxt(log, delimiter=",", comments="#", skip_header=1)
    track = lh.fuse(recording, config.params)
    np.testing.assert_allclose(board[:, 7:11], track.quat, atol=2e-4)


@pytest.mark.parametrize("chip", [name for name in CHIPS if name != "MPU-6050"])
def test_each_chip_is_woken_and_read(tmp_path, chip):
    """The log holds what the chip felt, in SI units and in the right order of axes and bytes."""
    log = log_of(tmp_path, ExportConfig(lh.AccelTilt(), real="float", chip=chip))
    recording, felt = lh.read(log), np.loadtxt(tmp_path / "readings.txt")[:, :6]
    rows = np.round((recording.t - recording.t[-1]) * 100.0).astype(int) + len(felt) - 1
    there = np.isfinite(recording.acc).all(axis=1)
    near = [felt[np.clip(rows[there] + k, 0, len(felt) - 1)] for k in range(-3, 4)]
    read = np.hstack([np.degrees(recording.gyr[there]) + [1.0, -2.0, 0.5], recording.acc[there] / GRAVITY])
    apart = np.min([np.abs(read - row).max(axis=1) for row in near], axis=0)
    assert apart.max() < 0.1, "each line is what the chip felt within 30 ms"
    assert np.ptp(recording.gyr[there], axis=0).min() > 0.5
    assert np.abs(recording.gyr[there][:20]).max() < np.radians(0.2)


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("chip", WITH_FIELD)
def test_the_magnetometer_is_read_in_the_axes_of_the_chip(tmp_path, chip, real):
    """The log has the board's field in µT, or nothing where the chip was not ready; the filter used both."""
    log = log_of(tmp_path, ExportConfig(lh.Madgwick(), real=real, chip=chip))
    recording = lh.read(log)
    ready = np.isfinite(recording.mag).all(axis=1)
    assert 0.6 < ready.mean() < 0.7
    felt = np.loadtxt(tmp_path / "readings.txt")[:, 6:]
    rows = np.round((recording.t - recording.t[-1]) * 100.0).astype(int) + len(felt) - 1
    near = [felt[np.clip(rows[ready] + k, 0, len(felt) - 1)] for k in range(-3, 4)]
    assert np.min([np.abs(recording.mag[ready] - row).max(axis=1) for row in near], axis=0).max() < 0.3
    assert np.ptp(recording.mag[ready], axis=0).min() > 10.0
    board = np.genfromtxt(log, delimiter=",", comments="#", skip_header=2)
    found = lh.fuse(recording, lh.Madgwick())
    np.testing.assert_allclose(board[:, 10:14], found.quat, atol=2e-4)


def test_without_mag_no_magnetometer_is_read(tmp_path):
    write(ExportConfig(lh.Madgwick(), real="float", chip="MPU-9250", without=frozenset({"mag"})), tmp_path)
    sketch = (tmp_path / "lh_madgwick_mpu9250" / "lh_madgwick_mpu9250.ino").read_text(encoding="utf-8")
    assert "read_field" not in sketch and "mag_x" not in sketch


def test_one_axis_is_the_lesson(tmp_path):
    config = ExportConfig(lh.Kalman(), real="float", axis=True)
    log = log_of(tmp_path, config)
    board = np.genfromtxt(log, delimiter=",", comments="#", skip_header=2)
    t, measured, rolled = board[:, 0], board[:, 7], board[:, 8]
    there = np.isfinite(measured)
    found = lh.fuse_axis(t[there], measured[there], np.degrees(board[there, 1]), lh.Kalman(), period=360.0)
    assert np.isfinite(rolled).all()
    apart = (found.level - rolled[there] + 180.0) % 360.0 - 180.0
    assert np.abs(apart[50:]).max() < 0.01 and np.ptp(rolled) > 20.0


@pytest.mark.parametrize("other", [lh.Madgwick(), lh.EKF()], ids=lambda params: type(params).__name__)
def test_another_filter_is_another_include(tmp_path, other):
    """The sketch of Mahony, with nothing but its include changed, says what the other filter says."""
    config = ExportConfig(other, real="float")
    write(config, tmp_path)
    log = log_of(tmp_path, ExportConfig(lh.Mahony(), real="float"), config.name)
    board = np.genfromtxt(log, delimiter=",", comments="#", skip_header=2)
    found = lh.fuse(lh.read(log), other)
    np.testing.assert_allclose(np.abs(np.sum(board[:, 7:11] * found.quat, axis=1)), 1.0, atol=1e-6)
    assert np.abs(lh.fuse(lh.read(log), lh.Mahony()).quat - found.quat).max() > 0.01, "the filters differ"


@pytest.mark.parametrize("axis", [False, True], ids=["imu", "axis"])
def test_the_one_name_holds_for_every_function(tmp_path, axis):
    """Each function of the header, and each type in its declaration, under the one name; in C, without a warning."""
    config = ExportConfig(lh.Kalman(), axis=axis)
    write(config, tmp_path)
    header = (tmp_path / f"{config.name}.h").read_text(encoding="utf-8")
    code = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
    declared = re.findall(rf"^(\w[\w ]*?)\b{config.name}_(\w+)\(([^;]*)\);", code, re.MULTILINE)
    assert len(declared) == (3 if axis else 16)
    pointers = [f"{kind}(*{name})({given}) = lh_filter_{name};" for kind, name, given in declared]
    program = "\n".join(["#define LH_FILTER", f'#include "{config.name}.h"', "int main(void)", "{",
                         "static lh_filter filter;",
                         *(line.replace(f"{config.name}", "lh_filter") for line in pointers), "(void)filter;",
                         *(f"(void){name};" for _, name, _ in declared), "return 0; }"])  # fmt: skip
    (tmp_path / "main.c").write_text(program, encoding="utf-8")
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "main.c", f"{config.name}.c", "-lm", "-o", "main"]
    subprocess.run(command, cwd=tmp_path, check=True)
