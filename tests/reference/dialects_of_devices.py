"""Logs as instruments and wearables write them, in more layouts; see dialects.py."""

from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, names, ns, rows, with_words, write

QUAT = [1.0, 0.0, 0.0, 0.0]


def quats(m: Motion) -> np.ndarray:
    """A vendor's quaternion that nobody needs."""
    return np.zeros((len(m.t), 4)) + QUAT


@dialect
def xsens_awinda(folder: Path, m: Motion) -> Path:
    """MT Manager's export of an Awinda: many empty columns of UTC, the rate in the preamble."""
    head = (
        "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: human (46.1)\n// Option Flags: AHS Dis\n"
    )
    head += "// Firmware Version: 4.0.2\n"
    blank = ["SampleTimeFine", "Year", "Month", "Day", "Second", "UTC_Nano", "UTC_Year", "UTC_Month", "UTC_Day",
             "UTC_Hour", "UTC_Minute", "UTC_Second", "UTC_Valid"]  # fmt: skip
    titles = ["PacketCounter", *blank, *(f"{w}_{a}" for w in ("Acc", "Gyr", "Mag") for a in "XYZ"),
              *(f"Mat[{i}][{j}]" for j in (1, 2, 3) for i in (1, 2, 3))]  # fmt: skip
    identity = np.tile(np.eye(3).ravel(), (len(m.t), 1))
    text = rows(np.arange(len(m.t)) + 4210, np.full((len(m.t), 13), ""), m.acc, m.gyr, m.mag / 48.0, identity, sep="\t")
    return write(folder / "MT_012005D6_031-000_00B421AF.txt", head, "\t".join(titles), "\n", text)


@dialect
def movella_dot_plain(folder: Path, m: Motion) -> Path:
    """Movella DOT's USB export: no preamble, free acceleration before acceleration, no units."""
    head = "PacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3],"
    head += f"FreeAcc_X,FreeAcc_Y,FreeAcc_Z,{names('Acc_')},{names('Gyr_')},{names('Mag_')}\n"
    n = len(m.t)
    text = rows(np.arange(n) + 1, np.rint(m.t * 1e6).astype(int) + 77_000_000, 20 * m.gyr, quats(m), m.acc / 100,
                m.linear, m.acc, m.deg, m.mag / 48.0)  # fmt: skip
    return write(folder / "1_20230504_123015.csv", head, text)


