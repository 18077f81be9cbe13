"""Logs as student projects, laboratories and simulators write them; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, dialect, ms, names, ns, rows, with_words, write
from tests.reference.dialects_of_loggers import const, us

Array = np.ndarray


def triple(values: Array, form: str = "%.4f", sep: str = ",") -> str:
    """Three numbers as text."""
    return sep.join(form % v for v in values)


@dialect
def colons_and_semicolons(folder: Path, m: Motion) -> Path:
    """A wireless IMU: ACC:x,y,z;GYRO:x,y,z;MAG:x,y,z."""
    made = [f"ACC:{triple(a)};GYRO:{triple(g)};MAG:{triple(b)}\n" for a, g, b in zip(m.acc, m.gyr, m.mag, strict=True)]
    return write(folder / "udp.txt", *made)


@dialect
def a_line_for_each_sensor(folder: Path, m: Motion) -> Path:
    """A microcontroller's console: acc:x,y,z and gyro:x,y,z and mag:x,y,z on lines of their own."""
    made = []
    for a, g, b in zip(m.g, m.deg, m.mag, strict=True):
        made.append(f"acc:{triple(a, '%f')}\ngyro:{triple(g, '%f')}\nmag:{triple(b, '%f')}\n")
    return write(folder / "console.log", *made)


@dialect
def esp_log_units_in_names(folder: Path, m: Motion) -> Path:
    """ESP-IDF: "I (1234) IMU: acc[g] … gyro[dps] …"."""
    made = [
        f"I ({k}) IMU: acc[g] {triple(a, '%7.3f', ' ')}  gyro[dps] {triple(g, '%8.2f', ' ')}\n"
        for k, a, g in zip(ms(m) + 3210, m.g, m.deg, strict=True)
    ]
    return write(folder / "monitor.txt", *made)


@dialect
def brackets_and_bars(folder: Path, m: Motion) -> Path:
    """A glove: "t= 12 ms | a=[x, y, z] g | g=[x, y, z] °/s | m=[x, y, z] µT"."""
    made = []
    for k, a, g, b in zip(ms(m) + 120, m.g, m.deg, m.mag, strict=True):
        made.append(f"t= {k} ms | a=[{triple(a, '%.3f', ', ')}] g | g=[{triple(g, '%.2f', ', ')}] °/s | ")
        made.append(f"m=[{triple(b, '%.2f', ', ')}] µT\n")
    return write(folder / "glove.log", *made)


@dialect
def bars_between_sensors(folder: Path, m: Motion) -> Path:
    """An Arduino: "Mag x:1 y:2 z:3 | Gyro x:… | Acc x:…"."""
    made = []
    for a, g, b in zip(m.acc, m.gyr, m.mag, strict=True):
        parts = [f"{word} " + " ".join(f"{axis}:{v:.3f}" for axis, v in zip("xyz", one, strict=True))
                 for word, one in (("Mag", b), ("Gyro", g), ("Acc", a))]  # fmt: skip
        made.append(" | ".join(parts) + "\n")
    return write(folder / "serial.txt", *made)


@dialect
def text_book_recording(folder: Path, m: Motion) -> Path:
    """A text book's files: no header; time, stillness, gyroscope, accelerometer, quaternion, magnetometer."""
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (len(m.t), 1))
    return write(folder / "rec1.txt", rows(m.t, const(m, 0.97), m.deg, m.g, quat, m.mag / 100.0, form="%.4f"))


@dialect
def increments(folder: Path, m: Motion) -> Path:
    """A navigation course's .dat: index, time, increments of angle and velocity, temperature, status; no header."""
    step = 0.01
    k = np.arange(len(m.t))
    text = rows(k, m.t, m.gyr * step, m.acc * step, const(m, 25.0), np.zeros(len(k), int), sep=" ", form="%.9f")
    return write(folder / "IMU_X001.dat", text)


@dialect
def quoted_everything(folder: Path, m: Motion) -> Path:
    """A Java CSVWriter: all cells quoted; gravity and linear beside; letters large and small."""
    head = '"Timestamp","Accel_x","Accel_y","Accel_z","GRAVITY_x","GRAVITY_y","GRAVITY_z","LINEAR_ACC_x",'
    head += '"LINEAR_ACC_y","LINEAR_ACC_z","AUV","Gyro_x","GYRO_y","GYRO_z","Mag_x","Mag_y","Mag_z",'
    head += '"Ligt intensity","Compass","Label","StepMark"\n'
    text = rows(ms(m) + EPOCH, m.acc, m.acc - m.linear, m.linear, np.linalg.norm(m.acc, axis=1), m.gyr, m.mag,
                const(m, 120.0), const(m, 211.0), np.full(len(m.t), "walk"), np.zeros(len(m.t), int))  # fmt: skip
    quoted = "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in text.strip().split("\n"))
    return write(folder / "recording.csv", head, quoted, "\n")


