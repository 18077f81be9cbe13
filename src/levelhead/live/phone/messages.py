"""Messages of the page and of phone apps, as readings of one sensor each."""

from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.live.phone.streams import Sensor, SensorReading
from levelhead.open_types import JsonObject, Untyped
from levelhead.units import GRAVITY

HECTOPASCAL = 100.0
NANO = 1e-9
DATAGRAM_SENSORS: dict[int, Sensor] = {3: "acc", 4: "gyr", 5: "mag", 85: "pressure"}
PHYPHOX_SENSORS: dict[str, Sensor] = {"accelerometer": "acc", "gyroscope": "gyr", "magnetic_field": "mag"}
PHYPHOX_BUFFERS: dict[Sensor, tuple[str, str, str, str]] = {
    "acc": ("acc_time", "accX", "accY", "accZ"),
    "gyr": ("gyro_time", "gyroX", "gyroY", "gyroZ"),
    "mag": ("mag_time", "magX", "magY", "magZ"),
}


def read_page(message: JsonObject) -> list[SensorReading]:
    """Readings from the page: rows of s, rad/s × 3, m/s² × 3 along the phone's axes.

    Raises:
        LevelheadError: other rows.
    """
    found: list[SensorReading] = []
    for row in _list(message, "rows"):
        if not isinstance(row, list) or len(row) != 7:
            raise LevelheadError("a row of the page has 7 numbers: s, rad/s × 3, m/s² × 3")
        t, *values = (_number(value) for value in row)
        found += [SensorReading("gyr", t, tuple(values[:3])), SensorReading("acc", t, tuple(values[3:]))]
    return found


class SensorLogger:
    """Readings from the messages of the app Sensor Logger (HTTP push, "Standardise Units & Frames" on).

    ``totalacceleration`` and ``accelerometeruncalibrated`` hold the specific force. Where neither comes,
    ``accelerometer`` and ``gravity`` are added at equal times. On an iPhone without "Standardise" the uncalibrated
    accelerometer is in g with the opposite sign of Android's; its length distinguishes them.
    """

    def __init__(self) -> None:
        self._linear: dict[int, tuple[float, ...]] = {}
        self._gravity: dict[int, tuple[float, ...]] = {}
        self._direct = ""  # the sensor whose specific force is kept to

    def read(self, message: JsonObject) -> list[SensorReading]:
        """The readings of one message.

        Raises:
            LevelheadError: not the app's form.
        """
        found: list[SensorReading] = []
        for entry in _list(message, "payload"):
            if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
                raise LevelheadError("an entry of the payload has a name, a time and values")
            reader = self._readers().get(entry["name"].lower())
            if reader is not None:
                found += reader(entry)
        return found

    def _readers(self) -> dict[str, Callable[[JsonObject], list[SensorReading]]]:
        return {
            "gyroscope": lambda entry: [SensorReading("gyr", _seconds(entry), _triple(entry))],
            "magnetometer": lambda entry: [SensorReading("mag", _seconds(entry), _triple(entry))],
            "barometer": lambda entry: [
                SensorReading("pressure", _seconds(entry), (HECTOPASCAL * _number(_values(entry).get("pressure")),))
            ],
            "totalacceleration": self._total,
            "accelerometeruncalibrated": self._total,
            "accelerometer": lambda entry: self._sum(entry, self._linear, self._gravity),
            "gravity": lambda entry: self._sum(entry, self._gravity, self._linear),
        }

    def _total(self, entry: JsonObject) -> list[SensorReading]:
        self._direct = self._direct or entry["name"].lower()
        if entry["name"].lower() != self._direct:
            return []
        values = _triple(entry)
        if sum(value * value for value in values) < (0.3 * GRAVITY) ** 2:  # Core Motion: g, and gravity points down
            values = tuple(-GRAVITY * value for value in values)
        return [SensorReading("acc", _seconds(entry), values)]

    def _sum(
        self, entry: JsonObject, own: dict[int, tuple[float, ...]], other: dict[int, tuple[float, ...]]
    ) -> list[SensorReading]:
        if self._direct:
            return []
        time, values = int(_number(entry.get("time"))), _triple(entry)
        if time in other:
            total = tuple(a + b for a, b in zip(values, other.pop(time), strict=True))
            return [SensorReading("acc", _seconds(entry), total)]
        own[time] = values
        while len(own) > 100:
            own.pop(next(iter(own)))
        return []


def read_datagram(line: str) -> list[SensorReading]:
    """Readings from a line of Sensorstream IMU+GPS: s, then a sensor's number with its values, for each sensor.

    3: accelerometer, m/s²; 4: gyroscope, rad/s; 5: magnetometer, µT; 85: pressure, hPa.

    Raises:
        LevelheadError: not numbers.
    """
    numbers = [_number(word.strip()) for word in line.split(",")]
    found: list[SensorReading] = []
    i = 1
    while i < len(numbers):
        sensor = DATAGRAM_SENSORS.get(int(numbers[i]))
        count = 1 if sensor == "pressure" else 3
        values = tuple(numbers[i + 1 : i + 1 + count])
        if len(values) < count:
            raise LevelheadError(f"the line ends within the values of sensor {int(numbers[i])}")
        if sensor is not None:
            found.append(
                SensorReading(sensor, numbers[0], tuple((HECTOPASCAL if count == 1 else 1.0) * v for v in values))
            )
        i += 1 + count
    return found


def phyphox_buffers(config: JsonObject) -> dict[Sensor, tuple[str, str, str, str]]:
    """Names of the buffers for time, x, y, z of each sensor, from phyphox's /config; else those of its own experiments.

    Raises:
        LevelheadError: the experiment has no gyroscope or no accelerometer.
    """
    found: dict[Sensor, tuple[str, str, str, str]] = {}
    for one in config.get("inputs", []):
        sensor = PHYPHOX_SENSORS.get(one.get("source", ""))
        names = {key: name for output in one.get("outputs", []) for key, name in output.items()}
        if sensor is not None and all(key in names for key in "txyz"):
            found[sensor] = names["t"], names["x"], names["y"], names["z"]
    if not found:
        listed = {buffer.get("name") for buffer in config.get("buffers", [])}
        found = {sensor: names for sensor, names in PHYPHOX_BUFFERS.items() if listed.issuperset(names)}
    missing = [words for sensor, words in (("gyr", "gyroscope"), ("acc", "accelerometer")) if sensor not in found]
    if missing:
        raise LevelheadError(
            f"the experiment in phyphox has no {' and no '.join(missing)}; add one with both (+, simple experiment)"
        )
    return found


def _list(message: JsonObject, name: str) -> list[Untyped]:
    found = message.get(name)
    if not isinstance(found, list):
        raise LevelheadError(f"the message has no list '{name}'")
    return found


def _values(entry: JsonObject) -> JsonObject:
    found = entry.get("values", entry)  # in recordings the values stand beside the time
    if not isinstance(found, dict):
        raise LevelheadError(f"the values of '{entry.get('name')}' are not an object")
    return found


def _triple(entry: JsonObject) -> tuple[float, ...]:
    found = _values(entry)
    return tuple(_number(found.get(axis)) for axis in "xyz")


def _seconds(entry: JsonObject) -> float:
    return NANO * _number(entry.get("time"))


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise LevelheadError(f"{value!r:.40} is not a number")
    try:
        return float(value)
    except (ValueError, OverflowError):
        raise LevelheadError(f"{value!r:.40} is not a number") from None
