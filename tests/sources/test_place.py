"""Place and date from the log: satellite positions in its columns or topics, and stamps since 1970."""

import datetime
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead import simulate
from levelhead.magnetic_model import earth_field
from levelhead.sources.place import date_of, place_of, satellite_place

MUNICH, DAY = (48.137, 11.575, 520.0), 1_780_272_000.0  # 2026-06-01


def write_csv(path, rec, columns, start=DAY):
    """A log with further columns; stamps in s since 1970."""
    names = [
        "time [s]",
        *(f"{s}_{a} [{u}]" for s, u in (("gyr", "rad/s"), ("acc", "m/s2"), ("mag", "uT")) for a in "xyz"),
    ]
    rows = np.column_stack(
        [start + rec.t, rec.gyr, rec.acc, rec.mag, *(np.full(len(rec), x) for x in columns.values())]
    )
    np.savetxt(path, rows, delimiter=",", header=",".join([*names, *columns]), comments="", fmt="%.9f")
    return path


@pytest.fixture(scope="module")
def rec():
    return simulate.recording("ICM-20948", "hand", duration=40.0, rate=50.0, mag="AK09916", seed=1)


@pytest.mark.parametrize(
    "names", [("latitude", "longitude", "altitude"), ("GPS Lat (°)", "GPS Lon (°)", "GPS Alt (m)")]
)
def test_columns_of_a_phone(tmp_path, rec, names):
    path = write_csv(tmp_path / "a.csv", rec, dict(zip(names, MUNICH, strict=True)))
    read = lh.read(path)
    assert place_of(read) == (48.137, 11.575, 520.0, datetime.date(2026, 6, 1))
    assert any(note.startswith("place 48.1370,11.5750 by ") for note in read.meta["notes"])


def test_whole_numbers_and_missing_fixes():
    found = satellite_place(np.array([0, 481370000, 481370001]), np.array([0, 115750000, 115750000]), source="x")
    assert (found.facts["latitude"], found.facts["longitude"]) == (48.137, 11.575)
    assert satellite_place(np.zeros(3), np.zeros(3)) is None
    assert satellite_place(np.full(3, np.nan), np.zeros(3)) is None
    assert satellite_place(np.array([95.0]), np.array([1e12])) is None


def test_no_place_and_no_date(tmp_path, rec):
    plain = lh.read(write_csv(tmp_path / "a.csv", rec, {}, start=0.0))
    assert place_of(plain) is None and date_of(plain) is None
    lateral = lh.read(write_csv(tmp_path / "b.csv", rec, {"lateral": 1.0, "longitudinal": 2.0}))
    assert place_of(lateral) is None and date_of(lateral) == datetime.date(2026, 6, 1)


def turned_round(n=2000):
    """A sensor that turns over in all directions, in a field of 48.6 µT that dips by 64°: the place's own."""
    t = 0.02 * np.arange(n)
    gyr = np.stack([0.7 * np.cos(0.05 * t), 0.5 + 0.0 * t, 0.6 * np.sin(0.11 * t)], axis=1)
    turns = Rotation.identity()
    quats = []
    for rate in gyr:
        turns = turns * Rotation.from_rotvec(0.02 * rate)
        quats.append(turns.as_quat())
    back = Rotation.from_quat(quats).inv()
    field = earth_field(*MUNICH, date="2026-06-01")
    dip = np.radians(field.dip)
    noise = np.random.default_rng(0).normal(0.0, 0.3, (n, 3))
    mag = back.apply(field.strength * np.array([0.0, np.cos(dip), -np.sin(dip)])) + noise
    return lh.Recording(t, gyr, back.apply([0.0, 0.0, 9.80665]), mag)


@pytest.mark.parametrize("factor, option", [(1.0, None), (1.5, "--counts mag=1.5"), (0.6, "--counts mag=0.6"),
                                            (10.0, "--units mag=mG")])  # fmt: skip
def test_a_magnetometer_of_the_wrong_scale_is_found(tmp_path, factor, option):
    """The field is that of the place, so that only its scale is wrong."""
    pytest.importorskip("pygeomag")
    right = turned_round()
    scaled = lh.Recording(right.t, right.gyr, right.acc, factor * right.mag)
    place = dict(zip(("lat", "lon", "alt"), MUNICH, strict=True))
    report = lh.inspect(write_csv(tmp_path / "a.csv", scaled, place), units={"mag": "uT"})
    found = [one for one in report.findings if one.name == "mag_strength"]
    assert len(found) == (option is not None)
    for one in found:
        assert one.value == pytest.approx(factor, rel=0.02) and one.interval[0] < factor < one.interval[1]
        assert option in one.cure and "by the World Magnetic Model" in one.evidence


def test_a_ulog_s_receiver():
    from levelhead.sources.formats.ulog import _place

    old = SimpleNamespace(name="vehicle_gps_position", data={
        "lat": np.array([481370000] * 3), "lon": np.array([115750000] * 3), "alt": np.array([520000] * 3),
        "time_utc_usec": np.array([0, 0, int(DAY * 1e6)]),
    })  # fmt: skip
    new = SimpleNamespace(name="sensor_gps", data={
        "latitude_deg": np.array([48.137]), "longitude_deg": np.array([11.575]), "altitude_msl_m": np.array([520.0]),
        "time_utc_usec": np.array([int(DAY * 1e6)]),
    })  # fmt: skip
    for topic in (old, new):
        facts = _place(topic).facts
        assert (facts["latitude"], facts["longitude"], facts["altitude"], facts["unix"]) == (*MUNICH, DAY)
    assert _place(SimpleNamespace(name="x", data={})) is None


