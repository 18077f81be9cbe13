"""Layouts of firmware: what boards print and write to cards, after headers and print statements in public code."""

import json
from pathlib import Path

import numpy as np
from tests.reference.dialects import Motion, dates, ms, rows, with_words, write
from tests.reference.layouts import layout


def _const(m: Motion, *values: float) -> np.ndarray:
    return np.tile(values, (len(m.t), 1))


def _us(m: Motion) -> np.ndarray:
    return np.rint(m.t * 1e6).astype(np.int64) + 2_000_000


@layout("firmware")
def direct_registers(folder: Path, m: Motion) -> Path:
    """A board that reads MPU6050 registers itself, units in the names."""
    head = "time_ms,accel_x_g,accel_y_g,accel_z_g,gyro_x_dps,gyro_y_dps,gyro_z_dps\n"
    return write(folder / "log.csv", head, rows(ms(m) + 29098, m.g, m.deg, form="%.4f"))


@layout("firmware")
def cansat_card(folder: Path, m: Motion) -> Path:
    """A CanSat's card by Adafruit's unified driver: m/s², rad/s, Time in ms."""
    head = "Time,Ax,Ay,Az,Gx,Gy,Gz,Temp,Humidity,Battery\n"
    return write(folder / "CANSAT.CSV", head, rows(ms(m) + 812, m.acc, m.gyr, _const(m, 24.5, 41.0, 3.92), form="%.2f"))


@layout("firmware")
def data_in_brackets(folder: Path, m: Motion) -> Path:
    """A rocket's card: [Data] above the header, everything else behind."""
    head = "[Data]\ntime,ax,ay,az,gx,gy,gz,mx,my,mz,roll,pitch,yaw,maxG,T,P,P_alt,fix,lon,lat,alt,vn,ve,vd,eject\n"
    rest = _const(m, 0.1, 0.2, 0.3, 1.1, 24.0, 1012.3, 3.0, 0, 127.0, 37.0, 40.0, 0.0, 0.0, 0.0, 0)
    return write(folder / "FLIGHT03.TXT", head, rows(m.t + 3.0, m.g, m.deg, m.mag, rest, form="%.3f"))


@layout("firmware")
def counts_of_a_badge(folder: Path, m: Motion) -> Path:
    """LSM_IMU.CSV of a badge: frame, ticks in ms, counts of an LSM6DSOX at ±4 g (0.122 mg) and ±2000 °/s (70 mdps)."""
    head = "frame_id,tick_ms,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n"
    counts = np.rint(np.hstack([m.g / 0.122e-3, m.deg / 70e-3])).astype(int)
    return write(folder / "LSM_IMU.CSV", head, rows(np.arange(len(m.t)), ms(m) + 5272, counts))


@layout("firmware")
def prefixed_imu(folder: Path, m: Motion) -> Path:
    """Every name with imu_ before it, counters of failures behind."""
    head = "imu_time_us,imu_sample,imu_temp_c,accel_x_g,accel_y_g,accel_z_g,gyro_x_dps,gyro_y_dps,gyro_z_dps,"
    text = rows(_us(m), np.arange(len(m.t)), _const(m, 24.1), m.g, m.deg, np.zeros(len(m.t), int), form="%.5f")
    return write(folder / "serial.csv", head + "imu_failed_reads\n", text)


@layout("firmware")
def milli_units(folder: Path, m: Motion) -> Path:
    """Whole mg and mdps of a vibration monitor."""
    head = "frame_id, tick_ms, accX_mg, accY_mg, accZ_mg, gyroX_mdps, gyroY_mdps, gyroZ_mdps\n"
    whole = np.rint(np.hstack([1e3 * m.g, 1e3 * m.deg])).astype(int)
    return write(folder / "lsm.csv", head, rows(np.arange(len(m.t)), ms(m), whole))


@layout("firmware")
def raw_and_calibrated_numbered(folder: Path, m: Motion) -> Path:
    """A buoy: rawAcc0 … counts, acc0 … calibrated in m/s² and deg/s."""
    head = "timestamp,rawAcc0,rawAcc1,rawAcc2,rawGyr0,rawGyr1,rawGyr2,rawMag0,rawMag1,rawMag2,"
    head += "acc0,acc1,acc2,gyr0,gyr1,gyr2,mag0,mag1,mag2\n"
    raw = np.rint(np.hstack([m.g * 4096 + 30, m.deg * 32.8 - 12, m.mag / 0.15])).astype(int)
    return write(folder / "buoy.csv", head, rows(ms(m) + 1000, raw, m.acc, m.deg, m.mag, form="%.4f"))


