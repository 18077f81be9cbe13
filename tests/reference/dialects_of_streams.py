"""Logs as boards stream them and as servers, apps and cars keep them; see dialects.py."""

from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, ns, rows, with_words, write
from tests.reference.dialects_of_loggers import const, us


@dialect
def percent_header(folder: Path, m: Motion) -> Path:
    """A BNO's stream: a header that begins with %%, rows that begin with the sensor's name; s and ms."""
    head = "%%,timestamp,elapsed,quat.w,quat.x,quat.y,quat.z,mag.x,mag.y,mag.z,gyro.x,gyro.y,gyro.z,"
    head += "accel.x,accel.y,accel.z\n"
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(m.t), 1))
    text = rows(m.t + EPOCH / 1e3, ms(m), quat, m.mag, m.gyr, m.acc, form="%.4f")
    return write(folder / "bno.txt", head, with_words(["bno"] * len(m.t), text))


@dialect
def two_timestamps_one_name(folder: Path, m: Motion) -> Path:
    """A remote laboratory's stream: Timestamp as a date and Timestamp (ms), counts of other things behind."""
    head = "Timestamp,Timestamp (ms),accel.x,accel.y,accel.z,gyro.x,gyro.y,gyro.z,strain,analog_0,analog_1,current,"
    head += "enc-disp,enc-cont,VB,VG,Temp,Status1,Status2\n"
    more = np.tile([12.0, 1.0, 2.0, 0.4, 31.0, 30.0, 4.1, 3.3, 25.0, 0.0, 1.0], (len(m.t), 1))
    text = rows(ms(m) + 20310, m.g, m.deg, more, form="%.4f")
    return write(folder / "stream.csv", head, with_words(dates(m, "%Y-%m-%d %H:%M:%S.%f"), text))


@dialect
def raw_and_corrected_by_turns(folder: Path, m: Motion) -> Path:
    """A rocket's SD card: each axis raw and corrected side by side, "Raw Ax (g),Ax (g),Raw Ay (g),Ay (g), …"."""
    parts, values = ["Time (seconds)"], [m.t + 2.5]
    for stem, unit, good in (("A", "g", m.g), ("G", "deg/s", m.deg)):
        for i, axis in enumerate("xyz"):
            parts += [f"Raw {stem}{axis} ({unit})", f"{stem}{axis} ({unit})"]
            values += [good[:, i] * 1.05 + 0.2 * (1 + 9 * (stem == "G")), good[:, i]]
    parts += ["Temperature (*C)", "Pressure (kpA)", "Altitude (m)"]
    values += [const(m, 24.0), const(m, 101.2), const(m, 12.0)]
    return write(folder / "launch.csv", ", ".join(parts), "\n", rows(*values, form="%.4f"))


@dialect
def hash_is_a_name(folder: Path, m: Motion) -> Path:
    """Two sensors on one wire: "#" is the first column's name, "device ID" says whose each row is."""
    head = (
        "#, time(ms), device ID, gX (deg/s), gY (deg/s), gZ (deg/s), aX (g), aY (g), aZ (g), pitch (deg), roll (deg)\n"
    )
    made = []
    for k in range(len(m.t)):
        for device, turn in ((0, 1), (1, -1)):
            sign = np.array([1, turn, turn])
            numbers = ", ".join(f"{v:.4f}" for v in (*m.deg[k] * sign, *m.g[k] * sign, 0.0, 0.0))
            made.append(f"{2 * k + device}, {ms(m)[k] + 900 + device}, {device}, {numbers}\n")
    return write(folder / "two.csv", head, *made)


@dialect
def date_time_and_microseconds(folder: Path, m: Motion) -> Path:
    """A data set of machines: Date, Time in whole seconds, Time (µs) since power on, a label."""
    head = "Date,Time,Time (µs),Ax (m/s²),Ay (m/s²),Az (m/s²),Gx (deg/s),Gy (deg/s),Gz (deg/s),label\n"
    text = rows(us(m), m.acc, m.deg, np.ones(len(m.t), int), form="%.4f")
    return write(folder / "drill.csv", head, with_words(dates(m, "%d/%m/%Y,%H:%M:%S"), text))


