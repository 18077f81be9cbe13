"""A Calibration: the errors of a sensor with their σ, as a filter has estimated them, and their correction.

track = fuse(recording, ESKF())
print(track.calibration)                      in words, and the numbers that this motion did not show
track.calibration.save("sensor.json")
fuse(another, ESKF(), prior=Calibration.read("sensor.json"))
"""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.errors import LevelheadError, nearest
from levelhead.filters.eskf.calibration import Estimate
from levelhead.filters.eskf.state import ALWAYS, BLOCKS, WITH_MAG, Block
from levelhead.json_file import read_json, write_json
from levelhead.kernels import correction
from levelhead.kernels.correction import SensorErrors
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.vec3 import Vec3
from levelhead.open_types import JsonObject
from levelhead.recording import Array, Recording, real_array

FORMAT = "levelhead calibration 1"

UNLEARNED = 0.7  # of the σ that it would have had unlearned (about half of the variance): it has not been learned


@dataclass(frozen=True, eq=False)
class Quantity:
    """One thing that was learned.

    Attributes:
        value: the estimate.
        sigma: its 1σ, of the same shape.
        unlearned: its 1σ by now without measurements; 0 where it was not requested.
        start: its value at the start; the rest of ``unlearned`` is a random walk since.
    """

    value: Array
    sigma: Array
    unlearned: Array
    start: Array

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where the motion showed a number: σ has shrunk to less than 0.7 of ``unlearned``."""
        return self.sigma < UNLEARNED * self.unlearned


# Those that ``words`` has sentences of its own for
IN_WORDS = {
    "gyr_bias", "gyr_matrix", "acc_bias", "acc_matrix", "mag_offset", "mag_matrix", "soft_iron", "mag_delay", "field",
    "north",
}  # fmt: skip
# Only poses show it (``calibrate``), no filter estimates it: it is subtracted from the readings before a filter.
MATRICES = {
    name: Block(name, -1, (3, 3), "", meaning, "from poses", True, False, False, 0.0)
    for name, meaning in {
        "acc_matrix": "accelerometer matrix T: scale factors and cross-axis terms",
        "mag_matrix": "magnetometer matrix M: soft iron, scale factors and rotation to the accelerometer",
    }.items()
}
# Properties of the place and the orientation, not of the sensor.
OF_PLACE = {
    "field": Block("field", -1, (2,), "µT", "horizontal and upward field", WITH_MAG, True, False, True, 0.0),
    "north": Block("north", -1, (1,), "rad", "azimuth of magnetic north", WITH_MAG, True, False, False, 0.0),
}
QUANTITIES = {block.name: block for block in BLOCKS if block.calibration} | MATRICES | OF_PLACE
SYMMETRIC = (0, 2, 3, 2, 1, 4, 3, 4)  # where the numbers of soft iron stand in its matrix, but for the last


@dataclass(frozen=True, eq=False)
class TemperatureCurve:
    """How the bias of one sensor changes with its temperature.

    Attributes:
        reference: T₀, °C.
        low: coldest temperature that was measured, °C.
        high: warmest, °C; beyond both the change at the nearer end counts.
        value: (3, 3) change of the biases of x, y and z, rad/s or m/s² over K, K² and K³ from T₀.
    """

    reference: float
    low: float
    high: float
    value: Array

    def change(self, temperature: Array) -> Array:
        """(n, 3) bias at (n,) °C minus that at the reference."""
        off = np.clip(temperature, self.low, self.high) - self.reference
        off = off[:, None]
        found: Array = off * (self.value[:, 0] + off * (self.value[:, 1] + off * self.value[:, 2]))
        return found

    def to_dict(self) -> JsonObject:
        """For JSON."""
        return {"reference_C": self.reference, "low_C": self.low, "high_C": self.high, "value": self.value.tolist()}

    @classmethod
    def from_dict(cls, name: str, part: object) -> "TemperatureCurve":
        """The object that ``to_dict`` described.

        Raises:
            LevelheadError: it is something else.
        """
        keys = ("reference_C", "low_C", "high_C")
        if not isinstance(part, dict) or not all(isinstance(part.get(key), int | float) for key in keys):
            raise LevelheadError(f"temperature.{name} is not whole; expected {', '.join(keys)} in °C, and value")
        value = real_array(
            f"temperature.{name}.value", part.get("value", ()), (3, 3), "the sensor's unit over K, K², K³"
        )
        reference, low, high = (float(part[key]) for key in keys)
        if not np.isfinite([low, high, *value.ravel()]).all() or not low <= reference <= high:
            raise LevelheadError(f"temperature.{name} is {part}; expected finite numbers, low_C ≤ reference_C ≤ high_C")
        return cls(reference, low, high, value)


class Calibration:
    """The errors of a sensor with their σ: the true rate is ω − S ω − b, the true specific force a − T a − c, the true
    field h − d ω × h with h = (1 − S_m) (μ − M μ) − o.

    Attributes:
        gyr_matrix: S (3, 3): scale factor errors on the diagonal (0.01: the axis reads one percent too much), beside it
            by how much an axis answers to turns about another.
        gyr_bias: b (3,) in rad/s.
        acc_bias: c (3,) in m/s².
        mag_offset: o (3,) in µT (hard iron); None: there was no magnetometer.
        mag_delay: d (1,) in s, by which the magnetometer is later than the gyroscope.
        acc_matrix: T (3, 3): the same as S for the accelerometer; None: taken to be 0.
        mag_matrix: M (3, 3): the same for the magnetometer, with soft iron; None: taken to be 0.
        soft_iron: (5,) S_m: symmetric matrix without trace, by its xx, yy, xy, xz, yz; None: taken to be 0.
        field: (2,) horizontal and vertical (upwards) strength of the field in µT: of the place, not of the sensor.
        north: (1,) azimuth of magnetic north in rad, clockwise from the y axis of the orientation; likewise.
        temperature: "gyr" and "acc" to how their biases change; the biases above are those at its reference. ``apply``
            and ``fuse`` correct recordings with a temperature, a stream and exported C by ``update_temperature``.
    """

    gyr_matrix: Quantity
    gyr_bias: Quantity
    acc_bias: Quantity
    mag_offset: Quantity | None
    mag_delay: Quantity | None
    soft_iron: Quantity | None
    field: Quantity | None
    north: Quantity | None
    acc_matrix: Quantity | None
    mag_matrix: Quantity | None
    temperature: Mapping[str, TemperatureCurve]

    def __init__(
        self, temperature: Mapping[str, TemperatureCurve] = MappingProxyType({}), /, **parts: Quantity | None
    ) -> None:
        object.__setattr__(self, "temperature", temperature)
        for name in parts:
            if name not in QUANTITIES:
                raise LevelheadError(f"a Calibration has no '{name}'; {nearest(name, list(QUANTITIES))}")
        for name, block in QUANTITIES.items():
            if parts.get(name) is None and block.exists == ALWAYS:
                raise LevelheadError(f"a Calibration needs {name}, the {block.meaning}")
            object.__setattr__(self, name, parts.get(name))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Calibration cannot be changed, so {name} stays as it is")

    def __repr__(self) -> str:
        return f"Calibration({', '.join(name for name, part in self._parts().items() if part is not None)})"

    @classmethod
    def from_estimates(cls, found: Mapping[str, Estimate]) -> "Calibration":
        """From a filter's estimates, by name."""
        return cls(**{name: _quantity(name, part) for name, part in found.items()})

    def with_north(self, north: Quantity) -> "Calibration":
        """The same with another azimuth of north, of an orientation that was turned."""
        return Calibration(self.temperature, **{**self._parts(), "north": north})

    def prior(self) -> dict[str, Estimate]:
        """Estimates for the next run of the same sensor, by name.

        A random walk in this run is removed: of a number whose 1σ was s at the start and would be w by now, a share
        k = s²/w² is expected to be constant, and this has the variance k² σ² + (1 − k) s². Biases change when a sensor
        is switched on: σ of the gyroscope's grows by 0.3 °/s, that of the accelerometer's by 0.02 m/s². The field
        belongs to the place and is left out.
        """
        parts = {name: part for name, part in self._parts().items() if part is not None and QUANTITIES[name].prior}
        return {name: _constant(part, QUANTITIES[name].turn_on) for name, part in parts.items()}

    def without(self, *names: str) -> "Calibration":
        """The same without some quantities."""
        parts = {name: part for name, part in self._parts().items() if name not in names}
        return Calibration(self.temperature, **parts)

    def with_temperature(self, curves: Mapping[str, TemperatureCurve], gyr_bias: Quantity) -> "Calibration":
        """The same with how biases change, and the gyroscope's at the reference."""
        return Calibration(dict(curves), **{**self._parts(), "gyr_bias": gyr_bias})

    @classmethod
    def of_nothing(cls, **known: Quantity | None) -> "Calibration":
        """One with these quantities alone; of all others nothing is known."""
        nothing = {
            name: Quantity(*(np.zeros(block.shape) for _ in range(4)))
            for name, block in QUANTITIES.items()
            if block.exists == ALWAYS
        }
        return cls(**nothing | known)

    def _parts(self) -> dict[str, Quantity | None]:
        return {name: getattr(self, name) for name in QUANTITIES}

    def apply(self, recording: Recording) -> Recording:
        """The recording that a sensor without these errors would have given; the given one stays as it is.

        The field of a sample whose rate is missing is not corrected for the delay; a sensor that is silent (all zero)
        stays so. ``truth.bias`` becomes the residual bias. The bits are those of ``levelhead export --calibration`` in
        C.
        """
        errors, recording = self.errors, self.at_reference(recording)
        gyr = _rows(correction.true_rate(errors, _columns(recording.gyr)))
        acc = _unless_silent(recording.acc, correction.true_force(errors, _columns(recording.acc)))
        mag = recording.mag
        if mag is not None and self.mag_offset is not None and self.mag_delay is not None:
            turn = np.where(np.isfinite(gyr), gyr, 0.0)
            mag = _unless_silent(mag, correction.true_field(errors, _columns(turn), _columns(mag)))
        truth = recording.truth
        if truth is not None and truth.bias is not None:
            truth = replace(truth, bias=_rows(correction.true_rate(errors, _columns(truth.bias))))
        return replace(recording, gyr=gyr, acc=acc, mag=mag, truth=truth)

    def at_reference(self, recording: Recording) -> Recording:
        """The recording without the change of its biases with temperature; without a thermometer a note is added."""
        if not self.temperature:
            return recording
        warmth = recording.temperature
        known = np.zeros(0, dtype=bool) if warmth is None else np.isfinite(warmth)
        if warmth is None or not known.any():
            note = "the log has no temperature, so that biases are corrected as those at the reference"
            notes = (*recording.meta.get("notes", ()), note)
            return replace(recording, meta={**recording.meta, "notes": notes})
        warmth = np.interp(recording.t, recording.t[known], warmth[known])
        corrected = {name: getattr(recording, name) - curve.change(warmth) for name, curve in self.temperature.items()}
        if "acc" in corrected:
            corrected["acc"] = _unless_silent(recording.acc, _columns(corrected["acc"]))
        return replace(recording, **corrected)

    def matrices(self) -> "Calibration | None":
        """Only the part that no filter estimates, to be subtracted from a filter's readings; None: nothing."""
        parts = {name: self._parts()[name] for name in MATRICES}
        if all(part is None for part in parts.values()):
            return None
        for name, block in QUANTITIES.items():
            if block.exists == ALWAYS or name in ("mag_offset", "mag_delay"):
                parts[name] = Quantity(*(np.zeros(block.shape) for _ in range(4)))
        return Calibration(**parts)

    def with_matrices(self, other: "Calibration | None") -> "Calibration":
        """The same with the matrices of another that no filter estimates."""
        if other is None:
            return self
        parts = self._parts() | {name: getattr(other, name) for name in MATRICES}
        return Calibration(other.temperature, **parts)

    @property
    def errors(self) -> SensorErrors:
        """The same in plain numbers, for the kernels of ``correction``; 0 for unknown numbers of a magnetometer."""
        offset, delay = self.mag_offset, self.mag_delay
        return SensorErrors(
            Mat3(*self.gyr_matrix.value.ravel().tolist()),
            Vec3(*self.gyr_bias.value.tolist()),
            _matrix(self.acc_matrix),
            Vec3(*self.acc_bias.value.tolist()),
            Mat3(*self.magnetic_matrix.ravel().tolist()),
            Vec3(0.0, 0.0, 0.0) if offset is None else Vec3(*offset.value.tolist()),
            0.0 if delay is None else float(delay.value[0]),
        )

    @property
    def magnetic_matrix(self) -> Array:
        """(3, 3): soft iron found by poses and by a filter, together."""
        fixed = np.zeros((3, 3)) if self.mag_matrix is None else self.mag_matrix.value
        if self.soft_iron is None:
            return fixed
        numbers = self.soft_iron.value
        found = np.array([*numbers[list(SYMMETRIC)], -numbers[0] - numbers[1]]).reshape(3, 3)
        together: Array = fixed + found - found @ fixed
        return together

    def to_dict(self) -> dict[str, object]:
        """For JSON: of each quantity its unit and its four attributes as lists; None for absent ones."""
        found: dict[str, object] = {
            name: None if part is None else {"unit": QUANTITIES[name].unit} | {
                one.name: getattr(part, one.name).tolist() for one in fields(part)
            }
            for name, part in self._parts().items()
        }  # fmt: skip
        if self.temperature:
            found["temperature"] = {name: one.to_dict() for name, one in self.temperature.items()}
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, whole or not at all.

        Raises:
            LevelheadError: the path cannot be written.
        """
        write_json(path, FORMAT, self.to_dict())

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> "Calibration":
        """The calibration that ``save`` wrote, to the last bit.

        Raises:
            LevelheadError: no such file, or not such a file.
        """
        whole = read_json(path, FORMAT, "calibration", "the JSON that levelhead saved")
        return cls.from_dict(whole, str(path))

    @classmethod
    def from_dict(cls, parts: Mapping[str, object], source: str) -> "Calibration":
        """The calibration that ``to_dict`` described.

        Raises:
            LevelheadError: a part that is missing or wrong; the sentence begins with ``source``.
        """
        try:
            curves = parts.get("temperature", {})
            if not isinstance(curves, dict) or not curves.keys() <= {"gyr", "acc"}:
                raise LevelheadError("temperature is not a table of gyr and acc; expected one, or nothing")
            temperature = {name: TemperatureCurve.from_dict(name, one) for name, one in curves.items()}
            return cls(temperature, **{name: _read(name, parts.get(name)) for name in QUANTITIES})
        except LevelheadError as error:
            raise LevelheadError(f"{source}: {error}") from None

    def counts(self) -> tuple[int, int]:
        """How many of the sensor's errors are known, and of how many that the filter estimates."""
        parts = [self.gyr_bias, self.gyr_matrix, self.acc_bias, self.mag_offset, self.soft_iron, self.mag_delay]
        there = [part for part in parts if part is not None]
        return sum(int(part.known.sum()) for part in there), sum(int((part.unlearned > 0.0).sum()) for part in there)

    def words(self) -> list[str]:
        """The learned quantities with ± 1σ, a line each; the last line names those that are still unknown."""
        quantities = self._quantities()
        lines = [line for line in map(_found, quantities) if line] + self._place_and_delay()
        missing = [words for words in map(_reasons_missing, quantities) if words]
        if self.mag_delay is not None and not self.mag_delay.known[0] and self.mag_delay.sigma[0] > 0.0:
            missing.append("magnetometer delay (too little rotation)")
        lines += [
            f"{words} bias by temperature, {curve.low:.1f} to {curve.high:.1f} °C; above: at {curve.reference:.1f} °C"
            for name, words in (("gyr", "gyroscope"), ("acc", "accelerometer"))
            if (curve := self.temperature.get(name)) is not None
        ]
        if missing:
            lines.append(f"could not be learned from this motion: {', '.join(missing)}")
        return [line.replace(" -", " −") for line in lines]

    def _quantities(self) -> list["_Words"]:
        """The vectors and matrices that exist, in the order of their lines."""
        few, axes = "held in too few attitudes", _axes()
        scale = _axes([(i, i) for i in range(3)])
        cross = _axes([(i, j) for i in range(3) for j in range(3) if i != j])
        symmetric: dict[str, tuple[int, ...]] = {name: (i,) for i, name in enumerate(("xx", "yy", "xy", "xz", "yz"))}
        table: list[tuple[str, Quantity | None, float, str, dict[str, tuple[int, ...]], str]] = [
            ("gyroscope bias", self.gyr_bias, math.degrees(1.0), "°/s", axes, "neither rest nor enough motion"),
            ("gyroscope scale", self.gyr_matrix, 100.0, "%", scale, "too little rotation about it"),
            ("gyroscope cross-axis", self.gyr_matrix, 100.0, "%", cross, "too little rotation"),
            ("accelerometer bias", self.acc_bias, 1.0, "m/s²", axes, few),
            ("accelerometer scale", self.acc_matrix, 100.0, "%", scale, few),
            ("accelerometer cross-axis", self.acc_matrix, 100.0, "%", cross, few),
            ("magnetometer scale", self.mag_matrix, 100.0, "%", scale, few),
            ("magnetometer cross-axis", self.mag_matrix, 100.0, "%", cross, few),
            ("magnetometer offset", self.mag_offset, 1.0, "µT", axes, few),
            ("soft iron", self.soft_iron, 100.0, "%", symmetric, few),
        ]
        table += [
            (block.meaning, self._parts()[name], 1.0, block.unit, _flat(block.shape), "too little motion")
            for name, block in QUANTITIES.items()
            if name not in IN_WORDS
        ]
        return [
            _Words(name, part, factor, unit, names, why) for name, part, factor, unit, names, why in table
            if part is not None
        ]  # fmt: skip

    def _place_and_delay(self) -> list[str]:
        """Lines for the magnetometer's delay, the field and north, as far as they were learned."""
        lines = []
        if self.mag_delay is not None and self.mag_delay.known[0]:
            delay, sigma = 1e3 * self.mag_delay.value[0], 1e3 * self.mag_delay.sigma[0]
            when = "later" if delay >= 0.0 else "earlier"
            lines.append(f"magnetometer {_pm(abs(delay), sigma)} ms {when} than the gyroscope")
        if self.field is not None:
            level, up = self.field.value
            dip = math.degrees(math.atan2(-up, level))
            lines.append(f"field of the place {math.hypot(level, up):.1f} µT, dip {dip:.1f}°")
        if self.north is not None and self.north.known[0]:
            degrees = math.degrees(1.0)
            lines.append(f"north at {_pm(degrees * self.north.value[0], degrees * self.north.sigma[0])}°")
        return lines

    def __str__(self) -> str:
        return "\n".join(self.words())


