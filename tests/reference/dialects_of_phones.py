"""Logs as apps on phones, watches and cameras write them, in more layouts; see dialects.py."""

import json
import zipfile
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, ns, rows, with_words, write


@dialect
def sensor_logger_zip_ios(folder: Path, m: Motion) -> Path:
    """Sensor Logger's zip from an iPhone: user acceleration and gravity apart, in m/s², beside attitude."""
    head = "time,seconds_elapsed,z,y,x\n"
    parts = {"Gyroscope": m.gyr, "Accelerometer": m.linear, "Gravity": m.acc - m.linear, "Magnetometer": m.mag}
    path = folder / "2023-05-04_12-30-15.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in parts.items():
            archive.writestr(f"{name}.csv", head + rows(ns(m), m.t, values[:, ::-1]))
        orient = "time,seconds_elapsed,yaw,qx,qz,roll,qw,qy,pitch\n"
        archive.writestr("Orientation.csv", orient + rows(ns(m), m.t, np.zeros((len(m.t), 7)) + 0.1))
        archive.writestr("Annotation.csv", "time,seconds_elapsed,text,millisecond_press_duration\n")
        archive.writestr("Metadata.csv", "version,device name,platform\n3,iPhone 13,ios\n")
    return path


@dialect
def phyphox_zip(folder: Path, m: Motion) -> Path:
    """phyphox's zip of tabs, with the sensor's rates a little apart."""
    path = folder / "Acceleration and rotation 2023-05-04 12-30-15.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, unit, values, late in (("Gyroscope", "rad/s", m.gyr, 0.0), ("Accelerometer", "m/s^2", m.acc, 0.0007)):
            head = "\t".join(f'"{word}"' for word in ("Time (s)", *(f"{axis} ({unit})" for axis in "xyz"))) + "\n"
            archive.writestr(f"{name}.csv", head + rows(m.t + late, values, sep="\t", form="%.9E"))
        archive.writestr("meta/device.csv", '"property"\t"value"\n"version"\t"1.1.14"\n')
        archive.writestr("meta/time.csv", '"event"\t"experiment time"\t"system time"\n"START"\t0.0\t1683203415.25\n')
    return path


@dialect
def phyphox_rotation_rate(folder: Path, m: Motion) -> Path:
    """phyphox's single experiments in a folder: "Acceleration x (m/s^2)", "Gyroscope x (rad/s)", Absolute …"""
    for name, word, unit, values in (("Gyroscope", "Gyroscope", "rad/s", m.gyr),
                                     ("Raw Data", "Acceleration", "m/s^2", m.acc)):  # fmt: skip
        size = "Absolute" if word == "Gyroscope" else "Absolute acceleration"
        head = ",".join(f'"{w}"' for w in ("Time (s)", *(f"{word} {a} ({unit})" for a in "xyz"), f"{size} ({unit})"))
        write(folder / f"{name}.csv", head, "\n", rows(m.t, values, np.linalg.norm(values, axis=1), form="%.9E"))
    return folder


@dialect
def physics_toolbox_clock(folder: Path, m: Motion) -> Path:
    """Physics Toolbox with clock times whose milliseconds follow a colon, and semicolons."""
    head = "time;gFx;gFy;gFz;wx;wy;wz;\n"
    clock = [word.replace(".", ":") for word in dates(m, "%H:%M:%S.%f", 3)]
    text = rows(m.g, m.gyr, sep=";", form="%.4f").replace(".", ",").replace("\n", ";\n")
    return write(folder / "toolbox.csv", head, with_words(clock, text, ";"))


@dialect
def androsensor_date_last(folder: Path, m: Motion) -> Path:
    """AndroSensor with commas: stamps in the last two columns, ms since the start and a date with colons."""
    sensors = [("ACCELEROMETER", "m/s²"), ("GRAVITY", "m/s²"), ("LINEAR ACCELERATION", "m/s²"), ("GYROSCOPE", "rad/s")]
    head = ",".join(f"{w} {a} ({u})" for w, u in [*sensors, ("MAGNETIC FIELD", "μT")] for a in "XYZ")
    head += ",Time since start in ms ,YYYY-MO-DD HH-MI-SS_SSS\n"
    stamps = [word.replace(".", ":") for word in dates(m, "%Y-%m-%d %H:%M:%S.%f", 3)]
    text = rows(m.acc, m.acc - m.linear, m.linear, m.gyr, m.mag, ms(m) + 12, form="%.4f").strip().split("\n")
    return write(folder / "Sensor_record.csv", head, "\n".join(f"{a},{b}" for a, b in zip(text, stamps, strict=True)))


