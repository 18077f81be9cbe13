"""Layouts that say little of themselves, written from one simulated motion and read back."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.recording import Recording
from levelhead.units import GRAVITY


def up(made: Recording) -> np.ndarray:
    """(n, 3) m/s²: gravity's reaction in the sensor's frame."""
    assert made.truth is not None
    return Rotation.from_quat(made.truth.quat[:, [1, 2, 3, 0]]).inv().apply([0.0, 0.0, GRAVITY])


def check(read: Recording, made: Recording, acc: float = 1e-3, gyr: float = 1e-3) -> None:
    assert len(read) == len(made)
    np.testing.assert_allclose(read.gyr, made.gyr, atol=gyr)
    np.testing.assert_allclose(read.acc, made.acc, atol=acc)


@pytest.mark.parametrize("order", ["ag", "ga", "agme"])
def test_rows_of_sensors_by_turns_without_names(tmp_path: Path, hand: Recording, order: str) -> None:
    angles = np.degrees(np.cumsum(hand.gyr, axis=0) * 0.01)
    parts = {"a": hand.acc / GRAVITY, "g": np.degrees(hand.gyr), "m": up(hand)[:, [1, 0, 2]] * 5.0, "e": angles}
    rows = np.stack([parts[sign] for sign in order], axis=1).reshape(-1, 3)
    np.savetxt(tmp_path / "lines.txt", rows, "%.5f", " ")
    with pytest.raises(lh.LevelheadError, match="--rate"):
        lh.read(tmp_path / "lines.txt")
    read = lh.read(tmp_path / "lines.txt", rate=hand.rate)
    check(read, hand)
    assert any(one.reason == "stacked_rows" for one in read.meta["conclusions"])


@pytest.mark.parametrize("more", [2, 3, 6])
def test_more_cells_than_names(tmp_path: Path, hand: Recording, more: int) -> None:
    rest = np.random.default_rng(0).normal(0.0, 1.0, (len(hand), more))
    np.savetxt(
        tmp_path / "more.csv", np.column_stack([hand.t, hand.acc, hand.gyr, rest]), "%.6f", ",",
        header="t,ax,ay,az,gx,gy,gz", comments="",
    )  # fmt: skip
    read = lh.read(tmp_path / "more.csv")
    check(read, hand)
    assert any(one.reason == "rest_unnamed" for one in read.meta["conclusions"])


def test_gravity_in_a_file_whose_name_does_not_say_so(tmp_path: Path, hand: Recording) -> None:
    parts = {"Gyroscope": hand.gyr, "LinearAcceleration": hand.acc - up(hand), "ForceVector": up(hand)}
    for name, values in parts.items():
        rows = np.column_stack([hand.t, values])
        np.savetxt(tmp_path / f"{name}.csv", rows, "%.6f", ",", header="time,x,y,z", comments="")
    check(lh.read(tmp_path), hand)


def test_a_python_dictionary_on_each_line(tmp_path: Path, hand: Recording) -> None:
    def sample(k: int) -> dict[str, object]:
        acc, gyro = ({axis: float(value) for axis, value in zip("xyz", part[k], strict=True)}
                     for part in (hand.acc, np.degrees(hand.gyr)))  # fmt: skip
        return {"time": float(hand.t[k]), "acc": acc, "gyro": gyro, "mag": None, "still": False}

    (tmp_path / "dicts.txt").write_text("".join(f"{sample(k)}\n" for k in range(len(hand))))
    check(lh.read(tmp_path / "dicts.txt"), hand)


def test_streams_of_gopro_telemetry(tmp_path: Path, hand: Recording) -> None:
    import json

    def stream(name: str, key: str, unit: str, values: np.ndarray) -> dict[str, object]:
        samples = [{"value": row, "cts": 1000.0 * t} for t, row in zip(hand.t.tolist(), values.tolist(), strict=True)]
        return {"TSMP": len(samples), "STNM": name, "SIUN": unit, key: samples}

    streams = [
        stream("Accelerometer (z,x,y)", "ACCL", "m/s2", hand.acc),
        stream("Gyroscope (z,x,y)", "GYRO", "rad/s", hand.gyr),
        *({"TSMP": k, "STNM": f"Face {k}", "FACE": []} for k in range(5)),
    ]  # fmt: skip
    whole = {"1": {"DEVC": [{"DVID": 1, "DVNM": "Hero6 Black", "STRM": streams}]}, "frames/second": 29.97}
    (tmp_path / "devc.json").write_text(json.dumps(whole))
    check(lh.read(tmp_path / "devc.json"), hand)


@pytest.mark.parametrize("scale", [1.0, np.pi / 180.0], ids=["deg/s", "rad/s"])
def test_the_digit_tells_the_unit_of_a_spin(tmp_path: Path, scale: float) -> None:
    """A rocket on its pad, then a spin at full scale: gravity tells nothing, the converter's step does."""
    rng = np.random.default_rng(0)
    t = np.arange(6000) * 0.01
    spin = np.where(t < 20.0, 0.0, np.minimum(200.0 * (t - 20.0), 2293.0))
    rate = np.column_stack([spin, *rng.normal(0.0, 3.0, (2, 6000)) * (1.0 + spin / 50.0)])
    rate = np.rint((rate + rng.normal(0.0, 0.1, rate.shape)) / 0.07) * 0.07
    acc = np.column_stack([np.full(6000, GRAVITY), np.zeros(6000), 0.02 * np.radians(spin) ** 2])
    acc += rng.normal(0.0, 0.02, acc.shape) * (1.0 + spin[:, None])
    np.savetxt(tmp_path / "rocket.csv", np.column_stack([t, acc, rate * scale]), "%.8f", ",",
               header="t,ax,ay,az,wx,wy,wz", comments="")  # fmt: skip
    read = lh.read(tmp_path / "rocket.csv")
    np.testing.assert_allclose(read.gyr, np.radians(rate), atol=1e-6)
    np.testing.assert_allclose(read.acc, acc, atol=1e-6)


