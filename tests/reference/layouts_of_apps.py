"""Layouts of apps, browsers and watches, after headers in public code and the apps' exports."""

import json
import zipfile
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, ms, ns, rows, with_words, write
from tests.reference.layouts import layout


def _epoch(m: Motion) -> np.ndarray:
    return ms(m) + EPOCH


@layout("apps")
def device_motion(folder: Path, m: Motion) -> Path:
    """A browser's DeviceMotion: linear acceleration, with gravity, rotation rate in deg/s as alpha, beta, gamma."""
    head = "timestamp,accelerationX,accelerationY,accelerationZ,accelerationIncludingGravityX,"
    head += "accelerationIncludingGravityY,accelerationIncludingGravityZ,"
    head += "rotationRateAlpha,rotationRateBeta,rotationRateGamma,interval\n"
    return write(
        folder / "motion.csv", head, rows(_epoch(m), m.linear, m.acc, m.deg, np.full(len(m.t), 10), form="%.4f")
    )


@layout("apps")
def gyro_alpha_with_sep(folder: Path, m: Motion) -> Path:
    """A web server's file for Excel: sep=; gyro-alpha … accel-z."""
    head = "sep=;\ntimestamp;gyro-alpha;gyro-beta;gyro-gamma;accel-x;accel-y;accel-z\n"
    return write(folder / "phone3.csv", head, rows(_epoch(m), m.deg, m.acc, sep=";", form="%.4f"))


@layout("apps")
def android_trace(folder: Path, m: Motion) -> Path:
    """A gzipped trace of an Android app, linear acceleration and a rotation vector beside."""
    import gzip

    names = [f"{s}{a}" for s in ("accelerometer", "gyroscope", "linearAcceleration") for a in "XYZ"]
    head = ",".join(["timestampNanos", *names, *(f"rotationVector{a}" for a in "WXYZ")]) + "\n"
    text = rows(ns(m) - EPOCH * 10**6 + 10**13, m.acc, m.gyr, m.linear, np.tile([1.0, 0, 0, 0], (len(m.t), 1)))
    path = folder / "trace.csv.gz"
    path.write_bytes(gzip.compress((head + text).encode()))
    return path


@layout("apps")
def wear_os_beside_heart_rate(folder: Path, m: Motion) -> Path:
    """A watch's folder: time,AX,AY,AZ,GX,GY,GZ and a file of heart rates."""
    write(folder / "IMU_1683203415.csv", "time,AX,AY,AZ,GX,GY,GZ\n", rows(_epoch(m), m.acc, m.gyr, form="%.4f"))
    write(folder / "HR_1683203415.csv", "time,HeartRate\n", rows(_epoch(m)[::100], np.full(len(m.t[::100]), 71)))
    return folder


@layout("apps")
def core_motion_short_names(folder: Path, m: Motion) -> Path:
    """A car's phone: rot_rate_x, gravity as g_x, user acceleration as user_a_x, in Core Motion's sign."""
    head = "t,lat,long,alt,course,speed,att_pitch,att_roll,att_yaw,rot_rate_x,rot_rate_y,rot_rate_z,g_x,g_y,g_z,"
    head += "user_a_x,user_a_y,user_a_z,m_x,m_y,m_z\n"
    place = np.tile([37.1, 127.0, 30.0, 90.0, 0.0, 0.1, 0.2, 0.3], (len(m.t), 1))
    text = rows(m.t + EPOCH / 1e3, place, m.gyr, -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665, m.mag)
    return write(folder / "trip.csv", head, text)


@layout("apps")
def watch_with_zulu(folder: Path, m: Motion) -> Path:
    """ISO stamps in UTC, camel case, a label."""
    stamps = [one + "Z" for one in dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)]
    text = with_words(stamps, rows(m.acc, m.gyr, form="%.5f")).replace("\n", ",walking\n")
    return write(folder / "watch.csv", "timestamp,accX,accY,accZ,gyrX,gyrY,gyrZ,label\n", text.strip())


@layout("apps")
def physics_toolbox_folder(folder: Path, m: Motion) -> Path:
    """Physics Toolbox, one sensor each: gFx with TgF, wx."""
    total = np.sqrt((m.g**2).sum(axis=1))
    write(folder / "2023-05-0412.30.15 gforce.csv", "time,gFx,gFy,gFz,TgF\n", rows(m.t, m.g, total, form="%.4f"))
    write(folder / "2023-05-0412.30.15 gyro.csv", "time,wx,wy,wz\n", rows(m.t + 0.001, m.gyr, form="%.4f"))
    return folder


