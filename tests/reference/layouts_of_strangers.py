"""Layouts of public code that somebody who had not seen the reader chose, and that were not read at first."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import EPOCH, Motion, dates, ms, rows, with_words, write
from tests.reference.layouts import layout


@layout("strangers")
def esp_idf_in_colours(folder: Path, m: Motion) -> Path:
    """idf.py monitor: each line in a colour of the terminal."""
    made = [
        f"\x1b[0;32mI ({t + 1204}) icm42670 test: acc_x:{a[0]:.3f}, acc_y:{a[1]:.3f}, acc_z:{a[2]:.3f}, "
        f"gyro_x:{g[0]:.2f}, gyro_y:{g[1]:.2f}, gyro_z:{g[2]:.2f} temp: 27.0\x1b[0m"
        for t, a, g in zip(ms(m), m.g, m.deg, strict=True)
    ]
    head = "\x1b[0;32mI (271) main_task: Started on CPU0\x1b[0m\n\x1b[0;33mW (291) icm42670: id 0x67\x1b[0m\n"
    return write(folder / "idf_monitor.log", head, "\n".join(made))


@layout("strangers")
def json_behind_a_clock(folder: Path, m: Motion) -> Path:
    """A BNO055's objects in the serial monitor, each behind the monitor's clock."""
    sensors = ("gyroscope", "linear_accel", "magnetometer", "acceleration")
    made = [
        f"{clock} -> " + json.dumps({name: dict(zip("xyz", value.round(4), strict=True))
                                     for name, value in zip(sensors, values, strict=True)} | {"temperature": 27})
        for clock, *values in zip(dates(m, "%H:%M:%S.%f", 3), m.gyr, m.linear, m.mag, m.acc, strict=True)
    ]  # fmt: skip
    return write(folder / "monitor.txt", "\n".join(made))


@layout("strangers")
def temperature_called_t(folder: Path, m: Motion) -> Path:
    """Ax: … T: 27.01 of an ICM-42670-P: the temperature is no clock."""
    warm = 27.0 + np.random.default_rng(1).normal(0.0, 0.04, len(m.t))
    made = [f"Ax: {a[0]:.3f} Ay: {a[1]:.3f} Az: {a[2]:.3f} Gx: {g[0]:.2f} Gy: {g[1]:.2f} Gz: {g[2]:.2f} T: {t:.2f}"
            for a, g, t in zip(m.g, m.deg, warm, strict=True)]  # fmt: skip
    return write(folder / "minicom.cap", "\n".join(made))


@layout("strangers")
def comma_behind_a_name(folder: Path, m: Motion) -> Path:
    """A sketch for the serial plotter, which prints a comma too many: Accy:,0.04."""
    made = [f"Accx:{a[0]:.3f},Accy:,{a[1]:.3f},Accz:{a[2]:.3f},Gyrox:{g[0]:.2f},Gyroy:{g[1]:.2f},Gyroz:{g[2]:.2f}"
            for a, g in zip(m.g, m.deg, strict=True)]  # fmt: skip
    return write(folder / "plotter.txt", "mag scale []: \n1.01, 0.99, 1.00\n", "\n".join(made))


@layout("strangers")
def bluest_ticks(folder: Path, m: Motion) -> Path:
    """ST's BlueST app: a file a sensor, a counter of 5 ms beside the phone's ms, mGa."""
    k = np.arange(len(m.t))
    stamps = [f"20220112_101530.120,{t + 40},STTILE-1,{511 + 2 * i}," for t, i in zip(ms(m), k, strict=True)]
    for kind, unit, values in (
        ("Accelerometer", "mg", 1e3 * m.g), ("Gyroscope", "dps", m.deg), ("Magnetometer", "mGa", 10 * m.mag),
    ):  # fmt: skip
        head = f"Logged started on: 20220112_101530\nFeature: {kind}\n\nDate,HostTimestamp,NodeName,NodeTimestamp,"
        head += f"RawData,X ({unit}),Y ({unit}),Z ({unit}),\n"
        text = with_words(stamps, rows(values, form="%.1f"))
        write(folder / f"20220112_101530_{kind}.csv", head, text.replace("\n", ",\n"))
    return folder


@layout("strangers")
def sample_time_fine(folder: Path, m: Motion) -> Path:
    """A driver of Xsens' MTi: SampleTimeFine counts 100 µs, tv_sec and tv_usec are the computer's clock."""
    head = "PacketCounter;SampleTimeFine;StatusWord;Acc_X;Acc_Y;Acc_Z;Gyr_X;Gyr_Y;Gyr_Z;Mag_X;Mag_Y;Mag_Z;"
    head += "tv_sec;tv_usec;\n"
    unix = ms(m) + EPOCH
    k, field = np.arange(len(m.t)), m.mag / np.linalg.norm(m.mag, axis=1, keepdims=True)
    text = rows(
        k, 777_000 + 100 * k, np.full(len(k), 7), m.acc, m.gyr, field, unix // 1000, unix % 1000 * 1000, sep=";"
    )
    return write(folder / "mt.csv", head, text.replace("\n", ";\n"))


@layout("strangers")
def axes_called_1_2(folder: Path, m: Motion) -> Path:
    """gopro-telemetry: the second and third axis are called 1 and 2, a file for each sensor."""
    words = dates(m, "%Y-%m-%dT%H:%M:%S.%fZ", 6)
    for key, title, values in (("ACCL", "Accelerometer [m/s2]", m.acc), ("GYRO", "Gyroscope [rad/s]", m.gyr)):
        head = f"cts,date,{title},1,2,temperature [°C]\n"
        text = rows(values, np.full(len(m.t), 31.2))
        cts = [f"{1e3 * t:.3f},{word}" for t, word in zip(m.t, words, strict=True)]
        write(folder / f"GH011042-{key}.csv", head, with_words(cts, text))
    return folder


@layout("strangers")
def clock_before_date(folder: Path, m: Motion) -> Path:
    """An X-NUCLEO's logger: 12:34:56    05/11/22, whole seconds; mg, mdps, mG."""
    head = "Timestamp;ACC_X;ACC_Y;ACC_Z;GYR_X;GYR_Y;GYR_Z;MAG_X;MAG_Y;MAG_Z;Temp;;GNSS Position;\n"
    whole = np.rint(np.hstack([1e3 * m.g, 1e3 * m.deg, 10 * m.mag])).astype(int)
    text = with_words(dates(m, "%H:%M:%S    %d/%m/%y"), rows(whole, np.full(len(m.t), 27.06), sep=";"), ";")
    return write(folder / "DATA01.CSV", head, text.replace("\n", ";;;\n"))