@pytest.mark.parametrize("sense", [2.0, 0.0], ids=["in motion", "at rest, in whole numbers"])
def test_readings_of_a_phone_before_their_accuracy(tmp_path: Path, hand: Recording, sense: float) -> None:
    """As GetSensorData writes them: app's time, sensor's time, x, y, z, accuracy; or x, y, z last."""
    gyr = (sense * hand.gyr).round(6)
    end = ";3" if sense else ""
    lines = ["% LogFile created by the App 'GetSensorData2.1' for Android.", "%"]
    for t, w, f in zip(hand.t, gyr, hand.acc, strict=True):
        axes = ";".join(f"{one:.5f}" if sense else f"{one:.0f}" for one in w)
        lines += [f"GYRO;{t:.3f};{1000 + t:.3f};{axes}{end}"]
        lines += [f"ACCE;{t:.3f};{1000 + t:.3f};{f[0]:.5f};{f[1]:.5f};{f[2]:.5f}{end}"]
    (tmp_path / "log.txt").write_text("\n".join(lines) + "\n")
    read = lh.read(tmp_path / "log.txt", units={"gyr": "rad/s", "acc": "m/s²"})
    np.testing.assert_allclose(read.gyr, gyr, atol=1e-5)
    np.testing.assert_allclose(read.acc, hand.acc, atol=1e-5)


def test_a_bids_recording_by_its_channels(tmp_path: Path, hand: Recording) -> None:
    folder = tmp_path / "sub-01" / "motion"
    folder.mkdir(parents=True)
    np.savetxt(
        folder / "sub-01_task-walk_tracksys-imu_motion.tsv",
        np.column_stack([hand.acc, np.degrees(hand.gyr), -hand.acc, -np.degrees(hand.gyr)]), "%.7f", "\t",
    )  # fmt: skip
    lines = ["name\tcomponent\ttype\ttracked_point\tunits\tplacement\tsampling_frequency"]
    for point in ("left_foot", "right_foot"):
        for kind, unit in (("ACCEL", "m/s^2"), ("GYRO", "deg/s")):
            lines += [f"{point}_{kind}_{a}\t{a}\t{kind}\t{point}\t{unit}\tfoot\t{hand.rate:.6f}" for a in "xyz"]
    (folder / "sub-01_task-walk_tracksys-imu_channels.tsv").write_text("\n".join(lines) + "\n")
    (folder / "sub-01_task-walk_tracksys-imu_motion.json").write_text('{"TaskName": "walk"}')
    check(lh.read(folder), hand)
    check(lh.read(folder / "sub-01_task-walk_tracksys-imu_motion.tsv"), hand)
    right = lh.read(folder, sensor="right_foot")
    np.testing.assert_allclose(right.gyr, -hand.gyr, atol=1e-6)


