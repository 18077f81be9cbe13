"""ROS bags, 1 (.bag) and 2 (a folder with metadata.yaml, or one .mcap or .db3): sensor_msgs/Imu and MagneticField.

No ROS is needed. Messages are read by the definitions that ROS itself ships; those inside the bag are never compiled.
"""

import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped
from levelhead.recording import Array, Recording, median
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

IMU, MAG = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
TESLA = 1e6  # µT
ABSENT = -1.0  # first element of a covariance, REP 145: the message does not carry this quantity
NANO = 1_000_000_000
TOPICS = {IMU: "/imu/data_raw", MAG: "/imu/mag"}
FRAME = "imu_link"
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


def bag(path: Path, hints: Hints) -> ArrayTable:
    """The messages of one Imu topic, and of one MagneticField topic beside it, as columns in SI units.

    A magnetometer reading goes to the sample that is nearest in time. If there are several topics of a kind, the hints
    ``map={"gyr": "/imu/data"}`` and ``{"mag": "/mag"}`` choose.

    Raises:
        LevelheadError: rosbags is not installed, the bag is damaged, or has no Imu message, or several topics of them.
    """
    _require_library()
    found: Found = {}
    try:
        for topic, kind, arrived, message in _messages(path, (IMU, MAG)):
            row = _imu(message) if kind == IMU else _field(message)
            if row is not None:
                stamp = message.header.stamp
                t = stamp.sec * NANO + stamp.nanosec
                found.setdefault((kind, topic), []).append((t or arrived, row))
    except (LevelheadError, MemoryError):
        raise
    except Exception as error:  # rosbags raises what its YAML, SQLite and MCAP readers raise
        raise LevelheadError(f"{path} is no ROS bag, or it is damaged") from error
    imu, mag = (_choose_topic(path, kind, role, found, hints) for kind, role in ((IMU, "gyr"), (MAG, "mag")))
    if imu is None:
        raise LevelheadError(f"{path} has no messages of type sensor_msgs/Imu with rates and accelerations")
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


def _imu(message: Untyped) -> list[float] | None:
    """Rates, accelerations and orientation (w, x, y, z, NaN where there is none)."""
    if message.angular_velocity_covariance[0] == ABSENT or message.linear_acceleration_covariance[0] == ABSENT:
        return None
    w, a, q = message.angular_velocity, message.linear_acceleration, message.orientation
    said = message.orientation_covariance[0] != ABSENT and abs(q.w) + abs(q.x) + abs(q.y) + abs(q.z) > 0.0
    orientation = [q.w, q.x, q.y, q.z] if said else [np.nan] * 4
    return [w.x, w.y, w.z, a.x, a.y, a.z, *orientation]


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
    return Hints(
        {role: names for role, names in hints.map.items() if role not in ("gyr", "mag")}, hints.scale, hints.rate
    )


def write_bag(recording: Recording, path: str | os.PathLike[str], track: Track | None = None) -> None:
    """A recording as a ROS bag: 1 where ``path`` ends in .bag, else 2: one file (.mcap, .db3) or a folder (SQLite).

    Topics are /imu/data_raw (/imu/data with a track) and /imu/mag; the stamps are those of the recording, on the date
    that it has (``meta["t0"]``). Samples with missing readings are left out: a message cannot say that.

    Args:
        recording: rates, accelerations, field.
        path: must not exist yet, unless it is a file.
        track: the orientation and its σ, on the same clock; it goes into the same messages.

    Raises:
        LevelheadError: rosbags is not installed, the path cannot be written, the track is another recording's.
    """
    _require_library()
    if track is not None and not np.array_equal(track.t, recording.t):
        raise LevelheadError(
            f"the track has {len(track)} stamps that are not those of the recording ({len(recording)})"
        )
    if recording.t[0] + float(recording.meta.get("t0", 0.0)) < 0.0:
        raise LevelheadError("the recording begins before time 0, which ROS cannot say; shift it")
    target = Path(path)
    if target.suffix == ".bag":
        with atomic_path(target) as temporary:
            temporary.unlink()  # the writer wants to make it
            _write(recording, temporary, track)
        return
    if target.suffix in (".mcap", ".db3"):
        with atomic_path(target) as temporary:
            _write_one_file(recording, temporary, target.suffix, track)
        return
    if target.exists():
        raise LevelheadError(f"{target} exists already; a ROS 2 bag is a folder of its own")
    if not target.parent.is_dir():
        raise LevelheadError(f"cannot write {target}: there is no folder {target.parent}; make it first")
    unfinished = target.with_name(f".{target.name}-{os.urandom(8).hex()}")
    try:
        _write(recording, unfinished, track)
        unfinished.rename(target)
    except OSError as error:
        raise LevelheadError(f"cannot write {target}: {error.strerror or error}") from None
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _write_one_file(recording: Recording, path: Path, suffix: str, track: Track | None) -> None:
    """The one file of messages in a bag of ROS 2, without the folder around it."""
    folder = path.with_name(f"{path.name}-{os.urandom(8).hex()}")
    try:
        _write(recording, folder, track, mcap=suffix == ".mcap")
        (messages,) = folder.glob(f"*{suffix}")
        messages.replace(path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _write(recording: Recording, path: Path, track: Track | None, mcap: bool = False) -> None:
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
        kinds = [IMU] if recording.mag is None else [IMU, MAG]
        connections = {kind: writer.add_connection(topics[kind], kind, typestore=store) for kind in kinds}
        for kind, at, message in _made(recording, track, store.types, first):
            writer.write(connections[kind], at, serialize(message, kind))


def _made(recording: Recording, track: Track | None, types: Untyped, first: bool) -> Iterator[tuple[str, int, Untyped]]:
    """(type, ns, message) of all samples."""
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
            gyr, acc = vector(*recording.gyr[i].tolist()), vector(*recording.acc[i].tolist())
            yield IMU, at, types[IMU](head, q, covariance, gyr, unknown, acc, unknown)
        if recording.mag is not None and np.isfinite(recording.mag[i]).all():
            field = vector(*(recording.mag[i] / TESLA).tolist())
            yield MAG, at, types[MAG](head, field, unknown)


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The one table of a bag."""
    return [bag(path, hints)]
