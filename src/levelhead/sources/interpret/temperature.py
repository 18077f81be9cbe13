"""The column with the temperature of the sensor, in °C."""

import re
from collections.abc import Collection, Sequence

import numpy as np

from levelhead.recording import Array
from levelhead.sources.table import Column

NAMED = frozenset({"temp", "temperature", "temperatur", "temperatura", "température"})
OTHERS = frozenset(
    {"baro", "barometer", "bme", "bmp", "ambient", "air", "cpu", "battery", "bat", "motor", "esc", "water", "outside"}
)
OF_THE_SENSOR = frozenset({"imu", "gyr", "gyro", "gyroscope", "sensor", "chip", "die", "mpu", "icm", "lsm", "bmi"})
COLDEST, WARMEST = -60.0, 150.0  # °C that a chip is
KELVIN = 273.15


def find_temperature(names: Sequence[str], used: Collection[int]) -> int | None:
    """Position of the column, that of the inertial sensor first; None if there is none."""
    found: list[tuple[bool, int]] = []
    for i, name in enumerate(names):
        words = set(re.findall(r"[^\W\d_]+", re.sub(r"[(\[{].*", "", name).lower()))
        if i not in used and words & NAMED and not words & OTHERS:
            found.append((not words & OF_THE_SENSOR, i))
    return min(found)[1] if found else None


def celsius(name: str, column: Column) -> Array | None:
    """(n,) °C; None where the values are no temperature: counts of a register, say."""
    values = np.array(column, dtype=np.float64)
    values[np.isinf(values)] = np.nan
    seen = values[np.isfinite(values)]
    if not len(seen):
        return None
    unit = re.search(r"[(\[{]\s*°?\s*(K|F)", name)
    if unit is not None and unit[1] == "F":
        values = (values - 32.0) / 1.8
    elif unit is not None or (seen.min() > WARMEST and seen.max() < WARMEST + KELVIN):
        values = values - KELVIN
    if np.nanmin(values) < COLDEST or np.nanmax(values) > WARMEST:
        return None
    return values