@dialect
def apdm_csv(folder: Path, m: Motion) -> Path:
    """APDM's CSV: several rows of preamble, names with a slash, µs since 1970."""
    head = "Format=,4\nVersion=,2.0\nCase ID=,Test\nMonitor Label=,Lumbar\nSample Rate=,100\n"
    head += "Time," + ",".join(f"Acceleration/{a}" for a in "XYZ") + ","
    head += ",".join(f"Angular Velocity/{a}" for a in "XYZ") + "," + ",".join(f"Magnetic Field/{a}" for a in "XYZ")
    head += ",Temperature\n"
    return write(folder / "lumbar.csv", head, rows(ns(m) // 1000, m.acc, m.gyr, m.mag, np.full(len(m.t), 30.0)))


@dialect
def apdm_hdf5(folder: Path, m: Motion) -> Path:
    """APDM's HDF5: a group for each monitor, units as attributes, µs since 1970."""
    import h5py

    path = folder / "20230504-123015.h5"
    with h5py.File(path, "w") as file:
        for number, scale in (("5678", 1.0), ("5701", 0.5)):
            for name, unit, values in (("Accelerometer", "m/s^2", m.acc), ("Gyroscope", "rad/s", scale * m.gyr),
                                       ("Magnetometer", "uT", m.mag)):  # fmt: skip
                made = file.create_dataset(f"Sensors/{number}/{name}", data=values)
                made.attrs["Units"] = np.bytes_(unit)
            file[f"Sensors/{number}/Time"] = (ns(m) // 1000).astype(np.uint64)
            file[f"Processed/{number}/Orientation"] = quats(m)
    return path


@dialect
def delsys_trigno(folder: Path, m: Motion) -> Path:
    """Delsys EMGworks: a column of time beside each column, EMG at a higher rate."""
    titles, columns = ['"X[s]"', '"Trigno IM sensor 1: EMG 1[V]"'], []
    fast = np.arange(4 * len(m.t)) / 400.0
    columns = [fast, 1e-5 * np.sin(60 * fast)]
    for word, unit, values in (("Acc 1", "g", m.g), ("Gyro 1", "deg/s", m.deg), ("Mag 1", "uT", m.mag)):
        for axis, column in zip("XYZ", values.T, strict=True):
            titles += ['"X[s]"', f'"Trigno IM sensor 1: {word}.{axis} (IM) [{unit}]"']
            columns += [m.t, column]
    lines = [",".join(f"{column[k]:.6f}" if k < len(column) else "" for column in columns) for k in range(len(fast))]
    return write(folder / "Run_number_12.csv", ",".join(titles), "\n", "\n".join(lines))


@dialect
def trigno_discover(folder: Path, m: Motion) -> Path:
    """Trigno Discover: preamble, "ACC X Time Series (s)" beside "ACC X (G)"."""
    head = "Application:,Trigno Discover\nDate/Time:,5/4/2023 12:30:15 PM\nCollection Length (seconds):,20\n\n"
    titles, columns = [], []
    for word, unit, values in (("ACC", "G", m.g), ("GYRO", "deg/s", m.deg)):
        for axis, column in zip("XYZ", values.T, strict=True):
            titles += [f"{word} {axis} Time Series (s)", f"{word} {axis} ({unit})"]
            columns += [m.t, column]
    return write(folder / "Trial_1.csv", head, ",".join(titles), "\n", rows(*columns))


@dialect
def blue_trident(folder: Path, m: Motion) -> Path:
    """Vicon's Blue Trident (IMeasureU): units behind an underscore and a slash."""
    head = "time_s,ax_m/s/s,ay_m/s/s,az_m/s/s,gx_deg/s,gy_deg/s,gz_deg/s,mx_ut,my_ut,mz_ut\n"
    return write(folder / "TS-00123_2023-05-04_lowg.csv", head, rows(m.t, m.acc, m.deg, m.mag))


@dialect
def lpms_control(folder: Path, m: Motion) -> Path:
    """LpmsControl: blanks after commas, a second acceleration without gravity."""
    head = "SensorId, TimeStamp (s), FrameNumber, AccX (g), AccY (g), AccZ (g), GyroX (deg/s), GyroY (deg/s), "
    head += "GyroZ (deg/s), MagX (uT), MagY (uT), MagZ (uT), EulerX (deg), EulerY (deg), EulerZ (deg), QuatW, QuatX, "
    head += "QuatY, QuatZ, LinAccX (g), LinAccY (g), LinAccZ (g), Pressure (kPa), Altitude (m), Temperature (degC)\n"
    n = len(m.t)
    text = rows(np.full(n, 1), m.t + 3.0, np.arange(n), m.g, m.deg, m.mag, 10 * m.gyr, quats(m), m.linear / 9.80665,
                np.full((n, 3), 24.0), sep=", ")  # fmt: skip
    return write(folder / "LpmsData.csv", head, text)


@dialect
def vectornav_csv(folder: Path, m: Motion) -> Path:
    """VectorNav's binary groups as CSV: ns since start, names with indices, no units."""
    head = "TimeStartup,TimeGps,YawPitchRoll_0,YawPitchRoll_1,YawPitchRoll_2,AngularRate_0,AngularRate_1,AngularRate_2,"
    head += "Accel_0,Accel_1,Accel_2,Mag_0,Mag_1,Mag_2,Temp,Pres\n"
    n = len(m.t)
    at = ns(m) - EPOCH * 10**6 + 5 * 10**9
    text = rows(at, at + 10**18, 10 * m.gyr, m.gyr, m.acc, m.mag / 100, np.full((n, 2), 30.0))
    return write(folder / "vn300.csv", head, text)


@dialect
def sbg_center(folder: Path, m: Motion) -> Path:
    """sbgCenter's ASCII export: names, a row of units, tabs."""
    titles = ["Timestamp", "Status", "X Accelerometer", "Y Accelerometer", "Z Accelerometer", "X Gyroscope",
              "Y Gyroscope", "Z Gyroscope", "Temperature"]  # fmt: skip
    unit = ["us", "-", *["m.s^-2"] * 3, *["rad.s^-1"] * 3, "°C"]
    n = len(m.t)
    text = rows(np.rint(m.t * 1e6).astype(int) + 9_000_000, np.full(n, 511), m.acc, m.gyr, np.full(n, 30.0), sep="\t")
    return write(folder / "imuData.txt", "\t".join(titles), "\n", "\t".join(unit), "\n", text)


@dialect
def st_ble_sensor(folder: Path, m: Motion) -> Path:
    """ST's BLE Sensor app: a file per feature, four lines of preamble, dates and a device's counter."""
    stamps = dates(m, "%d/%m/%Y %H:%M:%S.%f", 3)
    for name, unit, values in (("Gyroscope", "dps", m.deg), ("Accelerometer", "mg", m.g * 1e3)):
        head = f"Log start on,20230504_123015\nFeature,{name}\nNodes,AM1V310 @C083A1\n"
        head += f"Date,HostTimestamp (ms),NodeName,NodeTimestamp,RawData,X ({unit}),Y ({unit}),Z ({unit}),\n"
        n = len(m.t)
        text = rows(np.rint(1e3 * m.t).astype(int) + 12, np.full(n, "AM1V310"), 37 * np.arange(n), np.full(n, "A0FF12"),
                    values, form="%.2f").replace("\n", ",\n")  # fmt: skip
        write(folder / f"20230504_123015_{name}.csv", head, with_words(stamps, text))
    return folder


@dialect
def witmotion_app(folder: Path, m: Motion) -> Path:
    """WitMotion's new software: long names, a chip's time, letters that are no units."""
    head = "time,DeviceName,Chip Time(),Acceleration X(g),Acceleration Y(g),Acceleration Z(g),Angular velocity X(°/s),"
    head += "Angular velocity Y(°/s),Angular velocity Z(°/s),Angle X(°),Angle Y(°),Angle Z(°),Magnetic field X(ʯt),"
    head += "Magnetic field Y(ʯt),Magnetic field Z(ʯt),Temperature(℃),Quaternions 0(),Quaternions 1(),Quaternions 2(),"
    head += "Quaternions 3()\n"
    n = len(m.t)
    chip = np.array(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3))
    text = rows(np.full(n, "WT901BLE68(e5:8e)"), chip, m.g, m.deg, 10 * m.gyr, m.mag, np.full(n, 31.0), quats(m))
    return write(folder / "data_20230504.csv", head, with_words(dates(m, "%H:%M:%S.%f", 3), text))


@dialect
def mind_monitor(folder: Path, m: Motion) -> Path:
    """Mind Monitor's CSV of a Muse: brain waves beside the IMU, words at the end."""
    head = (
        "TimeStamp,Delta_TP9,Alpha_AF7,RAW_TP9,RAW_AF7,Accelerometer_X,Accelerometer_Y,Accelerometer_Z,Gyro_X,Gyro_Y,"
    )
    head += "Gyro_Z,HeadBandOn,HSI_TP9,Battery,Elements\n"
    n = len(m.t)
    brain = np.column_stack([np.sin(9 * m.t), np.cos(5 * m.t), 800 + np.sin(60 * m.t), 810 + np.cos(61 * m.t)])
    text = rows(brain, m.g, m.deg, np.full((n, 2), 1), np.full(n, 87.0)).replace("\n", ",\n")
    return write(folder / "mindMonitor_2023-05-04.csv", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), text))


