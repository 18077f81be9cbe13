"""Where recordings come from: one function reads every format."""

import os
from collections.abc import Mapping, Sequence

from levelhead.recording import Recording
from levelhead.sources.hints import parse_lsb, parse_map, parse_units

__all__ = ["parse_lsb", "parse_map", "parse_units", "read"]


def read(
    path: str | os.PathLike[str],
    *,
    map: Mapping[str, Sequence[str] | str] | None = None,
    units: Mapping[str, str] | None = None,
    lsb: Mapping[str, str] | None = None,
    rate: float | None = None,
) -> Recording:
    """The recording in a file: .csv .tsv .txt .log .dat, .mat, .h5 .hdf5, .npz, .parquet.

    Columns, delimiter and units are found from the file. What was concluded stands in ``meta``: "notes" are sentences,
    "ignored" lists the columns that nothing uses, "units" what the file was in, "t0" the seconds subtracted from stamps
    that count from a date, "mag_unit" is "relative" for a magnetometer without unit.

    Args:
        path: the file.
        map: which columns are what: ``{"t": ["time"], "gyr": ["gx", "gy", "gz"], "acc": …, "mag": …, "q": …}``; "q" is
            the reference orientation in the order w, x, y, z. One name stands for all axes if they share it. No names,
            ``{"mag": []}``, leave the quantity out. Columns without a header are called "1", "2", ….
        units: of what the header does not say, or says wrongly: ``{"gyr": "deg/s", "t": "ms"}``.
        lsb: raw counts per unit: ``{"gyr": "131/deg/s", "acc": "16384/g"}``.
        rate: samples a second, for a file without time stamps: t = row / rate. With stamps in the file it is an error,
            unless ``map={"t": []}`` leaves them out.

    Returns:
        A Recording in SI units (rad/s, m/s², µT, s); missing values are NaN.

    Raises:
        LevelheadError: one sentence with what is wrong, the line or row, the column, and what would be right.

    >>> read("flight.csv", lsb={"gyr": "131/deg/s", "acc": "16384/g"})  # doctest: +SKIP
    """
    from levelhead.sources.dispatch import read_file
    from levelhead.sources.hints import check

    return read_file(path, check(map, units, lsb, rate))
