"""A decoder of its own for every log of shared/data/wild: what a human who knows the device takes from it, in SI.

It shares no code with levelhead; columns, scales and signs come from INDEX.json, read by eye.
"""

import csv
import io
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

G, DEG = 9.80665, np.pi / 180.0


@dataclass
class Stream:
    """(n,) s and (n, 3) SI."""

    t: Any
    values: Any


@dataclass
class Expected:
    """What must come out; sessions may be read one at a time."""

    gyr: Stream
    acc: Stream
    mag: Stream | None = None


def _rows(text: str, delimiter: str | None, skip: int, comma: bool = False) -> list[list[str]]:
    lines = [line for line in text.splitlines()[skip:] if line.strip()]
    if comma:
        lines = [line.replace(",", ".") for line in lines]
    return [
        line.split(delimiter) if delimiter is None else next(csv.reader([line], delimiter=delimiter)) for line in lines
    ]


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _table(text: str, delimiter: str | None, skip: int, columns: Sequence[int]) -> Any:
    return np.array([[_number(row[i]) for i in columns] for row in _rows(text, delimiter, skip)])


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", "replace")


def one(delimiter: str | None, skip: int, t: int | None, gyr: Sequence[int], acc: Sequence[int],
        mag: Sequence[int] | None = None, *, tick: float = 1.0, g: float = G, w: float = 1.0, m: float = 1.0,
        rate: float | None = None) -> Callable[[Path], Expected]:  # fmt: skip
    """A text table: positions of columns, and the factors to SI."""

    def decode(path: Path) -> Expected:
        text = _text(path)
        values = _table(text, delimiter, skip, [*gyr, *acc, *(mag or ())])
        stamps = np.arange(len(values)) / rate if rate else _table(text, delimiter, skip, [t])[:, 0] * tick
        field = Stream(stamps, values[:, 6:9] * m) if mag else None
        return Expected(Stream(stamps, values[:, :3] * w), Stream(stamps, values[:, 3:6] * g), field)

    return decode


def _file(text: str, t: int, xyz: Sequence[int], factor: float, tick: float, skip: int = 1) -> Stream:
    rows = _rows(text, ",", skip)
    stamps = np.array(
        [
            float(int(row[t]) - int(rows[0][t])) * tick if tick < 1e-2 and row[t].isdigit() else float(row[t]) * tick
            for row in rows
        ]
    )
    if tick < 1e-2 and rows[0][t].isdigit():
        stamps = stamps + int(rows[0][t]) * tick
    return Stream(stamps, np.array([[float(row[i]) for i in xyz] for row in rows]) * factor)


def _clock(text: str) -> float:
    return datetime.fromisoformat(text.strip()).timestamp()


def _applewatch(path: Path) -> Expected:
    values = _table(_text(path), ",", 1, range(1, 11))
    t = values[:, 0]
    return Expected(Stream(t, values[:, 1:4]), Stream(t, -G * (values[:, 4:7] + values[:, 7:10])))


def _sensorlogger(files: dict[str, str], acc: str, gyr: str, factor: float, mag: str | None) -> Expected:
    made = {name: _file(files[name], 1, (4, 3, 2), 1.0, 1.0) for name in (acc, gyr, *((mag,) if mag else ()))}
    made[acc].values *= factor
    return Expected(made[gyr], made[acc], made[mag] if mag else None)


def _folder(path: Path) -> dict[str, str]:
    return {part.name: _text(part) for part in path.iterdir() if part.is_file()}


def _zip(path: Path) -> dict[str, str]:
    with zipfile.ZipFile(path) as archive:
        return {
            name: archive.read(name).decode("utf-8", "replace") for name in archive.namelist() if name.endswith(".csv")
        }


def _metawear(path: Path) -> Expected:
    files = _folder(path)
    acc = next(text for name, text in files.items() if "Accelerometer" in name)
    gyr = next(text for name, text in files.items() if "Gyroscope" in name)
    return Expected(_file(gyr, 0, (3, 4, 5), DEG, 1e-3), _file(acc, 0, (3, 4, 5), G, 1e-3))


def _phyphox(path: Path) -> Expected:
    files = _folder(path)
    return Expected(_file(files["Gyroscope.csv"], 0, (1, 2, 3), 1.0, 1.0),
                    _file(files["Accelerometer.csv"], 0, (1, 2, 3), 1.0, 1.0))  # fmt: skip


