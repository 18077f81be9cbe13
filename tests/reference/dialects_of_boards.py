"""Logs as boards, instruments, robots and drones write them; see dialects.py."""

from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, ns, rows, with_words, write

US = 1_000_000


@dialect
def betaflight_explorer(folder: Path, m: Motion) -> Path:
    """Blackbox Explorer's CSV: a preamble of settings, then columns; gyroADC in deg/s, accSmooth in 2048 a g."""
    head = '"Product","Blackbox flight data recorder by Nicholas Sherlock"\n"firmwareType","Cleanflight"\n'
    head += '"looptime",125\n"acc_1G",2048\n"gyro_scale",1.0\n'
    head += '"loopIteration","time","axisP[0]","rcCommand[0]","gyroADC[0]","gyroADC[1]","gyroADC[2]",'
    head += '"accSmooth[0]","accSmooth[1]","accSmooth[2]","motor[0]"\n'
    k = np.arange(len(m.t))
    acc = np.rint(m.g * 2048).astype(int)
    text = rows(k * 8, np.rint(m.t * US).astype(int) + 21_000_000, k % 7, k % 5, m.deg, acc, k % 900 + 200)
    return write(folder / "btfl_001.bbl.csv", head, text)


@dialect
def blackbox_decode(folder: Path, m: Motion) -> Path:
    """blackbox_decode: a header with blanks and units, gyroADC as whole deg/s."""
    head = (
        "loopIteration, time (us), axisP[0], axisP[1], gyroADC[0], gyroADC[1], gyroADC[2], accSmooth[0], accSmooth[1],"
    )
    head += " accSmooth[2], motor[0], flightModeFlags (flags)\n"
    k = np.arange(len(m.t))
    acc = np.rint(m.g * 2048).astype(int)
    flags = np.full(len(k), "ANGLE_MODE")
    text = rows(k * 8, np.rint(m.t * US).astype(int), k % 7, k % 5, np.rint(m.deg).astype(int), acc, k % 900, flags,
                sep=", ")  # fmt: skip
    return write(folder / "LOG00001.01.csv", head, text)


@dialect
def ardupilot_text(folder: Path, m: Motion) -> Path:
    """ArduPilot's .log: FMT rows name the columns of the rows after them; two IMUs, and MAG."""
    head = "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n"
    head += "FMT, 150, 47, IMU, QBffffffIIfBBHH, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n"
    head += "FMT, 160, 30, ATT, Qccccccc, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF\n"
    head += "PARM, 100000, LOG_BITMASK, 176126\n"
    made = []
    for k, stamp in enumerate(np.rint(m.t * US).astype(int) + 30_000_000):
        line = ", ".join(f"{v:.6f}" for v in (*m.gyr[k], *m.acc[k]))
        made.append(f"IMU, {stamp}, 0, {line}, 0, 0, 45.1, 1, 1, 1000, 1000\n")
        made.append(f"IMU, {stamp}, 1, {line}, 0, 0, 46.0, 1, 1, 1000, 1000\n")
        if k % 4 == 0:
            made.append(f"ATT, {stamp}, 0.00, 1.00, 0.00, 2.00, 0.00, 90.00, 3\n")
    return write(folder / "00000012.log", head, *made)


@dialect
def ulog2csv(folder: Path, m: Motion) -> Path:
    """PX4's ulog2csv of sensor_combined."""
    head = "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,"
    head += "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt\n"
    k = np.full(len(m.t), 10_000)
    text = rows(np.rint(m.t * US).astype(int) + 50_000_000, m.gyr, k, 0 * k, m.acc, k)
    return write(folder / "log_sensor_combined_0.csv", head, text)


