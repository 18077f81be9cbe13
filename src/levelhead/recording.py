"""A Recording: the readings of the sensors in SI units, checked once, here, and frozen."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from levelhead.errors import LevelheadError
from levelhead.open_types import ReadOnlyJson

Array = NDArray[np.float64]

MIN_PRESSURE, MAX_PRESSURE = 20_000.0, 150_000.0  # Pa: 11.8 km up, where the formula ends, and below any mine


def real_array(name: str, values: ArrayLike, shape: tuple[int | None, ...], unit: str) -> Array:
    """``values`` as a read-only float64 array of ``shape`` (None: any length); NaN passes, infinity does not.

    Raises:
        LevelheadError: not numbers, complex, wrong shape or infinite; the sentence names field, row and unit.
    """
    try:
        raw = np.asarray(values)
    except ValueError:
        raise LevelheadError(f"{name} has rows of different lengths; expected {_shape(shape)} in {unit}") from None
    if raw.dtype.kind not in "fiu":
        raise LevelheadError(f"{name} holds {raw.dtype} values; expected real numbers in {unit}")
    array = np.ascontiguousarray(raw, dtype=np.float64).view()
    fits = array.ndim == len(shape) and all(want in (None, have) for want, have in zip(shape, array.shape, strict=True))
    if not fits:
        raise LevelheadError(f"{name} has shape {array.shape}; expected {_shape(shape)} in {unit}")
    if not _plainly_finite(array) and (infinite := np.isinf(array)).any():
        row = int(np.argwhere(infinite)[0][0])
        raise LevelheadError(
            f"{name} is infinite at row {row}; expected finite values in {unit} (NaN marks a missing one)"
        )
    array.flags.writeable = False
    return array


def median(values: NDArray[np.number]) -> float:
    """The middle value (of an even number the upper one) of (n,) numbers without NaN; n at least 1.

    NumPy's own imports numpy.ma at its first call, which takes longer than reading a short log. With one place to find,
    its partition takes fifty times as long on values of which many are equal, as intervals are.
    """
    middle = len(values) // 2
    return float(np.partition(values, (middle, len(values) - 1))[middle])


def _plainly_finite(array: Array) -> bool:
    """A quick yes for the usual case: a sum is finite only if every term is.

    No product of BLAS, whose threads would run on the cores on which other recordings are being fused.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return math.isfinite(float(np.add.reduce(array.reshape(-1))))


def _shape(shape: tuple[int | None, ...]) -> str:
    return (
        "(" + ", ".join("n" if size is None else str(size) for size in shape) + ("," if len(shape) == 1 else "") + ")"
    )


def time_array(t: ArrayLike, name: str = "t") -> Array:
    """Time stamps in seconds, checked: finite, strictly increasing, at least one.

    Raises:
        LevelheadError: names the first row at which time is not finite or does not increase.
    """
    array = real_array(name, t, (None,), "s")
    if len(array) == 0:
        raise LevelheadError(
            "the recording is empty; expected at least one sample"
            if name == "t"
            else f"{name} is empty; expected a stamp"
        )
    forward = array[1:] > array[:-1]  # False where either is NaN, so one pass proves it all
    if math.isnan(array[0]) or not forward.all():
        missing = np.isnan(array)
        if missing.any():
            raise LevelheadError(f"{name} is NaN at row {int(missing.argmax())}; expected a time in s for every sample")
        row = int(forward.argmin()) + 1
        raise LevelheadError(
            f"{name} does not increase at row {row}: {array[row]:.6g} s after {array[row - 1]:.6g} s; "
            "expected strictly increasing seconds"
        )
    return array


