"""Layouts of instruments and apps, written from memory of their manuals before they were tried with the reader."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Array, Motion, dates, ms, ns, rows, with_words, write
from tests.reference.layouts import layout


def _us(m: Motion) -> Array:
    return np.rint(m.t * 1e6).astype(np.int64)


@layout("instruments")
def sbg_ascii(folder: Path, m: Motion) -> Path:
    """SBG's export: units in a row of their own, in brackets."""
    head = (
        "# SBG Log export\n# device: ELLIPSE-N\n\ntimestamp\tstatus\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgy"
        "roZ\ttemp\n(us)\t(na)\t(m/s^2)\t(m/s^2)\t(m/s^2)\t(deg/s)\t(deg/s)\t(deg/s)\t(degC)\n"
    )
    return write(
        folder / "imuData.txt",
        head,
        rows(_us(m) + 12000000, np.full(len(m.t), 511), m.acc, m.deg, np.full(len(m.t), 36.2), sep="\t"),
    )


@layout("instruments")
def inertial_sense(folder: Path, m: Motion) -> Path:
    """pqr[0] is the rate about the first axis."""
    head = "index,time,pqr[0],pqr[1],pqr[2],acc[0],acc[1],acc[2],status\n"
    return write(
        folder / "LOG_SN30664_DID_IMU.csv",
        head,
        rows(np.arange(len(m.t)), m.t + 381230.5, m.gyr, m.acc, np.full(len(m.t), 65535)),
    )


@layout("instruments")
def advanced_navigation(folder: Path, m: Motion) -> Path:
    """Whole seconds without a unit beside what is left of them in microseconds."""
    head = (
        "Unix Time,Microseconds,Accelerometer X (m/s/s),Accelerometer Y (m/s/s),Accelerometer Z (m/s/s),Gyros"
        "cope X (rad/s),Gyroscope Y (rad/s),Gyroscope Z (rad/s),Magnetometer X (mG),Magnetometer Y (mG),Magne"
        "tometer Z (mG),IMU Temperature (deg C),Pressure (Pa),Pressure Temperature (deg C)\n"
    )
    u = _us(m) + EPOCH * 1000
    return write(
        folder / "RawSensors.csv",
        head,
        rows(
            u // 1000000,
            u % 1000000,
            m.acc,
            m.gyr,
            10 * m.mag,
            np.full(len(m.t), 31.5),
            np.full(len(m.t), 100934.0),
            np.full(len(m.t), 31.0),
        ),
    )


@layout("instruments")
def mind_monitor(folder: Path, m: Motion) -> Path:
    """A row for a blink holds no reading and shares the stamp of a sample."""
    head = (
        "TimeStamp,Delta_TP9,Alpha_TP9,RAW_TP9,Accelerometer_X,Accelerometer_Y,Accelerometer_Z,Gyro_X,Gyro_Y,"
        "Gyro_Z,HeadBandOn,HSI_TP9,Battery,Elements\n"
    )
    words = dates(m, "%Y-%m-%d %H:%M:%S.%f", 3)
    np.full(len(m.t), 0.53)
    lines = [
        f"{w},{0.5:.6f},{0.6:.6f},{801.2:.4f},{a[0]:.6f},{a[1]:.6f},{a[2]:.6f},{g[0]:.6f},{g[1]:.6f},{g[2]:.6f},1,1.0,94.0,"
        for w, a, g in zip(words, m.g, m.deg, strict=True)
    ]
    lines.insert(200, words[200] + ",,,,,,,,,,,,,/muse/elements/blink")
    return write(folder / "mindMonitor_2023-05-04.csv", head, "\n".join(lines) + "\n")


@layout("instruments")
def myo(folder: Path, m: Motion) -> Path:
    """A file a sensor, of one time; the muscles' file is twice as long."""
    t = _us(m) + 1456704054000000
    write(folder / "gyro-1456704054.csv", "timestamp,x,y,z\n", rows(t, m.deg))
    write(folder / "accelerometer-1456704054.csv", "timestamp,x,y,z\n", rows(t, m.g))
    write(
        folder / "emg-1456704054.csv",
        "timestamp,emg1,emg2,emg3,emg4,emg5,emg6,emg7,emg8\n",
        rows(np.repeat(t, 2), np.ones((2 * len(t), 8), int)),
    )
    return folder


@layout("instruments")
def stray_scanner(folder: Path, m: Motion) -> Path:
    """alpha_x is a rate; the camera's track lies beside it."""
    write(
        folder / "odometry.csv",
        "timestamp, frame, x, y, z, qx, qy, qz, qw\n",
        rows(
            m.t[::3] + 81234.5,
            np.arange(len(m.t[::3])),
            np.zeros((len(m.t[::3]), 3)),
            np.tile([0, 0, 0, 1.0], (len(m.t[::3]), 1)),
            sep=", ",
        ),
    )
    write(
        folder / "imu.csv",
        "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n",
        rows(m.t + 81234.5, m.acc, m.gyr, sep=", "),
    )
    return folder