def _columns(rows: Array) -> Vec3:
    """Vectors as one whose components are arrays: kernels without a condition take both, with the same bits."""
    return Vec3(*rows.T)


def _rows(columns: Vec3) -> Array:
    return np.stack(columns, axis=1)


def _unless_silent(rows: Array, corrected: Vec3) -> Array:
    """The corrected vectors, but the zero vector of a silent sensor as it is."""
    return np.where(np.asarray(correction.is_absent(_columns(rows)))[:, None], rows, _rows(corrected))


def _matrix(part: Quantity | None) -> Mat3:
    """For the kernels; 0 where nothing is known."""
    return Mat3(*(np.zeros(9) if part is None else part.value.ravel()).tolist())


class _Words(NamedTuple):
    """A quantity as text: its factor to a unit, the names of its numbers, and why it may be unknown."""

    name: str
    part: Quantity
    factor: float
    unit: str
    names: dict[str, tuple[int, ...]]
    why: str


def _axes(places: list[tuple[int, int]] | None = None) -> dict[str, tuple[int, ...]]:
    """Name -> index: x, y, z, or xy for the share of turns about y in x."""
    if places is None:
        return {axis: (i,) for i, axis in enumerate("xyz")}
    return {"xyz"[i] + ("xyz"[j] if i != j else ""): (i, j) for i, j in places}