@dialect
def state_rows(folder: Path, m: Motion) -> Path:
    """A robot's serial protocol: STATE, then wheels, battery, bumpers and the sensors; no header and no time."""
    k = np.zeros(len(m.t), int)
    text = rows(const(m, 0.2), const(m, 0.21), const(m, 11.9), k, k, m.acc, m.gyr, m.mag, const(m, 31.0), form="%.4f")
    return write(folder / "robot.log", with_words(["STATE"] * len(m.t), text))


@dialect
def words_before_the_header(folder: Path, m: Motion) -> Path:
    """An Adafruit example made into CSV: sentences of the start-up, "CSV Header: timestamp,…"."""
    head = "MPU6050 Found!\nAccelerometer range set to: +-8G\nGyro range set to: +- 500 deg/s\n"
    head += (
        "Filter bandwidth set to: 21 Hz\n\nCSV Header: timestamp,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temp\n"
    )
    return write(folder / "capture.txt", head, rows(ms(m) + 1000, m.acc, m.gyr, const(m, 25.7), form="%.3f"))


@dialect
def frame_numbers(folder: Path, m: Motion) -> Path:
    """Sensors sampled at a camera's frames: frame_number, sync_timestamp in s with three decimals."""
    head = "frame_number,sync_timestamp,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n"
    text = with_words([f"{k},{s:.3f}" for k, s in enumerate(m.t)], rows(m.acc, m.gyr, form="%.5f"))
    return write(folder / "imu.csv", head, text)


@dialect
def quaternion_first_no_names(folder: Path, m: Motion) -> Path:
    """A headset's row without header: ns, quaternion, Euler angles, rates, acceleration, field."""
    quat = np.tile([0.1, 0.2, 0.3, 0.927], (len(m.t), 1)) + 0.1 * np.sin(m.t)[:, None] * [1.0, -1.0, 0.5, 0.0]
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    euler = 0.3 * np.column_stack([np.sin(m.t), np.cos(m.t), 0.5 * np.sin(0.7 * m.t)])
    return write(folder / "headset.csv", rows(ns(m), quat, euler, m.gyr, m.acc, m.mag))


@dialect
def g_as_acceleration(folder: Path, m: Motion) -> Path:
    """A car's logger: xG, yG, zG beside xGyro, yGyro, zGyro; date and time, GPS, and the car."""
    head = "Date,Time,Latitude,Longitude,Speed,Course,xG,yG,zG,xGyro,yGyro,zGyro,mag_heading,throttle_position,"
    head += "brake_pressure,steering_angle,rpm\n"
    more = np.tile([181.0, 23.0, 0.0, 3.0, 2400.0], (len(m.t), 1))
    text = rows(const(m, 51.0), const(m, -1.0), const(m, 13.0), const(m, 180.0), m.g, m.deg, more, form="%.3f")
    return write(folder / "lap.csv", head, with_words(dates(m, "%Y-%m-%d,%H:%M:%S.%f", 3), text))


@dialect
def no_time_but_position(folder: Path, m: Motion) -> Path:
    """An FPGA board's SD card: position and speed, and no time."""
    head = "Lat,Lon,Speed(km/h),Alt(m),Satellites,AccelX(g),AccelY(g),AccelZ(g),GyroX(dps),GyroY(dps),GyroZ(dps)\n"
    text = rows(
        const(m, 48.1), const(m, 11.5), const(m, 12.0), const(m, 540.0), np.full(len(m.t), 9), m.g, m.deg, form="%.4f"
    )
    return write(folder / "log.csv", head, text)


@dialect
def blanks_and_brackets(folder: Path, m: Motion) -> Path:
    """A header with blanks between names, one of which has a blank before its bracket."""
    head = "Timestamp(us) AccX(mg) AccY(mg) AccZ(mg) GyroX(dps) GyroY(dps) GyroZ (dps)\n"
    return write(folder / "DATA01.TXT", head, rows(us(m), m.g * 1000, m.deg, sep=" ", form="%.2f"))


@dialect
def tabs_without_time(folder: Path, m: Motion) -> Path:
    """A BHI385's example: tabs, units, no time."""
    head = "\t".join([f"Accel{a}(g)" for a in "XYZ"] + [f"Gyro{a}(dps)" for a in "XYZ"]) + "\n"
    return write(folder / "bhi.txt", head, rows(m.g, m.deg, sep="\t", form="%.4f"))