@dialect
def rostopic_echo(folder: Path, m: Motion) -> Path:
    """rostopic echo -p: %time, field.… , covariances."""
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
    head += ",".join(f"field.orientation.{a}" for a in "xyzw") + ","
    head += ",".join(f"field.orientation_covariance{i}" for i in range(9)) + ","
    head += names("field.angular_velocity.", "xyz") + ","
    head += ",".join(f"field.angular_velocity_covariance{i}" for i in range(9)) + ","
    head += names("field.linear_acceleration.", "xyz") + ","
    head += ",".join(f"field.linear_acceleration_covariance{i}" for i in range(9)) + "\n"
    n = len(m.t)
    k, nine = np.arange(n), np.full((n, 9), 0.0)
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    text = rows(ns(m) + 300_000, k, ns(m), np.full(n, "imu_link"), quat, nine - 1, m.gyr, nine, m.acc, nine)
    return write(folder / "imu.csv", head, text)


@dialect
def bagpy_csv(folder: Path, m: Motion) -> Path:
    """bagpy's CSV of sensor_msgs/Imu: the bag's time, stamps as secs and nsecs."""
    head = "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,"
    head += ",".join(f"orientation.{a}" for a in "xyzw") + "," + names("angular_velocity.", "xyz") + ","
    head += names("linear_acceleration.", "xyz") + "\n"
    n = len(m.t)
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    stamps = ns(m)
    text = rows(stamps / 1e9 + 0.0004, np.arange(n), stamps // 10**9, stamps % 10**9, np.full(n, "imu"), quat, m.gyr,
                m.acc, form="%.7f")  # fmt: skip
    return write(folder / "imu-data.csv", head, text)


@dialect
def euroc(folder: Path, m: Motion) -> Path:
    """EuRoC's imu0/data.csv."""
    head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    head += "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
    return write(folder / "data.csv", head, rows(ns(m), m.gyr, m.acc))


@dialect
def uzh_fpv(folder: Path, m: Motion) -> Path:
    """UZH-FPV's imu.txt: names in a comment, blanks between."""
    head = "# id timestamp ang_vel_x ang_vel_y ang_vel_z lin_acc_x lin_acc_y lin_acc_z\n"
    return write(folder / "imu.txt", head, rows(np.arange(len(m.t)), ns(m) / 1e9, m.gyr, m.acc, sep=" ", form="%.9f"))


@dialect
def realsense_convert(folder: Path, m: Motion) -> Path:
    """rs-convert's CSV: Gyro and Accel rows under a header that names only their first five columns."""
    made = ["\nStream Type,F#,HW Timestamp (ms),Backend Timestamp(ms),Host Timestamp(ms)\n"]
    for k, s in enumerate(m.t):
        at = f"{1e3 * s + 9000:.3f},{1e3 * s + EPOCH:.3f},{1e3 * s + EPOCH + 1:.3f}"
        for word, values in (("Gyro", m.gyr), ("Accel", m.acc)):
            made.append(f"{word},{k + 1},{at},{','.join(f'{v:.6f}' for v in values[k])}\n")
    return write(folder / "imu_data.csv", *made)


@dialect
def gyroflow(folder: Path, m: Motion) -> Path:
    """Gyroflow's .gcsv: scales of time, gyroscope (rad/s) and accelerometer (g) stand in the preamble."""
    head = (
        "GYROFLOW IMU LOG\nversion,1.3\nid,custom_logger\norientation,XYZ\nnote,development_test\nfwversion,FIRMWARE\n"
    )
    head += "timestamp,1683203415\nvendor,potatocam\ntscale,0.001\ngscale,0.00122173047\nascale,0.00048828125\n"
    head += "t,gx,gy,gz,ax,ay,az\n"
    gyr, acc = np.rint(m.gyr / 0.00122173047).astype(int), np.rint(m.g / 0.00048828125).astype(int)
    return write(folder / "clip.gcsv", head, rows(ms(m), gyr, acc))


