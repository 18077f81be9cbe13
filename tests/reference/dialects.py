"""Logs as well-known programs write them, made from one recording: what a name stands for is in its docstring.

Each function takes a folder and a ``Motion`` and returns the path to read. The layouts are those of the programs' own
exports; the numbers are the recording's, so that a test can compare.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import levelhead as lh

Array = np.ndarray
Dialect = Callable[[Path, "Motion"], Path]
DIALECTS: dict[str, Dialect] = {}
START = datetime(2023, 5, 4, 12, 30, 15, 250_000)
EPOCH = 1_683_203_415_250  # ms, of START as UTC
STEP = 0.01  # s, between samples


class Motion(NamedTuple):
    """Stamps in s from 0, rad/s, m/s², µT, and the share of the force that is not gravity."""

    t: Array
    gyr: Array
    acc: Array
    mag: Array
    linear: Array

    @property
    def deg(self) -> Array:
        return np.degrees(self.gyr)

    @property
    def g(self) -> Array:
        return self.acc / 9.80665


def dialect(function: Dialect) -> Dialect:
    """Registers a dialect by its name."""
    DIALECTS[function.__name__] = function
    return function


def rows(*columns: Array, sep: str = ",", form: str = "%.6f") -> str:
    """Lines of numbers; integers stay integers."""
    table: list[Array] = []
    for one in columns:
        table += list(np.atleast_2d(np.asarray(one).T)) if np.ndim(one) > 1 else [np.asarray(one)]
    cells = [[str(v) if one.dtype.kind in "iuU" else form % v for v in one] for one in table]
    return "\n".join(sep.join(line) for line in zip(*cells, strict=True)) + "\n"


def write(path: Path, *parts: str, encoding: str = "utf-8") -> Path:
    """Writes text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes("".join(parts).encode(encoding))
    return path


def ns(m: Motion) -> Array:
    """Nanoseconds since 1970."""
    return np.rint(m.t * 1e9).astype(np.int64) + EPOCH * 1_000_000


def ms(m: Motion) -> Array:
    """Milliseconds since the start."""
    return np.rint(m.t * 1e3).astype(np.int64)


def dates(m: Motion, form: str, digits: int = 6) -> list[str]:
    """Stamps as words; %f cut to ``digits``."""
    made = []
    for s in m.t:
        words = (START + timedelta(seconds=float(s))).strftime(form)
        made.append(words[: digits - 6] if form.endswith("%f") and digits < 6 else words)
    return made


def with_words(words: Iterable[str], numbers: str, sep: str = ",") -> str:
    """A column of words before lines of numbers."""
    return "\n".join(f"{a}{sep}{b}" for a, b in zip(words, numbers.strip().split("\n"), strict=True)) + "\n"


def names(stem: str, axes: Sequence[str] = "XYZ", end: str = "") -> str:
    """Names of three columns, joined by commas."""
    return ",".join(f"{stem}{axis}{end}" for axis in axes)


# phones -----------------------------------------------------------------------------------------------------------


@dialect
def sensor_logger_android(folder: Path, m: Motion) -> Path:
    """Sensor Logger: a file per sensor, axes z, y, x; Accelerometer is linear, TotalAcceleration is not."""
    head = "time,seconds_elapsed,z,y,x\n"
    gravity = m.acc - m.linear
    for name, values in (("Gyroscope", m.gyr), ("Accelerometer", m.linear), ("Gravity", gravity),
                         ("TotalAcceleration", m.acc), ("Magnetometer", m.mag)):  # fmt: skip
        write(folder / f"{name}.csv", head, rows(ns(m), m.t, values[:, ::-1]))
    write(folder / "Metadata.csv", "version,device name,platform\n3,Pixel 6,android\n")
    write(folder / "Annotation.csv", "time,seconds_elapsed,text\n")
    return folder


@dialect
def sensor_logger_without_total(folder: Path, m: Motion) -> Path:
    """The same, older: gravity and linear acceleration must be added."""
    sensor_logger_android(folder, m)
    (folder / "TotalAcceleration.csv").unlink()
    return folder