@layout("firmware")
def chiptime(folder: Path, m: Motion) -> Path:
    """WitMotion's Python example: Chiptime as a date without zeros, tabs, degrees."""
    head = "Chiptime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tAngleY(deg)\tAngleZ(deg)\tT(°)"
    head += "\tmagx\tmagy\tmagz\tlon\tlat\tYaw\tSpeed\tq1\tq2\tq3\tq4\n"
    more = _const(m, 1.0, 2.0, 3.0, 30.5, 120, -80, 333, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    words = [one.replace("-0", "-") for one in dates(m, "%Y-%m-%d %H:%M:%S.%f", 3)]
    return write(folder / "20230504.txt", head, with_words(words, rows(m.g, m.deg, more, sep="\t", form="%.4f"), "\t"))


@layout("firmware")
def blank_for_the_time(folder: Path, m: Motion) -> Path:
    """An older one: the header begins with a blank, the lines with a clock time."""
    head = " \tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tAngleY(deg)\tAngleZ(deg)\tT(°)\n"
    text = rows(m.g, m.deg, _const(m, 1.0, 2.0, 3.0, 30.5), sep="\t", form="%.4f")
    return write(folder / "old.txt", head, with_words(dates(m, " %H:%M:%S.%f", 3), text, "\t"))


@layout("firmware")
def stamps_behind_each_report(folder: Path, m: Motion) -> Path:
    """A BNO085's reports, each with its own stamp …_t in ms; linear acceleration and gravity beside."""
    axes = [
        f"{stem}_{a}" for stem in ("acceleration", "angular_velocity", "linear_acceleration", "gravity") for a in "xyzt"
    ]
    head = ",".join(["time_ms", "time_utc", *axes, *(f"orientation_{a}" for a in ("i", "j", "k", "real", "t"))]) + "\n"
    t = ms(m) + 60123
    text = rows(
        m.acc, t - 3, m.gyr, t - 2, m.linear, t - 4, m.acc - m.linear, t - 4, _const(m, 0, 0, 0, 1), t - 1, form="%.4f"
    )
    text = with_words(dates(m, "%Y-%m-%dT%H:%M:%SZ"), text)
    return write(folder / "bno.csv", head, with_words(map(str, t), text))


@layout("firmware")
def race_logger_with_units_row(folder: Path, m: Motion) -> Path:
    """A race logger's export: quoted preamble, names, a row of units."""
    head = '"Format","CSV File"\n"Venue","Most"\n"Sample Rate","100"\n\n'
    head += "Time,GPS Speed,GPS Nsat,AccelerometerX,AccelerometerY,AccelerometerZ,GyroX,GyroY,GyroZ,Int Batt Voltage\n"
    head += "s,km/h, ,g,g,g,deg/s,deg/s,deg/s,V\n\n"
    return write(folder / "lap.csv", head, rows(m.t, _const(m, 80.0, 11), m.g, m.deg, _const(m, 12.1), form="%.4f"))


@layout("firmware")
def values_in_words(folder: Path, m: Motion) -> Path:
    """'Ax value: 0.10   Ay value: …' without a time."""
    made = [
        "".join(
            f"{name} value: {v:.3f}   " for name, v in zip(("Ax", "Ay", "Az", "Gx", "Gy", "Gz"), (*a, *g), strict=True)
        )
        for a, g in zip(m.acc, m.deg, strict=True)
    ]
    return write(folder / "monitor.txt", "\n".join(made))


@layout("firmware")
def pairs_with_semicolons(folder: Path, m: Motion) -> Path:
    """'ax: 0.1;  ay: …;  gz: 0.2;' behind a time in ms."""
    made = [
        f"t: {t};  "
        + "  ".join(f"{n}: {v:.3f};" for n, v in zip(("ax", "ay", "az", "gx", "gy", "gz"), (*a, *g), strict=True))
        for t, a, g in zip(ms(m), m.acc, m.gyr, strict=True)
    ]
    return write(folder / "radio.log", "\n".join(made))


@layout("firmware")
def letters_before_triples(folder: Path, m: Motion) -> Path:
    """'T:1234 A:0.1,0.2,9.8 G:0.1,0.2,0.3'."""
    made = [
        f"T:{t} A:{','.join(f'{v:.3f}' for v in a)} G:{','.join(f'{v:.3f}' for v in g)}"
        for t, a, g in zip(ms(m), m.acc, m.deg, strict=True)
    ]
    return write(folder / "esp.log", "\n".join(made))


@layout("firmware")
def openlog_artemis(folder: Path, m: Motion) -> Path:
    """OpenLog Artemis: a date, a time in hundredths, mg, dps, µT, the rate in the last column, a comma at the end."""
    head = "rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,\n"
    text = rows(1e3 * m.g, m.deg, m.mag, _const(m, 31.2, 100.0), form="%.2f").replace("\n", ",\n")
    return write(folder / "dataLog00001.TXT", head, with_words(dates(m, "%m/%d/%Y,%H:%M:%S.%f", 2), text.strip()))


@layout("firmware")
def openlog_micros(folder: Path, m: Motion) -> Path:
    """The same with the board's microseconds and without a date."""
    head = "micros,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,count,\n"
    text = rows(_us(m), 1e3 * m.g, m.deg, m.mag, _const(m, 31.2, 100.0), np.arange(len(m.t)), form="%.2f")
    return write(folder / "dataLog00002.TXT", head, text.replace("\n", ",\n"))


@layout("firmware")
def m5_without_time(folder: Path, m: Motion) -> Path:
    """M5StickC: a header, no time."""
    return write(folder / "m5.csv", "AccX,AccY,AccZ,GyroX,GyroY,GyroZ\n", rows(m.g, m.deg, form="%.3f"))


@layout("firmware")
def semicolons_at_the_end(folder: Path, m: Motion) -> Path:
    """micros; ax; … with a semicolon behind each line and header."""
    head = "micros; ax; ay; az; gx; gy; gz;\n"
    return write(folder / "teensy.txt", head, rows(_us(m), m.acc, m.gyr, sep="; ", form="%.4f").replace("\n", ";\n"))


@layout("firmware")
def short_json(folder: Path, m: Motion) -> Path:
    """{"t":12,"a":[…],"g":[…]} a line."""
    made = [json.dumps({"t": int(t), "a": a, "g": g})
            for t, a, g in zip(ms(m), m.acc.round(4).tolist(), m.deg.round(3).tolist(), strict=True)]  # fmt: skip
    return write(folder / "esp32.log", "\n".join(made))


@layout("firmware")
def tuples_in_quotes(folder: Path, m: Motion) -> Path:
    """MicroPython: time,accel,gyro with tuples in quotes."""
    made = [f'{t:.3f},"({a[0]:.3f}, {a[1]:.3f}, {a[2]:.3f})","({g[0]:.3f}, {g[1]:.3f}, {g[2]:.3f})"'
            for t, a, g in zip(m.t, m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "pico.csv", "time,accel,gyro\n", "\n".join(made))


@layout("firmware")
def can_by_turns(folder: Path, m: Motion) -> Path:
    """Decoded CAN: a row holds the signals of one message, the others are blank."""
    made = ["Timestamp,ID,IMU_AccelX,IMU_AccelY,IMU_AccelZ,IMU_GyroX,IMU_GyroY,IMU_GyroZ,IMU_Roll"]
    for t, a, g in zip(m.t, m.g, m.deg, strict=True):
        made.append(f"{t + 55.0:.4f},0x97,{a[0]:.4f},{a[1]:.4f},{a[2]:.4f},,,,")
        made.append(f"{t + 55.0005:.4f},0x98,,,,{g[0]:.3f},{g[1]:.3f},{g[2]:.3f},")
    return write(folder / "can.csv", "\n".join(made))


@layout("firmware")
def drone_magnetometer(folder: Path, m: Motion) -> Path:
    """A survey drone: date and time apart, one scalar magnetometer, nT."""
    head = "Date,Time,Latitude,Longitude,Mag,GyroscopeX,GyroscopeY,GyroscopeZ,"
    head += "AccelerometerX,AccelerometerY,AccelerometerZ\n"
    text = rows(_const(m, 37.1, 127.2, 50669.4), m.deg, m.g, form="%.4f")
    return write(folder / "survey.csv", head, with_words(dates(m, "%Y-%m-%d,%H:%M:%S.%f", 3), text))


@layout("firmware")
def msp_raw(folder: Path, m: Motion) -> Path:
    """MSP_RAW_IMU of a flight controller: acceleration in 512 per g, rates in deg/s, both whole."""
    head = "t,wall,dt,armed,roll_deg,pitch_deg,yaw_deg,gyro_x_raw,gyro_y_raw,gyro_z_raw,acc_x_raw,acc_y_raw,acc_z_raw\n"
    whole = np.rint(np.hstack([m.deg, 512 * m.g])).astype(int)
    text = rows(m.t, m.t + 1683203415.25, _const(m, 0.01, 1, 0.1, 0.2, 0.3), whole, form="%.3f")
    return write(folder / "msp.csv", head, text)


@layout("firmware")
def esp_idf_log(folder: Path, m: Motion) -> Path:
    """I (1234) IMU: acc 0.1 0.2 9.8 gyr 0.1 0.2 0.3"""
    made = [f"I ({t + 320}) IMU: acc {a[0]:.3f} {a[1]:.3f} {a[2]:.3f} gyr {g[0]:.3f} {g[1]:.3f} {g[2]:.3f}"
            for t, a, g in zip(ms(m), m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "idf.log", "I (12) boot: ESP-IDF v5.1\n", "\n".join(made))


@layout("firmware")
def zephyr_shell(folder: Path, m: Motion) -> Path:
    """Zephyr's sensor sample: two lines a sample, with units and brackets."""
    made = [f"[{t // 3600000:02d}:{t // 60000 % 60:02d}:{t // 1000 % 60:02d}.{t % 1000:03d}]:"
            f" accel {a[0]:f} {a[1]:f} {a[2]:f} m/s/s\n  gyro {g[0]:f} {g[1]:f} {g[2]:f} rad/s"
            for t, a, g in zip(ms(m), m.acc, m.gyr, strict=True)]  # fmt: skip
    return write(folder / "zephyr.txt", "\n".join(made))
