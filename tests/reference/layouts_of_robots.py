"""Layouts of robots, drones, simulators and databases, after headers in public code."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, ms, ns, rows, with_words, write
from tests.reference.layouts import layout


def _quat(m: Motion) -> np.ndarray:
    return np.tile([1.0, 0.0, 0.0, 0.0], (len(m.t), 1))


@layout("robots")
def recorder_of_a_node(folder: Path, m: Motion) -> Path:
    """A node's record: comments, three clocks, a norm, the gap since the message before."""
    head = "# sensor_msgs/Imu\n# frequency_hz=100\nreceive_time_ns,ros_stamp_sec,ros_stamp_nanosec,"
    head += "quaternion_w,quaternion_x,quaternion_y,quaternion_z,quaternion_norm,"
    head += "angular_velocity_x,angular_velocity_y,angular_velocity_z,"
    head += "linear_acceleration_x,linear_acceleration_y,linear_acceleration_z,arrival_gap_ms\n"
    jitter = np.random.default_rng(3).integers(0, 3_000_000, len(m.t))
    text = rows(
        ns(m) + jitter,
        ns(m) // 10**9,
        ns(m) % 10**9,
        _quat(m),
        np.ones(len(m.t)),
        m.gyr,
        m.acc,
        np.full(len(m.t), 10.0),
    )
    return write(folder / "imu.csv", head, text)


@layout("robots")
def received_and_sent(folder: Path, m: Motion) -> Path:
    """recv_time,msg_time,orientation_x,…"""
    head = "recv_time,msg_time,orientation_x,orientation_y,orientation_z,orientation_w,angular_velocity_x,"
    head += "angular_velocity_y,angular_velocity_z,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z\n"
    jitter = np.random.default_rng(4).uniform(0, 4e-3, len(m.t))
    text = rows(m.t + EPOCH / 1e3 + 0.02 + jitter, m.t + EPOCH / 1e3, _quat(m)[:, ::-1], m.gyr, m.acc)
    return write(folder / "imu.csv", head, text)


@layout("robots")
def plotjuggler(folder: Path, m: Motion) -> Path:
    """PlotJuggler's export: __time and paths of fields, alphabetically."""
    stems = [(f"/imu/data/{q}/{a}", v[:, i]) for q, v in (("angular_velocity", m.gyr), ("linear_acceleration", m.acc))
             for i, a in enumerate("xyz")]  # fmt: skip
    head = ",".join(["__time", *(name for name, _ in stems), "/imu/data/header/stamp"]) + "\n"
    t = m.t + EPOCH / 1e3
    return write(folder / "plot.csv", head, rows(t + 0.001, *(v for _, v in stems), t))


@layout("robots")
def pandas_of_a_bag(folder: Path, m: Motion) -> Path:
    """A bag through pandas: stamps apart, covariances as lists in quotes."""
    head = "Time,header.stamp.sec,header.stamp.nanosec,header.frame_id,orientation.x,orientation.y,orientation.z,"
    head += "orientation.w,orientation_covariance,angular_velocity.x,angular_velocity.y,angular_velocity.z,"
    head += "angular_velocity_covariance,linear_acceleration.x,linear_acceleration.y,linear_acceleration.z\n"
    made = [f'{n / 1e9:.6f},{n // 10**9},{n % 10**9},imu_link,0,0,0,1,"[0. 0. 0.\n 0. 0. 0.\n 0. 0. 0.]",'
            f'{g[0]:.6f},{g[1]:.6f},{g[2]:.6f},"[0. 0. 0.\n 0. 0. 0.\n 0. 0. 0.]",{a[0]:.5f},{a[1]:.5f},{a[2]:.5f}'
            for n, g, a in zip(ns(m).tolist(), m.gyr, m.acc, strict=True)]  # fmt: skip
    return write(folder / "bag.csv", head, "\n".join(made))


@layout("robots")
def ulog2csv_sensor_combined(folder: Path, m: Motion) -> Path:
    """ulog2csv of sensor_combined."""
    head = "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,"
    head += "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt,"
    head += "accelerometer_clipping,gyro_clipping,accel_calibration_count,gyro_calibration_count\n"
    k = np.zeros(len(m.t), int)
    text = rows(np.rint(m.t * 1e6).astype(int) + 3_512_000, m.gyr, k + 10000, k, m.acc, k + 10000, k, k, k, k)
    return write(folder / "log_sensor_combined_0.csv", head, text)