@layout("instruments")
def spectacular_jsonl(folder: Path, m: Motion) -> Path:
    """The kind stands inside of an object beside the values."""
    lines = []
    for t, a, g in zip(m.t, m.acc, m.gyr, strict=True):
        lines.append(
            json.dumps(
                {
                    "time": round(120.3 + t, 6),
                    "sensor": {"type": "accelerometer", "values": [round(float(v), 6) for v in a]},
                }
            )
        )
        lines.append(
            json.dumps(
                {
                    "time": round(120.3005 + t, 6),
                    "sensor": {"type": "gyroscope", "values": [round(float(v), 6) for v in g]},
                }
            )
        )
    lines.insert(31, json.dumps({"time": 121.0, "number": 0, "frames": [{"cameraInd": 0, "time": 121.0}]}))
    return write(folder / "data.jsonl", "\n".join(lines) + "\n")


@layout("instruments")
def cats_tag(folder: Path, m: Motion) -> Path:
    """(UTC) behind a time is its scale, not its unit; mrad/s."""
    head = (
        "Date (UTC),Time (UTC),Accelerometer X [m/s\u00b2],Accelerometer Y [m/s\u00b2],Accelerometer Z [m/s"
        "\u00b2],Gyroscope X [mrad/s],Gyroscope Y [mrad/s],Gyroscope Z [mrad/s],Magnetometer X [\u00b5T],Magn"
        "etometer Y [\u00b5T],Magnetometer Z [\u00b5T],Temperature (imu) [\u00b0C],Depth (100bar) [m]\n"
    )
    w = dates(m, "%d.%m.%Y,%H:%M:%S.%f", 3)
    return write(
        folder / "cats.csv",
        head,
        with_words(w, rows(m.acc, 1e3 * m.gyr, m.mag, np.full(len(m.t), 17.3), np.full(len(m.t), 3.2))),
        encoding="latin-1",
    )


@layout("instruments")
def trigno(folder: Path, m: Motion) -> Path:
    """Each column has an abscissa of its own, X[s]."""
    [("R TA: EMG 1 [V]", np.zeros(len(m.t)))]
    cols = []
    head = []
    head += ["X[s]", "R TA: EMG 1 [V]"]
    cols += [m.t, np.full(len(m.t), 1e-5)]
    for i, ax in enumerate("XYZ"):
        head += ["X[s]", f"R TA: ACC.{ax} 1 [g]"]
        cols += [m.t, m.g[:, i]]
    for i, ax in enumerate("XYZ"):
        head += ["X[s]", f"R TA: GYRO.{ax} 1 [deg/s]"]
        cols += [m.t, m.deg[:, i]]
    return write(folder / "Run_1_Rep_1.csv", ",".join(head) + "\n", rows(*cols, form="%.9f"))


@layout("instruments")
def biostamp(folder: Path, m: Motion) -> Path:
    """A file a sensor, microseconds of Unix time."""
    write(
        folder / "gyro.csv",
        "Timestamp (microseconds),Gyro X (\u00b0/s),Gyro Y (\u00b0/s),Gyro Z (\u00b0/s)\n",
        rows(_us(m) + EPOCH * 1000, m.deg),
    )
    write(
        folder / "accel.csv",
        "Timestamp (microseconds),Accel X (g),Accel Y (g),Accel Z (g)\n",
        rows(_us(m) + EPOCH * 1000, m.g),
    )
    return folder


@layout("instruments")
def nicla_ble(folder: Path, m: Motion) -> Path:
    """A stamp, and words before three counts each."""
    lines = []
    for t, a, g in zip(ms(m), m.acc, m.gyr, strict=True):
        A = np.rint(a / 9.80665 * 4096).astype(int)
        G = np.rint(np.degrees(g) * 16.384).astype(int)
        lines.append(f"{t} | accel XYZ: {A[0]}, {A[1]}, {A[2]} | gyro XYZ: {G[0]}, {G[1]}, {G[2]}")
    return write(folder / "nicla.log", "\n".join(lines) + "\n")