@dialect
def exercise_rows(folder: Path, m: Motion) -> Path:
    """A fitness project: user, exercise and repetition before "t (sec)"."""
    head = "User,exerciseType,rep_count,t (sec),acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,magnet_x,magnet_y,magnet_z\n"
    text = rows(np.full(len(m.t), 10), m.t, m.g, m.deg, m.mag, form="%.4f")
    return write(folder / "squats.csv", head, with_words(["ann,squat"] * len(m.t), text))


@dialect
def delta_time_only(folder: Path, m: Motion) -> Path:
    """A neural network's training data: the time since the row before in ms, and no clock."""
    steps = np.rint(np.diff(m.t, prepend=-0.01) * 1000).astype(int)
    return write(folder / "train.csv", "deltaTime,Acc_X,Acc_Y,Acc_Z,Gyro_X,Gyro_Y,Gyro_Z\n", rows(steps, m.g, m.deg))


@dialect
def dump_of_a_flight_log(folder: Path, m: Motion) -> Path:
    """A helicopter's dump over serial: a word before each line, semicolons at the ends, angles in between."""
    head = "logHead;Time;Roll;Pitch;Yaw;DriftX;DriftY;DriftZ;Heading;AccX;AccY;AccZ;GyroX;GyroY;GyroZ;rwPWM;lwPWM;\n"
    made = []
    for k, a, g in zip(ms(m) + 7000, m.g, m.deg, strict=True):
        made.append(f"logEntry;{k};1.00;2.00;3.00;0.00;0.00;0.00;181.00;{triple(a, '%.3f', ';')};")
        made.append(f"{triple(g, '%.3f', ';')};1500;1500;\n")
    return write(folder / "log12.txt", head, *made)


@dialect
def names_left_blank(folder: Path, m: Motion) -> Path:
    """A flight controller's SD card: two columns without a name behind Lat and Lon, time of day in centiseconds."""
    head = (
        "Time;GPS Lock;Lat;;Lon;;Alt;Speed;Track angle;HDOP;GG;AccX;AccY;AccZ;GyroX;GyroY;GyroZ;MagX;MagY;MagZ;Baro\r\n"
    )
    made = []
    for k, s in enumerate(dates(m, "%H:%M:%S.%f", 2)):
        numbers = ";".join(f"{v:.4f}" for v in (*m.g[k], *m.deg[k], *m.mag[k]))
        made.append(f"{s};3;5152.12;N;00413.2;E;12.3;0.2;181.0;1.1;0;{numbers};1013.2\r\n")
    return write(folder / "LOG003.CSV", head, *made)


@dialect
def androsensor_of_cars(folder: Path, m: Motion) -> Path:
    """A vehicle data set made with AndroSensor: gravity beside, garbled signs of degree and micro, date at the end."""
    head = "GPS LATITUDE (degrees), GPS LONGITUDE (degrees), GPS ALTITUDE (m), GPS SPEED (Kmh), GPS ORIENTATION (Â°), "
    head += "TIME SINCE START (ms), DATE (YYYY-MO-DD HH-MI-SS_SSS), ACCELEROMETER X (m/sÂ²), ACCELEROMETER Y (m/sÂ²), "
    head += "ACCELEROMETER Z (m/sÂ²), GRAVITY X (m/sÂ²), GRAVITY Y (m/sÂ²), GRAVITY Z (m/sÂ²), GYROSCOPE X (rad/s), "
    head += "GYROSCOPE Y (rad/s), GYROSCOPE Z (rad/s), MAGNETIC FIELD X (Î¼T), MAGNETIC FIELD Y (Î¼T), "
    head += "MAGNETIC FIELD Z (Î¼T), ORIENTATION X (Â°)\n"
    made = []
    stamps = [s[:23].replace(":", "-").replace(".", "_") for s in dates(m, "%Y-%m-%d %H:%M:%S.%f")]
    for k, stamp in enumerate(stamps):
        numbers = ", ".join(f"{v:.5f}" for v in (*m.acc[k], *(m.acc - m.linear)[k], *m.gyr[k], *m.mag[k]))
        made.append(f"52.4, -1.5, 90.0, 31.0, 12.0, {ms(m)[k]}, {stamp}, {numbers}, 11.0\n")
    return write(folder / "S1.csv", head, *made)