@dataclass(frozen=True, eq=False)
class Truth:
    """Reference (optical, simulated) for the same samples; NaN where it has no value.

    Attributes:
        quat: (n, 4) orientation wxyz, sensor frame to earth frame.
        bias: (n, 3) true gyroscope bias in rad/s, known in simulations.
        moving: (n,) whether the sample counts when errors are averaged (BROAD's movement phases); None: all count.
        north: whether the earth frame's y axis is magnetic north. If not, only relative heading can be compared.
        position: (n, 3) m, earth frame.
        velocity: (n, 3) m/s, earth frame.
    """

    quat: Array
    bias: Array | None = None
    moving: NDArray[np.bool_] | None = None
    north: bool = True
    position: Array | None = None
    velocity: Array | None = None

    def __getitem__(self, rows: slice | NDArray[np.intp]) -> "Truth":
        """Of some samples."""
        parts = {
            name: None if (values := getattr(self, name)) is None else values[rows]
            for name in ("bias", "moving", "position", "velocity")
        }
        return Truth(self.quat[rows], north=self.north, **parts)

    def __post_init__(self) -> None:
        quat = real_array("truth.quat", self.quat, (None, 4), "unit quaternions wxyz")
        norm = np.linalg.norm(quat, axis=1)
        bad = np.abs(norm - 1.0) > 0.01
        if bad.any():
            row = int(bad.argmax())
            raise LevelheadError(
                f"truth.quat has norm {norm[row]:.3g} at row {row}; expected 1 (NaN marks a missing one)"
            )
        if (np.abs(norm - 1.0) > 1e-12).any():  # a unit quaternion keeps its bits
            quat = quat / norm[:, None]
            quat.flags.writeable = False
        object.__setattr__(self, "quat", quat)
        if self.bias is not None:
            object.__setattr__(self, "bias", real_array("truth.bias", self.bias, (len(quat), 3), "rad/s"))
        for name, unit in (("position", "m"), ("velocity", "m/s")):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, real_array(f"truth.{name}", values, (len(quat), 3), unit))
        if self.moving is not None:
            moving = np.asarray(self.moving)
            if moving.shape != (len(quat),):
                raise LevelheadError(
                    f"truth.moving has shape {moving.shape}; expected ({len(quat)},) of True and False"
                )
            object.__setattr__(self, "moving", moving.astype(bool))


def _deviation(name: str, sigma: ArrayLike, shape: tuple[int, ...], unit: str) -> Array:
    """1σ for every value, from one number, one for each axis, or all.

    Raises:
        LevelheadError: a shape that does not fit, or a σ that is not greater than 0.
    """
    one = np.asarray(sigma)
    if one.dtype.kind in "fiu" and (one.ndim == 0 or one.shape == shape[1:]):
        one = np.broadcast_to(one, shape)
    array = real_array(name, one, shape, unit)
    good = array > 0.0
    if not good.all():
        row = int(np.argwhere(~good)[0][0])
        raise LevelheadError(f"{name} is {np.ravel(array[row])[0]} at row {row}; expected more than 0 {unit}")
    return array


@dataclass(frozen=True, eq=False)
class Pressure:
    """Readings of a barometer, on the clock of the recording, with stamps of its own.

    Attributes:
        t: (n,) s, strictly increasing.
        values: (n,) air pressure in Pa; NaN marks a missing reading.
        sigma: 1σ of a reading in Pa, one number or (n,). The default is twice the noise of a BMP280 at its highest
            resolution, because air moves.

    Raises:
        LevelheadError: one sentence with the field, the row and the unit expected.
    """

    t: Array
    values: Array
    sigma: Array | float = 2.6

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", time_array(self.t, "pressure.t"))
        n = len(self.t)
        values = real_array("pressure.values", self.values, (n,), "Pa")
        object.__setattr__(self, "values", values)
        wrong = (values < MIN_PRESSURE) | (values > MAX_PRESSURE)
        if wrong.any():
            row = int(wrong.argmax())
            raise LevelheadError(
                f"pressure.values is {values[row]:g} at row {row}; expected air pressure in Pa, "
                f"{MIN_PRESSURE:g} to {MAX_PRESSURE:g} (1 hPa is 100 Pa)"
            )
        object.__setattr__(self, "sigma", _deviation("pressure.sigma", self.sigma, (n,), "Pa"))

    def __len__(self) -> int:
        return len(self.t)

    def between(self, start: float, end: float) -> "Pressure | None":
        """The readings with stamps from start to end; None if there are none."""
        rows = _within(self.t, start, end)
        return Pressure(self.t[rows], self.values[rows], np.asarray(self.sigma)[rows]) if len(self.t[rows]) else None