@layout("apps")
def sensor_kinetics(folder: Path, m: Motion) -> Path:
    """Sensor Kinetics: a title, TIME X Y Z by commas and blanks."""
    for name, values in (("Accelerometer", m.acc), ("Gyroscope", m.gyr)):
        head = f"Sensor Kinetics Pro {name}\nINNOVENTIONS, Inc.\n\n\tTIME, \tX_value, \tY_value, \tZ_value\n"
        write(folder / f"{name.lower()}_1.csv", head, rows(m.t, values, sep=", \t", form="%.5f"))
    return folder


@layout("apps")
def writetimetable(folder: Path, m: Motion) -> Path:
    """MATLAB Mobile by writetimetable: Acceleration.csv and AngularVelocity.csv with Timestamp,X,Y,Z."""
    stamps = dates(m, "%d-%b-%Y %H:%M:%S.%f", 3)
    for name, values in (("Acceleration", m.acc), ("AngularVelocity", m.gyr)):
        write(folder / f"{name}.csv", "Timestamp,X,Y,Z\n", with_words(stamps, rows(values, form="%.6f")))
    return folder


@layout("apps")
def movesense_showcase(folder: Path, m: Motion) -> Path:
    """Movesense Showcase: a file a sensor, the unit in the file's name."""
    for name, values in (("LinearAcceleration", m.acc), ("AngularVelocity", m.deg), ("MagneticField", m.mag)):
        write(
            folder / f"20230504T123015Z_174630000123_{name}.csv", "timestamp,x,y,z\n", rows(ms(m), values, form="%.4f")
        )
    return folder


@layout("apps")
def embrace_plus(folder: Path, m: Motion) -> Path:
    """EmbracePlus' raw CSV: µs of Unix; g and deg/s."""
    micro = ns(m) // 1000
    for name, values in (("accelerometer", m.g), ("gyroscope", m.deg)):
        write(folder / f"1-1-001_{name}.csv", "unix_timestamp,x,y,z\n", rows(micro, values, form="%.6f"))
    return folder


@layout("apps")
def fitbit_json(folder: Path, m: Motion) -> Path:
    """[{"t":…,"acc":{"x":…},"gyro":{…}}, …]"""
    made = [{"t": int(t), "acc": dict(zip("xyz", a, strict=True)), "gyro": dict(zip("xyz", g, strict=True)), "hr": 70}
            for t, a, g in zip(_epoch(m), m.acc.round(4).tolist(), m.gyr.round(4).tolist(), strict=True)]  # fmt: skip
    return write(folder / "fitbit.json", json.dumps(made))


