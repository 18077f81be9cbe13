"""Logs of protocols and messages: several samples in one message, comments that are data, braces; see dialects.py."""

import json
from datetime import timedelta
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, START, Motion, dates, dialect, ms, ns, rows, with_words, write


def vector(values: np.ndarray) -> dict[str, float]:
    """Three numbers by their axes."""
    return {axis: round(float(v), 5) for axis, v in zip("xyz", values, strict=True)}


@dialect
def movesense_messages(folder: Path, m: Motion) -> Path:
    """Movesense's JSON: two samples in each message, lists of objects, one stamp."""
    made = []
    for k in range(0, len(m.t), 2):
        lists = {
            f"Array{word}": [vector(values[k + j]) for j in (0, 1)]
            for word, values in (("Acc", m.acc), ("Gyro", m.deg), ("Magn", m.mag))
        }
        made.append({"imu9": {"Timestamp": round(m.t[k] * 1000) + 81234, **lists}})
    return write(folder / "imu9.json", json.dumps({"data": made}))


@dialect
def batches_over_bluetooth(folder: Path, m: Motion) -> Path:
    """A line of JSON for ten samples: a list for each axis, one stamp."""
    made = []
    for k in range(0, len(m.t), 10):
        part = slice(k, k + 10)
        line = {"ts": round(EPOCH + m.t[k] * 1000)}
        for i, axis in enumerate("xyz"):
            line |= {f"a{axis}": m.g[part, i].round(4).tolist(), f"g{axis}": m.deg[part, i].round(3).tolist()}
        made.append(json.dumps(line))
    return write(folder / "ble.jsonl", "\n".join(made))


@dialect
def glasses(folder: Path, m: Motion) -> Path:
    """A line of JSON for each sample of gyroscope and accelerometer, one for each of the magnetometer."""
    made = []
    for k, t in enumerate(m.t + 0.0046):
        data = {"accelerometer": m.acc[k].round(4).tolist(), "gyroscope": m.deg[k].round(4).tolist()}
        made.append(json.dumps({"type": "imu", "timestamp": round(float(t), 6), "data": data}))
        if k % 10 == 3:
            field = {"magnetometer": m.mag[k].round(3).tolist()}
            made.append(json.dumps({"type": "imu", "timestamp": round(float(t) + 5e-4, 6), "data": field}))
    return write(folder / "imudata.jsonl", "\n".join(made))


@dialect
def pymavlink_messages(folder: Path, m: Motion) -> Path:
    """mavlogdump without options: a date, the message's name, "{name : value, …}"; other messages between."""
    made = []
    for k, t in enumerate(m.t):
        date = (START + timedelta(seconds=float(t))).strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
        us = round(t * 1e6) + 10**7
        numbers = [f"{n}{a} : {v:.6f}" for n, x in (("Gyr", m.gyr), ("Acc", m.acc)) for a, v in zip("XYZ", x[k])]  # noqa: B905
        made.append(f"{date}: IMU {{TimeUS : {us}, I : 0, {', '.join(numbers)}, T : 45.1}}\n")
        if k % 20 == 0:
            made.append(f"{date}: MODE {{TimeUS : {us}, Mode : 5, ModeNum : 5, Rsn : 1}}\n")
    return write(folder / "dump.txt", *made)


@dialect
def razor_with_angles(folder: Path, m: Motion) -> Path:
    """Razor AHRS for ROS: "#YPRAMG=", then angles, accelerometer in counts, magnetometer, rates; no time."""
    made = [
        "#YPRAMG=" + ",".join(f"{v:.2f}" for v in (3 * t % 90, 1.2, 3.3, *(256 * a), *b, *g)) + "\n"
        for t, a, b, g in zip(m.t, m.g, m.mag, m.gyr, strict=True)
    ]
    return write(folder / "razor.txt", *made)


@dialect
def numbered_kinds(folder: Path, m: Motion) -> Path:
    """An Android logger: Android's numbers of sensors first, two stamps, x, y, z, length; headers above."""
    made = [
        "info;time;excel time;info text;\n", "1-13 (sensors);time;excel time;x;y;z;abs value;RoT/steps\n",
        "geo;time;excel time;lon;lat;alt\n", "- 01 accelerometer\n", "- 04 gyroscope\n",
    ]  # fmt: skip
    for k, t in enumerate(m.t):
        stamp = (START + timedelta(seconds=float(t))).strftime("%H:%M:%S.%f")[:-3] + f";{45050.52 + t / 86400:.14f}"
        for kind, values, more in ((4, m.gyr, ""), (1, m.acc, ";12.0"), (10, m.linear, "")):
            three = values[k]
            made.append(f"{kind};{stamp};{';'.join(f'{v:.4f}' for v in (*three, np.linalg.norm(three)))}{more}\n")
        if k % 100 == 0:
            made.append(f"geo;{stamp};30.34;60.07;36.0\n")
    return write(folder / "trip.csv", *made)


