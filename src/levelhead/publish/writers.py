"""A Track as a file: CSV for people and spreadsheets, Parquet and .npz for the rest. Whole or not at all.

All hold the same columns, each with its unit in its name:

    t [s]
    qw, qx, qy, qz                          sensor to earth (x east, y north, z up); north is magnetic, or true after
                                            ``Track.to_true_north``; ned_qw … in another frame (``Track.to_frame``)
    roll [deg], pitch [deg], yaw [deg]      the same, intrinsic z-y-x, for people; computed from the quaternion
    bias_x [rad/s], bias_y …, bias_z …      if the filter estimates a bias
    sigma_east [rad], sigma_north …, sigma_up …    1σ of the attitude error, if the filter has it
    specific_force_x [m/s²] …, linear_acceleration_x …, earth_acceleration_east …, rate_x [rad/s] …: ``motion_columns``
    position_east [m], position_north …, position_up …    and velocity_east [m/s] …, sigma_position_east [m] …,
                                            sigma_velocity_east [m/s] …: if the recording saw any of it
    health                                  bits of ``levelhead.filters.health``; 0: nothing was wrong, 2048: at rest

In CSV, t and the quaternion come back to the last bit; angles have 6 decimals, bias and σ at least 9 significant digits
(all of them where pyarrow writes the file, which it does for large ones). Parquet holds every column as float64, health
as uint32, to the last bit, and so does .npz.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from itertools import chain, repeat
from pathlib import Path

import numpy as np

from levelhead.earth_frame import find_frame
from levelhead.errors import LevelheadError, nearest, require
from levelhead.motion import VectorSeries
from levelhead.open_types import JsonObject, Untyped
from levelhead.recording import Array
from levelhead.track import POSE, Track

MIN_ARROW_ROWS = 200_000  # rows from which pyarrow, if it is there, writes CSV faster than it takes to import it
CHUNK = 50_000  # rows in memory as text or table at a time
SUFFIXES = (".csv", ".parquet", ".npz")
AXES = ("x", "y", "z")
NOTHING_MORE: Mapping[str, Array] = {}


def write_track(
    track: Track,
    path: str | Path,
    progress: Callable[[float], None] | None = None,
    more: Mapping[str, Array] | None = None,
) -> None:
    """Write the track as CSV, Parquet or NumPy's .npz, by the suffix of ``path``; it appears whole or not at all.

    ``progress`` is called with the fraction done; ``more`` has further columns (n,), such as ``motion_columns``.

    Raises:
        LevelheadError: another suffix, a folder that does not exist or may not be written, or no pyarrow for Parquet.
    """
    from levelhead.atomic import atomic_path

    path, report, more = Path(path), progress or (lambda fraction: None), more or {}
    if path.suffix.lower() not in SUFFIXES:
        raise LevelheadError(f"'{path.name}' ends in '{path.suffix}'; {nearest(path.suffix or 'nothing', SUFFIXES)}")
    with atomic_path(path) as temporary:
        if path.suffix.lower() == ".npz":
            _write_npz(track, temporary, more)
        elif path.suffix.lower() == ".parquet":
            _write_parquet([track], _schema(track, more), temporary, report, more)
        elif len(track) >= MIN_ARROW_ROWS and find_spec("pyarrow") is not None:
            _write_large_csv([track], _schema(track, more), temporary, report, more)
        else:
            _write_csv(track, temporary, report, more)


def motion_series(track: Track) -> dict[str, VectorSeries]:
    """Specific force, accelerations and rate of a track by name, each with its 1σ where it is known.

    Raises:
        LevelheadError: the track does not hold its readings.
    """
    return {
        "specific_force": track.specific_force(),
        "linear_acceleration": track.linear_acceleration(),
        "earth_acceleration": track.earth_acceleration(),
        "rate": track.angular_rate(),
    }


def motion_columns(track: Track) -> dict[str, Array]:
    """``motion_series`` as columns of a file, each with its unit.

    Raises:
        LevelheadError: the track does not hold its readings.
    """
    directions = find_frame(track.frame).axes
    columns: dict[str, Array] = {}
    for name, series in motion_series(track).items():
        axes = directions if name == "earth_acceleration" else AXES
        unit = "rad/s" if name == "rate" else "m/s²"
        for prefix, values in (("", series.value), ("sigma_", series.sigma)):
            if values is not None:
                columns |= {f"{prefix}{name}_{axis} [{unit}]": values[:, i] for i, axis in enumerate(axes)}
    return columns


def write_tracks(tracks: Iterable[Track], path: str | Path) -> None:
    """Write tracks that follow each other, such as those of ``fuse_chunks``, as one; each is gone before the next.

    Needs pyarrow. Tracks of a whole number of ``CHUNK`` rows give the same bytes as ``write_track`` of all of them.

    Raises:
        LevelheadError: as ``write_track``; or no track at all.
    """
    from levelhead.atomic import atomic_path

    path = Path(path)
    if path.suffix.lower() not in SUFFIXES[:2]:
        raise LevelheadError(
            f"'{path.name}' ends in '{path.suffix}'; {nearest(path.suffix or 'nothing', SUFFIXES[:2])}"
        )
    require("pyarrow", "writing a long track", "formats")
    every = iter(tracks)
    first = next(every, None)
    if first is None:
        raise LevelheadError(f"there is no track to write to {path}")
    write = _write_parquet if path.suffix.lower() == ".parquet" else _write_large_csv
    with atomic_path(path) as temporary:
        write(chain([first], every), _schema(first), temporary, lambda fraction: None)


def _columns(track: Track, rows: slice, more: Mapping[str, Array]) -> JsonObject:
    """Column name -> values of some rows; the order is that of the file."""
    part = Track(track.t[rows], track.quat[rows])
    prefix = _prefix(track)
    axes = AXES if track.frame == POSE else find_frame(track.frame).axes
    columns: JsonObject = {"t [s]": part.t}
    columns |= zip((f"{prefix}{name}" for name in ("qw", "qx", "qy", "qz")), part.quat.T, strict=True)
    angles = (f"{prefix}{name} [deg]" for name in ("roll", "pitch", "yaw"))
    columns |= zip(angles, part.euler().T, strict=True)
    groups: tuple[tuple[str, Iterable[str], str, Array | None], ...] = (
        ("bias", AXES, "rad/s", track.bias),
        ("sigma", axes, "rad", track.sigma),
        ("position", axes, "m", track.position),
        ("velocity", axes, "m/s", track.velocity),
        ("sigma_position", axes, "m", track.sigma_position),
        ("sigma_velocity", axes, "m/s", track.sigma_velocity),
    )
    for name, along, unit, values in groups:
        if values is not None:
            columns |= zip((f"{name}_{axis} [{unit}]" for axis in along), values[rows].T, strict=True)
    columns |= {name: values[rows] for name, values in more.items()}
    assert track.health is not None  # Track fills it in
    return columns | {"health": track.health[rows]}


def _prefix(track: Track) -> str:
    """In front of the names of quaternion and angles; empty in ENU."""
    return "" if track.frame == "ENU" else f"{track.frame.lower()}_"


def _chunks(
    track: Track, report: Callable[[float], None], more: Mapping[str, Array] = NOTHING_MORE
) -> Iterator[JsonObject]:
    for start in range(0, len(track), CHUNK):
        yield _columns(track, slice(start, start + CHUNK), more)
        report(min((start + CHUNK) / len(track), 1.0))


def _format(name: str) -> str:
    """How one value of a column is written in CSV; ``%r`` is the shortest text that reads back to the same bits."""
    if name == "t [s]" or name.endswith(("qw", "qx", "qy", "qz")):
        return "%r"
    return "%d" if name == "health" else "%.6f" if name.endswith("[deg]") else "%.9g"


def _write_csv(track: Track, path: Path, report: Callable[[float], None], more: Mapping[str, Array]) -> None:
    names = list(_columns(track, slice(0, 1), more))
    steady = [name for name in names if _format(name) == "%.9g"]
    line = ",".join("%s" if name in steady else _format(name) for name in names if name not in steady[1:]) + "\n"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(names) + "\n")
        for columns in _chunks(track, report, more):
            values = {name: column.tolist() for name, column in columns.items() if name not in steady}
            if steady:
                values[steady[0]] = _repeated_texts([columns[name] for name in steady])
            rows = zip(*(values[name] for name in names if name in values), strict=True)
            file.write("".join([line % row for row in rows]))


def _repeated_texts(columns: Sequence[Array]) -> Iterator[str]:
    """The text of each row of columns that keep their values for many rows, as bias and σ do: written once for all."""
    values = np.stack(columns, axis=1)
    bits = values.view(np.uint64)
    starts = np.flatnonzero(np.concatenate([[True], (bits[1:] != bits[:-1]).any(axis=1)]))
    form = ",".join(["%.9g"] * len(columns))
    texts = [form % tuple(row) for row in values[starts].tolist()]
    counts = np.diff(starts, append=len(values)).tolist()
    return chain.from_iterable(map(repeat, texts, counts))


def _write_large_csv(
    tracks: Iterable[Track],
    schema: Untyped,
    path: Path,
    report: Callable[[float], None],
    more: Mapping[str, Array] = NOTHING_MORE,
) -> None:
    import pyarrow.csv as pc

    with path.open("wb") as file:
        file.write((",".join(schema.names) + "\n").encode())
        with pc.CSVWriter(file, schema, write_options=pc.WriteOptions(include_header=False)) as writer:
            for columns in (part for track in tracks for part in _chunks(track, report, more)):
                rounded = {name: np.round(a, 6) if _format(name) == "%.6f" else a for name, a in columns.items()}
                writer.write_table(_arrow(rounded, schema))


def _write_parquet(
    tracks: Iterable[Track],
    schema: Untyped,
    path: Path,
    report: Callable[[float], None],
    more: Mapping[str, Array] = NOTHING_MORE,
) -> None:
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise LevelheadError("writing Parquet needs pyarrow: pip install 'levelhead[formats]'") from None
    with pq.ParquetWriter(path, schema, use_dictionary=["health"]) as writer:  # floats seldom repeat
        for columns in (part for track in tracks for part in _chunks(track, report, more)):
            writer.write_table(_arrow(columns, schema))


def _write_npz(track: Track, path: Path, more: Mapping[str, Array]) -> None:
    """Arrays by the names of the columns, and the facts that Parquet has in its metadata."""
    facts = {name: np.array(text) for name, text in _facts(track).items()}
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **_columns(track, slice(None), more), **facts)


def _schema(track: Track, more: Mapping[str, Array] = NOTHING_MORE) -> Untyped:
    import pyarrow as pa

    types = {"health": pa.uint32()}
    names = _columns(track, slice(0, 1), more)
    return pa.schema([(name, types.get(name, pa.float64())) for name in names], metadata=_facts(track))


def _facts(track: Track) -> dict[str, str]:
    """The filter, the orientation in words, its frame, and how the sensor is mounted."""
    north = "magnetic" if track.declination is None else "true"
    mounted = "sensor" if track.axes is None else "body"
    if track.frame == POSE:
        orientation = f"quaternion wxyz, {mounted} to the pose of the {mounted} that it is relative to"
    else:
        x, y, z = (axis.replace("north", f"{north} north") for axis in find_frame(track.frame).axes)
        orientation = f"quaternion wxyz, {mounted} to earth; earth x {x}, y {y}, z {z}"
    facts = {"filter": track.name, "orientation": orientation, "frame": track.frame}
    return facts | ({} if track.axes is None else {"axes": str(track.axes)})


def _arrow(columns: JsonObject, schema: Untyped) -> Untyped:
    import pyarrow as pa

    return pa.Table.from_arrays([pa.array(np.ascontiguousarray(a)) for a in columns.values()], schema=schema)