@dialect
def matlab_mobile_csv(folder: Path, m: Motion) -> Path:
    """MATLAB Mobile's timetables by writetimetable: month names, a file per sensor."""
    stamps = dates(m, "%d-%b-%Y %H:%M:%S.%f", 3)
    for name, values in (("Acceleration", m.acc), ("AngularVelocity", m.gyr), ("MagneticField", m.mag)):
        write(folder / f"{name}.csv", "Timestamp,X,Y,Z\n", with_words(stamps, rows(values)))
    return folder


@dialect
def hyper_imu(folder: Path, m: Motion) -> Path:
    """HyperIMU's file: chips' names, no units, a header after a preamble."""
    head = "HyperIMU v3.1 - File Stream\nSampling Rate: 10 ms\n\nTimestamp,"
    head += ",".join(f"LSM6DSM Acceleration Sensor.{a}" for a in "xyz") + ","
    head += ",".join(f"LSM6DSM Gyroscope Sensor.{a}" for a in "xyz") + ","
    head += ",".join(f"AK09918 Magnetic field Sensor.{a}" for a in "xyz") + "\n"
    return write(folder / "HIMU-2023-05-04.csv", head, rows(ns(m) // 1_000_000, m.acc, m.gyr, m.mag))


@dialect
def android_type_names(folder: Path, m: Motion) -> Path:
    """An Android logger that writes the type as android.sensor.…, with accuracy at the end."""
    made = ["timestamp,sensor_type,value_0,value_1,value_2,accuracy\n"]
    for k, stamp in enumerate(ns(m) - EPOCH * 1_000_000 + 10**14):
        for kind, values in (("accelerometer", m.acc), ("gyroscope", m.gyr), ("magnetic_field", m.mag)):
            made.append(f"{stamp},android.sensor.{kind},{','.join(f'{v:.6f}' for v in values[k])},3\n")
    return write(folder / "sensors.csv", *made)


@dialect
def gsdc_device_imu(folder: Path, m: Motion) -> Path:
    """Google's Smartphone Decimeter Challenge: device_imu.csv with biases in columns of their own."""
    made = ["MessageType,utcTimeMillis,elapsedRealtimeNanos,MeasurementX,MeasurementY,MeasurementZ,BiasX,BiasY,BiasZ\n"]
    for k, stamp in enumerate(ns(m)):
        for kind, values in (("UncalAccel", m.acc), ("UncalGyro", m.gyr), ("UncalMag", m.mag)):
            line = ",".join(f"{v:.7f}" for v in values[k])
            made.append(f"{kind},{stamp // 10**6},{stamp - EPOCH * 10**6 + 10**13},{line},0.0,0.0,0.0\n")
    return write(folder / "device_imu.csv", *made)


@dialect
def motion_sense(folder: Path, m: Motion) -> Path:
    """MotionSense: Core Motion without stamps, gravity and user acceleration apart, a number before each row."""
    head = (
        ",attitude.roll,attitude.pitch,attitude.yaw," + names("gravity.", "xyz") + "," + names("rotationRate.", "xyz")
    )
    head += "," + names("userAcceleration.", "xyz") + "\n"
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    text = rows(np.arange(len(m.t)), 0.1 * m.gyr, gravity, m.gyr, user)
    return write(folder / "sub_1.csv", head, text)


@dialect
def core_motion_json(folder: Path, m: Motion) -> Path:
    """A watch app's JSON: lists of samples whose vectors are objects, Core Motion's words."""
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    made = [{"timestamp": float(s) + 700.5, "rotationRate": dict(zip("xyz", g, strict=True)),
             "userAcceleration": dict(zip("xyz", u, strict=True)), "gravity": dict(zip("xyz", d, strict=True))}
            for s, g, u, d in zip(m.t, m.gyr.tolist(), user.tolist(), gravity.tolist(), strict=True)]  # fmt: skip
    return write(folder / "watch.json", json.dumps({"deviceModel": "Watch6,7", "samples": made}))


@dialect
def gopro_telemetry_json(folder: Path, m: Motion) -> Path:
    """gopro-telemetry's JSON: streams with names and units, a list in each sample, cts in ms."""

    def stream(name: str, unit: str, values: np.ndarray) -> dict:
        return {"name": name, "units": unit, "samples": [
            {"value": [round(float(v), 6) for v in line], "cts": 1e3 * float(s), "date": "2023-05-04T12:30:15.250Z"}
            for s, line in zip(m.t, values, strict=True)]}  # fmt: skip

    streams = {"ACCL": stream("Accelerometer", "m/s2", m.acc), "GYRO": stream("Gyroscope", "rad/s", m.gyr)}
    return write(folder / "GX010001.json", json.dumps({"1": {"streams": streams, "device name": "Hero8 Black"},
                                                       "frames/second": 29.97}))  # fmt: skip


@dialect
def gopro_telemetry_csv(folder: Path, m: Motion) -> Path:
    """gopro-telemetry's CSV: the axes stand in brackets, in the camera's order z, x, y, before the unit."""
    stamps = dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)
    for name, word, unit, values in (("ACCL", "Accelerometer", "m/s²", m.acc), ("GYRO", "Gyroscope", "rad/s", m.gyr)):
        head = f'"cts","date","{word} (z) [{unit}]","{word} (x) [{unit}]","{word} (y) [{unit}]","temperature [°C]"\n'
        lines = [f"{1e3 * s:.3f},{d}Z,{z:.6f},{x:.6f},{y:.6f},41.2\n" for s, d, (x, y, z) in
                 zip(m.t, stamps, values, strict=True)]  # fmt: skip
        write(folder / f"GX010001_Hero8 Black-{name}.csv", head, *lines)
    return folder


@dialect
def hololens(folder: Path, m: Motion) -> Path:
    """HoloLens 2's recorder: a file per sensor, ticks of 100 ns, several stamps."""
    for name, word, values in (("imu_gyro", "Gyro", m.gyr), ("imu_accel", "Accel", m.acc)):
        head = f"SensorTicks,VinylHupTicks,SocTicks,{names(word)}\n"
        ticks = np.rint(m.t * 1e7).astype(np.int64) + 10_583_920_000
        write(folder / f"{name}.csv", head, rows(ticks, ticks * 100 + 7, ticks + 132_000_000_000_000_000, values))
    return folder


@dialect
def sensorstream_labels(folder: Path, m: Motion) -> Path:
    """Matlab-like vectors in quoted cells: one column per sensor, [x, y, z] in it."""
    made = ["timestamp,acceleration,rotation_rate,magnetic_field\n"]
    for s, a, g, b in zip(ns(m) // 10**6, m.acc, m.gyr, m.mag, strict=True):
        cells = ",".join(f'"[{v[0]:.5f}, {v[1]:.5f}, {v[2]:.5f}]"' for v in (a, g, b))
        made.append(f"{s},{cells}\n")
    return write(folder / "stream.csv", *made)


@dialect
def unity_vectors(folder: Path, m: Motion) -> Path:
    """Unity's Vector3.ToString in columns set apart by semicolons."""
    made = ["time;gyro;acceleration\n"]
    for s, g, a in zip(m.t, m.gyr, m.acc, strict=True):
        made.append(";".join([f"{s:.4f}", *("(" + ", ".join(f"{v:.5f}" for v in one) + ")" for one in (g, a))]) + "\n")
    return write(folder / "unity.csv", *made)


@dialect
def chinese_phone(folder: Path, m: Motion) -> Path:
    """A Chinese app: 陀螺仪 and 加速度, units in Chinese brackets."""
    head = (
        "时间（s）,"
        + ",".join(f"加速度{a}（m/s²）" for a in "XYZ")
        + ","
        + ",".join(f"陀螺仪{a}（rad/s）" for a in "XYZ")
    )
    return write(folder / "记录.csv", head, "\n", rows(m.t, m.acc, m.gyr))


@dialect
def russian_table(folder: Path, m: Motion) -> Path:
    """A Russian table: Время, Ускорение, Угловая скорость, decimal commas."""
    head = "Время, с;" + ";".join(f"Ускорение {a}, м/с^2" for a in "XYZ") + ";"
    head += ";".join(f"Угловая скорость {a}, град/с" for a in "XYZ") + "\n"
    return write(folder / "запись.csv", head, rows(m.t, m.acc, m.deg, sep=";").replace(".", ","), encoding="cp1251")
