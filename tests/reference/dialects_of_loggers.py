"""Logs as small projects of one person write them: boards with an SD card, web pages, phones; see dialects.py."""

from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, ns, rows, with_words, write

US = 1_000_000
Array = np.ndarray


def us(m: Motion) -> Array:
    """Microseconds since power was on."""
    return np.rint(m.t * 1e6).astype(np.int64) + 7_412_331


def const(m: Motion, value: float) -> Array:
    """A column of one number."""
    return np.full(len(m.t), value)


@dialect
def packet_numbers(folder: Path, m: Motion) -> Path:
    """A reader of DEDALOS data: a packet's number, deg/s, g; the period is given elsewhere."""
    head = "Packet_Number,Gyro_x,Gyro_y,Gyro_z,Acc_x,Acc_y,Acc_z\n"
    return write(folder / "stairs.csv", head, rows(np.arange(len(m.t)), m.deg, m.g))


@dialect
def ov_debug(folder: Path, m: Motion) -> Path:
    """A visual odometry's debug file: a comment as header, then stamps of nine decimals, a quaternion, a field of 0."""
    head = "# timestamp,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,qw,qx,qy,qz,mag_x,mag_y,mag_z\n"
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(m.t), 1))
    return write(folder / "imu_data.txt", head, rows(m.t + EPOCH / 1e3, m.acc, m.gyr, quat, 0 * m.mag, form="%.9f"))


@dialect
def length_between(folder: Path, m: Motion) -> Path:
    """A fall detector on an ESP32: |A| between the sensors."""
    length = np.linalg.norm(m.g, axis=1)
    text = rows(ms(m) + 5123, m.g, length, m.deg, const(m, 0.5), np.zeros(len(m.t), int), form="%.2f")
    return write(folder / "dataLog.csv", "Time,AX,AY,AZ,|A|,GX,GY,GZ,CalibrationLoss,FallDetected\n", text)


@dialect
def header_with_time_rows_without(folder: Path, m: Motion) -> Path:
    """A CanSat: the header begins with Time, but the rows have none."""
    text = rows(m.acc, m.deg, const(m, 24.1), const(m, 1008.2), const(m, 43.0), form="%.4f")
    return write(folder / "data.csv", "Time,Ax,Ay,Az,Gx,Gy,Gz,Temp,Pre(hPa),Alti\n", text)


@dialect
def filtered_beside(folder: Path, m: Motion) -> Path:
    """A serial log with the filtered acceleration, without gravity, beside the raw one."""
    head = "time,ax,ay,az,gx,gy,gz,filterAx,filterAy,filterAz,motion,smoothMotion\n"
    motion = np.linalg.norm(m.linear, axis=1)
    return write(
        folder / "log.csv", head, rows(ms(m) + 2010, m.g, m.deg, m.linear / 9.80665, motion, motion, form="%.2f")
    )


@dialect
def data_section(folder: Path, m: Motion) -> Path:
    """A rocket's computer: a line [Data], then 24 columns."""
    head = "[Data]\ntime,ax,ay,az,gx,gy,gz,mx,my,mz,roll,pitch,yaw,maxG,T,P,P_alt,fix,lon,lat,alt,vn,ve,vd,eject\n"
    more = np.tile([1.0, 2.0, 3.0, 1.1, 24.0, 101.3, 30.0, 3.0, 127.1, 37.2, 31.0, 0.0, 0.0, 0.1, 0.0], (len(m.t), 1))
    return write(folder / "output_003.csv", head, rows(m.t + 12.0, m.acc, m.deg, m.mag, more, form="%.3f"))


@dialect
def flags_and_twins(folder: Path, m: Motion) -> Path:
    """A balloon's computer: names that come four times, two accelerometers, the first one of them high-g and coarse."""
    head = "MET [sec],Flag,Flag,Flag,Flag,Volt [V],Curr [A],AccelX,AccelY,AccelZ,Temp[C],AccelX,AccelY,AccelZ,BMXTemp,"
    head += "GyroX,GyroY,GyroZ,MagX,MagY,MagZ,Hall\n"
    zero, coarse = np.zeros((len(m.t), 4), int), np.round(m.g / 0.02) * 0.02
    text = rows(m.t + 3.0, zero, const(m, 8.1), const(m, 0.3), coarse, const(m, 21.0), m.g, const(m, 22.0), m.deg,
                m.mag, np.zeros(len(m.t), int), form="%.3f")  # fmt: skip
    return write(folder / "flight.csv", head, text)