@dialect
def movesense(folder: Path, m: Motion) -> Path:
    """Movesense's Showcase app: "linearAcceleration" is the accelerometer with gravity in it; ms of the device."""
    for name, values in (("linearacceleration", m.acc), ("angularvelocity", m.deg), ("magneticfield", m.mag)):
        write(folder / f"20230504T123015Z_174630000192_{name}_stream.csv", "timestamp,x,y,z\n",
              rows(np.rint(1e3 * m.t).astype(int) + 55_000, values))  # fmt: skip
    return folder


@dialect
def phidgets(folder: Path, m: Motion) -> Path:
    """Phidgets' control panel: axes as digits from 0."""
    head = "Time (ms),Acceleration 0,Acceleration 1,Acceleration 2,Angular Rate 0,Angular Rate 1,Angular Rate 2,"
    head += "Magnetic Field 0,Magnetic Field 1,Magnetic Field 2\n"
    return write(folder / "spatial.csv", head, rows(1e3 * m.t + 17.0, m.g, m.deg, m.mag / 100))


@dialect
def ngimu(folder: Path, m: Motion) -> Path:
    """x-io's NGIMU: sensors.csv in a folder of a session, battery.csv beside it."""
    head = (
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
    )
    head += "Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)\n"
    write(folder / "NGIMU - 0035F6E2" / "sensors.csv", head, rows(m.t, m.deg, m.g, m.mag, np.full(len(m.t), 990.0)))
    head = "Time (s),Battery (%),Time To Empty (minutes),Voltage (V),Current (mA)\n"
    write(folder / "NGIMU - 0035F6E2" / "battery.csv", head, rows(m.t[::100], np.full((len(m.t[::100]), 4), 3.0)))
    return folder