@layout("instruments")
def dji_dat(folder: Path, m: Motion) -> Path:
    """DatCon: ticks of 4.5 MHz beside seconds."""
    head = (
        "Tick#,offsetTime,IMU_ATTI(0):accelX,IMU_ATTI(0):accelY,IMU_ATTI(0):accelZ,IMU_ATTI(0):accelComposite"
        ",IMU_ATTI(0):gyroX,IMU_ATTI(0):gyroY,IMU_ATTI(0):gyroZ,IMU_ATTI(0):gyroComposite,IMU_ATTI(0):magX,IM"
        "U_ATTI(0):magY,IMU_ATTI(0):magZ\n"
    )
    tick = np.rint(m.t * 4.5e6).astype(np.int64) + 991234
    return write(
        folder / "FLY012.csv",
        head,
        rows(tick, m.t, m.g, np.linalg.norm(m.g, axis=1), m.deg, np.linalg.norm(m.deg, axis=1), m.mag * 10),
    )


@layout("instruments")
def racechrono(folder: Path, m: Motion) -> Path:
    """Units and the number of a sensor below the header."""
    pre = (
        'This file is created using RaceChrono v7.1.8 ( http://racechrono.com/ ).\nFormat,3\nSession title,"T'
        'rack"\nSession type,Lap timing\nCreated,04/05/2023,12:30\nNote\n\n'
    )
    head = (
        "timestamp,fragment_id,lap_number,x_acc,y_acc,z_acc,x_rate_of_rotation,y_rate_of_rotation,z_rate_of_r"
        "otation\nunix time,,,G,G,G,deg/s,deg/s,deg/s\n,,,100: acc,100: acc,100: acc,100: gyro,100: gyro,100:"
        " gyro\n"
    )
    return write(
        folder / "session.csv",
        pre,
        head,
        rows(m.t + EPOCH / 1000, np.zeros(len(m.t), int), np.ones(len(m.t), int), m.g, m.deg),
    )


@layout("instruments")
def crazyflie(folder: Path, m: Motion) -> Path:
    """The client's log blocks: g and deg/s, ms."""
    head = "Timestamp,acc.x,acc.y,acc.z,gyro.x,gyro.y,gyro.z,stateEstimate.roll\n"
    return write(folder / "cf.csv", head, rows(ms(m) + 4312, m.g, m.deg, np.zeros(len(m.t))))


@layout("instruments")
def tobii_g3(folder: Path, m: Motion) -> Path:
    """A stamp and vectors in an object called data; the field comes seldom."""
    lines = []
    for t, a, g in zip(m.t, m.acc, m.deg, strict=True):
        lines.append(
            json.dumps(
                {
                    "type": "imu",
                    "timestamp": round(float(t), 6),
                    "data": {
                        "accelerometer": [round(float(v), 4) for v in a],
                        "gyroscope": [round(float(v), 4) for v in g],
                    },
                }
            )
        )
        if len(lines) % 30 == 0:
            lines.append(
                json.dumps(
                    {
                        "type": "imu",
                        "timestamp": round(float(t) + 0.001, 6),
                        "data": {"magnetometer": [11.0, -2.0, 40.0]},
                    }
                )
            )
    return write(folder / "imudata", "\n".join(lines) + "\n").rename(folder / "imudata.jsonl")


@layout("instruments")
def joycon_counts(folder: Path, m: Motion) -> Path:
    """Counts of 4096 per g and 16.4 per deg/s."""
    lines = ["time_ms,ax,ay,az,gx,gy,gz"]
    for t, a, g in zip(ms(m), m.g, m.deg, strict=True):
        A = np.rint(a * 4096).astype(int)
        G = np.rint(g / 0.06103).astype(int)
        lines.append(f"{t},{A[0]},{A[1]},{A[2]},{G[0]},{G[1]},{G[2]}")
    return write(folder / "joycon.csv", "\n".join(lines) + "\n")


@layout("instruments")
def spanish_serial(folder: Path, m: Motion) -> Path:
    """aceleracion, giro, tiempo, each before its numbers."""
    lines = [
        f"aceleracion: {a[0]:.2f} {a[1]:.2f} {a[2]:.2f} giro: {g[0]:.2f} {g[1]:.2f} {g[2]:.2f} tiempo: {t}"
        for t, a, g in zip(ms(m), m.acc, m.deg, strict=True)
    ]
    return write(folder / "serie.txt", "\n".join(lines) + "\n")


@layout("instruments")
def pupil_invisible(folder: Path, m: Motion) -> Path:
    """Two words before each row."""
    head = (
        "section id,recording id,timestamp [ns],gyro x [deg/s],gyro y [deg/s],gyro z [deg/s],acceleration x ["
        "g],acceleration y [g],acceleration z [g],roll [deg],pitch [deg],yaw [deg],quaternion w,quaternion x,"
        "quaternion y,quaternion z\n"
    )
    w = ["a1b2,c3d4"] * len(m.t)
    return write(
        folder / "imu.csv",
        head,
        with_words(w, rows(ns(m), m.deg, m.g, np.zeros((len(m.t), 3)), np.tile([1.0, 0, 0, 0], (len(m.t), 1)))),
    )