@dialect
def sensor_logger_json(folder: Path, m: Motion) -> Path:
    """Sensor Logger's JSON: a list of readings of all sensors, numbers as strings."""
    made: list[dict[str, str]] = [{"version": "3", "sensor": "Metadata", "platform": "android"}]
    for k, stamp in enumerate(ns(m)):
        for name, values in (("Gyroscope", m.gyr), ("TotalAcceleration", m.acc)):
            x, y, z = values[k]
            made.append({"sensor": name, "time": str(stamp), "seconds_elapsed": f"{m.t[k]:.6f}",
                         "x": f"{x:.6f}", "y": f"{y:.6f}", "z": f"{z:.6f}"})  # fmt: skip
    return write(folder / "log.json", json.dumps(made))


@dialect
def phyphox_folder(folder: Path, m: Motion) -> Path:
    """phyphox's CSV export: quoted names with units, the sensor in the file's name only; meta/ beside them."""
    for name, unit, values in (("Gyroscope", "rad/s", m.gyr), ("Accelerometer", "m/s^2", m.acc),
                               ("Linear Accelerometer", "m/s^2", m.linear)):  # fmt: skip
        head = ",".join(f'"{word}"' for word in ("Time (s)", *(f"{axis} ({unit})" for axis in "XYZ")))
        write(folder / f"{name}.csv", head, "\n", rows(m.t, values, form="%.9E"))
    write(folder / "meta" / "device.csv", '"property","value"\n"version","1.1.11"\n"deviceModel","Pixel"\n')
    write(folder / "meta" / "time.csv", '"event","experiment time","system time"\n"START",0.0,1683203415.25\n')
    return folder


@dialect
def phyphox_semicolon(folder: Path, m: Motion) -> Path:
    """phyphox's CSV with semicolons and decimal commas, all sensors in one table."""
    head = '"Time (s)";"Gyroscope x (rad/s)";"Gyroscope y (rad/s)";"Gyroscope z (rad/s)";'
    head += '"Acceleration x (m/s^2)";"Acceleration y (m/s^2)";"Acceleration z (m/s^2)"\n'
    return write(folder / "Raw Data.csv", head, rows(m.t, m.gyr, m.acc, sep=";", form="%.9E").replace(".", ","))


@dialect
def phyphox_workbook(folder: Path, m: Motion) -> Path:
    """phyphox's Excel export: one sheet per sensor, and two of metadata."""
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, unit, values in (("Accelerometer", "m/s^2", m.acc), ("Gyroscope", "rad/s", m.gyr)):
        sheet = book.create_sheet(name)
        sheet.append(["Time (s)", *(f"{axis} ({unit})" for axis in "XYZ")])
        for stamp, line in zip(m.t, values, strict=True):
            sheet.append([float(stamp), *map(float, line)])
    for name in ("Metadata Device", "Metadata Time"):
        sheet = book.create_sheet(name)
        sheet.append(["property", "value"])
        sheet.append(["version", "1.1.11"])
    book.save(folder / "phyphox.xlsx")
    return folder / "phyphox.xlsx"


@dialect
def physics_toolbox(folder: Path, m: Motion) -> Path:
    """Physics Toolbox Sensor Suite, several sensors: g-force, linear acceleration and gyroscope side by side."""
    head = "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,Bx,By,Bz\n"
    return write(folder / "2023-05-0412.30.15.csv", head, rows(m.t, m.g, m.linear, m.gyr, m.mag))


@dialect
def sensorlog_ios(folder: Path, m: Motion) -> Path:
    """SensorLog for iOS: a date, three clocks, Core Motion's raw accelerometer in G with Apple's sign."""
    head = "loggingTime(txt),loggingSample(N),accelerometerTimestamp_sinceReboot(s),"
    head += names("accelerometerAcceleration", end="(G)") + ",gyroTimestamp_sinceReboot(s),"
    head += names("gyroRotation", end="(rad/s)") + ",motionTimestamp_sinceReboot(s),motionYaw(rad),motionRoll(rad),"
    head += "motionPitch(rad)," + names("motionRotationRate", end="(rad/s)") + ","
    head += names("motionUserAcceleration", end="(G)") + "," + names("motionGravity", end="(G)") + "\n"
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    up = m.t + 5000.0
    text = rows(np.arange(len(m.t)), up, -m.g, up + 0.002, m.gyr, up, 0 * m.gyr, m.gyr, user, gravity)
    return write(folder / "my_iPhone.csv", head, with_words(dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3), text))


