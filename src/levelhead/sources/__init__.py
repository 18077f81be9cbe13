"""Where recordings come from: one function reads every format."""

import os
from collections.abc import Mapping, Sequence

from levelhead.recording import Array, Recording
from levelhead.sources.hints import parse_counts, parse_map, parse_units
from levelhead.track import Track

__all__ = ["attitudes", "orientation", "parse_counts", "parse_map", "parse_units", "read"]


def read(
    path: str | os.PathLike[str],
    *,
    map: Mapping[str, Sequence[str] | str] | None = None,
    units: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
    rate: float | None = None,
    sensor: str | None = None,
    session: int | None = None,
) -> Recording:
    """The recording in a file: .csv .tsv .txt .log .dat, JSON lines (.jsonl .ndjson), .mat, .h5 .hdf5, .npz, .parquet,
    a ROS bag, a node's black box (.mcap).

    Columns, delimiter and units are found from the file. The conclusions are in ``meta``: "notes" are sentences,
    "ignored" lists the unused columns, "units" those of the file, "t0" the seconds subtracted from stamps that count
    from a date, "mag_unit" is "relative" for a magnetometer without unit.

    Args:
        path: the file.
        map: the column of each reading: ``{"t": ["time"], "gyr": ["gx", "gy", "gz"], "acc": …, "mag": …, "q": …}``; "q"
            is the reference orientation in the order w, x, y, z. One name serves all axes if they share it. No names,
            ``{"mag": []}``, leave the quantity out. Columns without a header are called "1", "2", ….
        units: of quantities whose header has none, or a wrong one: ``{"gyr": "deg/s", "t": "ms"}``.
        counts: raw counts per unit: ``{"gyr": "131/deg/s", "acc": "16384/g"}``.
        rate: samples a second, for a file without time stamps: t = row / rate. With stamps in the file it is an error,
            unless ``map={"t": []}`` leaves them out.
        sensor: of several sensors side by side, the one whose columns, file or topic have this word in their names.
        session: of a file whose clock begins again, the part to take, from 1; the longest otherwise.

    Returns:
        A Recording in SI units (rad/s, m/s², µT, s); missing values are NaN.

    Raises:
        LevelheadError: one sentence with the fault, the line or row, the column, and the right input.

    >>> read("flight.csv", counts={"gyr": "131/deg/s", "acc": "16384/g"})  # doctest: +SKIP
    """
    from levelhead.sources.hints import check
    from levelhead.sources.pipeline import read_file

    return read_file(path, check(map, units, counts, rate, sensor, session))


def sensor_names(path: str | os.PathLike[str]) -> list[str]:
    """The names of the sensors in a log, each a value of ``sensor`` of ``read``; empty where there is only one.

    Raises:
        LevelheadError: as ``read``, of a file that it cannot open.
    """
    from levelhead.sources.hints import check
    from levelhead.sources.interpret import roles
    from levelhead.sources.pipeline import open_table

    table = open_table(path, check(None, None, None, None))
    return roles.sensor_names(table.names)


def orientation(
    path: str | os.PathLike[str],
    column: str,
    *,
    map: Mapping[str, Sequence[str] | str] | None = None,
    units: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
    rate: float | None = None,
) -> Track:
    """An orientation in a log beside the sensors, such as that of a vendor's own filter.

    Its quaternions come as the file has them; ``levelhead.evaluate.align`` finds their convention, and ``compare``
    with ``tracks`` does so by itself.

    Args:
        path: the file, as for ``read``.
        column: the name that its four columns share, such as ``q`` for q0 … q3 or qw … qz, ``ahrs_q``, ``quat``, the
            name of an (n, 4) array, or four column names with commas.
        map: as for ``read``, so that both are on the same clock.
        units: as for ``read``.
        counts: as for ``read``.
        rate: as for ``read``.

    Returns:
        A Track on the clock of ``read`` with the same hints: unit length, NaN where the cells are blank or all zero.

    Raises:
        LevelheadError: no such columns (the nearest are named), no quaternions in them, or as ``read``.

    >>> orientation("flight.csv", "ahrs_q")  # doctest: +SKIP
    """
    from levelhead.sources.hints import check
    from levelhead.sources.tracks.orientation_columns import read_orientation

    return read_orientation(path, column, check(map, units, counts, rate))


def angle(
    path: str | os.PathLike[str],
    column: str,
    *,
    map: Mapping[str, Sequence[str] | str] | None = None,
    units: Mapping[str, str] | None = None,
    counts: Mapping[str, str] | None = None,
    rate: float | None = None,
) -> tuple[str, Array, Array]:
    """One angle in a log beside the sensors, such as ``board_roll`` of the sketch of one axis.

    Args:
        path: the file, as for ``read``.
        column: its whole name, with roll, pitch or yaw in it; degrees, or radians where ``rad`` is in it.
        map: as for ``read``, so that both are on the same clock.
        units: as for ``read``.
        counts: as for ``read``.
        rate: as for ``read``.

    Returns:
        "roll", "pitch" or "yaw"; the stamps of ``read`` with the same hints, s, (n,); the angle, rad, (n,), NaN where
        the cells are blank.

    Raises:
        LevelheadError: no such column, a name without the angle, no number in it, or the reasons of ``read``.
    """
    from levelhead.sources.hints import check
    from levelhead.sources.tracks.orientation_columns import read_angle

    return read_angle(path, column, check(map, units, counts, rate))


def attitudes(path: str | os.PathLike[str]) -> dict[str, Track]:
    """The orientations that the device itself computed, by name: a chip's or an autopilot's own, for ``compare``.

    They stand in a node's black box, in PX4's ULog, in ArduPilot's DataFlash log and in a MAVLink log (.tlog), on the
    clock of ``read``. Empty where a file has none.

    Raises:
        LevelheadError: the file cannot be read.
    """
    from levelhead.sources.pipeline import own_attitudes

    return own_attitudes(path)