def test_series_of_nwb_with_their_rate(tmp_path: Path, hand: Recording) -> None:
    h5py = pytest.importorskip("h5py", reason="h5py is not installed (extra levelhead[formats])")
    with h5py.File(tmp_path / "walk.nwb", "w") as file:
        for name, values, unit in (("accelerometer", hand.acc, "m/s^2"), ("gyroscope", hand.gyr, "rad/s")):
            data = file.create_dataset(f"acquisition/{name}/data", data=np.rint(values * 1e6).astype(np.int32))
            data.attrs["unit"], data.attrs["conversion"] = unit, 1e-6
            start = file.create_dataset(f"acquisition/{name}/starting_time", data=0.0)
            start.attrs["rate"], start.attrs["unit"] = hand.rate, "seconds"
    check(lh.read(tmp_path / "walk.nwb"), hand)


def test_ticks_beside_seconds_are_no_clock(tmp_path: Path, hand: Recording) -> None:
    rows = np.column_stack([np.rint(4.5e6 * hand.t), hand.t, hand.acc, np.degrees(hand.gyr)])
    names = [f"IMU_ATTI(0):{sensor}{axis}[{unit}]" for sensor, unit in (("accel", "meters/Sec2"), ("gyro", "degrees/s"))
             for axis in "XYZ"]  # fmt: skip
    header = ",".join(["Clock:Tick#", "Clock:offsetTime", *names])
    np.savetxt(tmp_path / "FLY001.csv", rows, "%.6f", ",", header=header, comments="")
    read = lh.read(tmp_path / "FLY001.csv")
    check(read, hand)
    assert read.rate == pytest.approx(hand.rate, rel=1e-3)


def test_a_minus_before_a_name_is_asked_about(tmp_path: Path, hand: Recording) -> None:
    """Numbers under "-gy" may be of the reversed axis: neither answer is taken in silence; a hint takes them as is."""
    path = tmp_path / "minus.csv"
    rows = np.column_stack([hand.t, hand.acc * [1, -1, 1], hand.gyr * [1, -1, 1]])
    np.savetxt(path, rows, delimiter=",", comments="", header="time,ax,-ay,az,gx,-gy,gz")
    with pytest.raises(lh.LevelheadError, match="'-gy' begins with a minus.*--map gyr=gx,-gy,gz --map acc=ax,-ay,az"):
        lh.read(path)
    read = lh.read(path, map={"gyr": ["gx", "-gy", "gz"], "acc": ["ax", "-ay", "az"]})
    np.testing.assert_allclose(read.acc, rows[:, 1:4], atol=1e-9)
    bullets = tmp_path / "bullets.csv"
    np.savetxt(bullets, rows[:, 1:], delimiter=",", comments="", header="- ax,- ay,- az,- gx,- gy,- gz")
    np.testing.assert_allclose(lh.read(bullets, rate=100.0).acc, rows[:, 1:4], atol=1e-9)


