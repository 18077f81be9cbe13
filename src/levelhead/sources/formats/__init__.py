"""The table of formats: which module reads which file.

A format is a module with a function ``tables(path, shown, hints)`` that gives the tables in a file, and an entry here.
"""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from levelhead.sources.hints import Hints
from levelhead.sources.table import Table

Reader = Callable[[Path, str, Hints], Sequence[Table]]


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Attributes:
        name: what people call it.
        suffixes: of its files.
        module: in ``levelhead.sources.formats``, with the function ``tables``.
        extra: what must be installed for it ("levelhead[…]"), or "".
        devices: who writes it, for the docs.
        reads: what is read of it, for the docs.
        leaves: what is not.
    """

    name: str
    suffixes: tuple[str, ...]
    module: str
    extra: str = ""
    devices: str = ""
    reads: str = ""
    leaves: str = ""

    @property
    def tables(self) -> Reader:
        """The function that reads it; its module is imported when it is needed."""
        return cast(Reader, importlib.import_module(f"levelhead.sources.formats.{self.module}").tables)


TEXT = Format(
    "text", (".csv", ".tsv", ".txt", ".log", ".dat", ".asc", ".out", ".data", ".prn"), "text",
    devices="phones, Xsens, Shimmer, MicroStrain, WitMotion, YEI, Arduino, decoded Betaflight, ArduPilot",
    reads="tables, words before numbers, rows typed by sensor; see Text", leaves="free text",
)  # fmt: skip
FORMATS = (
    TEXT,
    Format(
        "JSON", (".json", ".jsonl", ".ndjson"), "json_tables",
        devices="Sensor Logger, Movesense, serial lines, web services",
        reads="an object per line, with one sample or several; lists of objects, one table per sensor; "
        "lists of numbers at any depth",
    ),
    Format(
        "MATLAB", (".mat",), "matlab", "formats (v7.3)", "MATLAB Mobile, research data",
        "arrays, structures; v4 to v7.3", "timetables and other objects",
    ),
    Format(
        "HDF5", (".h5", ".hdf5"), "hdf5", "formats", "research data", "datasets of 1 or 2 dimensions", "compound types",
    ),
    Format("NumPy", (".npz", ".npy"), "npz", "", "levelhead simulate, research data", "arrays", "pickles, never"),
    Format(
        "Parquet", (".parquet", ".pq"), "parquet", "formats",
        "levelhead doctor --fix, data lakes", "columns, structures",
    ),
    Format(
        "ROS bag", (".bag", ".db3", ".mcap"), "rosbag", "ros", "ROS 1 and 2",
        "sensor_msgs/Imu and MagneticField", "other messages",
    ),
    Format(
        "ULog", (".ulg",), "ulog", "formats", "PX4", "sensor_combined, or sensor_gyro, sensor_accel, sensor_mag",
        "other topics",
    ),
    Format("DataFlash", (".bin",), "dataflash", "", "ArduPilot", "IMU, MAG; each unit by --sensor", "other messages"),
    Format(
        "workbook", (".xlsx", ".xls", ".ods"), "workbook", "formats", "phyphox, spreadsheets", "one table per sheet",
        "formulas without values",
    ),
)  # fmt: skip
BY_SUFFIX = {suffix: one for one in FORMATS for suffix in one.suffixes}
CONTAINERS = (".zip", ".gz")