def _unity(path: Path) -> Expected:
    values = _table(_text(path), ",", 0, range(7))
    new = np.concatenate([[True], (np.diff(values[:, 0]) > 0)])
    t = values[new, 0] * 1e-3
    return Expected(Stream(t, values[new, 4:7]), Stream(t, values[new, 1:4]))


def _witmotion(path: Path) -> Expected:
    rows = _rows(_text(path), "\t", 2)
    t = np.array([datetime.strptime(row[1].strip(), "%H:%M:%S.%f").timestamp() for row in rows])
    values = np.array([[float(cell) for cell in row[2:8]] for row in rows])
    return Expected(Stream(t, values[:, 3:6] * DEG), Stream(t, values[:, :3] * G))


def _razor(path: Path) -> Expected:
    values = _table(_text(path), ",", 1, range(1, 11))
    values = values[np.isfinite(values).all(axis=1)]
    t = np.arange(len(values)) * 0.0206
    return Expected(Stream(t, values[:, 7:10] * DEG / 14.375), Stream(t, values[:, 1:4] * G / 256.0))


def _ulog(path: Path) -> Expected:
    from pyulog import ULog

    data = next(one for one in ULog(str(path), ["sensor_combined"]).data_list if one.name == "sensor_combined").data
    t = data["timestamp"] * 1e-6
    pick = lambda name: np.column_stack([data[f"{name}[{i}]"] for i in range(3)]).astype(float)  # noqa: E731
    return Expected(Stream(t, pick("gyro_rad")), Stream(t, pick("accelerometer_m_s2")),
                    Stream(t, pick("magnetometer_ga") * 100.0))  # fmt: skip


def _bag(topic: str, mag: str | None) -> Callable[[Path], Expected]:
    def decode(path: Path) -> Expected:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        rows: dict[str, list[list[float]]] = {}
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, _, raw in reader.messages():
                if connection.topic == topic:
                    message: Any = reader.deserialize(raw, connection.msgtype)
                    stamp, a, w = message.header.stamp, message.linear_acceleration, message.angular_velocity
                    rows.setdefault(topic, []).append([stamp.sec + stamp.nanosec * 1e-9, w.x, w.y, w.z, a.x, a.y, a.z])
        values = np.array(rows[topic])
        return Expected(Stream(values[:, 0], values[:, 1:4]), Stream(values[:, 0], values[:, 4:7]))

    return decode


def _gnss(path: Path) -> Expected:
    files = _folder(path)
    t = np.loadtxt(io.StringIO(files["time.csv"]), skiprows=1)
    gyr = np.loadtxt(io.StringIO(files["gyro-0.csv"]), delimiter=",", skiprows=1) * DEG
    acc = np.loadtxt(io.StringIO(files["accel-0.csv"]), delimiter=",", skiprows=1)
    n = min(len(t), len(gyr))
    return Expected(Stream(t[:n], gyr[:n]), Stream(t[:n], acc[:n]))


def _ese650(path: Path) -> Expected:
    import scipy.io

    data = scipy.io.loadmat(path)
    vals, t = data["vals"].astype(float), data["ts"].reshape(-1)
    acc = (vals[:3].T - [511.0, 500.0, 503.0]) * [-1.0, -1.0, 1.0] * G / 104.0
    gyr = (vals[[4, 5, 3]].T - [373.6, 375.4, 369.7]) * 0.0169
    return Expected(Stream(t, gyr), Stream(t, acc))


def _sunsided(path: Path) -> Expected:
    import h5py

    def load(name: str, variable: str, factor: float) -> Stream:
        with h5py.File(path / name) as file:
            data = np.array(file[variable])
        return Stream(data[0], data[1:].T * factor)

    gyr = load("mpu6050_gyroscope.mat", "gyroBuffer", DEG)
    return Expected(
        gyr, load("mpu6050_accelerometer.mat", "accelBuffer", G), load("hmc5883l_compass.mat", "compassBuffer", 100.0)
    )


