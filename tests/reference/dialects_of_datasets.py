"""Logs as published data sets lay them out; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dialect, ms, names, ns, rows, with_words, write


def another(m: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Rates and forces of another sensor on another limb."""
    return 0.7 * m.gyr[::-1][:, [1, 2, 0]], np.roll(m.acc, 300, axis=0)[:, [1, 2, 0]] * 1.02


@dialect
def wisdm_raw(folder: Path, m: Motion) -> Path:
    """WISDM 2019: subject, letter, ns, three numbers and a semicolon; a folder per sensor."""
    for name, values in (("accel", m.acc), ("gyro", m.gyr)):
        text = rows(np.full(len(m.t), "1600"), np.full(len(m.t), "A"), ns(m) - EPOCH * 10**6 + 252 * 10**12, values)
        write(folder / "phone" / name / f"data_1600_{name}_phone.txt", text.replace("\n", ";\n"))
    return folder


@dialect
def real_world_har(folder: Path, m: Motion) -> Path:
    """RealWorld (HAR): id, attr_time, attr_x …; the sensor in the file's name."""
    for name, values in (("acc_walking_chest", m.acc), ("Gyroscope_walking_chest", m.gyr)):
        text = rows(np.arange(len(m.t)) + 1, ns(m) // 10**6, values)
        write(folder / f"{name}.csv", "id,attr_time,attr_x,attr_y,attr_z\n", text)
    return folder


@dialect
def hhar(folder: Path, m: Motion) -> Path:
    """Heterogeneity HAR: two clocks in ms and ns, words at the end of the line."""
    for name, values in (("Phones_accelerometer", m.acc), ("Phones_gyroscope", m.gyr)):
        head = "Index,Arrival_Time,Creation_Time,x,y,z,User,Model,Device,gt\n"
        text = rows(np.arange(len(m.t)), ns(m) // 10**6, ns(m) + 10**9, values)
        write(folder / f"{name}.csv", head, text.replace("\n", ",a,nexus4,nexus4_1,stand\n"))
    return folder


@dialect
def uci_hapt(folder: Path, m: Motion) -> Path:
    """UCI's postural transitions: three columns each, g and rad/s, neither header nor time."""
    for name, values in (("acc_exp01_user01", m.g), ("gyro_exp01_user01", m.gyr)):
        write(folder / f"{name}.txt", rows(values, sep=" "))
    return folder


@dialect
def pamap2(folder: Path, m: Motion) -> Path:
    """PAMAP2: 54 columns without a header, three sensors of which each has two accelerometers, NaN."""
    n = len(m.t)
    rates, forces = another(m)
    beat = np.where(np.arange(n) % 11 == 0, 88.0, np.nan)
    parts = []
    for gyr, acc in ((m.gyr, m.acc), (rates, forces), (rates[:, [2, 0, 1]], forces[:, [2, 0, 1]])):
        parts += [np.full(n, 30.4), acc, acc * 1.01 + 0.1, gyr, m.mag, np.full((n, 4), 0.0) + [1.0, 0.0, 0.0, 0.0]]
    return write(folder / "subject101.dat", rows(m.t + 5.7, np.full(n, 4), beat, *parts, sep=" "))


@dialect
def mhealth(folder: Path, m: Motion) -> Path:
    """mHealth: no header, no time; a chest with an accelerometer alone stands before the ankle."""
    n = len(m.t)
    rates, forces = another(m)
    chest = forces[:, [2, 0, 1]]
    text = rows(chest, np.full((n, 2), 0.01), m.acc, m.deg, m.mag, forces, np.degrees(rates), m.mag, np.full(n, 1),
                sep="\t")  # fmt: skip
    return write(folder / "mHealth_subject1.log", text)


@dialect
def usc_had(folder: Path, m: Motion) -> Path:
    """USC-HAD: (n, 6) sensor_readings in a .mat with words around it; g, deg/s, no time."""
    import scipy.io

    made = {"title": "USC Human Motion Database", "subject": "1", "sensor_location": "front-right-hip",
            "sensor_readings": np.hstack([m.g, m.deg])}  # fmt: skip
    scipy.io.savemat(folder / "a1t1.mat", made)
    return folder / "a1t1.mat"


@dialect
def shl(folder: Path, m: Motion) -> Path:
    """SHL's Hips_Motion.txt: ms since 1970, then seven sensors by blanks, no header."""
    n = len(m.t)
    gravity = m.acc - m.linear
    quat = np.zeros((n, 4)) + [0.5, 0.5, 0.5, 0.5]
    text = rows(ns(m) // 10**6, m.acc, m.gyr, m.mag, quat, gravity, m.linear, np.full(n, 990.1), np.full(n, 120.0),
                np.full(n, 25.0), sep=" ")  # fmt: skip
    return write(folder / "Hips_Motion.txt", text)


@dialect
def ridi(folder: Path, m: Motion) -> Path:
    """RIDI's processed data.csv: a number first, ns, acce beside linacce and grav, the pose of a phone with Tango."""
    head = ",time," + ",".join(names(word, "xyz") for word in ("gyro_", "acce_", "linacce_", "grav_", "magnet_"))
    head += ",ori_w,ori_x,ori_y,ori_z,pos_x,pos_y,pos_z\n"
    n = len(m.t)
    pose = np.zeros((n, 7)) + [1.0, 0, 0, 0, 0.1, 0.2, 0.3]
    text = rows(np.arange(n), ns(m) - EPOCH * 10**6 + 10**13, m.gyr, m.acc, m.linear, m.acc - m.linear, m.mag, pose)
    return write(folder / "data.csv", head, text)


@dialect
def ronin(folder: Path, m: Motion) -> Path:
    """RoNIN's data.hdf5: raw lists with time in front, and synced ones on one clock."""
    import h5py

    with h5py.File(folder / "data.hdf5", "w") as file:
        raw, synced = file.create_group("raw"), file.create_group("synced")
        for name, values in (("acce", m.acc), ("gyro", m.gyr), ("magnet", m.mag), ("linacce", m.linear)):
            synced[name] = values
            raw[f"imu/{name}"] = np.column_stack([m.t * 1e9, values])
        synced["time"] = m.t + 1000.0
        synced["grav"] = m.acc - m.linear
    return folder / "data.hdf5"


@dialect
def oxiod(folder: Path, m: Motion) -> Path:
    """OxIOD's imu1.csv: no header; attitude, rates, gravity and user acceleration in g, field."""
    gravity, user = -(m.acc - m.linear) / 9.80665, -m.linear / 9.80665
    text = rows(m.t + 1000.0, 0.3 + 0.1 * m.gyr, m.gyr, gravity, user, m.mag)
    return write(folder / "imu1.csv", text)


@dialect
def advio(folder: Path, m: Motion) -> Path:
    """ADVIO: accelerometer.csv and gyro.csv without a header, seconds first."""
    for name, values in (("accelerometer", m.acc), ("gyro", m.gyr), ("magnetometer", m.mag)):
        write(folder / "iphone" / f"{name}.csv", rows(m.t + 10.0, values, form="%.9f"))
    return folder / "iphone"


@dialect
def kaist_urban(folder: Path, m: Motion) -> Path:
    """KAIST's xsens_imu.csv: no header; ns, quaternion, Euler angles, rates, forces, field."""
    n = len(m.t)
    quat = np.column_stack([np.sin(m.t / 9), np.zeros(n), np.zeros(n), np.cos(m.t / 9)])
    return write(folder / "xsens_imu.csv", rows(ns(m), quat, 0.2 + 0.1 * m.gyr, m.gyr, m.acc, m.mag / 48.0))


@dialect
def nclt(folder: Path, m: Motion) -> Path:
    """NCLT's ms25.csv: no header; µs, field in gauss, forces, rates."""
    return write(folder / "ms25.csv", rows(ns(m) // 1000, m.mag / 100.0, m.acc, m.gyr, sep=", "))


@dialect
def zurich_mav(folder: Path, m: Motion) -> Path:
    """Zurich Urban MAV: RawAccel.csv and RawGyro.csv, µs in a misspelt column."""
    for name, unit, values in (("RawAccel", "range_m_s2", m.acc), ("RawGyro", "range_rad_s", m.gyr)):
        head = f"Timpstemp, Error_count, x, y, z, temperature, {unit}, scaling, x_raw, y_raw, z_raw, temperature_raw\n"
        n = len(m.t)
        counts = np.rint(values * 1000).astype(int)
        text = rows(np.rint(m.t * 1e6).astype(int) + 92_000_000, np.zeros(n, int), values, np.full(n, 41.0),
                    np.full(n, 78.4), np.full(n, 0.002), counts, np.full(n, 0), sep=", ")  # fmt: skip
        write(folder / f"{name}.csv", head, text)
    return folder


@dialect
def nuscenes_can(folder: Path, m: Motion) -> Path:
    """nuScenes' CAN bus: a list of objects; linear_accel holds gravity, utime is µs."""
    made = [{"linear_accel": a, "q": [1.0, 0.0, 0.0, 0.0], "rotation_rate": g, "utime": int(u)} for a, g, u in
            zip(m.acc.round(6).tolist(), m.gyr.round(6).tolist(), ns(m) // 1000, strict=True)]  # fmt: skip
    return write(folder / "scene-0001_ms_imu.json", json.dumps(made))


@dialect
def kitti_oxts(folder: Path, m: Motion) -> Path:
    """KITTI's oxts: a file of 30 numbers for each sample, and their stamps in another file."""
    n = len(m.t)
    place = np.tile([49.0, 8.4, 112.8, 0.01, 0.02, -1.2, 0.0, 0.0, 0.0, 0.0, 0.0], (n, 1))
    quality = np.tile([0.3, 0.04, 4.0, 4.0, 4.0, 4.0, 4.0], (n, 1))
    body = np.hstack([place, m.acc[:n], m.acc[:n], m.gyr[:n], m.gyr[:n], quality])
    for k, line in enumerate(body):
        write(folder / "oxts" / "data" / f"{k:010d}.txt", " ".join(f"{v:.9f}" for v in line) + "\n")
    from tests.reference.dialects import dates

    stamps = [f"{word}000\n" for word in dates(m, "%Y-%m-%d %H:%M:%S.%f")[:n]]
    write(folder / "oxts" / "timestamps.txt", *stamps)
    write(
        folder / "oxts" / "dataformat.txt", "lat:   latitude of the oxts-unit (deg)\nax:    acceleration in x (m/s^2)\n"
    )
    return folder / "oxts"


@dialect
def career_con(folder: Path, m: Motion) -> Path:
    """Kaggle's CareerCon: series of 128 rows, linear_acceleration with gravity in it, no time."""
    n = len(m.t)
    head = "row_id,series_id,measurement_number," + names("orientation_", "XYZW") + "," + names("angular_velocity_")
    head += "," + names("linear_acceleration_") + "\n"
    ids = [f"{k // 128}_{k % 128}" for k in range(n)]
    quat = np.zeros((n, 4)) + [0.0, 0.0, 0.0, 1.0]
    text = rows(np.arange(n) // 128, np.arange(n) % 128, quat, m.gyr, m.acc)
    return write(folder / "X_train.csv", head, with_words(ids, text))


@dialect
def astro_pi(folder: Path, m: Motion) -> Path:
    """Astro Pi's columns: G and rad/s without saying so, the stamp at the end."""
    from tests.reference.dialects import dates

    head = "ROW_ID,temp_cpu,temp_h,temp_p,humidity,pressure,pitch,roll,yaw," + names("mag_", "xyz") + ","
    head += names("accel_", "xyz") + "," + names("gyro_", "xyz") + ",reset,time_stamp\n"
    n = len(m.t)
    text = rows(np.arange(n) + 1, np.full((n, 5), 31.9), 90 + 5 * m.gyr, m.mag, m.g, m.gyr, np.zeros(n, int))
    stamps = dates(m, "%Y-%m-%d %H:%M:%S.%f")
    lines = [f"{a},{b}\n" for a, b in zip(text.strip().split("\n"), stamps, strict=True)]
    return write(folder / "astro_pi.csv", head, *lines)


@dialect
def tidy_long(folder: Path, m: Motion) -> Path:
    """A long table: a row for each axis, its name in one column and its number in another."""
    made = ["time,sensor,axis,value\n"]
    for k, stamp in enumerate(ms(m)):
        for word, values in (("accelerometer", m.acc), ("gyroscope", m.gyr)):
            made += [f"{stamp},{word},{a},{v:.6f}\n" for a, v in zip("xyz", values[k], strict=True)]
    return write(folder / "long.csv", *made)
