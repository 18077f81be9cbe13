"""Text of serial monitors and plotters: what the lessons print, against what a human reads in it."""

from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead.sources.formats.text.labelled import looks_labelled, parse, records

LINES = {
    "AcX = 1200 | AcY = -36 | Tmp = 36.53": {"AcX": 1200.0, "AcY": -36.0, "Tmp": 36.53},
    "ax=0.01 ay=-2e-3": {"ax": 0.01, "ay": -0.002},
    "roll:1.2,pitch:3.4": {"roll": 1.2, "pitch": 3.4},
    "roll: 1.2;\tpitch: 3.4": {"roll": 1.2, "pitch": 3.4},
    "a/g:\t1\t2\t3\t4\t5\t-6": {
        "acc_x": 1.0, "acc_y": 2.0, "acc_z": 3.0, "gyr_x": 4.0, "gyr_y": 5.0, "gyr_z": -6.0,
    },
    "Accel X: 0.1 \tY: 0.2 \tZ: 9.8 m/s^2 ": {
        "Accel X [m/s^2]": 0.1, "Accel Y [m/s^2]": 0.2, "Accel Z [m/s^2]": 9.8,
    },
    "X: 0.1 Y: 0.2 Z: 9.8 m/s^2": {"X [m/s^2]": 0.1, "Y [m/s^2]": 0.2, "Z [m/s^2]": 9.8},
    "Linear Accel X = 504, Y = 140, qw = 11795": {"Linear Accel X": 504.0, "Linear Accel Y": 140.0, "qw": 11795.0},
    "acc=[0.1, 0.2, 9.8] gyr=[1,2,3]": {
        "acc_x": 0.1, "acc_y": 0.2, "acc_z": 9.8, "gyr_x": 1.0, "gyr_y": 2.0, "gyr_z": 3.0,
    },
    "Got accel={x=0.1 m/s², y=0.2 m/s², z=9.8 m/s²}, gyro={x=1 °/s, y=2 °/s, z=3 °/s}": {
        "accel x [m/s²]": 0.1, "accel y [m/s²]": 0.2, "accel z [m/s²]": 9.8,
        "gyro x [°/s]": 1.0, "gyro y [°/s]": 2.0, "gyro z [°/s]": 3.0,
    },
    "accX: 0.50 g, gyroX: 3 deg/s": {"accX [g]": 0.5, "gyroX [deg/s]": 3.0},
}  # fmt: skip


@pytest.mark.parametrize("line", LINES)
def test_words_before_numbers(line: str) -> None:
    assert parse(line) == LINES[line]


@pytest.mark.parametrize(
    "line", ["", "1,2,3,4", "t,ax,ay", "12:30:05.1,0.1,0.2", "2023-10-18 01:58:35.5,1", '{"t": 1}']
)
def test_other_lines_have_no_words(line: str) -> None:
    assert parse(line) == {}


def test_a_sample_on_several_lines() -> None:
    lines = ["Accel X: 1 Y: 2 Z: 3", "Gyro X: 4 Y: 5 Z: 6", "", "Accel X: 7 Y: 8 Z: 9", "Gyro X: 0 Y: 0 Z: 0"]
    found = list(records(lines))
    assert [first for first, _ in found] == [0, 3]
    assert found[0][1] == {"Accel X": 1, "Accel Y": 2, "Accel Z": 3, "Gyro X": 4, "Gyro Y": 5, "Gyro Z": 6}
    assert looks_labelled(lines) and not looks_labelled(["1,2,3", "4,5,6"])


def test_a_heading_names_the_axes_below_it() -> None:
    lines = [
        "Accelerometer data",
        "x: 1",
        "y: 2",
        "Gyroscope (deg/s):",
        "x: 4",
        "Temp: 28 C",
        "Gyro calibration",
        "x: 5",
    ]
    (_, first), (_, second) = records(lines)
    assert first == {
        "Accelerometer data x": 1, "Accelerometer data y": 2, "Gyroscope (deg/s) x": 4, "Temp": 28,
    }  # fmt: skip
    assert second == {"Gyroscope (deg/s) x": 5}
    assert list(records(["Gyro calibration done", "x: 1"])) == [(1, {"x": 1})]


@pytest.mark.parametrize("rate", [5, 20])
def test_raw_counts_of_an_mpu6050_in_a_file_as_on_the_serial_line(tmp_path: Path, rate: int) -> None:
    """At rest, where gravity cannot tell the gyroscope's unit: beside counts stand counts, and it is said."""
    lines = [
        f"a/g:\t{120 + i % 9}\t{-30 + i % 5}\t{16384 - i % 7}\t{-rate + i % 3}\t{rate}\t{9 + i % 6}" for i in range(300)
    ]
    (tmp_path / "log.txt").write_text("\n".join(lines), encoding="utf-8")
    recording = lh.read(tmp_path / "log.txt", rate=100)
    np.testing.assert_allclose(recording.gyr[:, 1], np.radians(rate / 131.0))
    np.testing.assert_allclose(np.linalg.norm(recording.acc, axis=1), 9.80665, rtol=2e-3)
    assert any("a guess: 131 counts per deg/s" in note for note in recording.meta["notes"])