@layout("strangers")
def rotation_in_german(folder: Path, m: Motion) -> Path:
    """Beschleunigung x=… Rotationsgeschwindigkeit x=… of a Nano 33."""
    made = [f"Beschleunigung x={a[0]:.3f} y={a[1]:.3f} z={a[2]:.3f} "
            f"Rotationsgeschwindigkeit x={g[0]:.2f} y={g[1]:.2f} z={g[2]:.2f}"
            for a, g in zip(m.g, m.deg, strict=True)]  # fmt: skip
    return write(folder / "monitor.txt", "Der Arduino muss jetzt gerade liegen!\n", "\n".join(made))


@layout("strangers")
def angvelocity(folder: Path, m: Motion) -> Path:
    """A headphone's SDK: accel_x_mps2, angvelocity_x_radps."""
    head = "orientation,1\nsensor_timestamp_milliseconds,local_timestamp_milliseconds,accel_x_mps2,accel_y_mps2,"
    head += "accel_z_mps2,angvelocity_x_radps,angvelocity_y_radps,angvelocity_z_radps,yaw,pitch,roll\n"
    angles = np.tile([-122.6, -7.3, 4.5], (len(m.t), 1))
    return write(folder / "acc.csv", head, rows(ms(m) + 8123456, ms(m) + EPOCH, m.acc, m.gyr, angles))


@layout("strangers")
def android_uncalibrated(folder: Path, m: Motion) -> Path:
    """Google's decimetre challenge: rows of uncalibrated sensors, the phone's bias in the last three columns."""
    head = "MessageType,utcTimeMillis,elapsedRealtimeNanos,MeasurementX,MeasurementY,MeasurementZ,BiasX,BiasY,BiasZ\n"
    bias = np.array([11.0, 5.0, -20.0])
    lines = [
        f"{kind},{t + EPOCH},{123456789 * 10**6 + t * 10**6},{x[0]:.6f},{x[1]:.6f},{x[2]:.6f},{b[0]},{b[1]},{b[2]}"
        for t, a, g, f in zip(ms(m), m.acc, m.gyr, m.mag + bias, strict=True)
        for kind, x, b in (("UncalGyro", g, 0 * bias), ("UncalAccel", a, 0 * bias), ("UncalMag", f, bias))
    ]
    return write(folder / "device_imu.csv", head, "\n".join(lines))
