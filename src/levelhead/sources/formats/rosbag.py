"""ROS bags, 1 (.bag) and 2 (a folder with metadata.yaml, or one .mcap or .db3): sensor_msgs/Imu and MagneticField.

No ROS is needed. Messages are read by the definitions that ROS itself ships; those inside the bag are never compiled.
"""

import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.motion import VectorSeries
from levelhead.open_types import Untyped
from levelhead.recording import Array, Recording, median
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.ros_fields import Definitions, read_numbers
from levelhead.sources.formats.ros_messages import ACCELERATION, FRAME, WORLD, acceleration_covariance, variances
from levelhead.sources.hints import Hints
from levelhead.sources.names.column_groups import group_axes
from levelhead.sources.names.column_name import understand
from levelhead.sources.place import satellite_place
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

IMU, MAG = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
FIX = "sensor_msgs/msg/NavSatFix"
TESLA = 1e6  # µT
ABSENT = -1.0  # first element of a covariance, REP 145: the message does not carry this quantity
NANO = 1_000_000_000
ACCELERATIONS = {
    "/imu/linear_acceleration": ("linear_acceleration", FRAME),
    "/imu/earth_acceleration": ("earth_acceleration", WORLD),
}
TOPICS = {IMU: "/imu/data_raw", MAG: "/imu/mag"}
_VECTOR = re.compile(r"^(?:vector|point|data)\.(?=[xyz]$)")
_NO_COLUMN = re.compile(r"covariance|(?:^|\.)(?:stamp|header)\b")
_LISTED = 8  # topics in a sentence
Rows = list[tuple[int, list[float]]]  # stamp in ns, numbers
Found = dict[tuple[str, str], Rows]  # (type, topic)


def _require_library() -> None:
    try:
        import rosbags.rosbag1
        import rosbags.rosbag2  # noqa: F401
    except ImportError:
        raise LevelheadError("ROS bags need rosbags: pip install 'levelhead[ros]'") from None


def _messages(path: Path, wanted: Sequence[str]) -> Iterator[tuple[str, str, int, Untyped]]:
    """(topic, type, time of arrival in ns, message) of all messages of the wanted types."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.typesys import Stores, get_typestore

    first = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    deserialize = store.deserialize_ros1 if first else store.deserialize_cdr
    with (Reader1 if first else Reader2)(path) as reader:
        connections = [one for one in reader.connections if one.msgtype in wanted]
        if connections:
            for connection, arrived, data in reader.messages(connections=connections):
                yield connection.topic, connection.msgtype, arrived, deserialize(data, connection.msgtype)


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The messages of one Imu topic, and of one MagneticField topic beside it, as columns in SI units.

    A magnetometer reading goes to the sample that is nearest in time. If there are several topics of a kind, the hints
    ``map={"gyr": "/imu/data"}`` and ``{"mag": "/mag"}`` choose. Topics of which each has one sensor (RealSense) are a
    table each. Without any Imu message, topics of any type with rates or forces in their fields are taken, as a guess.

    Raises:
        LevelheadError: rosbags is not installed, the bag is damaged, has no such message, or several topics of them.
    """
    _require_library()
    try:
        found = _sensor_messages(path)
        if halves := _single_sensors(path, found, hints):
            return halves
        if not any(kind == IMU for kind, _ in found) and (others := _topics_of_any_type(path)):
            return others
    except (LevelheadError, MemoryError):
        raise
    except Exception as error:  # rosbags passes on the errors of its YAML, SQLite and MCAP readers
        raise LevelheadError(f"{path} is not a ROS bag, or it is damaged") from error
    table = _one_topic(path, found, hints)
    place = _place(found)
    return [table if place is None else replace(table, conclusions=[*table.conclusions, place])]


def _place(found: Found) -> Conclusion | None:
    """The place by the first topic of satellite fixes."""
    for (kind, topic), rows in found.items():
        if kind == FIX:
            lat, lon, alt = np.array([row for _, row in rows]).T
            return satellite_place(lat, lon, alt, 1e-9 * rows[0][0], topic)
    return None


