"""The table of formats: which module reads which file.

A format is a module with a function ``tables(path, display_path, hints)`` that gives the tables in a file, and an entry
here. Its libraries are imported when a file is read.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from levelhead.sources.formats import (
    c3d,
    dataflash,
    dialects,
    gpmf,
    hdf5,
    json_log,
    matlab,
    mavlink_log,
    mvnx,
    npz,
    parquet,
    rosbag,
    sqlite,
    ulog,
    witmotion,
    workbook,
)
from levelhead.sources.formats.container import PACKED, TARS
from levelhead.sources.hints import Hints
from levelhead.sources.table import Table
from levelhead.track import Track

Reader = Callable[[Path, str, Hints], Sequence[Table]]


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Attributes:
        name: its usual name.
        suffixes: of its files.
        tables: the function that reads one.
        extra: the extra that it needs ("levelhead[…]"), or "".
        devices: who writes it, for the docs.
        reads: the content that is read, for the docs.
        leaves: the content that is not.
        attitudes: the orientations that the device computed, by name, where a file holds some.
        matches: whether the first bytes of a file are of this kind; None: its suffix settles it.
    """

    name: str
    suffixes: tuple[str, ...]
    tables: Reader
    extra: str = ""
    devices: str = ""
    reads: str = ""
    leaves: str = ""
    matches: Callable[[bytes], bool] | None = None
    attitudes: Callable[[Path], Mapping[str, Track]] | None = None


TEXT = Format(
    "text", (".csv", ".tsv", ".txt", ".log", ".dat", ".asc", ".out", ".data", ".prn"), dialects.tables,
    devices="phones, Xsens, Shimmer, MicroStrain, WitMotion, YEI, Arduino, decoded Betaflight, ArduPilot",
    reads="tables, words before numbers, rows typed by sensor; see Text", leaves="free text",
)  # fmt: skip
FORMATS = (
    TEXT,
    Format(
        "JSON", (".json", ".jsonl", ".ndjson"), json_log.tables,
        devices="Sensor Logger, Movesense, serial lines, web services",
        reads="an object per line, with one sample or several; lists of objects, one table per sensor; "
        "lists of numbers at any depth",
    ),
    Format(
        "MATLAB", (".mat",), matlab.tables, "formats (v7.3)", "MATLAB Mobile, research data",
        "arrays, structures and arrays of them; v4 to v7.3", "timetables and other objects",
    ),
    Format(
        "HDF5", (".h5", ".hdf5", ".nwb"), hdf5.tables, "formats", "APDM, NWB, research data",
        "datasets of 1 or 2 dimensions, compound types, rates of groups", "",
    ),
    Format("NumPy", (".npz", ".npy"), npz.tables, "", "levelhead simulate, research data", "arrays", "pickles, never"),
    Format(
        "Parquet", (".parquet", ".pq", *parquet.ARROW), parquet.tables, "formats",
        "levelhead doctor --fix, data lakes, Feather", "columns, structures, lists of 3 or 4 numbers",
    ),
    Format(
        "ROS bag", (".bag", ".db3", ".mcap"), rosbag.tables, "ros", "ROS 1 and 2",
        "sensor_msgs/Imu and MagneticField; else any type whose fields have a sensor's names, as a guess",
        "clouds, images",
    ),
    Format(
        "ULog", (".ulg",), ulog.tables, "formats", "PX4", "sensor_combined, or sensor_gyro, sensor_accel, sensor_mag",
        "other topics", attitudes=ulog.attitudes,
    ),
    Format(
        "DataFlash", (".bin",), dataflash.tables, "", "ArduPilot", "IMU, MAG; each unit by --sensor",
        "other messages", attitudes=dataflash.attitudes,
    ),
    Format(
        "MAVLink log", (".tlog",), mavlink_log.tables, "", "QGroundControl, Mission Planner, MAVProxy",
        "HIGHRES_IMU, SCALED_IMU or RAW_IMU", "other messages", attitudes=mavlink_log.attitudes,
    ),
    Format(
        "WitMotion", (".bin", ".wit"), witmotion.tables, "", "WitMotion's serial and Bluetooth units",
        "packets 0x50 to 0x54, 0x61", "angles, quaternions", witmotion.is_witmotion,
    ),
    Format(
        "GPMF", (".mp4", ".mov", ".360", ".lrv"), gpmf.tables, "", "GoPro Hero5 and later",
        "ACCL, GYRO and MAGN of the metadata track", "other cameras", gpmf.is_mp4,
    ),
    Format(
        "MVNX", (".mvnx",), mvnx.tables, "", "Xsens MVN", "readings of sensors; each by --sensor", "segments, joints",
    ),
    Format(
        "C3D", (".c3d",), c3d.tables, "c3d", "motion capture",
        "analog channels; markers by `levelhead joint` and `compare --truth`", "rotations, events, force plates",
    ),
    Format(
        "SQLite", (".sqlite", ".sqlite3", ".db"), sqlite.tables, "", "loggers on phones and small computers",
        "a table of numbers, or one for each sensor", "views",
    ),
    Format(
        "workbook", (".xlsx", ".xls", ".ods"), workbook.tables, "formats", "phyphox, spreadsheets",
        "one table per sheet", "formulas without values",
    ),
)  # fmt: skip
BY_SUFFIX = {suffix: kind for kind in reversed(FORMATS) for suffix in kind.suffixes}  # of several the first
CONTAINERS = (".zip", *TARS, *PACKED)


def find_format(suffix: str, head: bytes) -> Format | None:
    """The format of a file by its suffix, or by its first bytes where these are of another one; None if unknown."""
    named = BY_SUFFIX.get(suffix)
    if named is TEXT or (named is not None and not any(suffix in one.suffixes and one.matches for one in FORMATS)):
        return named
    return next((one for one in FORMATS if one.matches is not None and one.matches(head)), named)
