"""The sketch for a chip on I²C, which logs lines for `levelhead fuse`."""

from collections.abc import Mapping

from levelhead.axis_map import IDENTITY
from levelhead.export.c_api import ANY_FILTER, CApi
from levelhead.export.chips import SketchChip, find_chip
from levelhead.export.config import ExportConfig
from levelhead.export.layout import template
from levelhead.export.magnetometers import field_reader, find_magnetometer
from levelhead.export.register_writes import write_calls
from levelhead.units import GRAVITY

NEEDS = "// Needs {0}.h and {0}.c in the sketch's folder; exported with --arduino they are a library.\n"
READINGS = "t [s],gyr_x [rad/s],gyr_y [rad/s],gyr_z [rad/s],acc_x [m/s^2],acc_y [m/s^2],acc_z [m/s^2]"
ANSWERS = ",board_qw,board_qx,board_qy,board_qz"
FIELD = ",mag_x [uT],mag_y [uT],mag_z [uT]"


RAW = """  for (int k = 0; k < 3; k++) {
    print_value(gyr[k], 6);
  }
  for (int k = 0; k < 3; k++) {
    print_value(acc[k], 5);
  }"""
RAW_FIELD = """
  for (int k = 0; k < 3; k++) {
    print_value(mag[k], 3);
  }"""
WAIT = """  Serial.println(F("# keep still"));
  while (!calibrate()) {
    Serial.println(F("# it moved; keep still"));
  }
"""


def _full_scale(table: Mapping[float, float], wanted: float, usual: float) -> float:
    """The full scale that the guard has, if the chip has it too."""
    return next((known for known in table if abs(known - wanted) < 0.01 * known), usual)


def sketch(api: CApi, boards: str, beside: bool) -> str:
    """The sketch; ``boards``: those that hold it.

    ``beside``: it needs the filter's two files in its own folder, as no library brings them.
    """
    config = api.config
    guard = config.guard
    name, chip = config.name, find_chip(config.chip)
    gyr_range = _full_scale(chip.gyr, guard.gyr_range if guard else 0.0, 500.0)
    acc_range = _full_scale(chip.acc, guard.acc_range / GRAVITY if guard else 0.0, 4.0)
    return template("sketch.ino").substitute(
        api.common_gaps()
        | (_axis(config) if config.axis else _imu(config))
        | _field(config, chip)
        | _bias(config)
        | _chip(chip)
        | {
            "gyr_range": f"{gyr_range:g}",
            "acc_range": f"{acc_range:g}",
            "gyr_count": f"{chip.gyr[gyr_range]:.8g}",
            "acc_count": f"{chip.acc[acc_range]:.8g}",
            "start_lines": "\n    && ".join(write_calls("CHIP", chip.start(gyr_range, acc_range))),
            "include": f'"{name}.h"' if beside else f"<{name}.h>",
            "boards": boards,
            "where": NEEDS.format(name) if beside else "",
        }
    )


def _chip(chip: SketchChip) -> dict[str, object]:
    """Its address, its identity and its output registers."""
    layout = chip.layout
    register, value, mask = (f"0x{number:02X}" for number in chip.identity)
    return {
        "chip": chip.name,
        "article": "an" if chip.name[0] in "AEILM" else "a",
        "source": chip.source,
        "address": f"0x{chip.address:02X}",
        "identity": register,
        "value": value,
        "mask": mask,
        "first": f"0x{layout.first:02X}",
        "bytes": 2 * layout.words,
        "words": layout.words,
        "high": "other" if layout.little else "one",
        "low": "one" if layout.little else "other",
        "gyr_word": layout.gyr[0],
        "acc_word": layout.acc[0],
    }


def _field(config: ExportConfig, chip: SketchChip) -> dict[str, str]:
    """The magnetometer, where the board has one and the filter uses it."""
    found = find_magnetometer(config, chip.name)
    if found is None:
        return {"field": "", "starts_field": "", "mag": ""}
    lines = ["float mag[3];", "if (!read_field(mag)) {", "  mag[0] = mag[1] = mag[2] = NAN;", "}"]
    return {
        "field": field_reader(found),
        "starts_field": " || !start_field()",
        "mag": "".join(f"  {line}\n" for line in lines),
    }


def _bias(config: ExportConfig) -> dict[str, str]:
    """The gyroscope's bias is read off at the start, unless the filter or its calibration has it already."""
    if config.prior is not None or config.calibration is not None:
        start = "The calibration of this sensor has the gyroscope's bias."
        return {"still": "", "wait": "", "bias": "", "unbiased": "gyr[k]", "start": start}
    return {
        "still": template("sketch.still.ino").template,
        "wait": WAIT,
        "bias": "float bias[3];  // rad/s\n",
        "unbiased": "gyr[k] - bias[k]",
        "start": "Keep the sensor still for two seconds after a reset: its bias is read off.",
    }


def _log_inputs(config: ExportConfig, given: str, field: bool) -> str:
    """The filter's input, into the log."""
    if not config.corrects:
        return RAW + RAW_FIELD if field else RAW
    lines = [f"  const {ANY_FILTER}_readings fed = {ANY_FILTER}_corrected(&filter, {given});"]
    for name, digits in (("gyr", 6), ("acc", 5), *([("mag", 3)] if field else [])):
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
    field = find_magnetometer(config, find_chip(config.chip).name) is not None
    read = ["gyr", "acc", *(["mag"] if field else [])]
    wide = ", ".join(f"{one[0]}[3] = {{{one}[0], {one}[1], {one}[2]}}" for one in read)
    update = [f"  const double {wide};"] if real == "double" else []
    taken = [one[0] if real == "double" else one for one in read]
    given = ", ".join(taken if field else [*taken, "NULL"])
    update.append(f"  {name}_update(&filter, {given}, {_seconds(real)});")
    parts = [f"  const {name}_output out = {name}_read(&filter);"]
    for axis in "wxyz":
        parts.append(f"  print_value({_narrow(f'out.quat.{axis}', real)}, 6);")
    healthy = "health" in config.answers
    parts += ["  Serial.print(',');", "  Serial.print((long)out.health);"] if healthy else []
    return {
        "own": "board_q           ",
        "now": "",
        "mounted": _axes_remark(config),
        "fed": _log_inputs(config, given, field),
        "init": f"  {name}_init(&filter);",
        "update": "\n".join(update),
        "head": f"{READINGS}{FIELD if field else ''}{ANSWERS}{',board_health' if healthy else ''}",
        "print": "\n".join(parts),
    }


def _axis(config: ExportConfig) -> dict[str, str]:
    """Roll, the lesson's angle: from the accelerometer, and its rate from the gyroscope."""
    name, real = ANY_FILTER, config.real
    init = [
        "  float gyr[3], acc[3];",
        "  while (!read_chip(gyr, acc)) {",
        "  }",
        f"  {name}_init(&filter, atan2(acc[1], acc[2]) / DEGREE);",
        "  now.level = atan2(acc[1], acc[2]) / DEGREE;",
    ]
    update = [
        "  const float roll = atan2(acc[1], acc[2]) / DEGREE;  // deg",
        f"  {name}_update(&filter, roll, gyr[0] / DEGREE, {_seconds(real)}, 360, &now);",
    ]
    return {
        "own": "column:board_roll",
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
