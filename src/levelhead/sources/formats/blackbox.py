"""The black box of a node: its contents, and reading it, whole or cut off by a crash.

An MCAP file. Metadata "levelhead" holds the configuration as JSON; topic imu/samples holds blocks of rows, whose layout
is ``ROW`` and is in the schema as NumPy spells it; topic imu/health holds events as JSON.
"""

import json
import os
import struct
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Recording
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.conclusions.sentences import notes
from levelhead.sources.formats.attitude import attitude_track
from levelhead.sources.formats.ros_messages import unpack_attitude
from levelhead.track import Track

SAMPLES, EVENTS, ATTITUDES = "imu/samples", "imu/health", "/imu/attitude"
SCHEMA, ENCODING, CONFIG = "levelhead/rows1", "numpy", "levelhead"
ROW = np.dtype([
    ("seq", "<u8"), ("t", "<f8"), ("stamp", "<i8"), ("gyr", "<f8", 3), ("acc", "<f8", 3), ("mag", "<f8", 3),
    ("pressure", "<f8"), ("temperature", "<f8"), ("quat", "<f8", 4), ("sigma", "<f8", 3), ("bias", "<f8", 3),
    ("health", "<u4"), ("flags", "<u4"),
])  # fmt: skip
PACKED = struct.Struct("<Qdq3d3d3ddd4d3d3dII")  # the same, for one row at a time
FUSED, MAG_NEW = 1, 2  # flags: the filter took it; the magnetometer had something new
LARGEST_RECORD = 1 << 28  # bytes; a longer one is damage


class Box(NamedTuple):
    """The contents of a black box.

    Attributes:
        rows: (n,) of ``ROW``: gyr in rad/s as read, before the bias of the start is taken off, acc in m/s², mag in µT.
        events: in order; each a dict with "name", "on", "text", "data", "seq", "t".
        config: "source", "filter", "params", "guard", "version", ….
        whole: False: it was cut off, by a crash or a full disk.
        attitudes: the source's own orientations, wxyz, by the stamp of their row.
    """

    rows: NDArray[np.void]
    events: list[JsonObject]
    config: ReadOnlyJson
    whole: bool
    attitudes: Mapping[int, tuple[float, float, float, float]]

    @property
    def bias(self) -> tuple[float, float, float]:
        """The gyroscope's bias that was read off at the start, rad/s; zero if none was."""
        for event in self.events:
            if event["name"] == "calibrated":
                x, y, z = event["data"]["bias"]
                return x, y, z
        x, y, z = self.config.get("bias", (0.0, 0.0, 0.0))  # of a box that began later
        return x, y, z

    @property
    def headings(self) -> list[tuple[int, float]]:
        """Yaws in degrees that were set: (number of the first sample that they hold for, yaw)."""
        return [(e["data"]["from"], e["data"]["heading"]) for e in self.events if e["name"] == "heading"]

    @property
    def changes(self) -> list[tuple[int, JsonObject]]:
        """Parameters that were changed: (number of the first sample that they hold for, all parameters)."""
        return [(e["data"]["from"], e["data"]["params"]) for e in self.events if e["name"] == "parameters"]


def read_box(path: str | os.PathLike[str]) -> Box:
    """All that can be read of a black box, up to where it was cut off.

    Raises:
        LevelheadError: mcap is not installed, or the file is not a black box.
    """
    try:
        from mcap.exceptions import McapError
        from mcap.records import Channel, Message, Metadata
        from mcap.stream_reader import StreamReader
    except ImportError:
        raise LevelheadError("a black box needs mcap: pip install 'levelhead[box]'") from None
    blocks: list[NDArray[np.void]] = []
    events: list[JsonObject] = []
    config: JsonObject | None = None
    topics: dict[int, str] = {}
    attitudes: dict[int, tuple[float, float, float, float]] = {}
    whole = False
    with open(path, "rb") as file:
        try:
            for record in StreamReader(file, record_size_limit=LARGEST_RECORD).records:
                if isinstance(record, Metadata) and record.name == CONFIG:
                    config = json.loads(record.metadata["config"])
                elif isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message) and topics.get(record.channel_id) == SAMPLES:
                    blocks.append(np.frombuffer(record.data, ROW))
                elif isinstance(record, Message) and topics.get(record.channel_id) == EVENTS:
                    events.append(json.loads(record.data))
                elif isinstance(record, Message) and topics.get(record.channel_id) == ATTITUDES:
                    stamp, quat = unpack_attitude(record.data)
                    attitudes[stamp] = quat
            whole = True
        except (McapError, struct.error, EOFError, ValueError, KeyError, IndexError):
            pass  # cut off: everything before is whole, record by record
    if config is None:
        raise LevelheadError(f"{path} is not a black box of a levelhead node: it has no configuration in it")
    return Box(np.concatenate(blocks) if blocks else np.empty(0, ROW), events, config, whole, attitudes)


def box_attitude(path: str | os.PathLike[str]) -> dict[str, Track]:
    """The source's own orientation, such as a chip's or an autopilot's, by its name; empty where it gave none.

    Raises:
        LevelheadError: no black box.
    """
    box = read_box(path)
    stamps = zip(box.rows["t"].tolist(), box.rows["stamp"].tolist(), strict=True)
    found = [(t, box.attitudes[stamp]) for t, stamp in stamps if stamp in box.attitudes]
    if not found:
        return {}
    t, quat = zip(*found, strict=True)
    return {box.config["source"]: attitude_track(np.array(t), np.array(quat))}


def box_recording(path: str | os.PathLike[str]) -> Recording:
    """The samples that the node's filter took, as it took them.

    ``meta["live"]`` holds the node's "filter", "params" (those of the first orientation) and "guard". Fused with these
    (``levelhead fuse`` does so; ``levelhead.fuse`` takes the defaults unless they are given) they give the node's
    orientations to the bit, as long as the parameters were not changed while it ran (``levelhead.live.rerun`` follows
    changes, too).

    Raises:
        LevelheadError: no black box, or no sample in it was fused.
    """
    box = read_box(path)
    rows = box.rows[(box.rows["flags"] & FUSED) > 0]
    if len(rows) == 0:
        raise LevelheadError(f"{path}: the node took {len(box.rows)} samples and fused none; there is nothing to fuse")
    mag = np.where(((rows["flags"] & MAG_NEW) > 0)[:, None], rows["mag"], np.nan)
    found = [] if box.whole else [Conclusion("box.end", "cut_off", "cut off", Basis.HEADER)]
    if any(box.bias):
        found.append(Conclusion("box.bias", "start", list(box.bias), Basis.HEADER))
    first = int(rows["seq"][0])
    before = [params for since, params in box.changes if since <= first]
    if len(before) < len(box.changes):
        found.append(Conclusion("box.params", "changed", len(box.changes), Basis.HEADER))
    live = {
        "filter": box.config["filter"],
        "params": (before or [box.config["params"]])[-1],
        "guard": box.config["guard"],
    }
    found.append(Conclusion("box.params", "node", live["filter"], Basis.HEADER))
    meta = {"source": os.fspath(path), "notes": notes(found), "conclusions": found, "live": live}
    some = np.isfinite(mag).any()
    return Recording(rows["t"], rows["gyr"] - np.array(box.bias), rows["acc"], mag if some else None, meta=meta)
