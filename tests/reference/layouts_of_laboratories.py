"""Layouts of laboratories, wearables and data sets, after their documentation and public code that reads them."""

import zipfile
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, ms, ns, rows, with_words, write
from tests.reference.layouts import layout


def _const(m: Motion, *values: float) -> np.ndarray:
    return np.tile(values, (len(m.t), 1))


@layout("laboratories")
def noraxon(folder: Path, m: Motion) -> Path:
    """Noraxon MR3: a preamble, quoted names with the segment, mG and deg/s."""
    head = '"Name","Trial 1"\n"Date","5/4/2023"\n"Frequency","100"\n\n'
    names = [f'"LT Shank Accel Sensor {a} (mG)"' for a in "XYZ"] + [f'"LT Shank Gyroscope-{a} (deg/s)"' for a in "xyz"]
    head += ",".join(['"time"', '"Activity"', '"Marker"', *names]) + "\n"
    text = with_words(["Activity 1,"] * len(m.t), rows(1e3 * m.g, m.deg, form="%.2f"))
    return write(folder / "MR3.csv", head, with_words([f"{t:.4f}" for t in m.t], text))


@layout("laboratories")
def two_segments_of_noraxon(folder: Path, m: Motion) -> Path:
    """The same with a second segment that moves otherwise; the first is taken."""
    names = [f"{s} {q}" for s in ("LT Shank", "RT Shank") for q in
             (*(f"Accel Sensor {a} (mG)" for a in "XYZ"), *(f"Gyroscope-{a} (deg/s)" for a in "xyz"))]  # fmt: skip
    text = rows(m.t, 1e3 * m.g, m.deg, 1e3 * m.g[::-1], -m.deg[::-1], form="%.3f")
    return write(folder / "gait.csv", ",".join(["time", *names]) + "\n", text)


@layout("laboratories")
def apdm_csv(folder: Path, m: Motion) -> Path:
    """Opal by its CSV export: Time as µs since 1970, a slash in the names."""
    head = "Time,Accelerometer/X,Accelerometer/Y,Accelerometer/Z,Gyroscope/X,Gyroscope/Y,Gyroscope/Z,"
    head += "Magnetometer/X,Magnetometer/Y,Magnetometer/Z,Temperature\n"
    return write(folder / "Lumbar.csv", head, rows(ns(m) // 1000, m.acc, m.gyr, m.mag, _const(m, 31.0)))


@layout("laboratories", fusable=False)
def mvn_segments(folder: Path, m: Motion) -> Path:
    """MVN's Excel as CSV: accelerations and rates of segments in the room, without gravity."""
    head = "Frame,Pelvis acceleration x,Pelvis acceleration y,Pelvis acceleration z,"
    head += "Pelvis angular velocity x,Pelvis angular velocity y,Pelvis angular velocity z\n"
    return write(folder / "mvn.csv", head, rows(np.arange(len(m.t)), m.linear, m.gyr))


@layout("laboratories", fusable=False)
def motive(folder: Path, m: Motion) -> Path:
    """Motive: rotations and positions of a rigid body."""
    head = (
        "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.0\n\n,,Rigid Body,Rigid Body,Rigid Body,Rigid Body"
    )
    head += ",Rigid Body,Rigid Body,Rigid Body\n,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n"
    head += "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n"
    place = np.column_stack([np.sin(m.t), np.cos(m.t), 1.0 + 0.1 * m.t])
    return write(folder / "take.csv", head, rows(np.arange(len(m.t)), m.t, _const(m, 0.0, 0.0, 0.0, 1.0), place))


@layout("laboratories")
def ax6_without_header(folder: Path, m: Motion) -> Path:
    """OmGui's CSV of an AX6: a date, g, deg/s, no header."""
    text = rows(m.g, m.deg, form="%.6f")
    return write(folder / "AX6.csv", with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), text))


@layout("laboratories")
def ax6_with_header(folder: Path, m: Motion) -> Path:
    """cwa-convert -header: Accel-X (g), Gyro-X (d/s)."""
    head = "Time,Accel-X (g),Accel-Y (g),Accel-Z (g),Gyro-X (d/s),Gyro-Y (d/s),Gyro-Z (d/s)\n"
    return write(folder / "AX6.csv", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), rows(m.g, m.deg)))


@layout("laboratories")
def actigraph_link(folder: Path, m: Motion) -> Path:
    """ActiGraph's IMU export: ten lines, stamps with seven digits, G, deg/s, µT and a temperature between."""
    head = "------------ Data File Created By ActiGraph Link ActiLife v6.13.4 Firmware v1.7.2 date format "
    head += "M/d/yyyy at 100 Hz  Filter Normal -----------\nSerial Number: TAS1F10190001\n"
    head += "Start Time 12:30:15\nStart Date 5/4/2023\n"
    head += "Epoch Period (hh:mm:ss) 00:00:00\nDownload Time 13:00:00\nDownload Date 5/4/2023\n"
    head += "Current Memory Address: 0\nCurrent Battery Voltage: 4.02     Mode = 12\n"
    head += "--------------------------------------------------\n"
    head += "Timestamp,Accelerometer X,Accelerometer Y,Accelerometer Z,Temperature,Gyroscope X,Gyroscope Y,Gyroscope Z,"
    head += "Magnetometer X,Magnetometer Y,Magnetometer Z\n"
    stamps = [one + "0" for one in dates(m, "%Y-%m-%dT%H:%M:%S.%f")]
    return write(folder / "imu.csv", head, with_words(stamps, rows(m.g, _const(m, 30.1), m.deg, m.mag)))