@layout("robots")
def ulog2csv_vehicle_imu(folder: Path, m: Motion) -> Path:
    """ulog2csv of vehicle_imu: angles and velocities gained in delta_angle_dt µs."""
    head = "timestamp,timestamp_sample,accel_device_id,gyro_device_id,delta_angle[0],delta_angle[1],delta_angle[2],"
    head += "delta_velocity[0],delta_velocity[1],delta_velocity[2],delta_angle_dt,delta_velocity_dt\n"
    k, t = np.zeros(len(m.t), int), np.rint(m.t * 1e6).astype(int) + 3_512_000
    text = rows(t + 200, t, k + 1310988, k + 1310988, m.gyr * 0.01, m.acc * 0.01, k + 10000, k + 10000, form="%.9f")
    return write(folder / "log_vehicle_imu_0.csv", head, text)


@layout("robots")
def mav_explorer(folder: Path, m: Motion) -> Path:
    """MAVExplorer's CSV: a Unix time, IMU.GyrX."""
    head = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n"
    k = np.zeros(len(m.t), int)
    more = np.tile([0, 0, 42.1, 1, 1, 100, 100], (len(m.t), 1))
    text = rows(m.t + EPOCH / 1e3, np.rint(m.t * 1e6).astype(int) + 10**7, k, m.gyr, m.acc, more)
    return write(folder / "IMU.csv", head, text)


@layout("robots")
def raw_imu_of_mavlink(folder: Path, m: Motion) -> Path:
    """SCALED_IMU2 through pymavlink: mg, mrad/s, mG, whole."""
    head = "timestamp,mavpackettype,time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,temperature\n"
    whole = np.rint(np.hstack([1e3 * m.g, 1e3 * m.gyr, 10 * m.mag])).astype(int)
    text = with_words(["SCALED_IMU2"] * len(m.t), rows(ms(m) + 9000, whole, np.full(len(m.t), 4210)))
    return write(folder / "mav.csv", head, with_words([f"{t:.3f}" for t in m.t + EPOCH / 1e3], text))


