"""Files that sensors and phones write and levelhead does not read: their converter, or the part that they lack.

From the documentation of each project: the FIT SDK of Garmin, ISO/IEC 14496-12 (MP4), Project Aria's VRS, Xsens MT
Manager and MVN, Betaflight's blackbox-tools, Apple's HealthKit.
"""

from typing import NamedTuple


class Conversion(NamedTuple):
    """A format, and the way from it to columns.

    Attributes:
        name: for people.
        cure: a command, a program's menu, or the reason why nothing helps.
        suffixes: of its files.
        signature: bytes in the file, "" if it has none.
        at: the position of the signature.
    """

    name: str
    cure: str
    suffixes: tuple[str, ...]
    signature: bytes = b""
    at: int = 0


CONVERSIONS = (
    Conversion(
        "a FIT activity",
        "most have no gyroscope; where one has, `java -jar FitCSVTool.jar` of Garmin's FIT SDK writes it as CSV",
        (".fit",), b".FIT", 8,
    ),
    Conversion(
        "an Insta360's video", "Gyroflow opens it: File > Export motion data gives its gyroscope as CSV",
        (".insv", ".insp"),
    ),
    Conversion(
        "u-blox's UBX", "gnssdump of pygnssutils prints its ESF-RAW messages, accelerometer and gyroscope, as text",
        (".ubx",), b"\xb5\x62",
    ),
    Conversion(
        "a VRS recording", "projectaria_tools gives its IMU in Python (create_vrs_data_provider); save it as CSV",
        (".vrs",), b"VisionRe",
    ),
    Conversion(
        "an Xsens recording",
        "MT Manager or MVN exports it: File > Export, with rate of turn and acceleration, as .txt",
        (".mtb", ".mvn"),
    ),
    Conversion(
        "a Betaflight blackbox", "`blackbox_decode FILE` of betaflight/blackbox-tools writes it as CSV",
        (".bbl", ".bfl"), b"H Product:Blackbox",
    ),
    Conversion("a GPS track", "it has no gyroscope; expected the log of an IMU", (".gpx", ".tcx", ".kml", ".nmea")),
    Conversion(
        "an actigraph's recording", "it has an accelerometer only; expected a log with a gyroscope",
        (".gt3x", ".cwa"),
    ),
)  # fmt: skip
_HEALTH = b"HealthData"


def find_cure(suffix: str, head: bytes) -> str | None:
    """The end of a sentence about a file with such a suffix or such first bytes; None for any other."""
    for one in CONVERSIONS:
        signed = bool(one.signature) and head[one.at :].startswith(one.signature)
        if signed or suffix in one.suffixes:
            return f"is {one.name}, which levelhead does not read: {one.cure}"
    if suffix == ".xml" and _HEALTH in head:
        return "is an Apple Health export: it has no gyroscope, and no readings at the rate of a sensor"
    return None
