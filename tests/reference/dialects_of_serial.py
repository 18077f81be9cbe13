"""Logs as makers' boards print them and terminals keep them, in more layouts; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import Motion, dates, dialect, ms, names, rows, with_words, write


@dialect
def razor_ahrs(folder: Path, m: Motion) -> Path:
    """Razor AHRS: three lines a sample, #A-C= #M-C= #G-C=."""
    made = []
    for g, a, b in zip(m.deg, m.g * 256, m.mag, strict=True):
        for word, values in (("A", a), ("M", b), ("G", g)):
            made.append(f"#{word}-C={','.join(f'{v:.2f}' for v in values)}\n")
    return write(folder / "razor.txt", *made)


@dialect
def minimu9_raw(folder: Path, m: Motion) -> Path:
    """minimu9-ahrs --mode raw: nine whole numbers, padded; neither header nor time."""
    parts = [np.rint(m.mag * 11).astype(int), np.rint(m.g * 4096).astype(int), np.rint(m.deg / 0.07).astype(int)]
    lines = ["   ".join(" ".join(f"{v:7d}" for v in one[k]) for one in parts) + "\n" for k in range(len(m.t))]
    return write(folder / "raw.txt", *lines)


@dialect
def motion_cal(folder: Path, m: Motion) -> Path:
    """MotionCal's protocol: Raw:… in whole numbers and Uni:… in units, by turns."""
    made = []
    for g, a, b in zip(m.deg, m.g, m.mag, strict=True):
        made.append("Raw:" + ",".join(str(round(v)) for v in (*(8192 * a), *(16 * g), *(10 * b))) + "\n")
        made.append("Uni:" + ",".join(f"{v:.4f}" for v in (*(9.80665 * a), *np.radians(g), *b)) + "\n")
    return write(folder / "motioncal.log", *made)


@dialect
def nano33_bursts(folder: Path, m: Motion) -> Path:
    """Arduino's IMU_Capture for Nano 33: gestures of 119 samples, a blank line between, no time."""
    made = ["aX,aY,aZ,gX,gY,gZ\n"]
    for k, line in enumerate(rows(m.g, m.deg, form="%.3f").strip().split("\n")):
        made.append(line + ("\n\n" if k % 119 == 118 else "\n"))
    return write(folder / "punch.csv", *made)


@dialect
def esp_log(folder: Path, m: Motion) -> Path:
    """ESP-IDF's log: a level, ms in brackets, a tag, words with colons."""
    made = ["I (312) mpu6050: WHO_AM_I: 0x68\n"]
    for s, g, a in zip(ms(m) + 400, m.deg, m.g, strict=True):
        words = [f"acce_{x}:{v:.3f}" for x, v in zip("xyz", a, strict=True)]
        words += [f"gyro_{x}:{v:.3f}" for x, v in zip("xyz", g, strict=True)]
        made.append(f"I ({s}) mpu6050: {', '.join(words)}\n")
    return write(folder / "monitor.log", *made)


@dialect
def python_logging(folder: Path, m: Motion) -> Path:
    """Python's logging: a date with a comma before the ms, a level, words."""
    made = []
    for s, g, a in zip(dates(m, "%Y-%m-%d %H:%M:%S,%f", 3), m.gyr, m.acc, strict=True):
        words = [f"{n}={v:.4f}" for n, v in zip(("ax", "ay", "az", "gx", "gy", "gz"), (*a, *g), strict=True)]
        made.append(f"{s} - INFO - {' '.join(words)}\n")
    return write(folder / "imu.log", *made)


@dialect
def coolterm_brackets(folder: Path, m: Motion) -> Path:
    """A terminal that puts the clock in square brackets before numbers."""
    made = ["[12:30:15.100] ax,ay,az,gx,gy,gz\n"]
    for s, line in zip(dates(m, "%H:%M:%S.%f", 3), rows(m.acc, m.gyr).strip().split("\n"), strict=True):
        made.append(f"[{s}] {line}\n")
    return write(folder / "CoolTerm Capture.txt", *made)


@dialect
def screen_log_tail(folder: Path, m: Motion) -> Path:
    """A board that was reset: half a line, boot messages, then words and numbers by tabs under a header."""
    head = "08,-0.12\t0.4\nets Jun  8 2016 00:22:57\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\n"
    head += "configsip: 0, SPIWP:0xee\nMPU6050 ready!\ntime_ms\tax\tay\taz\tgx\tgy\tgz\n"
    return write(folder / "screenlog.0.txt", head, rows(ms(m) + 53, m.g, m.deg, sep="\t", form="%.3f"))