def test_a_bag_s_fixes(tmp_path, rec):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        kinds = {"/imu": "sensor_msgs/msg/Imu", "/fix": "sensor_msgs/msg/NavSatFix"}
        to = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        vector, none = types["geometry_msgs/msg/Vector3"], np.zeros(9)
        for i in range(200):
            at = int((DAY + rec.t[i]) * 1e9)
            head = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9), "x")
            q = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            imu = types["sensor_msgs/msg/Imu"](head, q, none, vector(*rec.gyr[i]), none, vector(*rec.acc[i]), none)
            writer.write(to["/imu"], at, store.serialize_cdr(imu, kinds["/imu"]))
            if i % 50 == 0:
                status = types["sensor_msgs/msg/NavSatStatus"](0 if i else -1, 1)
                where = MUNICH if i else (1.0, 2.0, 3.0)  # no fix: not counted
                fix = types["sensor_msgs/msg/NavSatFix"](head, status, *where, none, 0)
                writer.write(to["/fix"], at, store.serialize_cdr(fix, kinds["/fix"]))
    assert place_of(lh.read(tmp_path / "bag")) == (*MUNICH, datetime.date(2026, 6, 1))


FORMATS = {  # number: name, letters, struct's letters, columns, as ArduPilot 4.5 writes them
    128: ("FMT", "BBnNZ", "BB4s16s64s", "Type,Length,Name,Format,Columns"),
    130: ("IMU", "QBffffffIIfBBHH", "QB6fIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"),
    131: ("GPS", "QBBIHBcLLeffffB", "QBBIHBhiiiffffB",
          "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
}  # fmt: skip


def message(number, *values):
    return struct.pack("<3B", 0xA3, 0x95, number) + struct.pack("<" + FORMATS[number][2], *values)


def write_dataflash(path, rec, fixes):
    """An ArduPilot log: IMU messages, and a GPS message for each 50 of them as long as there are fixes."""
    words = [
        message(128, number, 3 + struct.calcsize("<" + layout), name.encode(), letters.encode(), columns.encode())
        for number, (name, letters, layout, columns) in FORMATS.items()
    ]
    for i in range(len(rec)):
        us = round(1e6 * rec.t[i])
        words.append(message(130, us, 0, *rec.gyr[i], *rec.acc[i], 0, 0, 40.0, 1, 1, 1000, 1000))
        if i % 50 == 0 and i // 50 < len(fixes):
            status, ms, week, lat, lng, alt = fixes[i // 50]
            place = round(lat * 1e7), round(lng * 1e7), round(alt * 100)
            words.append(message(131, us, 0, status, ms, week, 9, 90, *place, 0.0, 0.0, 0.0, 0.0, 1))
    path.write_bytes(b"".join(words))
    return path


def test_an_ardupilot_log_s_receiver(tmp_path, rec):
    """2026-06-01 00:00 UTC is 86,418 s into GPS week 2421: GPS time is 18 s ahead. The first message has no fix."""
    mavutil = pytest.importorskip("pymavlink.mavutil")
    fixes = [(1, 0, 0, 0.0, 0.0, 0.0), *[(3, 86_418_000 + 1000 * k, 2421, *MUNICH) for k in range(5)]]
    path = write_dataflash(tmp_path / "flight.bin", rec, fixes)
    theirs = mavutil.mavlink_connection(str(path))
    read = [theirs.recv_match(type="GPS") for _ in fixes][-1]
    assert (read.Lat, read.Lng, read.Alt) == pytest.approx(MUNICH)
    assert place_of(lh.read(path)) == (*MUNICH, datetime.date(2026, 6, 1))
    assert place_of(lh.read(write_dataflash(path, rec, fixes[:1]))) is None


def test_a_folder_of_kitti(tmp_path, rec):
    """30 numbers a sample by dataformat.txt: latitude, longitude and altitude first, 11 to 13 force, 17 to 19 rate."""
    (tmp_path / "oxts" / "data").mkdir(parents=True)
    stamps = []
    for i in range(200):
        row = np.zeros(30)
        row[:3], row[11:14], row[17:20] = MUNICH, rec.acc[i], rec.gyr[i]
        (tmp_path / "oxts" / "data" / f"{i:010d}.txt").write_text(" ".join(f"{x:.9f}" for x in row) + "\n")
        at = datetime.datetime.fromtimestamp(DAY, datetime.UTC) + datetime.timedelta(seconds=float(rec.t[i]))
        stamps.append(f"{at:%Y-%m-%d %H:%M:%S.%f}000\n")
    (tmp_path / "oxts" / "timestamps.txt").write_text("".join(stamps))
    assert place_of(lh.read(tmp_path / "oxts")) == (*MUNICH, datetime.date(2026, 6, 1))


@pytest.mark.parametrize("name, place, day", [
    ("androsensor_semicolon.csv", (35.958, -83.925), "None"),  # its clock counts from the start
    ("sensorlogger_car", (18.45, 73.913), "2025-07-10"),
])  # fmt: skip
def test_real_phones(data_dir, name, place, day):
    found = place_of(lh.read(data_dir / "wild" / name))
    assert found[:2] == pytest.approx(place, abs=0.01) and str(found.date) == day
