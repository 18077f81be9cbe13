"""Logs as drones, robots, cars and their tools write them, in more layouts; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, ns, rows, with_words, write

US = 1_000_000


@dialect
def plot_juggler(folder: Path, m: Motion) -> Path:
    """PlotJuggler's CSV: __time and paths with slashes, covariances between."""
    head = "__time,/imu/data/header/seq," + names("/imu/data/orientation/", "xyzw") + ","
    head += names("/imu/data/angular_velocity/", "xyz") + ","
    head += ",".join(f"/imu/data/angular_velocity_covariance[{i};{j}]" for i in range(3) for j in range(3)) + ","
    head += names("/imu/data/linear_acceleration/", "xyz") + "\n"
    n = len(m.t)
    quat = np.zeros((n, 4)) + [0.0, 0.0, 0.0, 1.0]
    text = rows(ns(m) / 1e9, np.arange(n), quat, m.gyr, np.zeros((n, 9)), m.acc)
    return write(folder / "export.csv", head, text)


@dialect
def foxglove(folder: Path, m: Motion) -> Path:
    """A topic's CSV with its stamp in two columns, seconds and nanoseconds, and no other clock."""
    head = "header.stamp.sec,header.stamp.nanosec,header.frame_id," + names("angular_velocity.", "xyz") + ","
    head += names("linear_acceleration.", "xyz") + "\n"
    stamps = ns(m)
    text = rows(stamps // 10**9, stamps % 10**9, np.full(len(m.t), "imu"), m.gyr, m.acc)
    return write(folder / "imu.csv", head, text)


@dialect
def ros_secs_nsecs(folder: Path, m: Motion) -> Path:
    """A home-made dump of a bag: secs,nsecs and letters."""
    stamps = ns(m)
    return write(folder / "bag.csv", "secs,nsecs,ax,ay,az,wx,wy,wz\n",
                 rows(stamps // 10**9, stamps % 10**9, m.acc, m.gyr))  # fmt: skip


@dialect
def ros2_echo_csv(folder: Path, m: Motion) -> Path:
    """ros2 topic echo --csv: no header, seconds and nanoseconds apart, a frame's name, covariances."""
    n = len(m.t)
    stamps, nine, quat = ns(m), np.zeros((n, 9)), np.zeros((n, 4)) + [0.0, 0.0, 0.0, 1.0]
    text = rows(stamps // 10**9, stamps % 10**9, np.full(n, "imu_link"), quat, nine, m.gyr, nine, m.acc, nine)
    return write(folder / "imu.csv", text)


def echo(m: Motion, second: str, nano: str, indent: str) -> str:
    """The YAML that ROS prints."""
    made = []
    for stamp, g, a in zip(ns(m), m.gyr, m.acc, strict=True):
        made.append(
            f"header:\n  {indent}stamp:\n    {indent}{second}: {stamp // 10**9}\n    {indent}{nano}: {stamp % 10**9}\n"
        )
        made.append(
            "  frame_id: imu_link\norientation:\n  x: 0.0\n  y: 0.0\n  z: 0.0\n  w: 1.0\norientation_covariance:\n"
        )
        made.append("- 0.0\n" * 9 if second == "sec" else "")
        made.append("angular_velocity:\n" + "".join(f"  {x}: {v:.6f}\n" for x, v in zip("xyz", g, strict=True)))
        made.append("linear_acceleration:\n" + "".join(f"  {x}: {v:.6f}\n" for x, v in zip("xyz", a, strict=True)))
        made.append("linear_acceleration_covariance: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n---\n")
    return "".join(made)


@dialect
def ros2_topic_echo(folder: Path, m: Motion) -> Path:
    """ros2 topic echo > imu.txt: YAML, a document for each message."""
    return write(folder / "imu.txt", echo(m, "sec", "nanosec", ""))


@dialect
def rostopic_echo_text(folder: Path, m: Motion) -> Path:
    """rostopic echo > imu.yaml of ROS 1: secs, nsecs."""
    return write(folder / "imu.yaml", echo(m, "secs", "nsecs", ""))


@dialect
def mavlink_highres(folder: Path, m: Motion) -> Path:
    """HIGHRES_IMU as a ground station writes it: xacc, xgyro, xmag in SI and gauss."""
    head = "time_usec,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,abs_pressure,diff_pressure,temperature\n"
    n = len(m.t)
    text = rows(np.rint(m.t * US).astype(int) + 80 * US, m.acc, m.gyr, m.mag / 100, np.full((n, 3), 24.0))
    return write(folder / "HIGHRES_IMU.csv", head, text)


@dialect
def mavlink_scaled(folder: Path, m: Motion) -> Path:
    """SCALED_IMU2: whole mg, mrad/s and mgauss by definition, ms since boot."""
    head = "time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag\n"
    text = rows(ms(m) + 80_000, *(np.rint(v).astype(int) for v in (m.g * 1e3, m.gyr * 1e3, m.mag * 10)))
    return write(folder / "SCALED_IMU2.csv", head, text)


@dialect
def mavlogdump_csv(folder: Path, m: Motion) -> Path:
    """mavlogdump --format csv --types IMU: the rows of two IMUs alternate, column I says which."""
    made = ["timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n"]
    for s, u, g, a in zip(ns(m) / 1e9, np.rint(m.t * US).astype(int) + 10**7, m.gyr, m.acc, strict=True):
        for number, off in ((0, 0.0), (1, 0.4)):
            line = ",".join(f"{v:.6f}" for v in (*(g + off), *(a + off)))
            made.append(f"{s:.6f},{u},{number},{line},0,0,45.1,1,1,1000,1000\n")
    return write(folder / "IMU.csv", *made)


@dialect
def dji_datcon(folder: Path, m: Motion) -> Path:
    """DatCon's CSV of a DJI: a unit's name before colons, two units, g and deg/s."""
    head = "Tick#,offsetTime,IMU_ATTI(0):accelX,IMU_ATTI(0):accelY,IMU_ATTI(0):accelZ,IMU_ATTI(0):gyroX,"
    head += "IMU_ATTI(0):gyroY,IMU_ATTI(0):gyroZ,IMU_ATTI(0):magX,IMU_ATTI(0):magY,IMU_ATTI(0):magZ,"
    head += "IMU_ATTI(1):accelX,IMU_ATTI(1):accelY,IMU_ATTI(1):accelZ,IMU_ATTI(1):gyroX,IMU_ATTI(1):gyroY,"
    head += "IMU_ATTI(1):gyroZ,ConvertDatV3\n"
    n = len(m.t)
    text = rows(np.rint(m.t * 4.5e6).astype(int) + 1000, m.t - 3.0, m.g, m.deg, m.mag * 20, m.g * 1.01, m.deg + 0.3,
                np.full(n, ""))  # fmt: skip
    return write(folder / "FLY042.csv", head, text)


@dialect
def race_chrono(folder: Path, m: Motion) -> Path:
    """RaceChrono's CSV v3: a preamble, then names, units and sources in three rows, empty cells."""
    head = 'This file is created using RaceChrono v7.7.1 ( http://racechrono.com/ ).\nFormat,3\nSession title,"Track"\n'
    head += "Session type,Lap timing\n\n"
    head += "timestamp,fragment_id,lap_number,elapsed_time,speed,x_acc,y_acc,z_acc,x_rate_of_rotation,"
    head += "y_rate_of_rotation,z_rate_of_rotation\nunix time,,,s,m/s,G,G,G,deg/s,deg/s,deg/s\n"
    head += ",,,,100: gps,101: acc,101: acc,101: acc,102: gyro,102: gyro,102: gyro\n"
    n = len(m.t)
    text = rows(ns(m) / 1e9, np.zeros(n, int), np.full(n, ""), m.t, np.full(n, 12.0), m.g, m.deg)
    return write(folder / "session_v3.csv", head, text)


@dialect
def aircraft_letters(folder: Path, m: Motion) -> Path:
    """An aircraft's telemetry: rates by the letters p, q, r."""
    return write(folder / "flight.csv", "time_s,ax_mps2,ay_mps2,az_mps2,p_radps,q_radps,r_radps\n",
                 rows(m.t, m.acc, m.gyr))  # fmt: skip


@dialect
def roll_rates(folder: Path, m: Motion) -> Path:
    """A car's logger: RollRate, PitchRate, YawRate beside three accelerations."""
    head = "Time (s),Accel X (g),Accel Y (g),Accel Z (g),Roll Rate (deg/s),Pitch Rate (deg/s),Yaw Rate (deg/s)\n"
    return write(folder / "lap.csv", head, rows(m.t, m.g, m.deg))


@dialect
def novatel_rawimu(folder: Path, m: Motion) -> Path:
    """KVH or NovAtel by a converter: GPS week and seconds of the week."""
    head = "GPSWeek,GPSSeconds,AccelX(m/s^2),AccelY(m/s^2),AccelZ(m/s^2),GyroX(rad/s),GyroY(rad/s),GyroZ(rad/s)\n"
    return write(folder / "rawimu.csv", head, rows(np.full(len(m.t), 2260), m.t + 390_884.27, m.acc, m.gyr))


@dialect
def px4_json(folder: Path, m: Motion) -> Path:
    """An object of lists: names to columns, as pandas writes by default: {"t": {"0": …}}."""
    columns = {"timestamp_ms": ms(m), **{f"gyro_{a}": v for a, v in zip("xyz", m.gyr.T, strict=True)},
               **{f"acc_{a}": v for a, v in zip("xyz", m.acc.T, strict=True)}}  # fmt: skip
    made = {name: {str(k): round(float(v), 6) for k, v in enumerate(column)} for name, column in columns.items()}
    return write(folder / "frame.json", json.dumps(made))


@dialect
def livox_text(folder: Path, m: Motion) -> Path:
    """A lidar's IMU: no header, seconds since 1970, rates, then force in g."""
    return write(folder / "imu.txt", rows(ns(m) / 1e9, m.gyr, m.g, sep=" ", form="%.9f"))


@dialect
def boot_clock_and_date(folder: Path, m: Motion) -> Path:
    """A robot's logger: date and clock in two columns without a common name, units in one more row."""
    head = "Date,Time,GyroX,GyroY,GyroZ,AccelX,AccelY,AccelZ\nYYYY-MM-DD,hh:mm:ss.fff,deg/s,deg/s,deg/s,g,g,g\n"
    return write(folder / "log.csv", head, with_words(dates(m, "%Y-%m-%d,%H:%M:%S.%f", 3), rows(m.deg, m.g)))


@dialect
def gps_time_ms(folder: Path, m: Motion) -> Path:
    """A ship's logger: ms of the GPS week, forces and rates with a label in front of every line."""
    made = [f"$IMU,{int(1e3 * s) + 390_884_270},{','.join(f'{v:.6f}' for v in (*a, *g))}\n" for s, a, g in
            zip(m.t, m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "ship.txt", *made)


EPOCH_SECONDS = EPOCH // 1000
