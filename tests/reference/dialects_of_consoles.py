"""Logs as consoles and small apps print them; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, rows, with_words, write
from tests.reference.dialects_of_labs import triple
from tests.reference.dialects_of_loggers import const


@dialect
def along_across_through(folder: Path, m: Motion) -> Path:
    """AltOS, a rocket's altimeter: acceleration along, across and through; gyro_roll, gyro_pitch, gyro_yaw."""
    head = "#version,serial,flight,call,time,clock,state,state_name,acceleration,pressure,altitude,"
    head += "accel_along,accel_across,accel_through,gyro_roll,gyro_pitch,gyro_yaw,mag_x,mag_y,mag_z,tilt\n"
    made = []
    for k, s in enumerate(m.t):
        numbers = ",".join(f"{v:8.3f}" for v in (*m.acc[k], *m.deg[k], *(m.mag / 100.0)[k]))
        made.append(f"   6,  2341,    3,  KD7SQG,{s:9.2f},{ms(m)[k] // 10:10d},  3, boost,   0.10, 101325.0,  12.1,")
        made.append(f"{numbers}, 1.0\n")
    return write(folder / "flight-3.csv", head, *made)


@dialect
def clock_for_a_name(folder: Path, m: Motion) -> Path:
    """An Android app of Japan: the header begins with the time at which it was written, and misspells one name."""
    head = "12:30:14.950\tAccX\tAccY\tAccZ\tLAccX\tLAccY\tLAccZ\t"
    head += "GyroX\tGyroY\tGyroZ\tMangX\tMagY\tMagZ\tLatitude\tLongitude\tGPStime\n"
    text = rows(m.acc, m.linear, m.gyr, m.mag, const(m, 35.1), const(m, 139.2), const(m, 0.0), sep="\t")
    return write(folder / "sensor.txt", head, with_words(dates(m, "%H:%M:%S.%f", 3), text, "\t"))


@dialect
def balancing_cube(folder: Path, m: Motion) -> Path:
    """A balancing cube's telemetry: tabs, units in some names, torques behind."""
    head = (
        "t_ms\taccX\taccY\taccZ\tgyrX_dps\tgyrY_dps\tgyrZ_dps\ttauX_Nm\ttauY_Nm\ttauZ_Nm\tarmed\tgain_scale\tvelX_rps\n"
    )
    text = rows(ms(m) + 2300, m.g, m.deg, 0 * m.gyr, np.ones(len(m.t), int), const(m, 1.0), const(m, 0.3), sep="\t")
    return write(folder / "cube.txt", head, text)


@dialect
def underlined_header(folder: Path, m: Motion) -> Path:
    """A BMI160's example: a greeting, names, a line of dashes, a remark in brackets, counts; no time."""
    head = (
        "No errors.\n\nBMI160 ready!\n\nAccX\tAccY\tAccZ\tGyroX\tGyroY\tGyroZ\n----\t----\t----\t-----\t-----\t-----\n"
    )
    head += "(Board flat: AccZ ~ 16384, AccX/AccY ~ 0)\n"
    text = rows(np.rint(m.g * 16384).astype(int), np.rint(m.deg * 16.4).astype(int), sep="\t")
    return write(folder / "bmi160.txt", head, text)


@dialect
def misspelt_axis(folder: Path, m: Motion) -> Path:
    """A watch's service: gravity beside, and "grz" for the third axis of the gyroscope."""
    head = "timestamp\tppg\thrm\taccx\taccy\taccz\tgrax\tgray\tgraz\tgyrx\tgyry\tgrz\tpressure\tstress\n"
    text = rows(ms(m) + EPOCH, const(m, 1200.0), const(m, 71.0), m.acc, m.acc - m.linear, m.deg, const(m, 1009.0),
                const(m, 1.0), sep="\t", form="%.3f")  # fmt: skip
    return write(folder / "data_watch.csv", head, text)


@dialect
def database_rows(folder: Path, m: Motion) -> Path:
    """A Flutter app's database: id, measurementId, epoch ms, accuracy, then the sensors."""
    head = "id;measurementId;timestamp;accuracy;accelerometerX;accelerometerY;accelerometerZ;"
    head += "gyroscopeX;gyroscopeY;gyroscopeZ\n"
    k = np.arange(len(m.t)) + 4711
    return write(folder / "raw.csv", head, rows(k, 0 * k + 12, ms(m) + EPOCH, 0 * k + 3, m.acc, m.gyr, sep=";"))


