"""The writer of a log, by the names of its columns, and the units that this writer always uses without a mark."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from levelhead.sources.hints import Scale
from levelhead.units import GRAVITY


class Vendor(NamedTuple):
    """A program or device.

    Attributes:
        name: its usual name.
        marks: patterns, each of which some column's name must match.
        units: role to unit, where its files do not have it.
    """

    name: str
    marks: tuple[str, ...]
    units: Mapping[str, str]


_RADIANS = {"gyr": "rad/s"}
VENDORS = (
    Vendor("Sensor Logger", (r"^seconds_elapsed$", r"^time$|^t \[ns\]$"), _RADIANS),
    Vendor("Core Motion", (r"rotationRate[XYZ.]|RotationRate[XYZ.]|rotation_rate_x", r"(?i)accel|gravity"), _RADIANS),
    Vendor("Movella DOT", (r"^DeviceTag|\bDOT\b", r"^Gyr_X$"), {"gyr": "deg/s", "acc": "m/s²"}),
    Vendor(
        "Movella DOT",
        (r"^SampleTimeFine$", r"^(dq_W|Quat_W|Euler_X|Status)$", r"^Gyr_X$"),
        {"gyr": "deg/s", "acc": "m/s²"},
    ),
    Vendor("MAVLink", (r"^time_boot_ms$", r"^xgyro$", r"^xacc$"), {"gyr": "mrad/s", "acc": "mg", "mag": "mG"}),
    Vendor("Xsens", (r"^(Packet)?Counter$", r"^Acc_X$", r"^Gyr_X$"), _RADIANS | {"acc": "m/s²"}),
    Vendor("ROS", (r"angular_velocity[._]x$", r"linear_acceleration[._]x$"), _RADIANS),
    Vendor("EuRoC", (r"^#?w_RS_S_x", r"^a_RS_S_x"), _RADIANS),
    Vendor("ArduPilot", (r"^GyrX$", r"^AccX$", r"^TimeUS$"), _RADIANS | {"acc": "m/s²", "mag": "mG"}),
    Vendor("Betaflight", (r"^loopIteration$", r"^gyroADC\[0\]|^gyroData\[0\]"), {"gyr": "deg/s"}),
    Vendor("MATLAB Mobile", (r"^AngularVelocity[._]?X$|^AngularVelocity[._]1$", r"^Acceleration"), _RADIANS),
    Vendor("YEI 3-Space", (r"ChipTimeUS", r"RawGyroX"), _RADIANS),
    Vendor(
        "MicroStrain",
        (r"X Gyro \[x8005\]|scaledGyroX|deltaThetaX", r"X Accel|scaledAccelX"),
        _RADIANS | {"acc": "g", "mag": "G"},
    ),
)


_GYROFLOW = {"gyr": ("gscale", 1.0, "rad/s"), "acc": ("ascale", GRAVITY, "g")}  # the value of a number, in these units


def gyroflow_scale(role: str, preamble: Sequence[str]) -> Scale | None:
    """The scale that the preamble of Gyroflow's .gcsv gives a sensor; None if it gives none."""
    if role not in _GYROFLOW or not any(line.startswith("GYROFLOW") for line in preamble):
        return None
    word, factor, unit = _GYROFLOW[role]
    for line in preamble:
        name, _, text = line.partition(",")
        if name.strip() == word and (count := _positive(text)) is not None:
            return Scale(count * factor, f"counts, {count:g} {unit} each")
    return None


def _positive(text: str) -> float | None:
    """A number above 0; None for anything else."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 < value < math.inf and "_" not in text else None


def find_vendor(names: Sequence[str]) -> Vendor | None:
    """The writer of columns of these names; None: unknown."""
    for vendor in VENDORS:
        if all(any(re.search(mark, name.strip()) for name in names) for mark in vendor.marks):
            return vendor
    return None