@dialect
def esense(folder: Path, m: Motion) -> Path:
    """eSense earbuds by a desktop client: units written out behind the axes, and the number of the row as Timestamp."""
    head = "Timestamp,Accel_X_g,Accel_Y_g,Accel_Z_g,Gyro_X_deg_per_s,Gyro_Y_deg_per_s,Gyro_Z_deg_per_s\n"
    return write(folder / "imu_data.csv", head, rows(np.arange(len(m.t)), m.g, m.deg))


@dialect
def threespace_ctime(folder: Path, m: Motion) -> Path:
    """Yost's Python API: stamps as C prints them, whole seconds, AccelCorrected."""
    head = "Time," + ",".join(f"{w}Corrected{a}" for w in ("Accel", "Gyro") for a in "XYZ") + ",Pitch,Yaw,Roll\n"
    stamps = dates(m, "%a %b %d %H:%M:%S %Y")
    return write(folder / "imu_data.csv", head, with_words(stamps, rows(m.g, m.gyr, 0.1 * m.gyr)))


@dialect
def vmu931(folder: Path, m: Motion) -> Path:
    """VMU931's recorder: a word in each row, a stamp of two words, a file per sensor."""
    for word, values in (("Gyroscope", m.deg), ("Accelerometer", m.g)):
        text = rows(np.full(len(m.t), word), np.rint(1e3 * m.t).astype(int) + 156_496, values)
        write(folder / f"{word}.csv", "Attribute,Time stamp,x,y,z\n", text)
    return folder


@dialect
def excel_units_row(folder: Path, m: Motion) -> Path:
    """A laboratory's workbook: title, blank row, names, a row of units."""
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Trial 7"])
    sheet.append([])
    sheet.append(["Time", *(f"Acc {a}" for a in "XYZ"), *(f"Gyro {a}" for a in "XYZ")])
    sheet.append(["s", *["m/s²"] * 3, *["°/s"] * 3])
    for s, a, g in zip(m.t, m.acc, m.deg, strict=True):
        sheet.append([float(s), *map(float, a), *map(float, g)])
    book.save(folder / "trial.xlsx")
    return folder / "trial.xlsx"
