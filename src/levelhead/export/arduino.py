"""The sketch for an MPU-6050, which logs what `levelhead fuse` reads."""

from collections.abc import Mapping

from levelhead.axis_map import IDENTITY
from levelhead.export.c_api import ANY_FILTER, CApi
from levelhead.export.config import ExportConfig
from levelhead.export.layout import template
from levelhead.units import GRAVITY

# RM-MPU-6000A, rev. 4.2, sections 4.4 and 4.5: full scale -> FS_SEL or AFS_SEL, counts per unit (tables 4.19 and 4.17)
GYR = {250.0: (0, 131.0), 500.0: (1, 65.5), 1000.0: (2, 32.8), 2000.0: (3, 16.4)}  # deg/s
ACC = {2.0: (0, 16384.0), 4.0: (1, 8192.0), 8.0: (2, 4096.0), 16.0: (3, 2048.0)}  # g
NEEDS = "// Needs {0}.h and {0}.c in the sketch's folder; exported with --arduino they are a library.\n"
READINGS = "t [s],gyr_x [rad/s],gyr_y [rad/s],gyr_z [rad/s],acc_x [m/s^2],acc_y [m/s^2],acc_z [m/s^2]"


RAW = """  for (int k = 0; k < 3; k++) {
    print_value(gyr[k], 6);
  }
  for (int k = 0; k < 3; k++) {
    print_value(acc[k], 5);
  }"""
WAIT = """  Serial.println(F("# keep still"));
  while (!calibrate()) {
    Serial.println(F("# it moved; keep still"));
  }
"""


def _scale(table: Mapping[float, tuple[int, float]], wanted: float, usual: float) -> tuple[float, int, float]:
    """Full scale, its bits, and counts per unit: the one that the guard was told, if the chip has it."""
    full = next((known for known in table if abs(known - wanted) < 0.01 * known), usual)
    bits, counts = table[full]
    return full, bits << 3, counts


def sketch(api: CApi, boards: str, beside: bool) -> str:
    """The sketch; ``boards``: those that hold it.

    ``beside``: it needs the filter's two files in its own folder, as no library brings them.
    """
    config = api.config
    guard = config.guard
    gyr_range, gyr_bits, gyr_lsb = _scale(GYR, guard.gyr_range if guard else 0.0, 500.0)
    acc_range, acc_bits, acc_lsb = _scale(ACC, guard.acc_range / GRAVITY if guard else 0.0, 4.0)
    name = config.name
    return template("mpu6050.ino").substitute(
        api.common_gaps()
        | (_axis(config) if config.axis else _imu(config))
        | _bias(config)
        | {
            "gyr_range": f"{gyr_range:g}",
            "gyr_bits": f"0x{gyr_bits:02X}",
            "gyr_lsb": gyr_lsb,
            "acc_range": f"{acc_range:g}",
            "acc_bits": f"0x{acc_bits:02X}",
            "acc_lsb": acc_lsb,
            "include": f'"{name}.h"' if beside else f"<{name}.h>",
            "boards": boards,
            "where": NEEDS.format(name) if beside else "",
        }
    )


def _bias(config: ExportConfig) -> dict[str, str]:
    """The gyroscope's bias is read off at the start, unless the filter or its calibration knows of it already."""
    if config.prior is not None or config.calibration is not None:
        start = "The gyroscope's bias is among what is known of this sensor."
        return {"still": "", "wait": "", "bias": "", "unbiased": "gyr[k]", "start": start}
    return {
        "still": template("mpu6050.still.ino").template,
        "wait": WAIT,
        "bias": "float bias[3];  // rad/s\n",
        "unbiased": "gyr[k] - bias[k]",
        "start": "Keep the sensor still for two seconds after a reset: its bias is read off.",
    }


def _log_inputs(config: ExportConfig, given: str) -> str:
    """What the filter was fed with, into the log."""
    if not config.corrects:
        return RAW
    lines = [f"  const {ANY_FILTER}_readings fed = {ANY_FILTER}_corrected(&filter, {given}, NULL);"]
    for name, digits in (("gyr", 6), ("acc", 5)):
        lines += [f"  print_value({_narrow(f'fed.{name}.{axis}', config.real)}, {digits});" for axis in "xyz"]
    return "\n".join(lines)


def _axes_remark(config: ExportConfig) -> str:
    """A remark on the axes."""
    if config.axes == IDENTITY:
        return ""
    return (
        f"// The body's x (forward), y (left), z (up) are the sensor's {config.axes}; the log is in the body's axes.\n"
    )


def _imu(config: ExportConfig) -> dict[str, str]:
    name, real = ANY_FILTER, config.real
    convert = f"const {real} g[3] = {{gyr[0], gyr[1], gyr[2]}}, a[3] = {{acc[0], acc[1], acc[2]}};"
    given = ("g", "a") if real == "double" else ("gyr", "acc")
    update = [f"  {convert}"] if real == "double" else []
    update.append(f"  {name}_update(&filter, {given[0]}, {given[1]}, NULL, {_seconds(real)});")
    parts = [f"  const {name}_output out = {name}_read(&filter);"]
    for axis in "wxyz":
        parts.append(f"  print_value({_narrow(f'out.quat.{axis}', real)}, 6);")
    healthy = "health" in config.answers
    parts += ["  Serial.print(',');", "  Serial.print((long)out.health);"] if healthy else []
    return {
        "now": "",
        "mounted": _axes_remark(config),
        "fed": _log_inputs(config, ", ".join(given)),
        "init": f"  {name}_init(&filter);",
        "update": "\n".join(update),
        "head": f"{READINGS},board_qw,board_qx,board_qy,board_qz{',board_health' if healthy else ''}",
        "print": "\n".join(parts),
    }


def _axis(config: ExportConfig) -> dict[str, str]:
    """Roll, the lesson's angle: from the accelerometer, and its rate from the gyroscope."""
    name, real = ANY_FILTER, config.real
    init = [
        "  float gyr[3], acc[3];",
        "  while (!read_mpu(gyr, acc)) {",
        "  }",
        f"  {name}_init(&filter, atan2(acc[1], acc[2]) / DEGREE);",
        "  now.level = atan2(acc[1], acc[2]) / DEGREE;",
    ]
    update = [
        "  const float roll = atan2(acc[1], acc[2]) / DEGREE;  // deg",
        f"  {name}_update(&filter, roll, gyr[0] / DEGREE, {_seconds(real)}, 360, &now);",
    ]
    return {
        "mounted": "",
        "fed": RAW,
        "init": "\n".join(init),
        "update": "\n".join(update),
        "head": f"{READINGS},measured_roll,board_roll",
        "print": f"  print_value(roll, 4);\n  print_value({_narrow('now.level', real)}, 4);",
        "now": f"{name}_report now;\n",
    }


def _seconds(real: str) -> str:
    return "passed * 1e-6" if real == "double" else "passed * 1e-6f"


def _narrow(value: str, real: str) -> str:
    return f"(float){value}" if real == "double" else value