def _flat(shape: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """The indices of an array, by themselves."""
    return {",".join(map(str, at)): at for at in np.ndindex(shape)}


def _found(quantity: _Words) -> str:
    """The numbers that were learned; empty where none was."""
    part, factor = quantity.part, quantity.factor
    known = [name for name, at in quantity.names.items() if part.known[at]]
    said = [f"{name} {_pm(factor * part.value[quantity.names[name]], factor * part.sigma[quantity.names[name]])}"
            for name in known]  # fmt: skip
    return f"{quantity.name} {', '.join(said)} {quantity.unit}" if said else ""


def _reasons_missing(quantity: _Words) -> str:
    """The numbers that were asked for and not learned, and why."""
    part = quantity.part
    names = [name for name, at in quantity.names.items() if part.unlearned[at] > 0.0 and not part.known[at]]
    return f"{quantity.name} {' '.join(names)} ({quantity.why})" if names else ""


def _pm(value: float, sigma: float) -> str:
    """0.312 ± 0.024 as "0.31 ± 0.02": σ with one digit, the value as far as that goes."""
    digits = max(0, -math.floor(math.log10(sigma))) if sigma > 0.0 else 2
    return f"{round(value, digits) + 0.0:.{digits}f} ± {sigma:.{digits}f}"


def _quantity(name: str, part: Estimate) -> Quantity:
    shape, unit = QUANTITIES[name].shape, QUANTITIES[name].unit
    arrays = [real_array(name, np.reshape(numbers, shape), shape, unit or "no unit") for numbers in part]
    return Quantity(*arrays)


def _constant(part: Quantity, turn_on: float) -> Estimate:
    """A quantity after its run; σ 0, which means "unknown", where it was not asked for."""
    asked = part.start > 0.0
    share = np.square(np.divide(part.start, part.unlearned, out=np.zeros_like(part.start), where=asked))
    variance = np.square(share * part.sigma) + (1.0 - share) * np.square(part.start) + turn_on**2
    sigma = np.where(asked, np.sqrt(variance), 0.0)
    return Estimate(*(tuple(a.reshape(-1).tolist()) for a in (share * part.value, sigma, part.unlearned, part.start)))


def _read(name: str, part: object) -> Quantity | None:
    """One quantity from JSON."""
    shape, unit = QUANTITIES[name].shape, QUANTITIES[name].unit
    if part is None and QUANTITIES[name].exists != ALWAYS:
        return None
    if not isinstance(part, dict) or part.get("unit") != unit:
        raise LevelheadError(
            f"{name} is missing or not in {unit or 'its unit'}; expected value, sigma, unlearned and start"
        )
    arrays = []
    for key in Estimate._fields:
        array = real_array(f"{name}.{key}", part.get(key, ()), shape, unit or "no unit")
        if np.isnan(array).any() or (key != "value" and (array < 0.0).any()):
            what = "finite numbers" if key == "value" else "numbers of at least 0"
            raise LevelheadError(f"{name}.{key} is {part[key]}; expected {what}")
        arrays.append(array)
    return Quantity(*arrays)