@dialect
def web_page_angles(folder: Path, m: Motion) -> Path:
    """A web page's DeviceMotion events: rotationRate alpha, beta, gamma in deg/s, which browsers fill with x, y, z."""
    head = "label,timestamp,accelX,accelY,accelZ,gyroAlpha,gyroBeta,gyroGamma\n"
    text = rows(ms(m) + EPOCH, m.acc, m.deg, form="%.4f")
    return write(folder / "swing.csv", head, with_words(["swing"] * len(m.t), text))


@dialect
def grav_and_accel(folder: Path, m: Motion) -> Path:
    """An iPhone's app: GravX beside AccelX, which is user acceleration in g, Apple's signs."""
    head = "Time,GyroX,GyroY,GyroZ,GravX,GravY,GravZ,AccelX,AccelY,AccelZ\n"
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    return write(folder / "accel.csv", head, rows(m.t, m.gyr, gravity, user))


@dialect
def rocket_us(folder: Path, m: Motion) -> Path:
    """A rocket: position between time and sensors, attitude behind them, counts of a state."""
    head = "Time(us),Altitude(m),Latitude,Longitude,GyroX,GyroY,GyroZ,AccelX,AccelY,AccelZ,"
    head += "AttitudeX,AttitudeY,AttitudeZ,state\n"
    text = rows(
        us(m), const(m, 12.5), const(m, 32.99), const(m, -106.97), m.gyr, m.acc, 0 * m.gyr, np.ones(len(m.t), int)
    )
    return write(folder / "flight7.csv", head, text)


@dialect
def visual3d_text(folder: Path, m: Motion) -> Path:
    """Visual3D's ASCII as an insole's program writes it: five header lines with tabs, lines of numbers with blanks."""
    columns = ["TIME", "TIME", *(f"{s}_{a}" for s in ("ACC", "GYR", "MAG", "LACC") for a in "XYZ")]
    head = "\t".join(["DEFAULT"] * len(columns)) + "\n            " + "\t".join(columns) + "\n            "
    head += "\t".join(["FRAME_NUMBERS", *["ANALOG"] * (len(columns) - 1)]) + "\n            "
    head += "\t".join(["ORIGINAL"] * len(columns)) + "\n        ITEM\t0\t0" + "\tx" * 12 + "\n"
    k = np.arange(len(m.t))
    return write(folder / "trial.txt", head, rows(0 * k + 1, m.t, k, m.acc, m.gyr, m.mag, m.linear, sep=" "))


@dialect
def xsens_look_alike(folder: Path, m: Motion) -> Path:
    """Somebody's MPU6500 in the costume of an MT Manager export, without a rate."""
    head = (
        "// Start Time: Unknown\n// Update Rate: xxx\n// ZJUT MPU6500 \n// Baudrate 115200 \n// Firmware Version: xxx\n"
    )
    head += "PacketCounter\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n"
    return write(folder / "log.txt", head, rows(np.arange(len(m.t)), m.acc, m.gyr, sep="\t"))


@dialect
def gps_synchronised(folder: Path, m: Motion) -> Path:
    """An app for cars: tabs, a comment above the header, words and empty cells beside the numbers."""
    head = "# GPS Synchronized Data (Hybrid Logical Clock)\nGPS_TIME\tGPS_STATUS\tLAT\tLON\tALT\tACC_X\tACC_Y\tACC_Z\t"
    head += "GYRO_X\tGYRO_Y\tGYRO_Z\tMAG_X\tMAG_Y\tMAG_Z\tGNSS_TYPE\tSAT_ID\tCN0\tCAMERA_FRAME_ID\tBBOX_COUNT\n"
    made = []
    for k, stamp in enumerate(ns(m)):
        numbers = "\t".join(f"{v:.6f}" for v in (*m.acc[k], *m.gyr[k], *m.mag[k]))
        made.append(f"{stamp // 1_000_000}\tVALID\t37.5\t127.1\t38.2\t{numbers}\tGPS\t{k % 30}\t38.5\tNULL\tNULL\n")
    return write(folder / "gps_sync.tsv", head, *made)