@dialect
def xsens_matrix(folder: Path, m: Motion) -> Path:
    """MT Manager with a rotation matrix, velocity increments and free acceleration beside the sensors."""
    head = "// General information:\n//  MT Manager version:\t2021.4\n// Device information:\n//  DeviceId:\t03800A12\n"
    head += "// Update Rate: 100.0Hz\n"
    titles = ["PacketCounter", "SampleTimeFine", *(f"OriInc_q{i}" for i in range(4))]
    titles += [f"{word}_{a}" for word in ("VelInc", "Acc", "FreeAcc", "Gyr", "Mag") for a in "XYZ"]
    titles += [f"Mat[{i}][{j}]" for j in (1, 2, 3) for i in (1, 2, 3)]
    head += "\t".join(titles) + "\n"
    n = len(m.t)
    identity = np.tile(np.eye(3).ravel(), (n, 1))
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    text = rows(np.arange(n) + 700, np.rint(m.t * 1e4).astype(int) + 90_000, quat, m.acc / 100, m.acc, m.linear, m.gyr,
                m.mag / 48.0, identity, sep="\t")  # fmt: skip
    return write(folder / "MT_03800A12-000.txt", head, text)


@dialect
def movella_dot(folder: Path, m: Motion) -> Path:
    """The Movella DOT app's CSV: sep=, and a preamble; SampleTimeFine in µs, deg/s."""
    head = "sep=,\nDeviceTag:,Movella DOT\nFirmwareVersion:,3.0.0\nAppVersion:,2023.6.0\nSyncStatus:,Synced\n"
    head += (
        "OutputRate:,100Hz\nFilterProfile:,General\nMeasurement Mode:,Custom Mode 4\nStartTime:,2023-05-04_12-30-15\n"
    )
    head += " \n\nPacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,"
    head += names("Acc_") + "," + names("Gyr_") + "," + names("Mag_") + ",Status\n"
    n = len(m.t)
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    text = rows(
        np.arange(n) + 1, np.rint(m.t * US).astype(int) + 120_000, quat, m.acc, m.deg, m.mag / 48.0, 0 * np.arange(n)
    )
    return write(folder / "Movella DOT_1_D422CD00.csv", head, text)


@dialect
def shimmer_consensys(folder: Path, m: Motion) -> Path:
    """Shimmer's Consensys: sep=, three header rows, two accelerometers, tabs."""
    columns = ["Timestamp_Unix_CAL", *(f"Accel_LN_{a}_CAL" for a in "XYZ"), *(f"Accel_WR_{a}_CAL" for a in "XYZ"),
               *(f"Gyro_{a}_CAL" for a in "XYZ"), *(f"Mag_{a}_CAL" for a in "XYZ")]  # fmt: skip
    units = ["ms", *["m/(s^2)"] * 6, *["deg/s"] * 3, *["local_flux"] * 3]
    head = '"sep=\t"\n' + "\t".join(f"Shimmer_B6A1_{one}" for one in columns) + "\t\n" + "\t".join(units) + "\t\n"
    stamps = ns(m) / 1e6
    text = rows(stamps, m.acc, m.acc * 1.01, m.deg, m.mag / 48.0, sep="\t", form="%.5f").replace("\n", "\t\n")
    return write(folder / "Session1_Shimmer_B6A1_Calibrated_PC.csv", head, text)


