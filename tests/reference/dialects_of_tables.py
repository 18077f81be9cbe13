"""Home-made tables with the habits of spreadsheets, scripts and loggers; see dialects.py."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import Motion, dates, dialect, ms, names, ns, rows, with_words, write

AXES = ",ax,ay,az,gx,gy,gz\n"


@dialect
def iso_with_zone(folder: Path, m: Motion) -> Path:
    """pandas' time stamps with a zone."""
    stamps = [word + "+00:00" for word in dates(m, "%Y-%m-%d %H:%M:%S.%f")]
    head = "timestamp," + names("acceleration_", "xyz") + "," + names("gyroscope_", "xyz") + "\n"
    return write(folder / "data.csv", head, with_words(stamps, rows(m.acc, m.gyr)))


@dialect
def scientific_epoch(folder: Path, m: Motion) -> Path:
    """numpy.savetxt's default: everything as 1.683203415250000000e+09, names in a comment."""
    return write(folder / "log.txt", "# time ax ay az gx gy gz\n",
                 rows(ns(m) / 1e9, m.acc, m.gyr, sep=" ", form="%.18e"))  # fmt: skip


@dialect
def units_in_cells(folder: Path, m: Motion) -> Path:
    """A unit behind each number."""
    lines = []
    for s, a, g in zip(ms(m), m.g, m.deg, strict=True):
        cells = [f"{v:.4f} g" for v in a] + [f"{v:.3f} deg/s" for v in g]
        lines.append(f"{s} ms,{','.join(cells)}\n")
    return write(folder / "cells.csv", "time" + AXES, *lines)


@dialect
def fixed_width(folder: Path, m: Motion) -> Path:
    """Columns set apart by blanks under names with blanks in them."""
    titles = ["Time [s]", "Acc X [g]", "Acc Y [g]", "Acc Z [g]", "Gyr X [dps]", "Gyr Y [dps]", "Gyr Z [dps]"]
    head = "".join(f"{title:>14}" for title in titles) + "\n"
    lines = ["".join(f"{v:14.5f}" for v in (s, *a, *g)) + "\n" for s, a, g in zip(m.t, m.g, m.deg, strict=True)]
    return write(folder / "fixed.txt", head, *lines)


@dialect
def excel_minutes(folder: Path, m: Motion) -> Path:
    """Excel's own idea of a time: minutes, seconds and a tenth."""
    stamps = [word[3:-2] for word in dates(m, "%H:%M:%S.%f", 3)]
    return write(folder / "excel.csv", "time" + AXES, with_words(stamps, rows(m.acc, m.gyr)))


@dialect
def micros_overflow(folder: Path, m: Motion) -> Path:
    """Arduino's micros(), which begin again after 2^32."""
    stamps = (np.rint(m.t * 1e6).astype(np.int64) + 2**32 - 7_000_000) % 2**32
    return write(folder / "micros.csv", "micros" + AXES, rows(stamps, m.acc, m.gyr))


@dialect
def header_again(folder: Path, m: Motion) -> Path:
    """A logger that writes its header every 500 rows, and a line of sums at the end."""
    lines = rows(ms(m), m.acc, m.gyr).strip().split("\n")
    made = []
    for k, line in enumerate(lines):
        made += ["time_ms" + AXES] if k % 500 == 0 else []
        made.append(line + "\n")
    return write(folder / "again.csv", *made, "Total samples: 2000\n")


