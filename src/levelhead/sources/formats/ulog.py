"""PX4's ULog: sensor_combined, or the gyroscope, accelerometer and magnetometer of one unit."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.open_types import Untyped
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.attitude import attitude_track
from levelhead.sources.hints import Hints
from levelhead.sources.place import satellite_place
from levelhead.sources.table import ArrayTable
from levelhead.track import Track

GNSS = ("vehicle_gps_position", "sensor_gps")
WANTED = ["sensor_combined", "sensor_gyro", "sensor_accel", "sensor_mag", "vehicle_magnetometer", "vehicle_imu", *GNSS]
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
    place = next((one for topic in topics if topic.name in GNSS and (one := _place(topic)) is not None), None)
    if place is not None:
        found[0] = replace(found[0], conclusions=[*found[0].conclusions, place])
    return found


def _place(topic: Untyped) -> Conclusion | None:
    """The place by a receiver's topic; newer logs have degrees and m, older ones 1e-7 degrees and mm."""
    data = topic.data
    utc = np.asarray(data.get("time_utc_usec", np.zeros(1)), np.float64)
    unix = 1e-6 * float(utc.max()) if len(utc) else None
    if "latitude_deg" in data:
        lat, lon, alt = data["latitude_deg"], data["longitude_deg"], data.get("altitude_msl_m")
    elif "lat" in data and "lon" in data:
        lat, lon, alt = data["lat"], data["lon"], 1e-3 * data["alt"] if "alt" in data else None
    else:
        return None
    return satellite_place(lat, lon, alt, unix, topic.name)


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