@dialect
def value_of_each(folder: Path, m: Motion) -> Path:
    """An Arduino sketch: "Ax value: 0.01   Ay value: …", three blanks between."""
    made = []
    for a, g in zip(m.g, m.deg, strict=True):
        parts = [f"A{axis} value: {v:.2f}" for axis, v in zip("xyz", a, strict=True)]
        parts += [f"G{axis} value: {v:.3f}" for axis, v in zip("xyz", g, strict=True)]
        made.append("   ".join(parts) + "   \n")
    return write(folder / "monitor.txt", *made)


@dialect
def axis_lines_with_units(folder: Path, m: Motion) -> Path:
    """An LSM9DS1's sketch: a line for each axis with its unit, "ax: 0.10 m/s2", "gx: 1.20 dps"."""
    made = []
    for a, g in zip(m.acc, m.deg, strict=True):
        made += [f"a{axis}: {v:.2f} m/s2\n" for axis, v in zip("xyz", a, strict=True)]
        made += [f"g{axis}: {v:.2f} dps\n" for axis, v in zip("xyz", g, strict=True)]
    return write(folder / "imu.txt", *made)


@dialect
def one_line_of_java(folder: Path, m: Motion) -> Path:
    """A Java library's example: "accel: 0.10 0.20 9.80  gyro: 0.01 0.02 0.03"."""
    made = [
        f"accel: {triple(a, '%.2f', ' ')}  gyro: {triple(g, '%.2f', ' ')}\n" for a, g in zip(m.acc, m.gyr, strict=True)
    ]
    return write(folder / "out.txt", *made)


@dialect
def padded_words(folder: Path, m: Motion) -> Path:
    """A BNO085's example: words of one width, "ACC : 0.10 0.20 9.80 m/s²", "GYRO: …", "MAG : …"."""
    made = []
    for a, g, b in zip(m.acc, m.gyr, m.mag, strict=True):
        made.append(f"ACC : {triple(a, '%.2f', ' ')} m/s²\nGYRO: {triple(g, '%.2f', ' ')} rad/s\n")
        made.append(f"MAG : {triple(b, '%.1f', ' ')} uT\n")
    return write(folder / "bno.txt", *made)


@dialect
def arrow_and_two_semicolons(folder: Path, m: Motion) -> Path:
    """A board over WiFi: "MPU6050----> Acc:x,y,z;;Gyro:x,y,z"."""
    made = [f"MPU6050----> Acc:{triple(a, '%f')};;Gyro:{triple(g, '%f')}\n" for a, g in zip(m.g, m.deg, strict=True)]
    return write(folder / "wifi.txt", *made)


@dialect
def words_in_braces(folder: Path, m: Motion) -> Path:
    """A QMI8658's example: "{ACCEL: x,y,z}" and "{GYRO: x,y,z}" on lines of their own."""
    made = []
    for a, g in zip(m.g, m.deg, strict=True):
        made.append(f"{{ACCEL: {triple(a, '%.2f')}}}\n{{GYRO: {triple(g, '%.2f')}}}\n")
    return write(folder / "qmi.txt", *made)


@dialect
def health_line(folder: Path, m: Motion) -> Path:
    """A flight computer's line of health: words that are OK, then accel=x,y,z g gyro=x,y,z dps."""
    made = []
    for a, g in zip(m.g, m.deg, strict=True):
        made.append("[PCB] OK | core:OK flash:OK heap:OK imu:OK baro:OK vin:4.912V(OK) | ")
        made.append(f"accel={triple(a, '%.3f')} g gyro={triple(g, '%.3f')} dps temp=31.2 C pressure=1008.21 hPa\n")
    return write(folder / "pcb.log", *made)


@dialect
def donkey_tub(folder: Path, m: Motion) -> Path:
    """Donkeycar's catalog: a line of JSON for each frame, "imu/acl_x", "imu/gyr_x", _timestamp_ms."""
    made = []
    for k in range(len(m.t)):
        line = {"_index": k, "_session_id": "22-05-04_0", "_timestamp_ms": int(ms(m)[k] + EPOCH)}
        line |= {f"imu/acl_{a}": float(v) for a, v in zip("xyz", m.acc[k].round(5), strict=True)}
        line |= {f"imu/gyr_{a}": float(v) for a, v in zip("xyz", m.gyr[k].round(5), strict=True)}
        made.append(json.dumps(line | {"user/angle": 0.1, "user/mode": "user"}) + "\n")
    return write(folder / "catalog_0.catalog", *made)