@dialect
def events_with_numbered_values(folder: Path, m: Motion) -> Path:
    """A row for each event: the sensor's name in column "event", its axes in v0, v1, v2."""
    made = ["time,event,v0,v1,v2\n"]
    for t, a, g in zip(m.t, m.acc, m.gyr, strict=True):
        for name, values, late in (("Accelerometer", a, 0), ("Gyroscope", g, 300_000)):
            made.append(f"{round(t * 1e9) + 10**12 + late},{name},{','.join(f'{v:.5f}' for v in values)}\n")
    return write(folder / "events.csv", *made)


@dialect
def thousandths(folder: Path, m: Motion) -> Path:
    """A gesture recorder without floats: m/s² and rad/s times 1000 as whole numbers, a label; no time."""
    head = "accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,label\n"
    text = rows(np.rint(m.acc * 1000).astype(int), np.rint(m.gyr * 1000).astype(int))
    return write(folder / "gesture.csv", head, text.replace("\n", ",swipe\n"))


@dialect
def seconds_in_brackets(folder: Path, m: Motion) -> Path:
    """A robot's console: "[12.345] accel: (x, y, z) gyro: (x, y, z)"."""
    made = [
        f"[{t + 100:.3f}] accel: ({', '.join(f'{v:.3f}' for v in a)}) gyro: ({', '.join(f'{v:.3f}' for v in g)})\n"
        for t, a, g in zip(m.t, m.acc, m.gyr, strict=True)
    ]
    return write(folder / "robot.log", *made)


@dialect
def um7_sentences(folder: Path, m: Motion) -> Path:
    """CH Robotics' UM7: $PCHRS,0 has rates, $PCHRS,1 forces, a sentence of angles between, checksums."""
    made = []
    for t, a, g in zip(m.t + 50, m.g, m.deg, strict=True):
        for kind, values in enumerate((g, a)):
            made.append(f"$PCHRS,{kind},{t:.3f},{','.join(f'{v:.4f}' for v in values)},*5{kind}\n")
        made.append(f"$PCHRA,{t:.3f},1.2,0.3,33.1,*61\n")
    return write(folder / "um7.txt", *made)


@dialect
def units_in_brackets_before_axes(folder: Path, m: Motion) -> Path:
    """A camera's example: a clock for each sensor, "Accelerometer [m/s^2]: x: … y: … z: …" on one line."""
    made = []
    for t, a, g in zip(m.t, m.acc, m.gyr, strict=True):
        for name, unit, values in (("Accelerometer", "m/s^2", a), ("Gyroscope", "rad/s", g)):
            axes = " ".join(f"{axis}: {v:.6f}" for axis, v in zip("xyz", values, strict=True))
            made.append(f"{name} timestamp: {1000 * t:.3f} ms {name} [{unit}]: {axes} ")
        made.append("\n")
    return write(folder / "camera.txt", *made)


@dialect
def angular_velocity_by_angles(folder: Path, m: Motion) -> Path:
    """A falls data set: the limb and the sensor in one line, x-axis (g) and roll (deg/s) below; two limbs."""
    groups = [
        f"{limb}{sensor}"
        for limb in ("Ankle", "Belt")
        for sensor in ("Accelerometer,,", "AngularVelocity,,", "Luminosity")
    ]
    below = "x-axis (g),y-axis (g),z-axis (g),roll (deg/s),pitch (deg/s),yaw (deg/s),illuminance (lux)"
    head = f"TimeStamps,{','.join(groups)},Subject\nTime,{below},{below},\n"
    n = len(m.t)
    text = rows(m.g, m.deg, np.full(n, 25.0), m.g[:, [1, 0, 2]], m.deg[:, [1, 0, 2]], np.full(n, 33.0), np.ones(n, int))
    return write(folder / "fall.csv", head, with_words(dates(m, "%Y-%m-%dT%H:%M:%S.%f"), text))


@dialect
def whole_mg_and_mrad(folder: Path, m: Motion) -> Path:
    """A data set of daily life: blanks, no header; ms, whole mg, rates in thousandths of rad/s, the field."""
    whole = [np.rint(values * scale).astype(int) for values, scale in ((m.g, 1000), (m.gyr, 1000), (m.mag, 10))]
    return write(folder / "S1.dat", rows(ms(m), *whole, sep=" "))


