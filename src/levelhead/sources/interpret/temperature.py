"""The column with the temperature of the sensor, in °C."""

import re
from collections.abc import Collection, Sequence

import numpy as np

from levelhead.recording import Array
from levelhead.sources.hints import Scale
from levelhead.sources.table import Column

NAMED = frozenset({"temp", "temperature", "temperatur", "temperatura", "température"})
OTHERS = frozenset(
    {"baro", "barometer", "bme", "bmp", "ambient", "air", "cpu", "battery", "bat", "motor", "esc", "water", "outside"}
)
OF_THE_SENSOR = frozenset({"imu", "gyr", "gyro", "gyroscope", "sensor", "chip", "die", "mpu", "icm", "lsm", "bmi"})
COLDEST, WARMEST = -60.0, 150.0  # °C that a chip is
KELVIN = 273.15
CELSIUS, KELVINS, FAHRENHEIT = Scale(1.0, "°C"), Scale(1.0, "K"), Scale(1.0, "°F", 1.8)


def find_temperature(names: Sequence[str], used: Collection[int]) -> int | None:
    """Position of the column, that of the inertial sensor first; None if there is none."""
    found: list[tuple[bool, int]] = []
    for i, name in enumerate(names):
        words = set(re.findall(r"[^\W\d_]+", re.sub(r"[(\[{].*", "", name).lower()))
        if i not in used and words & NAMED and not words & OTHERS:
            found.append((not words & OF_THE_SENSOR, i))
    return min(found)[1] if found else None


def temperature_scale(name: str, column: Column) -> Scale | None:
    """The unit of (n,) numbers; None where they are not a temperature, such as counts of a register."""
    values = _finite(column)
    seen = values[~np.isnan(values)]
    if not len(seen):
        return None
    unit = re.search(r"[(\[{]\s*°?\s*(K|F)", name)
    if unit is not None and unit[1] == "F":
        scale = FAHRENHEIT
    elif unit is not None or (seen.min() > WARMEST and seen.max() < WARMEST + KELVIN):
        scale = KELVINS
    else:
        scale = CELSIUS
    made = celsius(scale, column)
    return None if np.nanmin(made) < COLDEST or np.nanmax(made) > WARMEST else scale


def celsius(scale: Scale, column: Column) -> Array:
    """(n,) °C of numbers in a unit of ``temperature_scale``."""
    values = _finite(column)
    if scale == FAHRENHEIT:
        return (values - 32.0) / 1.8
    return values - KELVIN if scale == KELVINS else values


def _finite(column: Column) -> Array:
    values = np.array(column, dtype=np.float64)
    values[np.isinf(values)] = np.nan
    return values