@dialect
def arduino_plotter(folder: Path, m: Motion) -> Path:
    """Arduino's plotter: name:number by tabs, the time as one of them."""
    made = []
    for s, g, a in zip(ms(m), m.deg, m.acc, strict=True):
        words = [
            f"{n}:{v:.3f}" for n, v in zip(("AccX", "AccY", "AccZ", "GyroX", "GyroY", "GyroZ"), (*a, *g), strict=True)
        ]
        made.append("\t".join([f"millis:{s}", *words]) + "\n")
    return write(folder / "plotter.txt", *made)


@dialect
def sentences_of_units(folder: Path, m: Motion) -> Path:
    """An Arduino sketch in sentences: each number with its unit behind it."""
    made = []
    for s, g, a in zip(ms(m), m.deg, m.g, strict=True):
        made.append(f"t = {s} ms, Acc X = {a[0]:.3f} g, Acc Y = {a[1]:.3f} g, Acc Z = {a[2]:.3f} g, "
                    f"Gyro X = {g[0]:.2f} deg/s, Gyro Y = {g[1]:.2f} deg/s, Gyro Z = {g[2]:.2f} deg/s\n")  # fmt: skip
    return write(folder / "sentences.txt", *made)


@dialect
def two_boards_numbered(folder: Path, m: Motion) -> Path:
    """Two MPU-6050 on one bus: ax1 … gz2, raw numbers, micros."""
    acc, gyr = np.rint(m.g * 16384).astype(int), np.rint(m.deg * 131).astype(int)
    head = "micros," + ",".join(f"{n}{k}" for k in (1, 2) for n in ("ax", "ay", "az", "gx", "gy", "gz")) + "\n"
    return write(folder / "two.csv", head, rows(np.rint(m.t * 1e6).astype(int) + 4000, acc, gyr, acc[::-1], gyr[::-1]))


@dialect
def delta_time_column(folder: Path, m: Motion) -> Path:
    """A sketch that prints the interval since the last row, in s, as dt."""
    step = np.diff(m.t, prepend=m.t[0] - 0.01)
    return write(folder / "dt.csv", "dt,ax,ay,az,gx,gy,gz\n", rows(step, m.acc, m.gyr))


@dialect
def bno055_calibrated(folder: Path, m: Motion) -> Path:
    """BNO055's raw modes: accelerometer beside linear and gravity vectors, rates in deg/s, calibration states."""
    head = "time_ms,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,lin_x,lin_y,lin_z,grav_x,grav_y,grav_z,quat_w,quat_x,quat_y,"
    head += "quat_z,cal_sys,cal_gyro,cal_acc,cal_mag\n"
    n = len(m.t)
    text = rows(ms(m) + 900, m.acc, m.deg, m.linear, m.acc - m.linear, np.zeros((n, 4)) + [1.0, 0, 0, 0],
                np.full((n, 4), 3), form="%.4f")  # fmt: skip
    return write(folder / "bno055.csv", head, text)


@dialect
def json_serial(folder: Path, m: Motion) -> Path:
    """MQTT messages in lines: a topic before each object."""
    made = [f"imu/raw {json.dumps({'ts': int(s), 'accel': a, 'gyro': g})}\n" for s, a, g in
            zip(ms(m), m.acc.round(5).tolist(), m.gyr.round(5).tolist(), strict=True)]  # fmt: skip
    return write(folder / "mqtt.log", *made)


@dialect
def float_seconds_words_between(folder: Path, m: Motion) -> Path:
    """A home-made table with a label of the movement between the columns, and a header of quoted names."""
    head = '"Timestamp","Activity","acc X","acc Y","acc Z","gyro X","gyro Y","gyro Z"\n'
    text = rows(np.full(len(m.t), "walking"), m.acc, m.gyr)
    return write(folder / "activity.csv", head, with_words([f"{s:.3f}" for s in m.t + 1_683_203_415.25], text))


@dialect
def joy_con(folder: Path, m: Motion) -> Path:
    """A Joy-Con's script: three samples in a report, so three rows share a stamp."""
    stamps = np.repeat(m.t[::3], 3)[: len(m.t)]
    head = f"time,{names('gyro.', 'xyz')},{names('accel.', 'xyz')}\n"
    return write(folder / "joycon.csv", head, rows(stamps, m.deg, m.g))


@dialect
def counted_rows(folder: Path, m: Motion) -> Path:
    """pandas' to_csv: a nameless number of the row first, then names in lower case with units in the names."""
    head = ",timestamp_us,accel_x_mps2,accel_y_mps2,accel_z_mps2,gyro_x_radps,gyro_y_radps,gyro_z_radps\n"
    return write(folder / "frame.csv", head, rows(np.arange(len(m.t)), np.rint(m.t * 1e6).astype(int), m.acc, m.gyr))