PRINTED = {
    "ESPHome": "[12:00:{t:06.3f}][D][mpu6050:123]: Got "
    "accel={{x={a[0]:.4f} m/s², y={a[1]:.4f} m/s², z={a[2]:.4f} m/s²}}, "
    "gyro={{x={d[0]:.4f} °/s, y={d[1]:.4f} °/s, z={d[2]:.4f} °/s}}, temp=27.1°C",
    "ROS 2 launch": "[imu_node-1] [INFO] [{s:.6f}] [imu_node]: accel: [{a[0]:.4f}, {a[1]:.4f}, {a[2]:.4f}] "
    "gyro: [{g[0]:.5f}, {g[1]:.5f}, {g[2]:.5f}]",
    "journalctl": "May 01 12:00:{t:09.6f} pi imu[812]: ax={a[0]:.4f} ay={a[1]:.4f} az={a[2]:.4f} "
    "gx={g[0]:.5f} gy={g[1]:.5f} gz={g[2]:.5f}",
    "Zephyr": "[00:00:{t:06.3f},250] <inf> main: accel x:{a[0]:.4f} y:{a[1]:.4f} z:{a[2]:.4f} "
    "gyro x:{g[0]:.5f} y:{g[1]:.5f} z:{g[2]:.5f}",
    "logcat": "05-01 12:00:{t:06.3f}  4321  4330 D SensorTest: ACC,{a[0]:.4f},{a[1]:.4f},{a[2]:.4f}\n"
    "05-01 12:00:{t:06.3f}  4321  4330 D SensorTest: GYR,{g[0]:.5f},{g[1]:.5f},{g[2]:.5f}",
    "logcat -v time": "05-01 12:00:{t:06.3f} D/Sensors( 4321): ax={a[0]:.4f} ay={a[1]:.4f} az={a[2]:.4f} "
    "gx={g[0]:.5f} gy={g[1]:.5f} gz={g[2]:.5f}",
    "bars behind a clock": "12:00:{t:06.3f} | {a[0]:.4f} | {a[1]:.4f} | {a[2]:.4f} | "
    "{g[0]:.5f} | {g[1]:.5f} | {g[2]:.5f}",
    "NSLog": "2026-05-01 12:00:{t:09.6f}+0200 App[12:34] acc: {a[0]:.4f} {a[1]:.4f} {a[2]:.4f} "
    "gyro: {g[0]:.5f} {g[1]:.5f} {g[2]:.5f}",
    "mosquitto_sub": 'home/imu {{"ts": {t:.3f}, "accel": {{"x": {a[0]:.4f}, "y": {a[1]:.4f}, "z": {a[2]:.4f}}}, '
    '"gyro": {{"x": {g[0]:.5f}, "y": {g[1]:.5f}, "z": {g[2]:.5f}}}}}',
    "one unit behind three axes": "t: {t:.3f}\nax = {a[0]:.4f} ay = {a[1]:.4f} az = {a[2]:.4f} m/s^2\n"
    "gx = {d[0]:.4f} gy = {d[1]:.4f} gz = {d[2]:.4f} deg/s",
    "durations": "{t:.3f} sec,{a[0]:.4f},{a[1]:.4f},{a[2]:.4f},{g[0]:.5f},{g[1]:.5f},{g[2]:.5f}",
    "Python's lists": "[{t:.3f}, {a[0]:.4f}, {a[1]:.4f}, {a[2]:.4f}, {d[0]:.4f}, {d[1]:.4f}, {d[2]:.4f}]",
    "headings": "t: {t:.3f}\nAccelerometer data\nx: {a[0]:.4f}\ny: {a[1]:.4f}\nz: {a[2]:.4f}\n"
    "Gyroscope data\nx: {d[0]:.4f}\ny: {d[1]:.4f}\nz: {d[2]:.4f}\nTemp: 28.1 C",
}


@pytest.mark.parametrize("line", PRINTED.values(), ids=PRINTED)
def test_lines_as_programs_print_them(tmp_path: Path, hand: Recording, line: str) -> None:
    lines = [
        line.format(t=t, s=t + 1.7e9, a=a, g=g, d=np.degrees(g))
        for t, a, g in zip(hand.t - hand.t[0], hand.acc, hand.gyr, strict=True)
        if t < 60.0
    ]
    (tmp_path / "lines.txt").write_text("\n".join(lines), encoding="utf-8")
    read = lh.read(tmp_path / "lines.txt")
    check(read, hand[: len(lines)])
    np.testing.assert_allclose(np.diff(read.t), np.diff(hand.t[: len(lines)]), atol=2e-3)


def test_the_rate_of_devices_in_a_file_of_nexus(tmp_path: Path, hand: Recording) -> None:
    """Vicon Nexus writes the rate of its devices below their title, and no stamps."""
    rows = np.column_stack([np.arange(1, len(hand) + 1), np.zeros(len(hand)), hand.acc, hand.gyr])
    above = [f"Devices\n{hand.rate:.0f}", ",,IMU 1 - Acc,,,IMU 1 - Gyro,,", "Frame,Sub Frame,X,Y,Z,X,Y,Z"]
    header = "\n".join([*above, ",,m/s^2,m/s^2,m/s^2,rad/s,rad/s,rad/s"])
    np.savetxt(tmp_path / "Trial01.csv", rows, "%.6f", ",", header=header, comments="")
    read = lh.read(tmp_path / "Trial01.csv")
    check(read, hand)
    assert read.rate == pytest.approx(hand.rate, rel=1e-3)