def _sensor_messages(path: Path) -> Found:
    found: Found = {}
    for topic, kind, arrived, message in _messages(path, (IMU, MAG, FIX)):
        row = _imu(message) if kind == IMU else _field(message) if kind == MAG else _fix(message)
        if row is not None:
            stamp = message.header.stamp
            t = stamp.sec * NANO + stamp.nanosec
            found.setdefault((kind, topic), []).append((t or arrived, row))
    return found


def _single_sensors(path: Path, found: Found, hints: Hints) -> list[ArrayTable]:
    """A table for each Imu topic, where none has both sensors: the other one is zero in each; [] if one has both."""
    made: list[ArrayTable] = []
    roles: set[str] = set()
    for (kind, topic), rows in found.items():
        if kind != IMU:
            continue
        values = np.array([row[:6] for _, row in rows])
        filled = [role for role, part in (("gyr", values[:, :3]), ("acc", values[:, 3:])) if part.any()]
        if len(filled) != 1:
            return []
        roles |= set(filled)
        first, unit = (0, "rad/s") if filled == ["gyr"] else (3, "m/s²")
        names = [f"{filled[0]}_{axis} [{unit}]" for axis in "xyz"]
        columns = dict(zip(names, values[:, first : first + 3].T, strict=True))
        stamps = np.array([stamp for stamp, _ in rows])
        made.append(ArrayTable(str(path), {"t [ns]": stamps} | columns, context=topic))
    return made if roles == {"gyr", "acc"} and not {"gyr", "acc"} & set(hints.map) else []


def _topics_of_any_type(path: Path) -> list[ArrayTable]:
    """Topics whose messages hold rates or forces in their fields, whatever their type: a table each, and a guess."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    first = path.suffix == ".bag"
    known = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE).fielddefs
    made = []
    with (Reader1 if first else Reader2)(path) as reader:
        for connection in reader.connections:
            definitions = dict(known)
            if connection.msgdef.format is MessageDefinitionFormat.MSG:
                definitions |= get_types_from_msg(connection.msgdef.data, connection.msgtype)
            if connection.msgtype not in definitions:
                continue
            messages = ((arrived, bytes(data)) for _, arrived, data in reader.messages(connections=[connection]))
            table = _topic_table(path, connection, messages, definitions, first)
            made += [] if table is None else [table]
    roles = {role for table in made for role in sensor_roles(table)}
    return made if {"gyr", "acc"} <= roles else []


def _topic_table(
    path: Path, connection: Untyped, messages: Iterator[tuple[int, bytes]], definitions: Definitions, first: bool
) -> ArrayTable | None:
    """The numbers of a topic's messages as columns; None if they are not a sensor's."""
    rows: list[tuple[int, dict[str, float]]] = []
    for arrived, data in messages:
        try:
            row = read_numbers(definitions, connection.msgtype, data, first)
        except ValueError:
            return None
        stamp = _stamp_in(row)
        rows.append((stamp or arrived, {_VECTOR.sub("", name): value for name, value in row.items()}))
        if len(rows) == 1 and not sensor_roles(_as_table(path, connection, rows)):
            return None
    return _as_table(path, connection, rows) if len(rows) > 1 else None


def _as_table(path: Path, connection: Untyped, rows: Sequence[tuple[int, dict[str, float]]]) -> ArrayTable:
    names = [name for name in rows[0][1] if not _NO_COLUMN.search(name)]
    columns = {name: np.array([row.get(name, np.nan) for _, row in rows], dtype=np.float64) for name in names}
    facts = {"topic": connection.topic, "type": connection.msgtype}
    kind = Conclusion("file.kind", "ros_fields", connection.msgtype, Basis.GUESS, facts)
    stamps = np.array([stamp for stamp, _ in rows])
    return ArrayTable(str(path), {"t [ns]": stamps} | columns, conclusions=[kind], context=connection.topic)


def sensor_roles(table: ArrayTable) -> set[str]:
    """The sensors that the names of a topic's fields give."""
    known = [understand(name, table.context) for name in table.names]
    return {role for role in ("gyr", "acc", "mag") if group_axes(role, known, None)[0]}


