"""PX4's ULog: sensor_combined, or the gyroscope, accelerometer and magnetometer of one unit."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.formats.attitude import attitude_track
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

WANTED = ["sensor_combined", "sensor_gyro", "sensor_accel", "sensor_mag", "vehicle_magnetometer", "vehicle_imu"]
_VECTORS = {  # topic to (name of its vector's fields, sensor, unit)
    "sensor_combined": [
        ("gyro_rad", "gyr", "rad/s"), ("accelerometer_m_s2", "acc", "m/s²"), ("magnetometer_ga", "mag", "G"),
    ],
    "sensor_gyro": [("", "gyr", "rad/s")],
    "sensor_accel": [("", "acc", "m/s²")],
    "sensor_mag": [("", "mag", "G")],
    "vehicle_magnetometer": [("magnetometer_ga", "mag", "G")],
}  # fmt: skip


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """One table for each topic with a sensor in it; sensor_combined, which PX4's own filter uses, before raw ones.

    Raises:
        LevelheadError: pyulog is not installed, the file is damaged or has no sensor in it.
    """
    try:
        from pyulog import ULog
    except ImportError:
        raise LevelheadError(
            f"{display_path} is PX4's ULog; reading it needs pyulog: pip install 'levelhead[formats]'"
        ) from None
    try:
        topics = ULog(str(path), WANTED).data_list
    except Exception as error:  # pyulog raises many kinds for a damaged file
        raise LevelheadError(f"{display_path} is not a ULog, or it is damaged") from error
    found = [table for topic in topics if (table := _table(topic, display_path)) is not None]
    combined = [table for table in found if table.context.startswith("sensor_combined")]
    if combined:
        found = combined + [table for table in found if table.context.startswith("vehicle_magnetometer")]
    if not found:
        raise LevelheadError(
            f"{display_path} has no topic sensor_combined, sensor_gyro and sensor_accel; switch their logging on"
        )
    return found


def attitudes(path: Path) -> dict[str, Track]:
    """The autopilot's own orientation, of its topic vehicle_attitude: forward-right-down in north-east-down."""
    from pyulog import ULog

    found = {}
    for topic in ULog(str(path), ["vehicle_attitude"]).data_list:
        quat = np.stack([topic.data[f"q[{i}]"] for i in range(4)], axis=1).astype(np.float64)
        name = "vehicle_attitude" + (f" {topic.multi_id}" if topic.multi_id else "")
        found[name] = attitude_track(1e-6 * topic.data["timestamp"], quat)
    return found


def _table(topic: object, display_path: str) -> ArrayTable | None:
    name, number, data = topic.name, topic.multi_id, topic.data  # type: ignore[attr-defined]
    columns = {"timestamp [us]": np.asarray(data["timestamp"]).astype(np.int64)}
    for field, sensor, unit in _VECTORS.get(name, ()):
        keys = [f"{field}[{i}]" for i in range(3)] if field else list("xyz")
        if all(key in data for key in keys):
            for axis, key in zip("xyz", keys, strict=True):
                columns[f"{sensor}_{axis} [{unit}]"] = np.asarray(data[key]).astype(np.float64)
    if len(columns) == 1:
        return None
    return ArrayTable(
        display_path,
        columns,
        context=f"{name} {number}" if number else name,
        conclusions=[Conclusion("frame", "ulog", "x forward, z down", Basis.HEADER, {"topic": name})],
    )
