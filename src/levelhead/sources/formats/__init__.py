"""The table of formats: which module reads which file.

A format is a module with a function ``tables(path, display_path, hints)`` that gives the tables in a file, and an entry
here. Its libraries are imported when a file is read.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from levelhead.sources.formats import (
    dataflash,
    dialects,
    hdf5,
    json_log,
    matlab,
    npz,
    parquet,
    rosbag,
    ulog,
    workbook,
)
from levelhead.sources.hints import Hints
from levelhead.sources.table import Table

Reader = Callable[[Path, str, Hints], Sequence[Table]]


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Attributes:
        name: what people call it.
        suffixes: of its files.
        tables: the function that reads one.
        extra: what must be installed for it ("levelhead[…]"), or "".
        devices: who writes it, for the docs.
        reads: what is read of it, for the docs.
        leaves: what is not.
    """

    name: str
    suffixes: tuple[str, ...]
    tables: Reader
    extra: str = ""
    devices: str = ""
    reads: str = ""
    leaves: str = ""


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
        "arrays, structures; v4 to v7.3", "timetables and other objects",
    ),
    Format(
        "HDF5", (".h5", ".hdf5"), hdf5.tables, "formats", "research data",
        "datasets of 1 or 2 dimensions", "compound types",
    ),
    Format("NumPy", (".npz", ".npy"), npz.tables, "", "levelhead simulate, research data", "arrays", "pickles, never"),
    Format(
        "Parquet", (".parquet", ".pq"), parquet.tables, "formats",
        "levelhead doctor --fix, data lakes", "columns, structures",
    ),
    Format(
        "ROS bag", (".bag", ".db3", ".mcap"), rosbag.tables, "ros", "ROS 1 and 2",
        "sensor_msgs/Imu and MagneticField; else any type whose fields have a sensor's names, as a guess",
        "clouds, images",
    ),
    Format(
        "ULog", (".ulg",), ulog.tables, "formats", "PX4", "sensor_combined, or sensor_gyro, sensor_accel, sensor_mag",
        "other topics",
    ),
    Format(
        "DataFlash", (".bin",), dataflash.tables, "", "ArduPilot", "IMU, MAG; each unit by --sensor",
        "other messages",
    ),
    Format(
        "workbook", (".xlsx", ".xls", ".ods"), workbook.tables, "formats", "phyphox, spreadsheets",
        "one table per sheet", "formulas without values",
    ),
)  # fmt: skip
BY_SUFFIX = {suffix: kind for kind in FORMATS for suffix in kind.suffixes}
CONTAINERS = (".zip", ".gz")