def _uci(path: Path) -> Expected:
    def load(name: str) -> Any:
        return np.column_stack([np.loadtxt(path / f"{name}_{axis}_test.txt")[:, :64].reshape(-1) for axis in "xyz"])

    gyr, acc = load("body_gyro"), load("total_acc") * G
    t = np.arange(len(gyr)) / 50.0
    return Expected(Stream(t, gyr), Stream(t, acc))


DECODERS: dict[str, Callable[[Path], Expected]] = {
    "xsens_mtw_counter.txt": one("\t", 5, None, (4, 5, 6), (1, 2, 3), g=1.0, rate=50.0),
    "xsens_mtx_latlon.txt": one("\t", 5, None, (4, 5, 6), (1, 2, 3), g=1.0, rate=120.0),
    "xsens_mtmanager_comma.txt": one(",", 6, None, (5, 6, 7), (2, 3, 4), g=1.0, rate=100.0),
    "shimmer3.csv": one(",", 4, 1, (9, 11, 13), (3, 5, 7), tick=1e-3, g=1.0, w=DEG),
    "razor9dof.csv": _razor,
    "yei_3space.txt": one(",", 1, 0, (1, 2, 3), (7, 8, 9), (4, 5, 6), tick=1e-6, m=100.0),
    "openshoe.txt": one(None, 4, 10, (4, 5, 6), (1, 2, 3), (14, 15, 16), m=100.0),
    "metawear": _metawear,
    "applewatch_wristmotion.csv": _applewatch,
    "sensorlogger_uncal": lambda path: _sensorlogger(
        _folder(path), "AccelerometerUncalibrated.csv", "GyroscopeUncalibrated.csv", -G, "MagnetometerUncalibrated.csv"
    ),
    "sensorlogger_original.zip": lambda path: _sensorlogger(
        _zip(path), "AccelerometerUncalibrated.csv", "GyroscopeUncalibrated.csv", -G, None
    ),
    "sensorlogger_car": lambda path: _sensorlogger(
        _folder(path), "TotalAcceleration.csv", "Gyroscope.csv", 1.0, "Magnetometer.csv"
    ),
    "androsensor_semicolon.csv": one(";", 1, -2, (9, 10, 11), (0, 1, 2), tick=1e-3, g=1.0),
    "phyphox_degs": _phyphox,
    "unity_phone_covs.csv": _unity,
    "mpu_pms67.csv": one(",", 1, 0, (4, 5, 6), (1, 2, 3), w=DEG),
    "mpu6050_vidplot.csv": one(",", 1, 0, (4, 5, 6), (1, 2, 3), w=DEG),
    "bike_epochms.csv": one(",", 1, 0, (4, 5, 6), (1, 2, 3), tick=1e-3, w=DEG),
    "robot_units_in_names.csv": one(",", 1, 0, (4, 5, 6), (1, 2, 3), w=DEG),
    "mpu_noheadertime_gdps.csv": one(",", 1, None, (3, 4, 5), (0, 1, 2), w=DEG, rate=80.0),
    "labyrinth_noheader.csv": one(",", 0, 0, (1, 2, 3), (4, 5, 6), w=DEG),
    "zupt_noheader_mps2.csv": one(",", 0, None, (3, 4, 5), (0, 1, 2), g=1.0, rate=100.0),
    "witmotion_txt.txt": _witmotion,
    "eskf_embedded.txt": one(",", 1, 0, (4, 5, 6), (1, 2, 3), g=1.0),
    "charge_challenge.csv": one(",", 1, 0, (4, 5, 6), (1, 2, 3), g=1.0),
    "magicleap2.csv": one(",", 1, 0, (6, 7, 8), (3, 4, 5), tick=1e-9),
    "rosbag1_ardrone.bag": _bag("/ardrone/imu", None),
    "rosbag1_phidgets.bag": _bag("/imu/data_raw", None),
    "rosbag2_ardrone_db3": _bag("/ardrone/imu", None),
    "px4_sample.ulg": _ulog,
    "microstrain_gx3.csv": one(",", 16, 2, (18, 19, 20), (15, 16, 17), (21, 22, 23), m=100.0),
    "dmvio_imu.txt": one(None, 1, 0, (1, 2, 3), (4, 5, 6), tick=1e-9, g=1.0),
    "gnss_ins_sim_bosch": _gnss,
    "ese650_imuRaw1.mat": _ese650,
    "sunsided_tiltsphere": _sunsided,
    "uci_har": _uci,
}