@pytest.mark.parametrize("order", ["ag", "agm", "ga", "mag"])
def test_a_rate_as_long_as_gravity_in_g_is_no_gravity(tmp_path: Path, order: str) -> None:
    """Columns without names of a body that turns in place: no force disturbs gravity, and |ω| is about 1 rad/s."""
    t = np.arange(0.0, 30.0, 0.02)
    rate = np.stack([0.3 * np.sin(1.9 * t), 0.3 * np.cos(2.9 * t), 0.95 + 0.2 * np.sin(1.4 * t)], axis=1)
    turned = Rotation.identity()
    turns = [turned := turned * Rotation.from_rotvec(0.02 * one) for one in rate]
    seen = {"g": rate}
    for sensor, vector in (("a", [0.0, 1.0, GRAVITY]), ("m", [0.0, 20.0, -43.0])):
        seen[sensor] = np.array([turn.inv().apply(vector) for turn in turns])
    np.savetxt(tmp_path / "bare.csv", np.column_stack([t, *(seen[sensor] for sensor in order)]), "%.5f", ",")
    read = lh.read(tmp_path / "bare.csv")
    np.testing.assert_allclose(read.gyr, rate, atol=2e-5)
    np.testing.assert_allclose(read.acc, seen["a"], rtol=3e-2, atol=1e-2)
    assert (read.mag is not None) == ("m" in order)


@pytest.mark.parametrize("scalar", [{"sample_rate": 100}, {"dt": 0.01}, {"ts": 1.7e9, "fs": 100.0}], ids=str)
@pytest.mark.parametrize("rows", [False, True], ids=["lists", "samples"])
def test_a_rate_beside_the_samples_of_json(
    tmp_path: Path, hand: Recording, scalar: dict[str, float], rows: bool
) -> None:
    acc, gyr = hand.acc.tolist(), hand.gyr.tolist()
    samples = {"samples": [{"acc": a, "gyr": g} for a, g in zip(acc, gyr, strict=True)]}
    content = scalar | (samples if rows else {"acc": acc, "gyr": gyr})
    (tmp_path / "log.json").write_text(json.dumps(content), encoding="utf-8")
    read = lh.read(tmp_path / "log.json")
    check(read, hand)
    assert read.rate == pytest.approx(hand.rate, rel=1e-3)


def test_stamps_outrank_a_number_beside_them(tmp_path: Path, hand: Recording) -> None:
    """The frequency of a radio is no rate of samples that have stamps."""
    content = {"frequency": 868, "t": hand.t.tolist(), "acc": hand.acc.tolist(), "gyr": hand.gyr.tolist()}
    (tmp_path / "log.json").write_text(json.dumps(content), encoding="utf-8")
    read = lh.read(tmp_path / "log.json")
    check(read, hand)
    assert read.rate == pytest.approx(hand.rate, rel=1e-3)


def test_one_name_over_three_columns(tmp_path: Path, hand: Recording) -> None:
    """A name in merged cells of a spreadsheet."""
    header = "time;acc;;;gyro;;\ns;m/s²;m/s²;m/s²;rad/s;rad/s;rad/s"
    rows = np.column_stack([hand.t, hand.acc, hand.gyr])
    np.savetxt(tmp_path / "merged.csv", rows, "%.6f", ";", header=header, comments="", encoding="utf-8")
    check(lh.read(tmp_path / "merged.csv"), hand)


@pytest.mark.parametrize(("name", "scale"), [("dt", 1.0), ("dt", 1e3), ("dt_ms", 1e3), ("Delta Time (us)", 1e6)])
def test_the_sum_of_intervals_is_the_clock(tmp_path: Path, hand: Recording, name: str, scale: float) -> None:
    dt = scale * np.diff(hand.t, prepend=hand.t[0] - 0.01)
    rows = np.column_stack([dt, hand.acc, hand.gyr])
    np.savetxt(tmp_path / "dt.csv", rows, "%.6f", ",", header=f"{name},ax,ay,az,gx,gy,gz", comments="")
    read = lh.read(tmp_path / "dt.csv")
    check(read, hand)
    np.testing.assert_allclose(read.t - read.t[0], hand.t - hand.t[0], atol=1e-3)
    assert lh.read(tmp_path / "dt.csv", rate=50.0).rate == pytest.approx(50.0)