@dialect
def quoted_numbers(folder: Path, m: Motion) -> Path:
    """Every cell in quotes."""
    lines = [",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in rows(m.t, m.acc, m.gyr).split()]
    return write(folder / "quoted.csv", '"time","ax","ay","az","gx","gy","gz"\n', *lines)


@dialect
def specific_force_letters(folder: Path, m: Motion) -> Path:
    """Inertial navigation's letters: f for specific force, w for rates."""
    return write(folder / "ins.csv", "t,fx,fy,fz,wx,wy,wz\n", rows(m.t, m.acc, m.gyr))


@dialect
def rotation_letters(folder: Path, m: Motion) -> Path:
    """rot_x for rates, acc_x, a count first."""
    head = "count,timestamp_ms,acc_x,acc_y,acc_z,rot_x,rot_y,rot_z\n"
    return write(folder / "rot.csv", head, rows(np.arange(len(m.t)), ms(m) + 40, m.acc, m.gyr))


@dialect
def units_with_underscores(folder: Path, m: Motion) -> Path:
    """Units between the sensor and the axis."""
    head = "t_us,accel_m_s2_x,accel_m_s2_y,accel_m_s2_z,gyro_deg_s_x,gyro_deg_s_y,gyro_deg_s_z\n"
    return write(folder / "under.csv", head, rows(np.rint(m.t * 1e6).astype(int), m.acc, m.deg))


@dialect
def lists_of_objects(folder: Path, m: Motion) -> Path:
    """A web app's JSON: a list of readings for each sensor."""
    made = {
        name: [{"timestamp": int(s), "x": a, "y": b, "z": c} for s, (a, b, c) in zip(ms(m), v.tolist(), strict=True)]
        for name, v in (("accelerometer", m.acc), ("gyroscope", m.gyr))
    }
    return write(folder / "web.json", json.dumps({"user": "7", "sensors": made}))


@dialect
def covariance_cells(folder: Path, m: Motion) -> Path:
    """A bag by a script: covariances as tuples of nine in quotes, vectors in columns."""
    head = "time,angular_velocity_x,angular_velocity_y,angular_velocity_z,angular_velocity_covariance,"
    head += "linear_acceleration_x,linear_acceleration_y,linear_acceleration_z\n"
    nine = '"(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)"'
    lines = [f"{s},{g[0]:.6f},{g[1]:.6f},{g[2]:.6f},{nine},{a[0]:.6f},{a[1]:.6f},{a[2]:.6f}\n" for s, g, a in
             zip(ns(m), m.gyr, m.acc, strict=True)]  # fmt: skip
    return write(folder / "bag.csv", head, *lines)


@dialect
def dict_cells(folder: Path, m: Motion) -> Path:
    """Python's dictionaries in cells."""
    lines = []
    for s, a, g in zip(ns(m) / 1e9, m.acc, m.gyr, strict=True):
        cells = [f"\"{{'x': {v[0]:.5f}, 'y': {v[1]:.5f}, 'z': {v[2]:.5f}}}\"" for v in (a, g)]
        lines.append(f"{s:.3f},{cells[0]},{cells[1]}\n")
    return write(folder / "dicts.csv", "time,accelerometer,gyroscope\n", *lines)


@dialect
def two_wrists(folder: Path, m: Motion) -> Path:
    """A folder for each wrist, a file per sensor in each."""
    head = "time,seconds_elapsed,z,y,x\n"
    for place, sign in (("left", 1.0), ("right", 0.5)):
        for name, values in (("Gyroscope", m.gyr * sign), ("TotalAcceleration", m.acc)):
            write(folder / place / f"{name}.csv", head, rows(ns(m), m.t, values[:, ::-1]))
    return folder


@dialect
def text_pair(folder: Path, m: Motion) -> Path:
    """gyro.txt and accel.txt by blanks, without a header, as a camera's recorder writes them."""
    for name, values in (("gyro", m.gyr), ("accel", m.acc)):
        write(folder / f"{name}.txt", rows(ns(m) / 1e9, values, sep=" ", form="%.6f"))
    return folder


@dialect
def words_and_triples(folder: Path, m: Motion) -> Path:
    """Two sensors in a line, three numbers behind each word, set apart by |."""
    made = [f"Acceleration: {a[0]:.4f}, {a[1]:.4f}, {a[2]:.4f} | Gyroscope: {g[0]:.4f}, {g[1]:.4f}, {g[2]:.4f}\n"
            for a, g in zip(m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "words.txt", *made)


@dialect
def sensor_then_axes(folder: Path, m: Motion) -> Path:
    """ACC: x=… y=… z=… GYR: x=… y=… z=…, the time in ms first."""
    made = []
    for s, a, g in zip(ms(m), m.acc, m.gyr, strict=True):
        parts = [" ".join(f"{x}={v:.4f}" for x, v in zip("xyz", one, strict=True)) for one in (a, g)]
        made.append(f"{s} ACC: {parts[0]} GYR: {parts[1]}\n")
    return write(folder / "axes.log", *made)


@dialect
def a_line_each(folder: Path, m: Motion) -> Path:
    """A line for time, one for each sensor."""
    made = []
    for s, a, g in zip(ms(m), m.acc, m.deg, strict=True):
        made.append(f"Time: {s}\nAccel: {a[0]:.3f}, {a[1]:.3f}, {a[2]:.3f}\nGyro: {g[0]:.3f}, {g[1]:.3f}, {g[2]:.3f}\n")
    return write(folder / "lines.txt", *made)


@dialect
def unit_in_the_word(folder: Path, m: Motion) -> Path:
    """Accelerometer (m/s^2): X: … Y: … Z: …, and the next line for the gyroscope."""
    made = []
    for a, g in zip(m.acc, m.gyr, strict=True):
        made.append(f"Accelerometer (m/s^2): X: {a[0]:.4f} Y: {a[1]:.4f} Z: {a[2]:.4f}\n")
        made.append(f"Gyroscope (rad/s): X: {g[0]:.4f} Y: {g[1]:.4f} Z: {g[2]:.4f}\n")
    return write(folder / "unit.txt", *made)


@dialect
def negative_gravity_ned(folder: Path, m: Motion) -> Path:
    """A dataset's table with a label, an index and NaN where the label is unknown."""
    label = np.where(np.arange(len(m.t)) % 3 == 0, "nan", "1")
    head = "index,label,time,GyroX [deg/s],GyroY [deg/s],GyroZ [deg/s],AccX [g],AccY [g],AccZ [g]\n"
    return write(folder / "label.csv", head, rows(np.arange(len(m.t)), label, m.t, m.deg, m.g))


@dialect
def matlab_struct(folder: Path, m: Motion) -> Path:
    """A structure with Accelerometer, Gyroscope, Time and fs in a .mat."""
    import scipy.io

    made = {"data": {"Accelerometer": m.g.T, "Gyroscope": m.deg.T, "Time": m.t[None], "fs": 100.0}}
    scipy.io.savemat(folder / "trial.mat", made)
    return folder / "trial.mat"


@dialect
def numpy_array(folder: Path, m: Motion) -> Path:
    """numpy.save of one array: time, forces, rates."""
    np.save(folder / "imu.npy", np.column_stack([m.t, m.acc, m.gyr]))
    return folder / "imu.npy"


@dialect
def parquet_frame(folder: Path, m: Motion) -> Path:
    """A data frame with dates and vectors by name."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {"ts": pa.array(ns(m), pa.timestamp("ns"))}
    for word, values in (("gyro", m.gyr), ("accel", m.acc)):
        columns |= {f"{word}.{axis}": column for axis, column in zip("xyz", values.T, strict=True)}
    pq.write_table(pa.table(columns), folder / "frame.parquet")
    return folder / "frame.parquet"