@dialect
def fenced_recording(folder: Path, m: Motion) -> Path:
    """A gesture recorder: lines of equals signs around the header and the rows."""
    head = "========== START_GESTURE_tap_index ==========\n"
    head += "Time(ms),AccelX(g),AccelY(g),AccelZ(g),GyroX(dps),GyroY(dps),GyroZ(dps)\n"
    text = rows(ms(m), m.g, m.deg, form="%.4f")
    return write(folder / "gesture.txt", head, text, "========== END_GESTURE_tap_index ==========\n")


@dialect
def comments_and_rates(folder: Path, m: Motion) -> Path:
    """An autopilot of a glider: comments with its settings, rates p, q, r; no time."""
    head = "#alpha:0.100000\n#beta:0.030000\n#dt:0.010000\np,q,r,ax,ay,az,vx,vy,vz,va,aoa,q1,q2,q3,q4,phi,theta\n"
    more = np.tile([12.0, 0.1, 0.2, 12.0, 0.03, 1.0, 0.0, 0.0, 0.0, 0.01, 0.02], (len(m.t), 1))
    return write(folder / "log.txt", head, rows(m.gyr, m.acc, more))


@dialect
def slashes_in_names(folder: Path, m: Motion) -> Path:
    """A force plate's IMU: units behind an underscore with their slashes; two clocks."""
    head = "unix_timestamp_microsec,time_s,ax_m/s/s,ay_m/s/s,az_m/s/s,gx_deg/s,gy_deg/s,gz_deg/s\n"
    return write(folder / "imu.csv", head, rows(ns(m) // 1000, m.t, m.acc, m.deg, form="%.5f"))


@dialect
def accel_and_gyro_txt(folder: Path, m: Motion) -> Path:
    """A camera app's Accel.txt, Gyro.txt and Motion.txt with headers, each at stamps of its own."""
    write(folder / "Accel.txt", "time_s,ax_g,ay_g,az_g\n", rows(m.t + 0.003, m.g))
    write(folder / "Gyro.txt", "time_s,gx_rad_s,gy_rad_s,gz_rad_s\n", rows(m.t, m.gyr))
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(m.t), 1))
    write(folder / "Motion.txt", "time_s,qw,qx,qy,qz\n", rows(m.t, quat))
    write(folder / "session.json", '{"device": "iPhone", "fps": 30}\n')
    return folder


@dialect
def whole_acceleration_and_gravity(folder: Path, m: Motion) -> Path:
    """A swing recorder of iOS: acceleration with gravity in it, in g with Apple's sign, and gravity beside."""
    head = "session_time_s,boot_time_s,accel_x_g,accel_y_g,accel_z_g,gyro_x_rads,gyro_y_rads,gyro_z_rads,roll_rad,"
    head += "pitch_rad,yaw_rad,gravity_x,gravity_y,gravity_z\n"
    down = -(m.acc - m.linear)
    gravity = down / np.linalg.norm(down, axis=1)[:, None]
    return write(folder / "swing.csv", head, rows(m.t, m.t + 90210.5, -m.g, m.gyr, 0 * m.gyr, gravity))


@dialect
def lengths_and_steps(folder: Path, m: Motion) -> Path:
    """A step counter: t and dt, lengths of both vectors between them, rates that were used."""
    head = "t,dt,acc_x_g,acc_y_g,acc_z_g,acc_mag_g,gyro_x_rads,gyro_y_rads,gyro_z_rads,"
    head += "gyro_mag_rads,yaw_rate_used,gyro_bias,hp,state\n"
    text = rows(m.t, const(m, 0.01), m.g, np.linalg.norm(m.g, axis=1), m.gyr, np.linalg.norm(m.gyr, axis=1),
                m.gyr[:, 2], const(m, 0.001), const(m, 0.0), np.zeros(len(m.t), int))  # fmt: skip
    return write(folder / "pdr.csv", head, text)