@dialect
def signs_and_angles(folder: Path, m: Motion) -> Path:
    """A balancing robot's printf: "fifo count:   12  accel:  +123,  -456,  +789  theta_accel:   +3°  gyro: …"."""
    made = []
    for a, g in zip(np.rint(m.g * 16384).astype(int), np.rint(m.deg * 131).astype(int), strict=True):
        made.append(f"fifo count:   12  accel: {triple(a, '%+6d', ', ')}  theta_accel:     +3°  ")
        made.append(f"gyro: {triple(g, '%+6d', ', ')}  theta_gyro:     +2°  best_theta:     +3°\n")
    return write(folder / "robot.txt", *made)


@dialect
def gyroscope_first_two_blanks(folder: Path, m: Motion) -> Path:
    """A MicroPython loop's print: six numbers, two blanks between, rates first; no names and no time."""
    return write(folder / "bmi.txt", rows(m.deg, m.g, sep="  ", form="%.4f"))


@dialect
def strings_in_json(folder: Path, m: Motion) -> Path:
    """A walking stick's messages: numbers in quotes, GPS_device and IMU as objects, an ISO stamp."""
    made = []
    for k, stamp in enumerate(dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)):
        imu = {word: {a: f"{v:.4f}" for a, v in zip("xyz", one, strict=True)} for word, one in
               (("accelerometer", m.acc[k]), ("gyroscope", m.gyr[k]), ("magnetometer", m.mag[k]))}  # fmt: skip
        place = {"latitude": "41.1", "altitude": "15.3"}
        line = {"stick_code": "S1", "GPS_device": place, "IMU": imu, "sent_at": f"{stamp}Z"}
        made.append(json.dumps(line) + "\n")
    return write(folder / "stick.jsonl", *made)


@dialect
def dash_settings(folder: Path, m: Motion) -> Path:
    """A car's dash: settings as "key,value" lines, a blank line, then names and units in two lines."""
    head = "Format,CSV File\nVehicle,\nSample Rate,100\nDuration,20.0\n\n"
    head += "Time," + names("Accel ") + "," + names("Gyro ") + ",GPS Speed\n"
    head += "s," + ",".join(["g"] * 3 + ["deg/s"] * 3) + ",km/h\n"
    return write(folder / "dash.csv", head, rows(m.t, m.g, m.deg, const(m, 31.0), form="%.4f"))


@dialect
def gestures_with_linear_acceleration(folder: Path, m: Motion) -> Path:
    """A watch's gestures: a row for each sensor, empty cells for the others, linear acceleration before the total."""
    head = "timestamp,sensor,gesture,sample,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n"
    made = []
    for k, linear, a, g in zip(ms(m), m.linear, m.acc, m.gyr, strict=True):
        made.append(f"{k / 1000:.3f},linear_acceleration,punch,1,{triple(linear, '%.4f', ',')},,,\n")
        made.append(f"{k / 1000 + 0.002:.3f},accelerometer,punch,1,{triple(a, '%.4f', ',')},,,\n")
        made.append(f"{k / 1000 + 0.003:.3f},gyroscope,punch,1,,,,{triple(g, '%.4f', ',')}\n")
    return write(folder / "punch.csv", head, *made)


@dialect
def gravity_called_g(folder: Path, m: Motion) -> Path:
    """A motion processor's demonstration: "AccX: 0.1 … GX: 0.02 …", in which G is gravity's direction; no rates."""
    smooth = m.acc - m.linear
    ways = smooth / np.linalg.norm(smooth, axis=1)[:, None]
    made = []
    for a, g in zip(m.acc, ways, strict=True):
        parts = [f"Acc{axis}: {v:.2f}" for axis, v in zip("XYZ", a, strict=True)]
        parts += [f"G{axis}: {v:.2f}" for axis, v in zip("XYZ", g, strict=True)]
        made.append("\t".join([*parts, "Yaw: 1.00"]) + "\n")
    return write(folder / "dmp.txt", *made)