@layout("laboratories")
def gait_up(folder: Path, m: Motion) -> Path:
    """Physilog: a preamble by colons, names with units in brackets, the barometer rarer."""
    head = "Device: Physilog5\nSensor position: left foot\nSampling frequency: 100 Hz\n\n"
    head += "Time [s],Accel X [g],Accel Y [g],Accel Z [g],Gyro X [°/s],Gyro Y [°/s],Gyro Z [°/s],Pressure [hPa]\n"
    made = rows(m.t, m.g, m.deg, form="%.5f").strip().split("\n")
    return write(
        folder / "LF.csv", head, "\n".join(f"{one},{'1013.2' if k % 4 == 0 else ''}" for k, one in enumerate(made))
    )


@layout("laboratories")
def real_world_har(folder: Path, m: Motion) -> Path:
    """RealWorld: a zip of acc_walking_waist.csv and Gyroscope_walking_waist.csv; id,attr_time,attr_x,…"""
    path = folder / "walking.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in (("acc_walking_waist", m.acc), ("Gyroscope_walking_waist", m.gyr)):
            text = rows(np.arange(len(m.t)) + 1, ms(m) + EPOCH, values)
            archive.writestr(f"{name}.csv", "id,attr_time,attr_x,attr_y,attr_z\n" + text)
    return path


@layout("laboratories")
def wisdm(folder: Path, m: Motion) -> Path:
    """WISDM 2019: two files without header; subject, a letter, ns, x, y, z;"""
    for name, values in (("accel", m.acc), ("gyro", m.gyr)):
        text = with_words(["1600,A"] * len(m.t), rows(ns(m) - EPOCH * 10**6 + 25 * 10**13, values)).replace("\n", ";\n")
        write(folder / f"data_1600_{name}_phone.txt", text.strip())
    return folder


@layout("laboratories")
def heterogeneity(folder: Path, m: Motion) -> Path:
    """HHAR: Index,Arrival_Time,Creation_Time,x,y,z,User,Model,Device,gt in two files."""
    jitter = np.random.default_rng(5).integers(0, 9, len(m.t))
    for name, values in (("accelerometer", m.acc), ("gyroscope", m.gyr)):
        text = rows(np.arange(len(m.t)), ms(m) + EPOCH + 20 + jitter, ns(m), values).replace(
            "\n", ",a,nexus4,nexus4_1,stand\n"
        )
        write(folder / f"Phones_{name}.csv", "Index,Arrival_Time,Creation_Time,x,y,z,User,Model,Device,gt\n", text)
    return folder


@layout("laboratories")
def ku_har(folder: Path, m: Motion) -> Path:
    """KU-HAR: eight columns without header, a time before each sensor."""
    return write(folder / "1001_A_1.csv", rows(m.t, m.acc, m.t + 0.002, m.gyr))


@layout("laboratories")
def mobi_act(folder: Path, m: Motion) -> Path:
    """MobiAct: # lines about the subject, @DATA, then ns, x, y, z; a file a sensor."""
    for name, values in (("acc", m.acc), ("gyro", m.gyr)):
        head = f"#Subject ID: 1\n#First Name: sub1\n#Sensor: {name}\n\n#Activity: 1 - WAL\n@DATA\n"
        write(folder / f"WAL_{name}_1_1.txt", head, rows(ns(m) - EPOCH * 10**6 + 10**12, values))
    return folder


@layout("laboratories")
def sis_fall(folder: Path, m: Motion) -> Path:
    """SisFall: nine counts, ADXL345 256 per g, ITG-3200 14.375 per deg/s, MMA8451Q 1024 per g; no header, no time."""
    counts = np.rint(np.hstack([256 * m.g, 14.375 * m.deg, 1024 * m.g])).astype(int)
    return write(folder / "D01_SA01_R01.txt", rows(counts, sep=",").replace("\n", ";\n"))


@layout("laboratories")
def up_fall(folder: Path, m: Motion) -> Path:
    """UP-Fall: two rows of names, the upper with gaps; Roll (deg/s) for the rates; two places."""
    head = "TimeStamps,AnkleAccelerometer,,,AnkleAngularVelocity,,,AnkleLuminosity,RightPocketAccelerometer,,,"
    head += "RightPocketAngularVelocity,,,RightPocketLuminosity,Subject,Activity\n"
    one = "X-axis (g),Y-axis (g),Z-axis (g),Roll (deg/s),Pitch (deg/s),Yaw (deg/s),illuminance (lux)"
    head += f"Time,{one},{one},,\n"
    text = rows(m.g, m.deg, _const(m, 12.0), m.g[::-1], -m.deg[::-1], _const(m, 5.0, 1, 1), form="%.4f")
    return write(folder / "CompleteDataSet.csv", head, with_words(dates(m, "%Y-%m-%dT%H:%M:%S.%f"), text))