@dataclass(frozen=True, eq=False)
class Gnss:
    """Readings of a satellite receiver, on the clock of the recording, with stamps of its own.

    The earth frame is that of the orientation: x east, y magnetic north, z up (``to_magnetic_north`` turns true north
    there); where its origin lies is the caller's choice.

    Attributes:
        t: (n,) s, strictly increasing.
        position: (n, 3) m, or None; NaN marks a missing number.
        velocity: (n, 3) m/s, or None; NaN marks a missing number.
        sigma_position: 1σ in m, one number, one for each axis, or (n, 3).
        sigma_velocity: 1σ in m/s, likewise.

    Raises:
        LevelheadError: one sentence with the field, the row and the unit expected.
    """

    t: Array
    position: Array | None = None
    velocity: Array | None = None
    sigma_position: Array | float = 2.0
    sigma_velocity: Array | float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", time_array(self.t, "gnss.t"))
        n = len(self.t)
        if self.position is None and self.velocity is None:
            raise LevelheadError("gnss has neither position nor velocity; expected (n, 3) in m or m/s")
        for name, unit in (("position", "m"), ("velocity", "m/s")):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, real_array(f"gnss.{name}", values, (n, 3), unit))
            deviation = _deviation(f"gnss.sigma_{name}", getattr(self, f"sigma_{name}"), (n, 3), unit)
            object.__setattr__(self, f"sigma_{name}", deviation)

    def __len__(self) -> int:
        return len(self.t)

    def between(self, start: float, end: float) -> "Gnss | None":
        """The readings with stamps from start to end; None if there are none."""
        rows = _within(self.t, start, end)
        parts = [None if values is None else np.asarray(values)[rows]
                 for values in (self.position, self.velocity, self.sigma_position, self.sigma_velocity)]  # fmt: skip
        return Gnss(self.t[rows], *parts) if len(self.t[rows]) else None  # type: ignore[arg-type]

    def to_magnetic_north(self, declination: float) -> "Gnss":
        """The same over an earth frame whose y axis is magnetic north instead of true north.

        Args:
            declination: degrees from true to magnetic north, positive east. σ is taken to be the same east and north.
        """
        c, s = math.cos(math.radians(declination)), math.sin(math.radians(declination))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        parts = [None if values is None else values @ turn.T for values in (self.position, self.velocity)]
        return Gnss(self.t, parts[0], parts[1], self.sigma_position, self.sigma_velocity)


@dataclass(frozen=True, eq=False)
class ZeroVelocity:
    """Instants at which the sensor stood still, such as those of a foot on the ground, on the clock of the recording.

    A measurement of velocity without direction: it bounds velocity and tilt, and position then drifts by step only.

    Attributes:
        t: (n,) s, strictly increasing; one for each sample that stood still.
        sigma: 1σ in m/s of the velocity along each axis, one number or (n,).

    Raises:
        LevelheadError: one sentence with the field, the row and the unit expected.
    """

    t: Array
    sigma: Array | float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", time_array(self.t, "zero_velocity.t"))
        object.__setattr__(self, "sigma", _deviation("zero_velocity.sigma", self.sigma, (len(self.t),), "m/s"))

    def __len__(self) -> int:
        return len(self.t)

    def between(self, start: float, end: float) -> "ZeroVelocity | None":
        """The instants from start to end; None if there are none."""
        rows = _within(self.t, start, end)
        return ZeroVelocity(self.t[rows], np.asarray(self.sigma)[rows]) if len(self.t[rows]) else None