@dialect
def two_units_raw_and_physical(folder: Path, m: Motion) -> Path:
    """A board with two IMUs: counts and physical numbers of both, the second one turned about x."""
    parts, values = ["timestamp_us"], [us(m)]
    for i, turn in ((1, 1), (2, -1)):
        sign = np.array([1, turn, turn])
        parts += [f"imu{i}_gyro_{a}_raw" for a in "xyz"] + [f"imu{i}_accel_{a}_raw" for a in "xyz"]
        parts += [f"imu{i}_gyro_{a}_dps" for a in "xyz"] + [f"imu{i}_accel_{a}_g" for a in "xyz"]
        values += [
            np.rint(m.deg * sign * 16.4).astype(int),
            np.rint(m.g * sign * 2048).astype(int),
            m.deg * sign,
            m.g * sign,
        ]
    return write(folder / "dual.csv", ",".join(parts), "\n", rows(*values))


@dialect
def simulator_with_truth(folder: Path, m: Motion) -> Path:
    """A drone's simulator: accel and angvel of the body in the world beside imu_accel and imu_gyro."""
    head = "t,pos_x,pos_y,pos_z,vel_x,vel_y,vel_z,accel_x,accel_y,accel_z,att_w,att_x,att_y,att_z,roll,pitch,yaw,"
    head += (
        "angvel_x,angvel_y,angvel_z,imu_accel_x,imu_accel_y,imu_accel_z,imu_gyro_x,imu_gyro_y,imu_gyro_z,imu_valid\n"
    )
    zero = 0 * m.gyr
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(m.t), 1))
    text = rows(m.t, zero, zero, m.linear[:, ::-1], quat, zero, m.gyr, m.acc, m.gyr, np.ones(len(m.t), int))
    return write(folder / "flight.csv", head, text)


@dialect
def fibre_gyroscope(folder: Path, m: Motion) -> Path:
    """A fibre-optic gyroscope's bench: three temperatures Tx, Ty, Tz behind the sensors, angles behind those."""
    head = "time,wx,wy,wz,ax,ay,az,Tx,Ty,Tz,Pitch,Roll,Yaw\n"
    warm = np.tile([38.2, 38.1, 38.3], (len(m.t), 1))
    return write(folder / "XLM550.txt", head, rows(m.t + 4.0, m.deg, m.g, warm, 0 * m.gyr, form="%.5f"))


@dialect
def merged_phyphox(folder: Path, m: Motion) -> Path:
    """phyphox merged with pandas: an index without name, Location columns half empty, a linear accelerometer first."""
    head = ",time (s),Location_Latitude (°),Location_Velocity (m/s),"
    head += names("Linear Accelerometer_", end=" (m/s^2)") + "," + names("Accelerometer_", end=" (m/s^2)") + ","
    head += names("Gyroscope_", end=" (rad/s)") + ",label\n"
    made = []
    for k in range(len(m.t)):
        place = "52.3,1.2" if k % 100 == 0 else ","
        numbers = ",".join(f"{v:.6f}" for v in (*m.linear[k], *m.acc[k], *m.gyr[k]))
        made.append(f"{k},{m.t[k]:.6f},{place},{numbers},bike\n")
    return write(folder / "bike.csv", head, *made)


@dialect
def posted_json(folder: Path, m: Motion) -> Path:
    """What a device posts to a web service: a list in "sensor_data", epoch ms."""
    made = []
    for k, stamp in enumerate(ms(m) + EPOCH):
        made.append({"device_id": "ESP32_001", "timestamp": int(stamp),
                     "accelerometer": dict(zip("xyz", m.acc[k].round(4).tolist(), strict=True)),
                     "gyroscope": dict(zip("xyz", m.gyr[k].round(5).tolist(), strict=True))})  # fmt: skip
    return write(folder / "post.json", json.dumps({"sensor_data": made}))