@dialect
def metabase(folder: Path, m: Motion) -> Path:
    """MbientLab's MetaBase: a file per sensor, its name at the end of a long file name."""
    stamps = dates(m, "%Y-%m-%dT%H.%M.%S.%f", 3)
    for name, unit, values in (
        ("Gyroscope_100.000Hz_1.5.0", "deg/s", m.deg),
        ("Accelerometer_100.000Hz_1.5.0", "g", m.g),
    ):
        head = f"epoc (ms),timestamp (-0400),elapsed (s),x-axis ({unit}),y-axis ({unit}),z-axis ({unit})\n"
        lines = [f"{e},{w},{s:.3f},{','.join(f'{v:.3f}' for v in line)}\n" for e, w, s, line in
                 zip(ns(m) // US, stamps, m.t, values, strict=True)]  # fmt: skip
        write(folder / f"Wrist_2023-05-04T12.30.15.250_C7F2_{name}.csv", head, *lines)
    return folder


@dialect
def x_imu3(folder: Path, m: Motion) -> Path:
    """x-io's x-IMU3 Inertial.csv and Magnetometer.csv."""
    stamps = np.rint(m.t * US).astype(int) + 3_000_000
    head = "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),"
    head += "Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n"
    write(folder / "Inertial.csv", head, rows(stamps, m.deg, m.g))
    head = "Timestamp (us),Magnetometer X (a.u.),Magnetometer Y (a.u.),Magnetometer Z (a.u.)\n"
    write(folder / "Magnetometer.csv", head, rows(stamps[::5], m.mag[::5] / 48.0))
    write(folder / "Temperature.csv", "Timestamp (us),Temperature (degC)\n", rows(stamps[::50], m.t[::50] * 0 + 31.0))
    return folder


@dialect
def x_imu_packets(folder: Path, m: Motion) -> Path:
    """The old x-IMU's CalInertialAndMag.csv: a packet number and no time."""
    head = "Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),"
    head += "Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (G),Magnetometer Y (G),Magnetometer Z (G)\n"
    text = rows(np.arange(len(m.t)) * 3 + 11, m.deg, m.g, m.mag / 100.0)
    return write(folder / "LoggedData_CalInertialAndMag.csv", head, text)


@dialect
def adafruit_sensor(folder: Path, m: Motion) -> Path:
    """Adafruit's unified sensor sketches: three lines a sample in words, no time."""
    made = []
    for g, a in zip(m.gyr, m.acc, strict=True):
        made.append(f"\t\tTemperature 24.51 deg C\n\t\tAccel X: {a[0]:.4f} \tY: {a[1]:.4f} \tZ: {a[2]:.4f} m/s^2 \n")
        made.append(f"\t\tGyro X: {g[0]:.4f} \tY: {g[1]:.4f} \tZ: {g[2]:.4f} radians/s \n\n")
    return write(folder / "monitor.txt", "Adafruit LSM6DS33 test!\nLSM6DS33 Found!\n", *made)


@dialect
def sparkfun_icm20948(folder: Path, m: Motion) -> Path:
    """SparkFun's ICM-20948 example: scaled values in brackets after their unit."""
    made = []
    for g, a, b in zip(m.deg, m.g * 1e3, m.mag, strict=True):
        parts = [f"{name} [ {', '.join(f'{v:09.2f}' for v in values)} ]" for name, values in
                 (("Acc (mg)", a), ("Gyr (DPS)", g), ("Mag (uT)", b))]  # fmt: skip
        made.append(f"Scaled. {', '.join(parts)}, Tmp (C) [ 00024.51 ]\n")
    return write(folder / "serial.log", "Initialization of the sensor returned: All is well.\n", *made)


@dialect
def openlog_artemis(folder: Path, m: Motion) -> Path:
    """SparkFun's OpenLog Artemis: date and time in two columns, mg and dps without saying so, a trailing comma."""
    head = "rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,\n"
    n = len(m.t)
    text = rows(m.g * 1e3, m.deg, m.mag, np.full(n, 24.5), np.full(n, 100.0), form="%.2f").replace("\n", ",\n")
    return write(folder / "dataLog00012.TXT", head, with_words(dates(m, "%m/%d/%Y,%H:%M:%S.%f", 2), text))


@dialect
def razor_m0(folder: Path, m: Motion) -> Path:
    """SparkFun's 9DoF Razor M0: ms, g, dps, µT; no header."""
    return write(folder / "logger0.txt", rows(ms(m) + 812, m.g, m.deg, m.mag, sep=", ", form="%.4f"))


@dialect
def arduino_timestamps(folder: Path, m: Motion) -> Path:
    """The Arduino IDE's serial monitor with time stamps shown: clock -> numbers under names."""
    clock = dates(m, "%H:%M:%S.%f", 3)
    text = rows(m.g, m.deg, sep="\t", form="%.3f")
    head = f"{clock[0]} -> ax\tay\taz\tgx\tgy\tgz\n"
    return write(folder / "serial.txt", head, with_words(clock, text, " -> "))


@dialect
def putty_log(folder: Path, m: Motion) -> Path:
    """PuTTY's log: a line of ornaments, then what the board printed."""
    head = "=~=~=~=~=~=~=~=~=~=~=~= PuTTY log 2023.05.04 12:30:15 =~=~=~=~=~=~=~=~=~=~=~=\n"
    head += "MPU6050 connection successful\nms,ax,ay,az,gx,gy,gz\n"
    acc, gyr = np.rint(m.g * 16384).astype(int), np.rint(m.deg * 131).astype(int)
    return write(folder / "putty.log", head, rows(ms(m) + 2000, acc, gyr))


@dialect
def mpu6050_words(folder: Path, m: Motion) -> Path:
    """MPU6050_tockn's GetAllData: names with colons, tabs, blocks between rulers."""
    made = []
    for g, a in zip(m.deg, m.g, strict=True):
        made.append("=======================================================\ntemp : 25.300\n")
        made.append(f"accX : {a[0]:.4f}\taccY : {a[1]:.4f}\taccZ : {a[2]:.4f}\n")
        made.append(f"gyroX : {g[0]:.3f}\tgyroY : {g[1]:.3f}\tgyroZ : {g[2]:.3f}\n")
    return write(folder / "tockn.txt", *made)


@dialect
def witmotion_chinese(folder: Path, m: Motion) -> Path:
    """WitMotion's recorder in Chinese, in the code page of Chinese Windows."""
    axes = [f"{word}{a}({unit})" for word, unit in (("加速度", "g"), ("角速度", "°/s"), ("角度", "°")) for a in "XYZ"]
    head = "\t".join(["时间", "设备名称", *axes, "温度(°C)"]) + "\n"
    n = len(m.t)
    stamps = dates(m, "%Y-%m-%d %H:%M:%S.%f", 3)
    text = rows(np.full(n, "WT901"), m.g, m.deg, m.deg * 0 + 12.5, np.full(n, 31.0), sep="\t", form="%.4f")
    return write(folder / "20230504123015.txt", head, with_words(stamps, text, "\t"), encoding="gb18030")


@dialect
def witmotion_english(folder: Path, m: Motion) -> Path:
    """WitMotion's recorder in English: AsX is angular speed, HX the field; a start time above."""
    head = "StartTime: 2023-05-04 12:30:15.250\n"
    head += (
        "time\tDeviceName\tAccX(g)\tAccY(g)\tAccZ(g)\tAsX(°/s)\tAsY(°/s)\tAsZ(°/s)\tAngleX(°)\tAngleY(°)\tAngleZ(°)\t"
    )
    head += "HX(uT)\tHY(uT)\tHZ(uT)\n"
    n = len(m.t)
    text = rows(np.full(n, "WT901"), m.g, m.deg, m.deg * 0 + 12.5, m.mag, sep="\t", form="%.4f")
    return write(folder / "wit.txt", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), text, "\t"))