@layout("laboratories")
def ridi(folder: Path, m: Motion) -> Path:
    """RIDI: acce.txt, gyro.txt, linacce.txt and gravity.txt by blanks below two comments."""
    for name, values in (("acce", m.acc), ("gyro", m.gyr), ("linacce", m.linear), ("gravity", m.acc - m.linear)):
        head = f"# {name}\n# Created at Thu May 04 12:30:15 GMT 2023\n"
        write(folder / f"{name}.txt", head, rows(ns(m) - EPOCH * 10**6 + 10**13, values, sep=" "))
    return folder


@layout("laboratories")
def newer_college(folder: Path, m: Motion) -> Path:
    """#counter,sec,nsec,wx,wy,wz,ax,ay,az in a comment."""
    head = "#counter,sec,nsec,wx,wy,wz,ax,ay,az\n"
    return write(folder / "imu.csv", head, rows(np.arange(len(m.t)), ns(m) // 10**9, ns(m) % 10**9, m.gyr, m.acc))


@layout("laboratories")
def types_in_the_header(folder: Path, m: Motion) -> Path:
    """A data set of augmented reality: t[s:double], w[x:rad/s:double], a[x:m/s^2:double]."""
    names = [f"w[{a}:rad/s:double]" for a in "xyz"] + [f"a[{a}:m/s^2:double]" for a in "xyz"]
    return write(folder / "data.csv", ",".join(["#t[s:double]", *names]) + "\n", rows(m.t + EPOCH / 1e3, m.gyr, m.acc))


@layout("laboratories")
def open_loris(folder: Path, m: Motion) -> Path:
    """Two files by blanks: '#Time ax ay az' and '#Time gx gy gz', each with its own clock."""
    write(folder / "d400_accelerometer.txt", "#Time ax ay az\n", rows(m.t + 1.56e9, m.acc, sep=" "))
    write(folder / "d400_gyroscope.txt", "#Time gx gy gz\n", rows(m.t + 1.56e9 + 0.003, m.gyr, sep=" "))
    return folder


@layout("laboratories")
def lpms(folder: Path, m: Motion) -> Path:
    """LPMS-Control: blanks after commas, LinAcc behind, units in brackets."""
    head = "SensorId, TimeStamp (s), FrameNumber, AccX (g), AccY (g), AccZ (g), GyroX (deg/s), GyroY (deg/s), "
    head += "GyroZ (deg/s), MagX (uT), MagY (uT), MagZ (uT), "
    head += "EulerX (deg), EulerY (deg), EulerZ (deg), QuatW, QuatX, QuatY, QuatZ, "
    head += "LinAccX (g), LinAccY (g), LinAccZ (g), Pressure (kPa)\n"
    k = np.arange(len(m.t))
    angles = _const(m, 1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0)
    text = rows(k * 0 + 1, m.t + 0.01, k + 1, m.g, m.deg, m.mag, angles, m.linear / 9.80665, _const(m, 101.3), sep=", ")
    return write(folder / "LpmsData.csv", head, text)


@layout("laboratories", fusable=False)
def open_signals(folder: Path, m: Motion) -> Path:
    """OpenSignals: counts of an analogue accelerometer and EMG, no gyroscope."""
    head = '# OpenSignals Text File Format\n# {"00:07:80:4D:2E:76": {"sensor": ["EMG", "XYZ", "XYZ", "XYZ"], '
    head += '"sampling rate": 100}}\n# EndOfHeader\n'
    counts = np.rint(32768 + 6000 * m.g).astype(int)
    k = np.arange(len(m.t))
    return write(folder / "opensignals.txt", head, rows(k % 16, k * 0, k * 0 + 32011, counts, sep="\t"))


@layout("laboratories")
def nexus_devices(folder: Path, m: Motion) -> Path:
    """Vicon Nexus' devices: the rate in the second line, three rows of names, no time but frames."""
    head = "Devices,,,,,,,\n100,,,,,,,\n,,Blue Trident - Accel,,,Blue Trident - Gyro,,\n"
    head += "Frame,Sub Frame,Accel X,Accel Y,Accel Z,Gyro X,Gyro Y,Gyro Z\n,,m/s²,m/s²,m/s²,deg/s,deg/s,deg/s\n"
    k = np.arange(len(m.t))
    return write(folder / "Trial01.csv", head, rows(k + 1, k * 0, m.acc, m.deg, form="%.5f"))


@layout("laboratories")
def labelled_windows(folder: Path, m: Motion) -> Path:
    """A data set of machine learning: user, activity, timestamp in ms, acc_x … gyro_z, spaces after commas."""
    head = "user, activity, timestamp, acc_x, acc_y, acc_z, gyro_x, gyro_y, gyro_z\n"
    text = with_words(["U1, walk"] * len(m.t), rows(ms(m) + EPOCH, m.acc, m.gyr, sep=", "), ", ")
    return write(folder / "har.csv", head, text)