@dialect
def core_motion_app(folder: Path, m: Motion) -> Path:
    """A home-made app for iOS: rotationRate, userAcceleration and gravity of Core Motion, no units."""
    head = f"timestamp,{names('rotationRate.', 'xyz')},{names('userAcceleration.', 'xyz')},{names('gravity.', 'xyz')}\n"
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    return write(folder / "motion.csv", head, rows(m.t + 81234.5, m.gyr, user, gravity))


@dialect
def android_sensor_types(folder: Path, m: Motion) -> Path:
    """An Android service that writes each event with its type: 1 accelerometer, 4 gyroscope, 2 magnetometer."""
    made = []
    for k, stamp in enumerate(ns(m)):
        for kind, values in ((1, m.acc), (4, m.gyr), (2, m.mag)):
            made.append(f"{stamp + kind * 1000},{kind},{','.join(f'{v:.6f}' for v in values[k])}\n")
    return write(folder / "events.csv", "timestamp,sensor,x,y,z\n", *made)


@dialect
def get_sensor_data(folder: Path, m: Motion) -> Path:
    """GetSensorData (IPIN): % preamble that lists the columns, rows ACCE;… GYRO;… MAGN;…"""
    head = "% LogFile created by the 'GetSensorData' App for Android\n% Date of creation: Thu May 04 2023\n"
    head += "% Accelerometer data: \tACCE;AppTimestamp(s);SensorTimestamp(s);Acc_X(m/s^2);Acc_Y(m/s^2);Acc_Z(m/s^2);"
    head += "Accuracy(integer)\n% Gyroscope data:    \tGYRO;AppTimestamp(s);SensorTimestamp(s);Gyr_X(rad/s);"
    head += "Gyr_Y(rad/s);Gyr_Z(rad/s);Accuracy(integer)\n"
    made = []
    for k, s in enumerate(m.t):
        for word, values in (("ACCE", m.acc), ("GYRO", m.gyr), ("MAGN", m.mag)):
            made.append(f"{word};{s + 0.004:.3f};{s + 7000:.6f};{';'.join(f'{v:.5f}' for v in values[k])};3\n")
        if k % 20 == 0:
            made.append(f"PRES;{s + 0.004:.3f};{s + 7000:.6f};945.2;0\n")
    return write(folder / "logfile_2023.txt", head, *made)


@dialect
def gnss_logger(folder: Path, m: Motion) -> Path:
    """Google's GnssLogger: a # line per kind of row; UncalGyro with its drift, UncalAccel with its bias."""
    head = "# \n# Header Description:\n# \n# Version: v3.0.5.6 Platform: 12 Manufacturer: Google Model: Pixel 5\n# \n"
    for word, unit in (("UncalAccel", "Mps2"), ("UncalGyro", "RadPerSec")):
        bias = "Bias" if word == "UncalAccel" else "Drift"
        head += f"# {word},utcTimeMillis,elapsedRealtimeNanos,"
        head += ",".join([f"{word}{a}{unit}" for a in "XYZ"] + [f"{bias}{a}{unit}" for a in "XYZ"]) + "\n# \n"
    made = []
    for k, stamp in enumerate(ns(m)):
        at = f"{stamp // 1_000_000},{stamp - EPOCH * 1_000_000 + 10**12}"
        for word, values in (("UncalAccel", m.acc), ("UncalGyro", m.gyr)):
            made.append(f"{word},{at},{','.join(f'{v:.6f}' for v in values[k])},0.0,0.0,0.0\n")
    return write(folder / "gnss_log_2023_05_04.txt", head, *made)


@dialect
def open_camera(folder: Path, m: Motion) -> Path:
    """Open Camera's video sensors: no header, x, y, z and then the stamp in ns; a file per sensor."""
    for name, values in (("accel", m.acc), ("gyro", m.gyr)):
        write(folder / f"VID_20230504_123015{name}.csv", rows(values, ns(m) - EPOCH * 1_000_000 + 10**13))
    return folder


@dialect
def mars_logger(folder: Path, m: Motion) -> Path:
    """MarsLogger's gyro_accel.csv."""
    head = "Timestamp[nanosec],gx[rad/s],gy[rad/s],gz[rad/s],ax[m/s^2],ay[m/s^2],az[m/s^2],Unix time[nanosec]\n"
    return write(folder / "gyro_accel.csv", head, rows(ns(m) - EPOCH * 1_000_000 + 10**13, m.gyr, m.acc, ns(m)))