@dialect
def sentences_with_checksums(folder: Path, m: Motion) -> Path:
    """A boat's bus: $IMU with ms, forces and rates, GPS sentences between, all with checksums."""
    made = []
    for k, (t, a, g) in enumerate(zip(m.t, m.acc, m.gyr, strict=True)):
        made.append(f"$IMU,{round(1000 * t)},{','.join(f'{v:.4f}' for v in (*a, *g))}*3F\n")
        if k % 100 == 0:
            made.append("$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\n")
    return write(folder / "bus.txt", *made)


@dialect
def tuples_in_tuples(folder: Path, m: Motion) -> Path:
    """Python's print of (t, acc, gyr)."""
    made = []
    for t, a, g in zip(m.t, m.acc, m.gyr, strict=True):
        inner = ", ".join(f"({', '.join(f'{v:.4f}' for v in values)})" for values in (a, g))
        made.append(f"({t:.4f}, {inner})\n")
    return write(folder / "print.txt", *made)


@dialect
def influx_lines(folder: Path, m: Motion) -> Path:
    """InfluxDB's line protocol: measurement and tags, fields, ns since 1970."""
    made = []
    for stamp, a, g in zip(ns(m), m.acc, m.gyr, strict=True):
        fields = ",".join(
            f"{s}{x}={v:.4f}" for s, three in (("a", a), ("g", g)) for x, v in zip("xyz", three, strict=True)
        )
        made.append(f"imu,device=esp32 {fields} {stamp}\n")
    return write(folder / "influx.txt", *made)


@dialect
def influx_long_table(folder: Path, m: Motion) -> Path:
    """InfluxDB's export: a row for each number, its name in column "field", one field below the other."""
    made = ["name,tags,time,field,value\n"]
    for stem, values in (("a", m.acc), ("g", m.gyr)):
        for i, axis in enumerate("xyz"):
            made += [f"imu,,{stamp},{stem}{axis},{v:.4f}\n" for stamp, v in zip(ns(m), values[:, i], strict=True)]
    return write(folder / "long.csv", *made)


@dialect
def days_of_a_spreadsheet(folder: Path, m: Motion) -> Path:
    """Excel's own number for a date with a time: days since 1900."""
    made = [f"{45050.520833333 + t / 86400:.9f},{','.join(f'{v:.4f}' for v in (*a, *g))}\n"
            for t, a, g in zip(m.t, m.acc, m.deg, strict=True)]  # fmt: skip
    return write(folder / "days.csv", "Time,AccX,AccY,AccZ,GyrX,GyrY,GyrZ\n", *made)


@dialect
def spanish_table(folder: Path, m: Motion) -> Path:
    """Tiempo, Aceleración, Velocidad angular, without units."""
    head = ",".join(["Tiempo", *(f"{word} {a}" for word in ("Aceleración", "Velocidad angular") for a in "XYZ")])
    return write(folder / "tabla.csv", head, "\n", rows(m.t, m.acc, m.gyr))


@dialect
def portuguese_table(folder: Path, m: Motion) -> Path:
    """tempo_ms, aceleracao, giroscopio, semicolons."""
    head = ";".join(["tempo_ms", *(f"{word}_{a}" for word in ("aceleracao", "giroscopio") for a in "xyz")])
    return write(folder / "tabela.csv", head, "\n", rows(ms(m), m.g, m.deg, sep=";"))


@dialect
def labview_measurement(folder: Path, m: Motion) -> Path:
    """LabVIEW's text: two headers of words and numbers, each with a line that ends it; X_Value."""
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tOne\n***End_of_Header***\t\n\t\n"
    for word, value in (("Samples", "2000"), ("Date", "2023/05/04"), ("X_Dimension", "Time"), ("Delta_X", "0.01")):
        head += f"{word}\t" + f"{value}\t" * 6 + "\n"
    head += "***End_of_Header***" + "\t" * 7 + "\nX_Value\tAccX\tAccY\tAccZ\tGyroX\tGyroY\tGyroZ\tComment\n"
    return write(folder / "measurement.txt", head, rows(m.t, m.acc, m.deg, sep="\t"))


@dialect
def thousandths_in_the_names(folder: Path, m: Motion) -> Path:
    """acc_x_mm_s2 and gyr_x_mrad_s."""
    names = [f"{s}_{a}_{u}" for s, u in (("acc", "mm_s2"), ("gyr", "mrad_s")) for a in "xyz"]
    return write(
        folder / "mm.csv", ",".join(["time_s", *names]), "\n", rows(m.t, m.acc * 1e3, m.gyr * 1e3, form="%.1f")
    )