@dialect
def vectornav_ascii(folder: Path, m: Motion) -> Path:
    """VectorNav's $VNIMU sentences: field in gauss, m/s², rad/s; no time."""
    made = []
    for b, a, g in zip(m.mag / 100, m.acc, m.gyr, strict=True):
        made.append(f"$VNIMU,{','.join(f'{v:+08.4f}' for v in (*b, *a, *g))},+24.1,+101.325*6A\n")
    return write(folder / "vn100.txt", *made)


@dialect
def sensor_connect(folder: Path, m: Motion) -> Path:
    """MicroStrain's SensorConnect: a preamble that ends in DATA_START, names with the device before a colon."""
    head = "FILE_INFO\nVersion,1.1\nCreated,2023-05-04\n\nDEVICE_INFO\nName,3DM-CV5-10\n\nDATA_START\nTime,"
    head += ",".join(f"inertial-6253.68903:scaledAccel{a}" for a in "XYZ") + ","
    head += ",".join(f"inertial-6253.68903:scaledGyro{a}" for a in "XYZ") + "\n"
    stamps = [word + "000" for word in dates(m, "%m/%d/%Y %H:%M:%S.%f")]
    return write(folder / "SensorConnectData.csv", head, with_words(stamps, rows(m.g, m.gyr)))