def _stamp_in(row: Mapping[str, float]) -> int:
    """ns of the first stamp in a message; 0 if there is none."""
    for name, value in row.items():
        if name.endswith(("stamp.sec", "stamp.secs")):
            rest = row.get(f"{name.rpartition('.')[0]}.nanosec", 0.0)
            return int(value) * NANO + int(rest)
    return 0


def _one_topic(path: Path, found: Found, hints: Hints) -> ArrayTable:
    imu, mag = (_choose_topic(path, kind, role, found, hints) for kind, role in ((IMU, "gyr"), (MAG, "mag")))
    if imu is None:
        raise LevelheadError(
            f"{path} has no messages of type sensor_msgs/Imu with rates and accelerations, and none of another type "
            f"with such fields{_list_topics(path)}"
        )
    t = np.array([stamp for stamp, _ in imu])
    values = np.array([row for _, row in imu])
    arrays = {"t [ns]": t}
    names = [f"{sensor}_{axis} [{unit}]" for sensor, unit in (("gyr", "rad/s"), ("acc", "m/s²")) for axis in "xyz"]
    arrays |= dict(zip(names, values[:, :6].T, strict=True))
    arrays |= dict(zip((f"orientation_{axis}" for axis in "wxyz"), values[:, 6:].T, strict=True))
    if mag is not None:
        placed = _place_nearest(t, np.array([stamp for stamp, _ in mag]), np.array([row for _, row in mag]))
        arrays |= dict(zip((f"mag_{axis} [µT]" for axis in "xyz"), placed.T, strict=True))
    return ArrayTable(str(path), arrays)