@layout("robots", fusable=False)
def ground_station(folder: Path, m: Motion) -> Path:
    """QGroundControl's CSV: angles and their rates, no accelerometer."""
    head = "Timestamp,roll,pitch,heading,rollRate,pitchRate,yawRate,groundSpeed,airSpeed,climbRate,altitudeRelative\n"
    more = np.tile([1.0, 0.0, 0.1, 3.0], (len(m.t), 1))
    text = rows(np.degrees(np.cumsum(m.gyr, axis=0) * 0.01), m.deg, more, form="%.3f")
    return write(folder / "vehicle1.csv", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f", 3), text))


@layout("robots")
def blackbox_with_units(folder: Path, m: Motion) -> Path:
    """blackbox_decode --unit-rotation deg/s --unit-acceleration g."""
    head = "loopIteration, time (us), axisP[0], axisP[1], axisP[2], gyroADC[0] (deg/s), gyroADC[1] (deg/s), "
    head += "gyroADC[2] (deg/s), accSmooth[0] (g), accSmooth[1] (g), accSmooth[2] (g), motor[0], motor[1]\n"
    k = np.arange(len(m.t))
    pid = np.tile([3, -2, 1], (len(m.t), 1))
    text = rows(
        k * 4,
        np.rint(m.t * 1e6).astype(int) + 71_000_000,
        pid,
        m.deg,
        m.g,
        k * 0 + 300,
        k * 0 + 310,
        sep=", ",
        form="%.3f",
    )
    return write(folder / "LOG00007.01.csv", head, text)


@layout("robots")
def crazyflie_console(folder: Path, m: Motion) -> Path:
    """cfclient's log: ms, acc.x in g, gyro.x in deg/s, stateEstimate beside."""
    head = "Timestamp,acc.x,acc.y,acc.z,gyro.x,gyro.y,gyro.z,stateEstimate.roll,stateEstimate.pitch,stateEstimate.ax\n"
    more = np.tile([1.0, 2.0, 0.01], (len(m.t), 1))
    return write(folder / "20230504T12.csv", head, rows(ms(m) + 61234, m.g, m.deg, more, form="%.5f"))


@layout("robots")
def vectornav_control_center(folder: Path, m: Motion) -> Path:
    """VectorNav's CSV: nanoseconds since start, Uncompensated beside compensated."""
    head = "TimeStartup,UncompAccelX,UncompAccelY,UncompAccelZ,UncompGyroX,UncompGyroY,UncompGyroZ,"
    head += "AccelX,AccelY,AccelZ,AngularRateX,AngularRateY,AngularRateZ,MagX,MagY,MagZ,Temperature,Pressure\n"
    t = np.rint(m.t * 1e9).astype(np.int64) + 5_000_000_000
    text = rows(t, m.acc * 1.02, m.gyr + 0.03, m.acc, m.gyr, m.mag / 100.0, np.tile([31.0, 101.3], (len(m.t), 1)))
    return write(folder / "vn.csv", head, text)


@layout("robots")
def sensor_connect(folder: Path, m: Motion) -> Path:
    """SensorConnect: FILE_INFO, then DATA_START, names with a model's number."""
    head = "FILE_INFO\nTIME_FORMAT,UTC\nDELIM,COMMA\nSAMPLE_RATE;100;hertz\nDATA_START\n"
    head += "Time,6284.12345:scaledAccelX,6284.12345:scaledAccelY,6284.12345:scaledAccelZ,"
    head += "6284.12345:scaledGyroX,6284.12345:scaledGyroY,6284.12345:scaledGyroZ\n"
    stamps = dates(m, "%m/%d/%Y %H:%M:%S.%f")
    return write(folder / "node.csv", head, with_words(stamps, rows(m.g, m.gyr)))


@layout("robots")
def dot_with_two_clocks(folder: Path, m: Motion) -> Path:
    """A DOT through an app: SampleTimeFine in µs, elapsed_ms, UTC; Euler before the sensors."""
    head = "PacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,Acc_X,Acc_Y,Acc_Z,"
    head += "Gyr_X,Gyr_Y,Gyr_Z,elapsed_ms,utc_timestamp\n"
    text = rows(
        np.arange(len(m.t)) + 1,
        np.rint(m.t * 1e6).astype(int) + 4_123_000,
        m.deg * 0.1,
        m.acc,
        m.deg,
        ms(m),
        form="%.5f",
    )
    lines = zip(text.strip().split("\n"), dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3), strict=True)
    return write(folder / "dot.csv", head, "\n".join(f"{a},{b}Z" for a, b in lines))


@layout("robots")
def flux_pivot(folder: Path, m: Motion) -> Path:
    """InfluxDB's annotated CSV, pivoted: four rows of annotations, result,table,_time."""
    head = "#datatype,string,long,dateTime:RFC3339,double,double,double,double,double,double\n"
    head += "#group,false,false,false,false,false,false,false,false,false\n#default,_result,,,,,,,,\n"
    head += ",result,table,_time,ax,ay,az,gx,gy,gz\n"
    lines = with_words(dates(m, ",,0,%Y-%m-%dT%H:%M:%S.%fZ"), rows(m.acc, m.gyr))
    return write(folder / "query.csv", head, lines)


@layout("robots")
def sqlite_list(folder: Path, m: Motion) -> Path:
    """sqlite3's output with .headers on: bars."""
    head = "id|ts|acc_x|acc_y|acc_z|gyro_x|gyro_y|gyro_z\n"
    return write(folder / "imu.txt", head, rows(np.arange(len(m.t)) + 1, m.t + EPOCH / 1e3, m.acc, m.gyr, sep="|"))


@layout("robots")
def unnamed_index(folder: Path, m: Motion) -> Path:
    """pandas' to_csv: an index without a name, Timestamp in whole ms."""
    head = ",Timestamp,Accel_X,Accel_Y,Accel_Z,Gyro_X,Gyro_Y,Gyro_Z\n"
    return write(folder / "frame.csv", head, rows(np.arange(len(m.t)), ms(m) + EPOCH, m.g, m.deg, form="%.5f"))