@dialect
def actigraph_imu(folder: Path, m: Motion) -> Path:
    """ActiGraph GT9X Link's IMU file: ten lines, dates to 100 ns, g and deg/s without saying so."""
    head = "------------ Data Table File Created By ActiGraph Link ActiLife v6.13.3 date format M/d/yyyy ------------\n"
    head += "Serial Number: TAS1D48140206\nStart Time 12:30:15\nStart Date 5/4/2023\nEpoch Period (hh:mm:ss) 00:00:00\n"
    head += "Download Time 16:48:59\nDownload Date 5/4/2023\nCurrent Memory Address: 0\nCurrent Battery Voltage: 4.07\n"
    head += (
        "--------------------------------------------------\nTimestamp,Accelerometer X,Accelerometer Y,Accelerometer Z,"
    )
    head += "Temperature,Gyroscope X,Gyroscope Y,Gyroscope Z,Magnetometer X,Magnetometer Y,Magnetometer Z\n"
    stamps = [word + "0" for word in dates(m, "%Y-%m-%dT%H:%M:%S.%f")]
    return write(folder / "TAS1D48140206-IMU.csv", head, with_words(stamps, rows(m.g, m.t * 0 + 33.5, m.deg, m.mag)))


@dialect
def axivity_ax6(folder: Path, m: Motion) -> Path:
    """Axivity's OMGUI export of an AX6: (d/s)."""
    head = "Time,Accel-X (g), Accel-Y (g), Accel-Z (g), Gyro-X (d/s), Gyro-Y (d/s), Gyro-Z (d/s)\n"
    return write(folder / "CWA-DATA.csv", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), rows(m.g, m.deg)))


@dialect
def sensortile(folder: Path, m: Motion) -> Path:
    """ST's SensorTile: mg, mdps and mgauss in brackets."""
    head = "T [ms],A_x [mg],A_y [mg],A_z [mg],G_x [mdps],G_y [mdps],G_z [mdps],M_x [mgauss],M_y [mgauss],M_z [mgauss]\n"
    text = rows(ms(m), m.g * 1e3, m.deg * 1e3, m.mag * 10, form="%.1f")
    return write(folder / "sensortile.csv", head, text)


@dialect
def noraxon(folder: Path, m: Motion) -> Path:
    """Noraxon's MyoMotion: two sensors side by side in one table, long names."""
    head = "time"
    for place in ("Pelvis", "Foot LT"):
        head += "," + ",".join(f"Noraxon MyoMotion-Segments-{place}-Accelerometer {a} (mG)" for a in "xyz")
        head += "," + ",".join(f"Noraxon MyoMotion-Segments-{place}-Gyroscope {a} (deg/s)" for a in "xyz")
    return write(folder / "trial.csv", head, "\n", rows(m.t, m.g * 1e3, m.deg, m.g[::-1] * 1e3, m.deg[::-1]))


@dialect
def repoimu_table(folder: Path, m: Motion) -> Path:
    """A table in UTF-16, as Excel's Unicode text: full words as names, degrees with a sign."""
    head = "Time (s)\tAcceleration X (m/s²)\tAcceleration Y (m/s²)\tAcceleration Z (m/s²)\tAngular Velocity X (°/s)\t"
    head += "Angular Velocity Y (°/s)\tAngular Velocity Z (°/s)\n"
    return write(folder / "table.txt", head, rows(m.t, m.acc, m.deg, sep="\t"), encoding="utf-16")


@dialect
def unknown_names(folder: Path, m: Motion) -> Path:
    """A home-made table in a language that levelhead does not know."""
    head = "ora,kimozgas_a,kimozgas_b,kimozgas_c,forgas_a,forgas_b,forgas_c\n"
    return write(folder / "meres.csv", head, rows(m.t, m.acc, m.deg))