@dialect
def gait_test_json(folder: Path, m: Motion) -> Path:
    """A gait test: results of tests, each with the samples of two ankles by turns."""
    made = []
    for k, stamp in enumerate(ms(m) + EPOCH):
        for side, turn in (("LEFT-ANKLE", 1), ("RIGHT-ANKLE", -1)):
            acc, gyr = m.acc[k] * [1, turn, turn], m.gyr[k] * [1, turn, turn]
            made.append({"deviceId": side, "timestamp": int(stamp),
                         "accelerometer": dict(zip("xyz", acc.round(4).tolist(), strict=True)),
                         "gyroscope": dict(zip("xyz", gyr.round(5).tolist(), strict=True))})  # fmt: skip
    return write(
        folder / "dgi.json", json.dumps({"patient": "p1", "dgiResults": [{"subtest": "gait", "imuData": made}]})
    )


@dialect
def matlab_of_a_quadrotor(folder: Path, m: Motion) -> Path:
    """A quadrotor's .mat: tImu, gyro, accel and times and positions of another system."""
    from scipy.io import savemat

    other = m.t[::4]
    savemat(folder / "imu.mat", {"tImu": m.t[:, None] + 1.6e9, "gyro": m.gyr, "accel": m.acc, "tVicon": other[:, None],
                                 "pos": np.zeros((len(other), 3))})  # fmt: skip
    return folder / "imu.mat"


@dialect
def matlab_two_clocks(folder: Path, m: Motion) -> Path:
    """Another .mat: acc and gyro as 3 × n, each with times of its own, accT and gyroT."""
    from scipy.io import savemat

    savemat(folder / "IMU.mat", {"acc": m.acc.T, "accT": m.t[None, :] + 0.002, "gyro": m.gyr.T, "gyroT": m.t[None, :]})
    return folder / "IMU.mat"


@dialect
def matlab_one_matrix(folder: Path, m: Motion) -> Path:
    """One matrix IMU of seven columns: time, rates, acceleration."""
    from scipy.io import savemat

    savemat(folder / "IMU.mat", {"IMU": np.column_stack([m.t, m.gyr, m.acc])})
    return folder / "IMU.mat"


@dialect
def matlab_shimmer(folder: Path, m: Motion) -> Path:
    """Consensys' .mat: one variable for each column, with the device before its name."""
    from scipy.io import savemat

    made: dict[str, Array] = {"Number3_Timestamp_Unix_CAL": (m.t * 1000.0 + EPOCH)[:, None]}
    for stem, values in (("Accel_LN", m.acc), ("Accel_WR", m.acc + 0.05), ("Gyro", m.deg), ("Mag", m.mag / 50.0)):
        made |= {f"Number3_{stem}_{axis}_CAL": values[:, i : i + 1] for i, axis in enumerate("XYZ")}
    savemat(folder / "Session1_Number3_Calibrated_SD.mat", made)
    return folder / "Session1_Number3_Calibrated_SD.mat"


@dialect
def data_and_times_apart(folder: Path, m: Motion) -> Path:
    """A radar data set: imu_data.txt without header, and timestamps.txt beside it."""
    write(folder / "imu_data.txt", rows(m.acc, m.gyr, sep=" "))
    write(folder / "timestamps.txt", rows(m.t + EPOCH / 1e3, form="%.6f"))
    return folder


@dialect
def two_delimiters(folder: Path, m: Motion) -> Path:
    """Sensors parted by semicolons, axes by commas; counts, no names, no time: "12,34,56 ;1,2,3 ;…"."""
    acc, gyr = np.rint(m.g * 16384).astype(int), np.rint(np.clip(m.deg, -250, 250) * 131).astype(int)
    made = [f"{a[0]}, {a[1]}, {a[2]};{g[0]}, {g[1]}, {g[2]}\n" for a, g in zip(acc, gyr, strict=True)]
    return write(folder / "ffs.txt", *made)


@dialect
def wearable_ids(folder: Path, m: Motion) -> Path:
    """A set of wearables: the device's number first, magne_x, the stamp behind the sensors, the activity's number."""
    head = "device_id,acce_x,acce_y,acce_z,gyro_x,gyro_y,gyro_z,magne_x,magne_y,magne_z,timestamp,activity_label\n"
    one = np.ones(len(m.t), int)
    return write(folder / "part0dev1.csv", head, rows(one, m.acc, m.deg, m.mag / 2.0, m.t * 1000.0, one * 4))


@dialect
def relative_seconds_first(folder: Path, m: Motion) -> Path:
    """A recorder for visual odometry: # t_rel_s, quaternion, rates, acceleration, ns at the end."""
    head = "# t_rel_s,qx,qy,qz,qw,wx,wy,wz,ax,ay,az,stamp_ns\n"
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (len(m.t), 1))
    return write(folder / "data.csv", head, rows(m.t, quat, m.gyr, m.acc, ns(m)))