@dialect
def edge_impulse(folder: Path, m: Motion) -> Path:
    """Edge Impulse's acquisition format: names with units, an interval, rows of values."""
    sensors = [{"name": f"acc{a}", "units": "m/s2"} for a in "XYZ"] + [
        {"name": f"gyr{a}", "units": "rad/s"} for a in "XYZ"
    ]
    payload = {"device_name": "ac:87:a3", "device_type": "DISCO-L475VG", "interval_ms": 10, "sensors": sensors,
               "values": np.hstack([m.acc, m.gyr]).round(6).tolist()}  # fmt: skip
    made = {"protected": {"ver": "v1", "alg": "HS256", "iat": 1683203415}, "signature": "0" * 64, "payload": payload}
    return write(folder / "idle01.json", json.dumps(made))


@dialect
def polar_sensor_logger(folder: Path, m: Motion) -> Path:
    """Polar Sensor Logger: a file per sensor, a date and the sensor's ns, mg and dps."""
    stamps = dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)
    for name, unit, values in (("ACC", "mg", m.g * 1e3), ("GYRO", "dps", m.deg)):
        head = f"Phone timestamp;sensor timestamp [ns];X [{unit}];Y [{unit}];Z [{unit}]\n"
        text = with_words(stamps, rows(ns(m) - 946_684_800 * 10**9, values, sep=";"), ";")
        write(folder / f"Polar_Sense_A1B2C3D4_20230504_123015_{name}.txt", head, text)
    return folder


@dialect
def nested_json_lines(folder: Path, m: Motion) -> Path:
    """A web service's lines of JSON: an object in an object in each."""
    made = []
    for stamp, g, a in zip(ns(m) // 1_000_000, m.gyr.tolist(), m.acc.tolist(), strict=True):
        imu = {"gyro": dict(zip("xyz", g, strict=True)), "accel": dict(zip("xyz", a, strict=True))}
        made.append(json.dumps({"ts": int(stamp), "imu": imu}))
    return write(folder / "log.jsonl", "\n".join(made))


@dialect
def phyphox_german(folder: Path, m: Motion) -> Path:
    """phyphox on a phone that speaks German."""
    for name, unit, values in (("Gyroskop", "rad/s", m.gyr), ("Beschleunigung", "m/s^2", m.acc),
                               ("Lineare Beschleunigung", "m/s^2", m.linear)):  # fmt: skip
        head = ",".join(f'"{word}"' for word in ("Zeit (s)", *(f"{axis} ({unit})" for axis in "XYZ")))
        write(folder / f"{name}.csv", head, "\n", rows(m.t, values, form="%.9E"))
    return folder


REFUSED = {
    "letters_around_counts",  # counts about 512: no hint can take an offset off
    "gravity_called_g",  # no gyroscope in it
}


def simulate(style: str) -> Motion:
    """20 s of a style of motion, with the numbers that dialects write."""
    made = lh.simulate.recording("MPU-6050", style, duration=20.0, seed=1)
    assert made.truth is not None
    body = Rotation.from_quat(made.truth.quat, scalar_first=True).inv()
    return Motion(made.t, made.gyr, made.acc, body.apply([0.0, 18.0, -45.0]), made.acc - body.apply([0, 0, 9.80665]))


def off(recording: lh.Recording, motion: Motion) -> str:
    """What of a reading is not what was written; "" if all is."""
    if abs(recording.duration - motion.t[-1]) > 0.15 or len(recording) < 0.95 * len(motion.t):
        return f"{len(recording)} samples, {recording.duration:.2f} s"
    first = int(np.isfinite(recording.gyr).all(axis=1).argmax())
    rows = np.rint((recording.t - recording.t[first]) / STEP).astype(int)
    if len(recording) == len(motion.t) and float(np.abs(recording.t - recording.t[0] - motion.t).max()) < 0.1:
        rows = np.arange(len(motion.t))  # bursts of stamps were spread
    for role, limit in (("gyr", 0.03), ("acc", 0.12)):
        real, said = getattr(motion, role), getattr(recording, role)
        apart = min(
            float(np.nanmedian(np.abs(said - real[np.clip(rows + shift, 0, len(real) - 1)]).max(axis=1)))
            for shift in (0, 1)
        )
        if not apart < limit:
            return f"{role} is off by {apart:.3g}"
    return ""
