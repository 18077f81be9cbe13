"""The units that people write, each with its factor to SI: the only place where degrees, g and gauss exist by name."""

import math
import re
from functools import cache

from levelhead.errors import LevelheadError, nearest

GRAVITY = 9.80665  # m/s², standard gravity (CGPM 1901)
DEGREE = math.pi / 180.0  # rad

SI = {"time": "s", "gyr": "rad/s", "acc": "m/s²", "mag": "µT", "angle": "rad"}

FACTORS: dict[str, dict[str, float]] = {
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
        **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), 1e-3),
        **dict.fromkeys(("us", "usec", "usecs", "micros", "microsecond", "microseconds"), 1e-6),
        "100us": 1e-4,  # SampleTimeFine (Xsens, MT Low-Level Communication Protocol, XDI_SampleTimeFine)
        **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecond", "nanoseconds"), 1e-9),
        "min": 60.0,
        "days": 86400.0,
    },
    "gyr": {
        "rad/s": 1.0,
        "rads": 1.0,
        **dict.fromkeys(("rad/sec", "rad/second", "radian/s", "radians/s", "radians/sec", "radians/second"), 1.0),
        **dict.fromkeys(
            (
                "rad s^-1",
                "rad s-1",
                "rad*s^-1",
                "rad.s-1",
                "rad.s^-1",
                "rad per second",
                "radians per second",
                "rad/s^1",
                "radps",
            ),
            1.0,
        ),
        **dict.fromkeys(("mrad/s", "mrads"), 1e-3),
        **dict.fromkeys(("рад/с", "弧度/s", "弧度/秒", "рад/сек"), 1.0),
        "deg/s": DEGREE,
        **dict.fromkeys(("deg/sec", "deg/second", "degree/s", "degrees/s", "degree/sec"), DEGREE),
        **dict.fromkeys(("degrees/sec", "degree/second", "degrees/second"), DEGREE),
        **dict.fromkeys(
            (
                "deg s^-1",
                "deg s-1",
                "deg*s^-1",
                "deg.s-1",
                "deg.s^-1",
                "degps",
                "°/sec",
                "°s^-1",
                "°s-1",
                "deg per second",
                "degrees per second",
            ),
            DEGREE,
        ),
        "degs": DEGREE,
        "d/s": DEGREE,
        "dps": DEGREE,
        "°/s": DEGREE,
        **dict.fromkeys(("град/с", "град/сек", "度/秒", "度/s"), DEGREE),
        "mdeg/s": 1e-3 * DEGREE,
        "mdps": 1e-3 * DEGREE,
    },
    "acc": {
        "m/s²": 1.0,
        "m/s2": 1.0,
        "m/s^2": 1.0,
        "m/s/s": 1.0,
        "m/sec^2": 1.0,
        "ms2": 1.0,
        "ms-2": 1.0,
        "m/s**2": 1.0,
        **dict.fromkeys(
            ("m.s-2", "m.s^-2", "m/(s^2)", "m/(sec^2)", "m/(s2)", "m/s^-2", "mps^2", "m/s/sec", "n/kg"), 1.0
        ),
        **dict.fromkeys(("meters/s^2", "metres/s^2", "m per s^2", "meter/s^2"), 1.0),
        **dict.fromkeys(("meters/sec2", "meters/sec^2", "meters/second^2", "meters/s2", "meters/sec/sec"), 1.0),
        **dict.fromkeys(("m s^-2", "m s-2", "m*s^-2", "m/sec²", "m/sec2", "mss", "mpss"), 1.0),
        "mps2": 1.0,
        **dict.fromkeys(("м/с2", "м/с^2"), 1.0),
        **dict.fromkeys(("mm/s²", "mm/s2", "mm/s^2", "mms2"), 1e-3),
        "cm/s²": 1e-2,
        "cm/s2": 1e-2,
        "g": GRAVITY,
        "gs": GRAVITY,
        "g-force": GRAVITY,
        "gravity": GRAVITY,
        "milli-g": GRAVITY * 1e-3,
        "mgs": GRAVITY * 1e-3,
        "mg": GRAVITY * 1e-3,
        "ug": GRAVITY * 1e-6,
    },
    "mag": {
        "µT": 1.0,
        "uT": 1.0,
        "nT": 1e-3,
        "mT": 1e3,
        "T": 1e6,
        "G": 100.0,
        "gauss": 100.0,
        "Gs": 100.0,
        "mG": 0.1,
        "mGa": 0.1,
        "mgauss": 0.1,
        "milligauss": 0.1,
        "ga": 100.0,
        "ʯt": 1.0,  # how WitMotion writes µT
        **dict.fromkeys(("microtesla", "microteslas", "microT", "microt"), 1.0),
        "nanotesla": 1e-3,
        "tesla": 1e6,
    },
    "angle": {"rad": 1.0, "deg": DEGREE, "°": DEGREE},
}


USUAL = {  # suggestions in an error
    "time": ["s", "ms", "us", "ns"],
    "gyr": ["rad/s", "deg/s", "dps", "mdps"],
    "acc": ["m/s²", "g", "mg"],
    "mag": ["µT", "nT", "G", "mG"],
    "angle": ["rad", "deg"],
}


_GARBLED = {  # a letter beyond ASCII, read in another code page than it was written in: "Â°/s", "째/s", "�T"
    "gyr": (re.compile(r"(?:[^\x00-\x7f]{1,2}|A°|\?)/s(?:ec)?"), "deg/s"),
    "acc": (re.compile(r"m/s(?:[^\x00-\x7f]{1,2}2?|A2|\?)"), "m/s²"),
    "mag": (re.compile(r"(?:[^\x00-\x7f]{1,2}u?|[AI]u|\?)T"), "µT"),
}


def _plain(unit: str) -> str:
    """One spelling for the characters that differ between keyboards (µ U+00B5 and μ U+03BC become u, ² becomes 2)."""
    unit = unit.strip().replace("µ", "u").replace("μ", "u").replace("²", "2").replace("º", "°")
    return unit.replace(" ", "").replace("·", "").replace("⁻", "-")


@cache
def find_factor(quantity: str, unit: str) -> float | None:
    """The factor from ``unit`` to SI for "time", "gyr", "acc", "mag" or "angle"; None if it is none of theirs.

    Case counts only where it distinguishes units (mT and MT do not both exist), so any case is accepted.
    """
    table = {_plain(name): factor for name, factor in FACTORS[quantity].items()}
    plain = _plain(unit)
    if plain in table:
        return table[plain]
    found = {name.lower(): factor for name, factor in table.items()}.get(plain.lower())
    if found is None and (garbled := _GARBLED.get(quantity)) is not None and garbled[0].fullmatch(plain):
        return table[_plain(garbled[1])]
    return found


def factor(quantity: str, unit: str) -> float:
    """Like ``find``, but an unknown unit raises ``LevelheadError`` naming the nearest usual one."""
    value = find_factor(quantity, unit)
    if value is None:
        raise LevelheadError(f"'{unit}' is not a unit of {quantity} of levelhead; {nearest(unit, USUAL[quantity])}")
    return value