@dialect
def yost_agent(folder: Path, m: Motion) -> Path:
    """An agent that polls a YEI sensor: semicolons, g and rad/s, q1 … q4."""
    head = (
        "system_time (s);accel_x (g);accel_y (g);accel_z (g);gyro_x (rad/s);gyro_y (rad/s);gyro_z (rad/s);q1;q2;q3;q4\n"
    )
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (len(m.t), 1))
    return write(folder / "imu.csv", head, rows(m.t + EPOCH / 1e3, m.g, m.gyr, quat, sep=";"))


@dialect
def number_before_name(folder: Path, m: Motion) -> Path:
    """Yost's sensors by their numbers: "2 Accel_x (g)"; two of them side by side."""
    parts, values = ["Time (s)"], [m.t]
    for i in (2, 5):
        parts += [f"{i} Accel_{a} (g)" for a in "xyz"] + [f"{i} Gyro_{a} (rad/s)" for a in "xyz"]
        parts += [f"{i} Mag_{a} (uT)" for a in "xyz"]
        turn = 1 if i == 2 else -1
        values += [m.g * [1, turn, turn], m.gyr * [1, turn, turn], m.mag * [1, turn, turn]]
    return write(folder / "yost.csv", ",".join(parts), "\n", rows(*values))


@dialect
def wearable_dual_clock(folder: Path, m: Motion) -> Path:
    """A wearable over Bluetooth: arrival in s and the board's own clock in ms; words for what the user does."""
    head = "Timestamp,imuTimestamp," + names("Gyro_", end=" (rad/s)") + "," + names("Acc_", end=" (g)") + ","
    head += (
        names("Mag_", end=" (μT)") + ",Euler_X,Euler_Y,Euler_Z,Quaternion_W,Quaternion_X,Quaternion_Y,Quaternion_Z\n"
    )
    late = m.t + EPOCH / 1e3 + 0.003 * np.random.default_rng(3).random(len(m.t))
    text = rows(late, ms(m) + 3321, m.gyr, m.g, m.mag, 0 * m.gyr, np.tile([1.0, 0, 0, 0], (len(m.t), 1)))
    return write(folder / "session.csv", head, text)


@dialect
def beacons(folder: Path, m: Motion) -> Path:
    """An indoor app of Android: ns, linearAcc beside Acc, an orientation in deg, beacons by their address."""
    head = "Time (ns),Acc X (m/s^2),Acc Y (m/s^2),Acc Z (m/s^2),linearAcc X (m/s^2),linearAcc Y (m/s^2),"
    head += "linearAcc Z (m/s^2),"
    head += "Orientation (deg),gyro_x (rad/s),gyro_y (rad/s),gyro_z (rad/s),C4:9B:11,D2:11:00\n"
    text = rows(ns(m) - EPOCH * US + 10**13, m.acc, m.linear, const(m, 83.0), m.gyr, const(m, -71.0), const(m, -80.0))
    return write(folder / "walk.csv", head, text)


@dialect
def ranges_in_columns(folder: Path, m: Motion) -> Path:
    """An MPU-6050 on an SD card: offsets in a first row of its own, counts, and the ranges' codes as columns."""
    head = "time [us],a_x, a_y,a_z,omega_x,omega_y,omega_z,acc range,gyro range\n-1,-1202,311,988,44,-12,5,0,0\n"
    ranges = np.tile([1, 1], (len(m.t), 1))
    text = rows(us(m), np.rint(m.g * 8192).astype(int), np.rint(m.deg * 65.5).astype(int), ranges)
    return write(folder / "datalog.txt", head, text)


@dialect
def pico_quake(folder: Path, m: Motion) -> Path:
    """PicoQuake: comments with the rate, a count of samples."""
    head = "# PLab PicoQuake Data\n# Time: 2024-04-21 15:54:46.333682, Device: D4E9 (E6632891E36F2029)\n"
    head += f"# Num. samples: {len(m.t)}, Duration: 20.0 s\n"
    head += "# Config: data_rate = 100.0 Hz, filter = 42 Hz, acc_range = 4 g, gyro_range = 250.0 dps\n"
    head += "# Integrity: True, Skipped samples: 0\ncount,a_x,a_y,a_z,g_x,g_y,g_z\n"
    return write(folder / "D4E9_20240421.csv", head, rows(np.arange(1, len(m.t) + 1), m.g, m.deg, form="%.5f"))


