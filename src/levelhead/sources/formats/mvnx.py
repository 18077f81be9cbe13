"""Xsens MVN's open XML, .mvnx: acceleration, rates and field of each sensor, frame by frame.

By the MVN User Manual (MVNX): <subject frameRate="240"><sensors><sensor label="Pelvis"/>…</sensors><frames>
<frame time="4" type="normal"><sensorFreeAcceleration>…, <sensorMagneticField>…. Older files have
<acceleration> and <angularVelocity> of segments only, in the earth frame, which are not a sensor's readings.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

_WANTED = {"sensorAcceleration": "acc", "sensorAngularVelocity": "gyr", "sensorMagneticField": "mag"}
_UNITS = {"acc": " [m/s²]", "gyr": " [rad/s]", "mag": ""}


def tables(path: Path, display_path: str, hints: Hints) -> Sequence[ArrayTable]:
    """A table for each sensor.

    Raises:
        LevelheadError: no XML, or none with the readings of sensors.
    """
    rows: dict[str, list[list[float]]] = {role: [] for role in _WANTED.values()}
    stamps: list[float] = []
    labels: list[str] = []
    rate: float | None = None
    try:
        for event, node in ElementTree.iterparse(path, ("start", "end")):
            name = node.tag.rpartition("}")[2]
            if event == "start" and name == "subject":
                rate = float(node.get("frameRate", "nan"))
            elif event == "start" and name == "sensor":
                labels.append(node.get("label", str(len(labels) + 1)))
            elif event == "end" and name == "frame":
                if node.get("type", "normal") == "normal":
                    stamps.append(float(node.get("time", "nan")))
                    for child in node:
                        role = _WANTED.get(child.tag.rpartition("}")[2])
                        if role is not None:
                            rows[role].append([float(word) for word in (child.text or "").split()])
                node.clear()
    except (ElementTree.ParseError, ValueError) as error:
        raise LevelheadError(f"{display_path} is not an XML of Xsens MVN, or it is damaged ({error})") from None
    if not rows["acc"] or not rows["gyr"]:
        raise LevelheadError(
            f"{display_path} holds segments, and no readings of sensors; expected sensorAcceleration and "
            "sensorAngularVelocity: in MVN Analyze, Options > File Export > MVNX, tick the sensor data; or export the "
            ".mtb of the same recording by MT Manager"
        )
    return _tables(display_path, {role: np.array(values) for role, values in rows.items() if values}, labels,
                   np.array(stamps), rate)  # fmt: skip


def _tables(source: str, values: dict[str, np.ndarray], labels: Sequence[str], t: np.ndarray, rate: float | None
            ) -> list[ArrayTable]:  # fmt: skip
    made = []
    known = np.isfinite(t).all() and len(t) > 1 and bool((np.diff(t) > 0).all())
    for k, label in enumerate(labels):
        columns = {"t [ms]": t} if known else {}
        for role, array in values.items():
            if array.ndim == 2 and len(array) == len(t) and array.shape[1] >= 3 * (k + 1):
                columns |= {f"{role}_{axis}{_UNITS[role]}": array[:, 3 * k + i] for i, axis in enumerate("xyz")}
        made.append(ArrayTable(source, columns, rate=None if known else rate, context=label))
    return made