def _list_topics(path: Path) -> str:
    """The topics of a bag, for the end of a sentence."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    with (Reader1 if path.suffix == ".bag" else Reader2)(path) as reader:
        listed = [f"{one.topic} ({one.msgtype.replace('/msg/', '/')})" for one in reader.connections]
    return f"; there are: {', '.join(listed[:_LISTED])}{', …' if len(listed) > _LISTED else ''}" if listed else ""


def _imu(message: Untyped) -> list[float] | None:
    """Rates, accelerations and orientation (w, x, y, z, NaN where there is none)."""
    if message.angular_velocity_covariance[0] == ABSENT or message.linear_acceleration_covariance[0] == ABSENT:
        return None
    w, a, q = message.angular_velocity, message.linear_acceleration, message.orientation
    said = message.orientation_covariance[0] != ABSENT and abs(q.w) + abs(q.x) + abs(q.y) + abs(q.z) > 0.0
    orientation = [q.w, q.x, q.y, q.z] if said else [np.nan] * 4
    return [w.x, w.y, w.z, a.x, a.y, a.z, *orientation]


def _fix(message: Untyped) -> list[float] | None:
    """Latitude and longitude in degrees, altitude in m; None: no fix."""
    return [message.latitude, message.longitude, message.altitude] if message.status.status >= 0 else None


def _field(message: Untyped) -> list[float]:
    b = message.magnetic_field
    return [b.x * TESLA, b.y * TESLA, b.z * TESLA]


def _choose_topic(path: Path, kind: str, role: str, found: Found, hints: Hints) -> Rows | None:
    topics = {topic: rows for (one, topic), rows in found.items() if one == kind}
    wanted = hints.map.get(role)
    if wanted is not None:
        if not wanted and role == "mag":
            return None
        if len(wanted) != 1 or wanted[0] not in topics:
            listed = ", ".join(topics) or "none"
            raise LevelheadError(
                f"{path} has no {kind.rpartition('/')[2]} topic {','.join(wanted)}; there is: {listed}"
            )
        return topics[wanted[0]]
    if len(topics) > 1:
        raise LevelheadError(
            f"{path} has {len(topics)} {kind.rpartition('/')[2]} topics: {', '.join(topics)}; the hint map "
            f"{role}={next(iter(topics))} chooses one"
        )
    return next(iter(topics.values()), None)


def _place_nearest(t: Untyped, stamps: Untyped, field: Array) -> Array:
    """(n, 3) readings at the samples nearest in time, NaN elsewhere; a reading far from any sample is left out."""
    placed = np.full((len(t), 3), np.nan)
    step = median(np.diff(t)) if len(t) > 1 else float(NANO)
    right = np.clip(np.searchsorted(t, stamps), 1, max(1, len(t) - 1))
    nearest = np.where(
        np.abs(t[right - 1] - stamps) <= np.abs(t[np.minimum(right, len(t) - 1)] - stamps), right - 1, right
    )
    nearest = np.minimum(nearest, len(t) - 1)
    near = np.abs(t[nearest] - stamps) <= step
    placed[nearest[near]] = field[near]
    return placed


def without_topics(hints: Hints) -> Hints:
    """The hints that are left once they have chosen topics."""
    return replace(hints, map={role: names for role, names in hints.map.items() if role not in ("gyr", "mag")})


def write_bag(
    recording: Recording,
    path: str | os.PathLike[str],
    track: Track | None = None,
    motion: Mapping[str, VectorSeries] | None = None,
) -> None:
    """A recording as a ROS bag: 1 where ``path`` ends in .bag, else 2: one file (.mcap, .db3) or a folder (SQLite).

    Topics are /imu/data_raw (/imu/data with a track) and /imu/mag; the stamps are those of the recording, on the date
    that it has (``meta["t0"]``). Samples with missing readings are left out: a message has no value for that.

    Args:
        recording: rates, accelerations, field.
        path: must not exist yet, unless it is a file.
        track: the orientation and its σ, on the same clock; it goes into the same messages.
        motion: that of the track, as ``publish.writers.motion_series`` gives it: rate and specific force take the place
            of the readings, and the accelerations are /imu/linear_acceleration and /imu/earth_acceleration.

    Raises:
        LevelheadError: rosbags is not installed, the path cannot be written, the track is another recording's.
    """
    _require_library()
    if track is not None and not np.array_equal(track.t, recording.t):
        raise LevelheadError(
            f"the track has {len(track)} stamps that are not those of the recording ({len(recording)})"
        )
    if recording.t[0] + float(recording.meta.get("t0", 0.0)) < 0.0:
        raise LevelheadError("the recording begins before time 0, which ROS cannot write; shift it")
    target = Path(path)
    if target.suffix == ".bag":
        with atomic_path(target) as temporary:
            temporary.unlink()  # the writer wants to make it
            _write(recording, temporary, track, motion)
        return
    if target.suffix in (".mcap", ".db3"):
        with atomic_path(target) as temporary:
            _write_one_file(recording, temporary, target.suffix, track, motion)
        return
    if target.exists():
        raise LevelheadError(f"{target} exists already; a ROS 2 bag is a folder of its own")
    if not target.parent.is_dir():
        raise LevelheadError(f"cannot write {target}: there is no folder {target.parent}; make it first")
    unfinished = target.with_name(f".{target.name}-{os.urandom(8).hex()}")
    try:
        _write(recording, unfinished, track, motion)
        unfinished.rename(target)
    except OSError as error:
        raise LevelheadError(f"cannot write {target}: {error.strerror or error}") from None
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _write_one_file(
    recording: Recording, path: Path, suffix: str, track: Track | None, motion: Mapping[str, VectorSeries] | None
) -> None:
    """The one file of messages in a bag of ROS 2, without the folder around it."""
    folder = path.with_name(f"{path.name}-{os.urandom(8).hex()}")
    try:
        _write(recording, folder, track, motion, mcap=suffix == ".mcap")
        (messages,) = folder.glob(f"*{suffix}")
        messages.replace(path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _write(
    recording: Recording, path: Path, track: Track | None, motion: Mapping[str, VectorSeries] | None, mcap: bool = False
) -> None:
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    first = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    serialize = store.serialize_ros1 if first else store.serialize_cdr
    topics = TOPICS if track is None else TOPICS | {IMU: "/imu/data"}
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer1(path) if first else Writer2(path, version=9, storage_plugin=plugin) as writer:
        kinds = {topics[IMU]: IMU} if recording.mag is None else {topics[IMU]: IMU, topics[MAG]: MAG}
        kinds |= {} if motion is None else dict.fromkeys(ACCELERATIONS, ACCELERATION)
        connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for topic, at, message in _made(recording, track, motion, topics[IMU], store.types, first):
            writer.write(connections[topic], at, serialize(message, kinds[topic]))


def _made(
    recording: Recording, track: Track | None, motion: Mapping[str, VectorSeries] | None, imu: str, types: Untyped,
    first: bool,
) -> Iterator[tuple[str, int, Untyped]]:  # fmt: skip
    """(topic, ns, message) of all samples; ``imu``: the topic of the readings."""
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    time, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    unknown, none = np.zeros(9), np.array([ABSENT, *[0.0] * 8])
    valid = recording.valid
    t0 = float(recording.meta.get("t0", 0.0))
    for i, t in enumerate(recording.t.tolist()):
        at = round(t0 * 1e9) + round(t * 1e9)
        stamp = time(at // NANO, at % NANO)
        head = header(i, stamp, FRAME) if first else header(stamp, FRAME)
        if valid[i]:
            q, covariance = quaternion(0.0, 0.0, 0.0, 1.0), none
            if track is not None:
                w, x, y, z = track.quat[i].tolist()
                q = quaternion(x, y, z, w)
                covariance = unknown if track.sigma is None else np.diag(track.sigma[i] ** 2).reshape(-1)
            gyr, acc, by_gyr, by_acc = recording.gyr[i], recording.acc[i], unknown, unknown
            if motion is not None:
                (gyr, by_gyr), (acc, by_acc) = (_value(motion[name], i) for name in ("rate", "specific_force"))
                yield from _accelerations(motion, i, at, (header, stamp, first), types)
            rate, force = vector(*gyr.tolist()), vector(*acc.tolist())
            yield imu, at, types[IMU](head, q, covariance, rate, by_gyr, force, by_acc)
        if recording.mag is not None and np.isfinite(recording.mag[i]).all():
            field = vector(*(recording.mag[i] / TESLA).tolist())
            yield TOPICS[MAG], at, types[MAG](head, field, unknown)


def _value(series: VectorSeries, i: int) -> tuple[Array, Array]:
    """The vector of a sample, and the nine numbers of its covariance; zeros: not known."""
    return series.value[i], np.array(variances(None if series.sigma is None else series.sigma[i].tolist()))


def _accelerations(
    motion: Mapping[str, VectorSeries], i: int, at: int, stamped: Untyped, types: Untyped
) -> Iterator[tuple[str, int, Untyped]]:
    """The two accelerations of a sample."""
    vector, (header, stamp, first) = types["geometry_msgs/msg/Vector3"], stamped
    for topic, (name, frame) in ACCELERATIONS.items():
        series = motion[name]
        accel = types["geometry_msgs/msg/Accel"](vector(*series.value[i].tolist()), vector(0.0, 0.0, 0.0))
        covariance = np.array(acceleration_covariance(None if series.sigma is None else series.sigma[i].tolist()))
        head = header(i, stamp, frame) if first else header(stamp, frame)
        whole = types["geometry_msgs/msg/AccelWithCovariance"](accel, covariance)
        yield topic, at, types[ACCELERATION](head, whole)