@dialect
def kalibr_imu(folder: Path, m: Motion) -> Path:
    """kalibr_bagcreater's imu0.csv: omega, and alpha for the acceleration."""
    return write(
        folder / "imu0.csv", "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n", rows(ns(m), m.gyr, m.acc)
    )


@dialect
def mono_and_estimated_clocks(folder: Path, m: Motion) -> Path:
    """An underwater robot's logger: the same time in ns and s, monotonic and estimated; angles, an empty column."""
    made = []
    for k, stamp in enumerate(ns(m)):
        numbers = ",".join(f"{v:.5f}" for v in (*m.g[k], *m.deg[k], 1.0, 2.0, 3.0))
        mono = stamp - EPOCH * US + 10**12
        made.append(f"{mono},{stamp},{mono / 1e9:.9f},{stamp / 1e9:.6f},{numbers},\n")
    head = "MonoNS,EstNS,MonoS,EstS,AccX,AccY,AccZ,GyroX,GyroY,GyroZ,AngX,AngY,AngZ,YawDeg\n"
    return write(folder / "min_imu_tb_20251103.csv", head, *made)


@dialect
def korean_degrees(folder: Path, m: Motion) -> Path:
    """A header in a Korean code page, in which ° are two bytes."""
    head = "Time(s),Ax(g),Ay(g),Az(g),Gx(°/s),Gy(°/s),Gz(°/s)\n"
    return write(folder / "imu.csv", head, rows(m.t, m.g, m.deg, form="%.4f"), encoding="cp949")


@dialect
def letters_around_counts(folder: Path, m: Motion) -> Path:
    """SparkFun's IMU 6DoF v2: "A 543 512 … Z", a sample's number and counts of a 10 bit converter about 512."""
    counts = np.rint(512 + np.hstack([m.g * 102.4, np.clip(m.deg, -300, 300) / 0.977])).astype(int)
    made = [f"A {k} {' '.join(map(str, line))}Z\n" for k, line in enumerate(counts)]
    return write(folder / "hyperterminal.txt", *made)


@dialect
def date_and_time_of_a_clock_chip(folder: Path, m: Motion) -> Path:
    """A boat's logger: date and time of a clock chip in two columns, in whole seconds."""
    stamps = dates(m, "%Y-%m-%d,%H:%M:%S")
    more = np.tile([2101.0, 2090.0], (len(m.t), 1))
    text = with_words(stamps, rows(more, m.g, m.deg, const(m, 51.1), const(m, 3.2), form="%.3f"))
    return write(folder / "RUN001.CSV", "Date,Time,P_RPM,S_RPM,AccX,AccY,AccZ,GyroX,GyroY,GyroZ,Lat,Lon\n", text)


@dialect
def angles_from_acc(folder: Path, m: Motion) -> Path:
    """TockN's MPU6050 library: angles of the accelerometer and of the filter behind the sensors; millis."""
    head = "Time,Temp,AccX,AccY,AccZ,GyroX,GyroY,GyroZ,AccAngleX,AccAngleY,AngleX,AngleY,AngleZ\n"
    angle = np.degrees(np.arctan2(m.acc[:, 1], m.acc[:, 2]))
    more = np.column_stack([angle] * 5)
    return write(folder / "test.txt", head, rows(ms(m) + 803, const(m, 26.1), m.g, m.deg, more, form="%.2f"))


@dialect
def bno055_everything(folder: Path, m: Motion) -> Path:
    """A BNO055 with all that it has: heading, rates, linear, gravity, field, acceleration, temperature, status."""
    head = "millis,heading,pitch,roll," + ",".join(
        f"{stem}_{a}" for stem in ("gyro", "linaccel", "gravity", "mag", "accel") for a in "xyz"
    ) + ",temp,qw,qx,qy,qz,cal_sys,cal_gyro,cal_accel,cal_mag\n"  # fmt: skip
    cal = np.tile([3, 3, 3, 3], (len(m.t), 1))
    text = rows(ms(m) + 1000, 0 * m.gyr, m.gyr, m.linear, m.acc - m.linear, m.mag, m.acc, const(m, 30.0),
                np.tile([1.0, 0, 0, 0], (len(m.t), 1)), cal, form="%.4f")  # fmt: skip
    return write(folder / "bno.csv", head, text)