@dialect
def devices_by_name(folder: Path, m: Motion) -> Path:
    """Two SensorTags: their names by turns in an irregular order, pressure and humidity before the sensors."""
    head = "timestamp_ms,device,pressure,humidity,temperature,accelerationX,accelerationY,accelerationZ,"
    head += "gyroX,gyroY,gyroZ\n"
    made, order = [], np.random.default_rng(2)
    for k in range(0, len(m.t) - 1, 2):
        block = [("tag_a", 1, k), ("tag_b", -1, k), ("tag_b", -1, k + 1), ("tag_a", 1, k + 1)]
        for device, turn, row in block if order.random() < 0.5 else [block[1], block[0], block[3], block[2]]:
            sign = np.array([1, turn, turn])
            numbers = ",".join(f"{v:.4f}" for v in (*m.g[row] * sign, *m.deg[row] * sign))
            made.append(f"{ms(m)[row] + EPOCH},{device},1008.1,41.0,24.5,{numbers}\n")
    return write(folder / "sampled_data.csv", head, *made)


@dialect
def whole_seconds_iso(folder: Path, m: Motion) -> Path:
    """An iOS app whose formatter gives whole seconds: a hundred rows with one stamp; Core Motion's rotationRate."""
    head = "Timestamp,AccelerationX,AccelerationY,AccelerationZ,RotationRateX,RotationRateY,RotationRateZ\n"
    return write(folder / "motion.csv", head, with_words(dates(m, "%Y-%m-%dT%H:%M:%SZ"), rows(m.acc, m.gyr)))


@dialect
def capital_letters(folder: Path, m: Motion) -> Path:
    """A Kalman filter's test data: T,P,Q,R,Ax,Ay,Az."""
    return write(folder / "k_control.csv", "T,P,Q,R,Ax,Ay,Az\n", rows(m.t, m.gyr, m.acc))


@dialect
def clock_in_pieces(folder: Path, m: Motion) -> Path:
    """A CanSat: rotX, rotY, rotZ, and year, month, day, hour, minute and second in columns of their own."""
    head = "message;tempCanSat;pressCanSat;accX;accY;accZ;rotX;rotY;rotZ;magX;magY;magZ;"
    head += "year;month;day;hour;minute;second;numOfSats\n"
    pieces = [s.replace("-", ";") for s in dates(m, "%Y-%m-%d-%H-%M-%S")]
    text = rows(np.arange(len(m.t)), const(m, 24.0), const(m, 1008.0), m.g, m.deg, m.mag, sep=";", form="%.3f")
    made = [f"{a};{b};7\n" for a, b in zip(text.strip().split("\n"), pieces, strict=True)]
    return write(folder / "CANSAT.CSV", head, *made)


@dialect
def roughness_app(folder: Path, m: Motion) -> Path:
    """A road app: ISO stamps with Z, words for the roughness, true and false."""
    head = "timestamp,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,roughness,roughness_level,orientation,is_moving\n"
    stamps = [f"{s}Z" for s in dates(m, "%Y-%m-%dT%H:%M:%S.%f", 3)]
    text = with_words(stamps, rows(m.acc, m.gyr, const(m, 0.1), form="%.4f"))
    return write(folder / "road.csv", head, text.replace("\n", ",smooth,portrait,true\n"))


@dialect
def sentences_for_axes(folder: Path, m: Motion) -> Path:
    """An I²C library's example in C: a sentence for each axis, counts at ±2 g and ±2000 °/s."""
    made = []
    for a, g in zip(np.rint(m.g * 16384).astype(int), np.rint(m.deg * 16.4).astype(int), strict=True):
        made += [f"Acceleration in {axis}-Axis : {v} \n" for axis, v in zip("XYZ", a, strict=True)]
        made += [f"{axis}-Axis of rotation : {v} \n" for axis, v in zip("XYZ", g, strict=True)]
    return write(folder / "out.txt", *made)


@dialect
def euler_then_sensors(folder: Path, m: Motion) -> Path:
    """A serial plotter's line of words with units inside brackets: "Roll(deg):1 … Ax(g):0.1 … Gx(dps):3"."""
    made = []
    for k, a, g in zip(ms(m) + 400, m.g, m.deg, strict=True):
        parts = [f"Time(ms):{k}", "Roll(deg):1.00", "Pitch(deg):2.00", "Yaw(deg):3.00"]
        parts += [f"A{axis}(g):{v:.3f}" for axis, v in zip("xyz", a, strict=True)]
        parts += [f"G{axis}(dps):{v:.2f}" for axis, v in zip("xyz", g, strict=True)]
        made.append("\t".join(parts) + "\n")
    return write(folder / "plot.txt", *made)