def _within(t: Array, start: float, end: float) -> slice:
    return slice(*np.searchsorted(t, [start, np.nextafter(end, np.inf)]))


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples of an inertial measurement unit on one clock.

    Attributes:
        t: (n,) seconds, strictly increasing; a gap in time stays a gap.
        gyr: (n, 3) angular rate in rad/s, sensor frame; a NaN row is a missing sample.
        acc: (n, 3) specific force in m/s² (level at rest: 0, 0, +9.81); a NaN row is a missing sample.
        mag: (n, 3) magnetic field in µT, or None; NaN rows where a slower magnetometer gave nothing.
        truth: reference orientation, or None.
        meta: its source and the reader's conclusions ("source", "notes", …).
        pressure: a barometer beside it, or None.
        gnss: a satellite receiver beside it, or None.
        temperature: (n,) °C of the sensor, or None; NaN where it gave nothing.
        zero_velocity: when the sensor stood still, or None.

    Raises:
        LevelheadError: one sentence with the field, the row and the unit expected.
    """

    t: Array
    gyr: Array
    acc: Array
    mag: Array | None = None
    truth: Truth | None = None
    meta: ReadOnlyJson = field(default_factory=dict)
    pressure: Pressure | None = None
    gnss: Gnss | None = None
    temperature: Array | None = None
    zero_velocity: ZeroVelocity | None = None

    def __post_init__(self) -> None:
        t = time_array(self.t)
        object.__setattr__(self, "t", t)
        for name, unit in (("gyr", "rad/s"), ("acc", "m/s²"), ("mag", "µT")):
            values = getattr(self, name)
            if values is None and name == "mag":
                continue
            if values is None:
                full = {"gyr": "gyroscope", "acc": "accelerometer"}[name]
                raise LevelheadError(f"there is no {full}; expected {name} of shape (n, 3) in {unit}")
            array = real_array(name, values, (None, 3), unit)
            if len(array) != len(t):
                raise LevelheadError(
                    f"{name} has {len(array)} rows, but t has {len(t)}; expected one row in {unit} per stamp"
                )
            object.__setattr__(self, name, array)
        if self.temperature is not None:
            object.__setattr__(self, "temperature", real_array("temperature", self.temperature, (len(t),), "°C"))
        for name, kind in (("pressure", Pressure), ("gnss", Gnss), ("zero_velocity", ZeroVelocity)):
            if not isinstance(getattr(self, name), kind | None):
                raise LevelheadError(
                    f"{name} is {type(getattr(self, name)).__name__}; expected a levelhead.{kind.__name__} or None"
                )
        if self.truth is not None and len(self.truth.quat) != len(t):
            raise LevelheadError(f"truth has {len(self.truth.quat)} rows, but t has {len(t)}")

    def __len__(self) -> int:
        return len(self.t)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(n,) True where gyroscope and accelerometer are both there."""
        return np.asarray(np.isfinite(self.gyr).all(axis=1) & np.isfinite(self.acc).all(axis=1))

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.t[-1] - self.t[0])

    @property
    def rate(self) -> float:
        """Samples a second: the inverse of the median interval; 0 for a single sample."""
        return round(1.0 / median(np.diff(self.t)), 6) if len(self) > 1 else 0.0

    def __getitem__(self, rows: slice) -> "Recording":
        """Some rows, as a Recording of its own: ``rec[1000:2000]``."""
        t = self.t[rows]
        seen = {
            name: None if (one := getattr(self, name)) is None or not len(t) else one.between(t[0], t[-1])
            for name in ("pressure", "gnss", "zero_velocity")
        }
        truth = None if self.truth is None else self.truth[rows]
        mag = None if self.mag is None else self.mag[rows]
        warmth = None if self.temperature is None else self.temperature[rows]
        return Recording(t, self.gyr[rows], self.acc[rows], mag, truth, self.meta, **seen, temperature=warmth)

    def __repr__(self) -> str:
        optional = ("mag", "pressure", "gnss", "zero_velocity", "temperature", "truth")
        parts = ["gyr", "acc", *(name for name in optional if getattr(self, name) is not None)]
        missing = int((~self.valid).sum())
        text = f"Recording({len(self)} samples, {self.duration:.1f} s at {self.rate:.1f} Hz: {', '.join(parts)}"
        return text + (f"; {missing} incomplete rows)" if missing else ")")