@layout("instruments")
def robosub_yaml(folder: Path, m: Motion) -> Path:
    """A list of YAML, an object a line."""
    lines = []
    for i, (t, a, g) in enumerate(zip(m.t, m.acc, m.gyr, strict=True)):
        lines.append(
            f"- {{stamp: {1683203415.25 + t:.6f}, seq: {i}, gyro: [{g[0]:.6f}, {g[1]:.6f}, {g[2]:.6f}], "
            f"accel: [{a[0]:.6f}, {a[1]:.6f}, {a[2]:.6f}]}}"
        )
    return write(folder / "imu.yaml", "\n".join(lines) + "\n")


@layout("instruments")
def mt_manager_bare(folder: Path, m: Motion) -> Path:
    """SampleTimeFine alone, in 100 µs."""
    k = np.arange(len(m.t))
    return write(
        folder / "MT_0.txt",
        "PacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n",
        rows(k + 12, 777000 + 100 * k, m.acc, m.gyr, sep="\t"),
    )


@layout("instruments")
def shimmer_cal(folder: Path, m: Motion) -> Path:
    """Two accelerometers, units below the names."""
    n = "Shimmer_5E89_"
    cols = [
        "Timestamp_Unix_CAL",
        "Accel_LN_X_CAL",
        "Accel_LN_Y_CAL",
        "Accel_LN_Z_CAL",
        "Accel_WR_X_CAL",
        "Accel_WR_Y_CAL",
        "Accel_WR_Z_CAL",
        "Gyro_X_CAL",
        "Gyro_Y_CAL",
        "Gyro_Z_CAL",
        "Mag_X_CAL",
        "Mag_Y_CAL",
        "Mag_Z_CAL",
    ]
    un = ["ms"] + ["m/(s^2)"] * 6 + ["deg/s"] * 3 + ["local_flux"] * 3
    return write(
        folder / "s.csv",
        '"sep=\t"\n',
        "\t".join(n + c for c in cols) + "\n",
        "\t".join(un) + "\n",
        rows((ms(m) + EPOCH).astype(float), m.acc, m.acc + 0.05, m.deg, m.mag / 50, sep="\t"),
    )


@layout("instruments")
def polar_verity(folder: Path, m: Motion) -> Path:
    """A file a sensor; its own clock counts from 2000."""
    head = "Phone timestamp;sensor timestamp [ns];X [mg];Y [mg];Z [mg]\n"
    w = dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)
    write(
        folder / "Polar_Sense_ACC.txt",
        head,
        with_words(w, rows(ns(m) - 946684800 * 10**9, np.rint(1e3 * m.g).astype(int), sep=";"), ";"),
    )
    write(
        folder / "Polar_Sense_GYRO.txt",
        head.replace("mg", "dps"),
        with_words(w, rows(ns(m) - 946684800 * 10**9, m.deg, sep=";"), ";"),
    )
    return folder


@layout("instruments")
def vn_ascii(folder: Path, m: Motion) -> Path:
    """$VNIMU with a checksum, no stamp."""

    def cs(b):
        c = 0
        for ch in b:
            c ^= ord(ch)
        return f"{c:02X}"

    lines = []
    for a, g, f in zip(m.acc, m.gyr, m.mag / 100, strict=True):
        b = "VNIMU," + ",".join(f"{v:+.4f}" for v in (*f, *a, *g, 23.4, 101.3))
        lines.append(f"${b}*{cs(b)}")
    return write(folder / "vn.txt", "\n".join(lines) + "\n")


@layout("instruments")
def android_logcat(folder: Path, m: Motion) -> Path:
    """A line a sensor behind the clock of a console."""
    lines = []
    for c, a, g in zip(dates(m, "%m-%d %H:%M:%S.%f", 3), m.acc, m.gyr, strict=True):
        lines.append(f"{c}  1234  1250 D SensorTest: ACC x={a[0]:.4f} y={a[1]:.4f} z={a[2]:.4f}")
        lines.append(f"{c}  1234  1250 D SensorTest: GYRO x={g[0]:.4f} y={g[1]:.4f} z={g[2]:.4f}")
    return write(folder / "logcat.txt", "--------- beginning of main\n", "\n".join(lines) + "\n")


@layout("instruments")
def dataframe_multi(folder: Path, m: Motion) -> Path:
    """pandas' header of two levels."""
    head = ",accelerometer,accelerometer,accelerometer,gyroscope,gyroscope,gyroscope\n,x,y,z,x,y,z\ntime,,,,,,\n"
    w = dates(m, "%Y-%m-%d %H:%M:%S.%f")
    return write(folder / "mi.csv", head, with_words(w, rows(m.acc, m.gyr)))