@layout("robots")
def gazebo_echo(folder: Path, m: Motion) -> Path:
    """gz topic -e: text of protobuf."""
    made = []
    for n, g, a in zip(ns(m).tolist(), m.gyr, m.acc, strict=True):
        made.append(f"header {{\n  stamp {{\n    sec: {n // 10**9}\n    nsec: {n % 10**9}\n  }}\n}}\n")
        for name, v in (("angular_velocity", g), ("linear_acceleration", a)):
            made.append(f"{name} {{\n  x: {v[0]:.6f}\n  y: {v[1]:.6f}\n  z: {v[2]:.6f}\n}}\n")
        made.append("\n")
    return write(folder / "gz.txt", *made)


@layout("robots")
def open_vins_debug(folder: Path, m: Motion) -> Path:
    """# timestamp,acc_x,…,gyro_z,qw,qx,qy,qz,mag_x,… in a comment."""
    head = "# timestamp,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,qw,qx,qy,qz,mag_x,mag_y,mag_z\n"
    return write(folder / "imu_data.txt", head, rows(m.t + EPOCH / 1e3, m.acc, m.gyr, _quat(m), m.mag))


@layout("robots")
def carla(folder: Path, m: Motion) -> Path:
    """CARLA: frame, seconds, accelerometer, gyroscope, a scalar compass."""
    head = (
        "frame,timestamp,accelerometer_x,accelerometer_y,accelerometer_z,gyroscope_x,gyroscope_y,gyroscope_z,compass\n"
    )
    return write(folder / "imu.csv", head, rows(np.arange(len(m.t)) + 312, m.t + 15.6, m.acc, m.gyr, m.t * 0 + 1.57))


@layout("robots")
def kitti_in_one_table(folder: Path, m: Motion) -> Path:
    """oxts in one file: ax, ay, az of the body and af, al, au of the vehicle, wx, wf likewise."""
    head = "timestamp lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu\n"
    place = np.tile([49.0, 8.4, 116.0, 0.01, 0.02, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0], (len(m.t), 1))
    return write(folder / "oxts.txt", head, rows(m.t + EPOCH / 1e3, place, m.acc, m.acc, m.gyr, m.gyr, sep=" "))


@layout("robots")
def mongo_export(folder: Path, m: Motion) -> Path:
    """mongoexport: a line for each document, $date and $numberDouble."""
    made = [json.dumps({"_id": {"$oid": f"{k:024x}"}, "ts": {"$date": one + "Z"},
                        "accel": dict(zip("xyz", a, strict=True)),
                        "gyro": dict(zip("xyz", g, strict=True))})
            for k, (one, a, g) in enumerate(zip(dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3), m.acc.round(5).tolist(),
                                                m.gyr.round(5).tolist(), strict=True))]  # fmt: skip
    return write(folder / "imu.json", "\n".join(made))


@layout("robots")
def cloud_payload(folder: Path, m: Motion) -> Path:
    """A cloud's messages: {"deviceId":…,"payload":{"ts":…,"acc":[…],"gyr":[…]}}"""
    made = [
        json.dumps({"deviceId": "a1", "topic": "imu/raw", "payload": {"ts": int(t), "acc": a, "gyr": g}})
        for t, a, g in zip(ms(m) + EPOCH, m.acc.round(4).tolist(), m.gyr.round(4).tolist(), strict=True)
    ]
    return write(folder / "cloud.ndjson", "\n".join(made))


@layout("robots")
def wheels_before_the_imu(folder: Path, m: Motion) -> Path:
    """A balancing robot: pitch_rate, roll_rate, yaw_rate and acc_x, wheels before them."""
    head = "time_s,left_angle,left_velocity,right_angle,right_velocity,pitch,roll,yaw,"
    head += "roll_rate,pitch_rate,yaw_rate,acc_x,acc_y,acc_z\n"
    wheels = np.column_stack([np.cumsum(m.gyr[:, 0]) * 0.01, m.gyr[:, 0], np.cumsum(m.gyr[:, 1]) * 0.01, m.gyr[:, 1]])
    angles = np.cumsum(m.gyr, axis=0) * 0.01
    return write(folder / "balance.csv", head, rows(m.t, wheels, angles, m.gyr, m.acc))