@layout("apps")
def sensorlog_json(folder: Path, m: Motion) -> Path:
    """SensorLog's JSON: strings, Core Motion's names and sign."""
    made = [{"loggingTime": one, "accelerometerAccelerationX": f"{-a[0]:.6f}",
             "accelerometerAccelerationY": f"{-a[1]:.6f}", "accelerometerAccelerationZ": f"{-a[2]:.6f}",
             "motionRotationRateX": f"{g[0]:.6f}",
             "motionRotationRateY": f"{g[1]:.6f}", "motionRotationRateZ": f"{g[2]:.6f}", "batteryLevel": "0.8"}
            for one, a, g in zip(dates(m, "%Y-%m-%dT%H:%M:%S.%f+02:00"), m.g, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "sensorlog.json", json.dumps(made))


@layout("apps")
def sensor_streamer(folder: Path, m: Motion) -> Path:
    """SensorStreamer's packets: {"accelerometer":{"timestamp":…,"value":[…]},"gyroscope":{…}} a line."""
    made = [json.dumps({"accelerometer": {"timestamp": int(t), "value": a},
                        "gyroscope": {"timestamp": int(t), "value": g}})
            for t, a, g in zip(ns(m), m.acc.round(5).tolist(), m.gyr.round(5).tolist(), strict=True)]  # fmt: skip
    return write(folder / "stream.json", "\n".join(made))


@layout("apps")
def sensor_record(folder: Path, m: Motion) -> Path:
    """Sensor Record: Milliseconds,X,Y,Z below two lines about the sensor, one file each."""
    for name, values in (("Accelerometer", m.acc), ("Gyroscope", m.gyr)):
        head = f"Sensor: BMI160 {name}\nVendor: BOSCH\n\nMilliseconds,X,Y,Z\n"
        write(folder / f"{name}.csv", head, rows(ms(m), values, form="%.5f"))
    return folder


@layout("apps")
def unity_vectors(folder: Path, m: Motion) -> Path:
    """Unity's Vector3 in cells: Time;Accel;Gyro and (0.10, 0.20, 9.80)."""
    made = ["Time;Accel;Gyro"]
    made += [f"{t:.3f};({a[0]:.2f}, {a[1]:.2f}, {a[2]:.2f});({g[0]:.2f}, {g[1]:.2f}, {g[2]:.2f})"
             for t, a, g in zip(m.t, m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "unity.csv", "\n".join(made))


@layout("apps")
def flutter_sensors(folder: Path, m: Motion) -> Path:
    """sensors_plus: local ISO stamps in µs, acc, userAcc and gyro."""
    head = "timestamp,acc_x,acc_y,acc_z,userAcc_x,userAcc_y,userAcc_z,gyro_x,gyro_y,gyro_z,latitude,longitude\n"
    text = rows(m.acc, m.linear, m.gyr, np.tile([48.1, 11.5], (len(m.t), 1)), form="%.6f")
    return write(folder / "flutter.csv", head, with_words(dates(m, "%Y-%m-%dT%H:%M:%S.%f"), text))


@layout("apps")
def react_native(folder: Path, m: Motion) -> Path:
    """expo-sensors: {"data":[{"accelerometer":{x,y,z in g},"gyroscope":{…},"timestamp":…}]}"""
    made = [{"accelerometer": dict(zip("xyz", a, strict=True)), "gyroscope": dict(zip("xyz", g, strict=True)),
             "timestamp": int(t)}
            for t, a, g in zip(_epoch(m), m.g.round(5).tolist(), m.gyr.round(5).tolist(), strict=True)]  # fmt: skip
    return write(folder / "expo.json", json.dumps({"device": "iPhone", "data": made}))


@layout("apps")
def connect_iq_seconds(folder: Path, m: Motion) -> Path:
    """A Garmin watch app: an object a second with lists of 25 mg and 25 deg/s, here at 100."""
    made = []
    for k in range(0, len(m.t) - 99, 100):
        a, g = np.rint(1e3 * m.g[k : k + 100]).astype(int), m.deg[k : k + 100].round(2)
        made.append({"timestamp": int(_epoch(m)[k]), "accelX": a[:, 0].tolist(), "accelY": a[:, 1].tolist(),
                     "accelZ": a[:, 2].tolist(), "gyroX": g[:, 0].tolist(), "gyroY": g[:, 1].tolist(),
                     "gyroZ": g[:, 2].tolist()})  # fmt: skip
    return write(folder / "garmin.json", "\n".join(map(json.dumps, made)))


@layout("apps", fusable=False)
def heart_rate_only(folder: Path, m: Motion) -> Path:
    """A watch's steps and heart rates."""
    text = rows(_epoch(m)[::50], np.full(len(m.t[::50]), 71), np.arange(len(m.t[::50])))
    return write(folder / "health.csv", "timestamp,heart_rate,steps\n", text)


@layout("apps")
def phone_zip_of_json(folder: Path, m: Motion) -> Path:
    """A zip with accelerometer.json and gyroscope.json: [{"x":…,"y":…,"z":…,"ts":…}]"""
    path = folder / "phone.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in (("accelerometer", m.acc), ("gyroscope", m.gyr)):
            made = [{"x": a, "y": b, "z": c, "ts": int(t)}
                    for t, (a, b, c) in zip(_epoch(m), values.round(5).tolist(), strict=True)]  # fmt: skip
            archive.writestr(f"{name}.json", json.dumps(made))
    return path


@layout("apps")
def g_force_recorder(folder: Path, m: Motion) -> Path:
    """A drive recorder: g_force_x, rot_rate_x in deg/s, speed; whole ms."""
    head = (
        "timestamp_ms,lat,lon,speed_kmh,heading,pdop,g_force_x,g_force_y,g_force_z,rot_rate_x,rot_rate_y,rot_rate_z\n"
    )
    place = np.tile([48.1, 11.5, 80.0, 12.0, 1.2], (len(m.t), 1))
    return write(folder / "drive.csv", head, rows(_epoch(m), place, m.g, m.deg, form="%.3f"))