@pytest.mark.parametrize(("sign", "quote"), [(",", '"'), ("'", ""), ("\u202f", "")])
def test_digits_in_groups_of_three(tmp_path: Path, hand: Recording, sign: str, quote: str) -> None:
    """Milliseconds as spreadsheets show them: 1,234.5 in quotes, 1'234.5, 1 234.5."""
    stamps = [f"{quote}{1e3 * t:,.1f}{quote}".replace(",", sign) for t in hand.t - hand.t[0]]
    rest = [",".join(f"{x:.5f}" for x in row) for row in np.hstack([hand.acc, hand.gyr])]
    lines = ["time_ms,ax,ay,az,gx,gy,gz", *(f"{t},{row}" for t, row in zip(stamps, rest, strict=True))]
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="utf-8")
    read = lh.read(tmp_path / "log.csv")
    check(read, hand)
    np.testing.assert_allclose(read.t - read.t[0], hand.t - hand.t[0], atol=1e-3)


def test_the_minus_of_the_north(tmp_path: Path, hand: Recording) -> None:
    """Programs in Swedish or Norwegian write U+2212 before a number."""
    lines = [";".join(f"{x:.5f}" for x in row) for row in np.column_stack([hand.t, hand.acc, hand.gyr])]
    text = "\n".join(["t;ax;ay;az;gx;gy;gz", *lines]).replace("-", "\u2212").replace(".", ",")
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    check(lh.read(tmp_path / "log.csv"), hand)


def test_noise_of_a_port_before_the_first_line(tmp_path: Path, hand: Recording) -> None:
    rows = "\n".join(",".join(f"{x:.5f}" for x in row) for row in np.column_stack([hand.t, hand.acc, hand.gyr]))
    path = tmp_path / "log.csv"
    path.write_bytes(b"\x00\xff\xfe\x12boot\r\n" + f"t,ax,ay,az,gx,gy,gz\n{rows}\n".encode())
    check(lh.read(path), hand)
    path.write_bytes(np.random.default_rng(0).bytes(5_000))
    with pytest.raises(lh.LevelheadError, match="not a text file"):
        lh.read(path)


def test_names_of_linux_iio(tmp_path: Path, hand: Recording) -> None:
    """Channels of Linux's industrial I/O: Documentation/ABI/testing/sysfs-bus-iio."""
    names = [f"{channel}_{axis}" for channel in ("in_accel", "in_anglvel") for axis in "xyz"]
    rows = np.column_stack([1e9 * hand.t, hand.acc, hand.gyr])
    np.savetxt(tmp_path / "iio.csv", rows, "%.6f", ",", header=",".join(["timestamp", *names]), comments="")
    check(lh.read(tmp_path / "iio.csv"), hand)


def test_seconds_and_microseconds_without_names(tmp_path: Path, hand: Recording) -> None:
    """REALDISP's logs: two columns of a clock before more than 64 others, and no names."""
    microseconds = np.rint(1e6 * (hand.t - hand.t[0])).astype(int)
    more = np.random.default_rng(0).normal(0.0, 1.0, (len(hand), 80))
    rows = np.column_stack([1000 + microseconds // 1_000_000, microseconds % 1_000_000, hand.acc, hand.gyr, more])
    np.savetxt(tmp_path / "subject.log", rows, ["%d", "%d", *["%.6f"] * 86], "\t")
    read = lh.read(tmp_path / "subject.log")
    check(read, hand)
    np.testing.assert_allclose(read.t - read.t[0], hand.t - hand.t[0], atol=1e-6)


def test_a_sensor_in_a_file_of_its_own(tmp_path: Path, hand: Recording) -> None:
    """The file of one sensor alone leads to the folder of both, which is read."""
    for name, unit, values in (
        ("Accelerometer", "g", hand.acc / GRAVITY),
        ("Gyroscope", "deg/s", np.degrees(hand.gyr)),
    ):
        header = ",".join(["elapsed (s)", *(f"{axis}-axis ({unit})" for axis in "xyz")])
        rows = np.column_stack([hand.t, values])
        np.savetxt(tmp_path / f"MetaWear_{name}.csv", rows, "%.7f", ",", header=header, comments="")
    for name, other in (("Accelerometer", "gyroscope"), ("Gyroscope", "accelerometer")):
        with pytest.raises(lh.LevelheadError, match=f"no {other} among.*put both into one folder, and give the folder"):
            lh.read(tmp_path / f"MetaWear_{name}.csv")
    check(lh.read(tmp_path), hand)
