"""Live use: one sample at a time, by the same step as a batch and with the same bits."""

from collections.abc import Callable, Sequence
from math import inf, isfinite, isnan
from typing import Any, SupportsFloat

import numpy as np
from numpy import ndarray

from levelhead import atmosphere, filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.binding import bind, bind_axis, choose_engine, estimates_bias, numba_installed
from levelhead.engine.driver import Settings
from levelhead.engine.heading_offset import HeadingOffset, heading_offset
from levelhead.engine.native import has_axis, has_imu
from levelhead.engine.prior import Warmth, apply_prior, correct_ticks, keep_prior, read_calibration
from levelhead.engine.serialization import StreamState, from_bytes, to_bytes
from levelhead.engine.stepper import MOST_DT, Eleven, Four, axis_stepper, imu_stepper
from levelhead.errors import LevelheadError
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, ZERO_VELOCITY, AxisReport, NavState, Output
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.kernels.correction import true_force
from levelhead.kernels.quat import Euler, Quat, rotate, to_euler, up
from levelhead.kernels.vec3 import ZERO, Vec3, scale, sub
from levelhead.recording import MAX_PRESSURE, MIN_PRESSURE, Array
from levelhead.rotations import turn_heading
from levelhead.track import North, north_of
from levelhead.units import GRAVITY

Triple = Sequence[float] | Array  # three numbers: a tuple, a list, a row of an array
Rows = Sequence[Triple] | Array


def _live_engine(engine: str, native: bool) -> str:
    """A stream goes on for long, so "auto" compiles where it has to, in the constructor, not at a sample."""
    if engine == "auto" and not native and numba_installed():
        return "compiled"
    return choose_engine(engine, 0, native)


def _triple(values: Any) -> Triple:  # Any: a user's value; other things than a row of numbers raise TypeError
    """A tuple of Python floats: NumPy's own scalars make everything after them several times slower."""
    return tuple(values.tolist() if type(values) is ndarray else values)


def _with_tuples(tick: Callable[..., Four]) -> Callable[..., Four]:
    """A tick that takes any rows of numbers, for an engine that takes tuples only."""

    def call(place: object, *given: object) -> Four:
        *rows, dt = given
        return tick(place, *map(_triple, rows), dt)

    return call


def _interval_error(dt: object) -> LevelheadError:
    return LevelheadError(f"dt is {dt!r}; it must be the seconds since the last sample, greater than 0")


def _sample_error(gyr: Triple, acc: Triple | None, mag: Triple | None, dt: object) -> LevelheadError:
    """Why a tick did not take a sample."""
    for name, values, unit in (("gyr", gyr, "rad/s"), ("acc", acc, "m/s²"), ("mag", mag, "µT")):
        try:
            three = values is None or len([float(x) for x in values]) == 3
        except (TypeError, ValueError):
            three = False
        if not three or (values is None and name == "gyr"):
            return LevelheadError(
                f"{name} is {values!r}; it must be three numbers in {unit} (NaN where one is missing)"
            )
    return _interval_error(dt)


def _rows(name: str, values: object, n: int | None, unit: str) -> Array:
    """(n, 3) float64 of the argument; ``n`` None: any number of rows.

    Raises:
        LevelheadError: it is of another shape, or holds other things than numbers.
    """
    try:
        rows = np.ascontiguousarray(values, np.float64)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.shape != (len(rows) if n is None else n, 3):
        wanted = "(n, 3)" if n is None else f"({n}, 3)"
        raise LevelheadError(f"{name} has the shape {np.shape(rows)}; it must be {wanted} numbers in {unit}")
    return rows


def _number(name: str, value: object, unit: str, *, positive: bool = False) -> float:
    """A number, which may be NaN unless it must be positive.

    Raises:
        LevelheadError: it is none.
    """
    number = float(value) if isinstance(value, SupportsFloat) else inf
    if abs(number) == inf or (positive and not number > 0.0) or (name == "age" and isnan(number)):
        wanted = "a number more than 0" if positive else "a finite number" if name == "age" else "a number, or NaN"
        raise LevelheadError(f"{name} is {value!r}; it must be {wanted} in {unit}")
    return number


def _pair_error(angle: object, rate: object, dt: object) -> LevelheadError:
    """Why a tick did not take a pair."""
    for name, value in (("angle", angle), ("rate", rate)):
        if not isinstance(value, SupportsFloat) or not isfinite(value):
            return LevelheadError(f"{name} is {value!r}; it must be a finite number: leave a missing sample out")
    return _interval_error(dt)


class Stream:
    """A filter that takes samples as they come.

        live = Stream(Kalman())
        quat = live.update(gyr=(0.0, 0.1, 0.0), acc=(0.0, 0.0, 9.81), dt=0.01)

    The first sample sets the attitude to start from (its dt does not matter). Feeding the samples of a recording gives
    the same bits as ``fuse``. A missing reading (None for the magnetometer, NaN for any) is bridged and marked in
    ``health``.

    Args:
        params: the filter, as for ``fuse``; default: the same as there.
        guard: as for ``fuse``.
        engine: as for ``fuse``; "auto" compiles a filter without a native engine in the constructor.
        prior: as for ``fuse``.
        calibration: errors that are taken off the readings before the filter, as by ``Calibration.apply``.

    Raises:
        LevelheadError: both a prior and a calibration, or a prior of a filter that learns none.
    """

    def __init__(
        self,
        params: FilterChoice | None = None,
        *,
        guard: Guard | None = DEFAULT_GUARD,
        engine: str = "auto",
        prior: Calibration | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        if prior is not None and calibration is not None:
            raise LevelheadError("prior and calibration both correct the readings; give one of them")
        resolved = filters.default() if params is None else filters.resolve(params)
        self._filter = filters.of(resolved)
        self._guarded = guard is not None
        settings = Settings(resolved, guard or DEFAULT_GUARD)
        begin = apply_prior(self._filter, bind(self._filter, self._guarded).begin(settings), prior)
        chosen = _live_engine(engine, has_imu(self._filter, self._guarded))
        self._stepper = imu_stepper(self._filter, settings, self._guarded, chosen)
        if prior is not None:
            self._stepper.state = begin
        self._tick: Callable[..., Four] = self._stepper.tick
        self._tick_mag: Callable[..., Four] = self._stepper.tick_mag
        self._place = self._stepper.place
        known = calibration if prior is None else prior
        self._prior, fixed = prior, calibration if prior is None else prior.matrices()
        if fixed is not None:
            self._tick, self._tick_mag = correct_ticks(self._tick, self._tick_mag, fixed.errors)
        self._warmth = Warmth(known.temperature) if known is not None and known.temperature else None
        if self._warmth is not None:
            self._tick, self._tick_mag = self._warmth.correct_ticks(self._tick, self._tick_mag)
        self._corrected = fixed is not None or self._warmth is not None
        in_rows = chosen == "native" and not self._corrected
        self._run_rows: Callable[..., None] | None = getattr(self._place, "run_rows", None) if in_rows else None
        if self._run_rows is None:
            self._tick, self._tick_mag = _with_tuples(self._tick), _with_tuples(self._tick_mag)
        self._plain_ticks = self._tick, self._tick_mag
        self._heading: HeadingOffset | None = None
        self._has_mag = False
        self._time: float | None = None

    def update(
        self,
        gyr: Triple,
        acc: Triple | None = None,
        mag: Triple | None = None,
        dt: float | None = None,
        t: float | None = None,
    ) -> tuple[float, float, float, float]:
        """Takes one sample and returns the orientation.

        Args:
            gyr: angular rate, rad/s.
            acc: specific force, m/s², or None when there is no new reading.
            mag: magnetic field, any unit, or None when there is no new reading.
            dt: seconds since the last sample.
            t: instead of dt, the stamp of this sample in seconds.

        Returns:
            Unit quaternion (w, x, y, z), sensor frame to earth frame.

        Raises:
            LevelheadError: dt is not greater than 0, or neither dt nor t is given; the sample is not taken.
        """
        if dt is None:
            return self._update_at(t, gyr, acc, mag)
        try:
            if mag is None:
                return self._tick(self._place, gyr, ZERO if acc is None else acc, dt)
            self._has_mag = True
            return self._tick_mag(self._place, gyr, ZERO if acc is None else acc, mag, dt)
        except (TypeError, ValueError):
            raise _sample_error(gyr, acc, mag, dt) from None

    def _update_at(
        self, t: float | None, gyr: Triple, acc: Triple | None, mag: Triple | None
    ) -> tuple[float, float, float, float]:
        """By stamps: dt is the time since the last sample that was taken; before the first one any will do."""
        if t is None:
            raise LevelheadError("update needs dt (seconds since the last sample) or t (the sample's stamp in seconds)")
        if not isinstance(t, SupportsFloat) or not isfinite(t):
            raise LevelheadError(f"t is {t!r}; it must be the sample's stamp in seconds")
        if self._time is not None and t <= self._time:
            raise LevelheadError(f"t is {t!r} after {self._time!r}; stamps must increase")
        quat = self.update(gyr, acc, mag, 1.0 if self._time is None else float(t) - self._time)
        self._time = float(t)
        return quat

    def update_rows(
        self,
        gyr: Rows,
        acc: Rows | None = None,
        mag: Rows | None = None,
        dt: float | Sequence[float] | Array | None = None,
        t: Sequence[float] | Array | None = None,
    ) -> Array:
        """Takes n samples at once, as a sensor's FIFO gives them; the same bits as n calls of ``update``.

        Args:
            gyr: (n, 3) angular rates, rad/s.
            acc: (n, 3) specific forces, m/s²; None: no new readings.
            mag: (n, 3) magnetic fields, any unit; None: no new readings.
            dt: seconds before each sample since the last: one number, or n.
            t: instead of dt, the n stamps of the samples in seconds.

        Returns:
            (n, 4) unit quaternions (w, x, y, z), one after each sample.

        Raises:
            LevelheadError: arrays of other shapes, an interval that is not greater than 0, or neither dt nor t is
                given; none of the samples is taken.
        """
        gyr = _rows("gyr", gyr, None, "rad/s")
        n = len(gyr)
        acc = np.zeros((n, 3)) if acc is None else _rows("acc", acc, n, "m/s²")
        mag = np.empty(0) if mag is None else _rows("mag", mag, n, "µT")
        intervals = self._intervals(n, dt, t)
        quat = np.empty((n, 4))
        self._has_mag |= len(mag) > 0
        if self._run_rows is not None:
            self._run_rows(intervals, gyr, acc, mag, quat)
            if self._heading is not None:
                quat = turn_heading(quat, self._heading.angle)
        else:
            fields = mag if len(mag) else [None] * n
            for i, (rate, force, field) in enumerate(zip(gyr, acc, fields, strict=True)):
                quat[i] = self.update(rate, force, field, float(intervals[i]))
        if t is not None and n:
            self._time = float(np.asarray(t, np.float64)[-1])
        return quat

    def _intervals(self, n: int, dt: object, t: object) -> Array:
        """(n,) seconds before each sample since the last, from the arguments; those of ``update``, to the bit."""
        if (dt is None) == (t is None):
            raise LevelheadError("update_rows needs dt (seconds since the last sample) or t (the samples' stamps)")
        if isinstance(dt, float) and 0.0 < dt < MOST_DT:  # in a third of the time of the general case
            return np.full(n, dt)
        try:
            given = np.asarray(dt if t is None else t, np.float64)
        except (TypeError, ValueError):
            given = np.empty(0)
        if t is None and given.ndim == 0:
            given = np.full(n, given)
        if given.shape != (n,):
            raise LevelheadError(f"{'dt' if t is None else 't'} has another length than gyr: expected {n} numbers")
        if t is not None and n:
            first = 1.0 if self._time is None else given[0] - self._time
            given = np.concatenate([[first], np.diff(given)])
        wrong = np.flatnonzero(~((given > 0.0) & (given < MOST_DT)))
        if len(wrong):
            row, value = int(wrong[0]), float(given[wrong[0]])
            raise LevelheadError(f"row {row} comes {value!r} s after the one before; intervals must be greater than 0")
        return np.ascontiguousarray(given)

    def set_heading(self, heading: float, sigma: float = 0.0, *, degrees: bool = True) -> None:
        """Turns all that follows about the vertical so that the yaw of the last sample is that given.

        The filter itself is not touched: with a magnetometer the offset from its north stays. σ of the heading starts
        with that given where heading is relative; where it has a reference, that of the filter counts as well.

        Args:
            heading: yaw, from east anticlockwise.
            sigma: its 1σ.
            degrees: the unit of both; False: rad.

        Raises:
            LevelheadError: no numbers, or the x axis is vertical within 1°.
        """
        numbers = self._stepper.report(self._place)
        referenced = self._has_mag and "heading" in self._filter.estimates
        self._use_heading(heading_offset(numbers[:4], numbers[9], heading, sigma, degrees, referenced))

    def _use_heading(self, offset: HeadingOffset | None) -> None:
        self._heading = offset
        self._tick, self._tick_mag = self._plain_ticks
        if offset is not None:
            self._tick, self._tick_mag = offset.tick(self._tick), offset.tick(self._tick_mag)

    def update_temperature(self, temperature: float) -> None:
        """Takes the sensor's temperature, by which the biases of a prior or calibration change from the next sample on.

        A file from ``noise --temperature`` has such curves; without them it changes nothing. The bits are those of
        ``fuse`` with the same temperature beside each sample.

        Args:
            temperature: °C; NaN is not a reading.

        Raises:
            LevelheadError: no number.
        """
        value = _number("temperature", temperature, "°C")
        if self._warmth is not None and not isnan(value):
            self._warmth.set(value)

    def update_pressure(self, pressure: float, sigma: float = 2.6, age: float = 0.0) -> None:
        """Takes air pressure: the height of the standard atmosphere, whose offset and drift the filter learns.

        The filter must be one that takes position, velocity or height (``ESKF``); this holds for every ``update_…``.

        Args:
            pressure: Pa; NaN: no reading.
            sigma: 1σ in Pa.
            age: seconds from the reading to the last sample; below 0 where it came after.

        Raises:
            LevelheadError: no number, σ or pressure that cannot be, or a filter that takes none.
        """
        value, deviation = _number("pressure", pressure, "Pa"), _number("sigma", sigma, "Pa", positive=True)
        if not (isnan(value) or MIN_PRESSURE <= value <= MAX_PRESSURE):
            raise LevelheadError(
                f"pressure is {pressure!r}; it must be in Pa, {MIN_PRESSURE:g} to {MAX_PRESSURE:g} (1 hPa is 100 Pa)"
            )
        self._update_row(HEIGHT, atmosphere.height(value), deviation * atmosphere.metres_per_pascal(value), age)

    def update_height(self, height: float, sigma: float, age: float = 0.0) -> None:
        """Takes a barometer's height in m with its 1σ, as ``update_pressure``."""
        self._update_row(HEIGHT, _number("height", height, "m"), _number("sigma", sigma, "m", positive=True), age)

    def update_climb(self, climb: float, sigma: float, age: float = 0.0) -> None:
        """Takes a climb rate in m/s with its 1σ."""
        self._update_row(
            VELOCITY + 2, _number("climb", climb, "m/s"), _number("sigma", sigma, "m/s", positive=True), age
        )

    def update_position(self, position: Triple, sigma: float | Triple, age: float = 0.0) -> None:
        """Takes a position in m, earth frame (x east, y magnetic north, z up); sigma: 1σ, one number or three."""
        self._update_vector("position", "m", POSITION, position, sigma, age)

    def update_velocity(self, velocity: Triple, sigma: float | Triple, age: float = 0.0) -> None:
        """Takes a velocity in m/s, earth frame; sigma: 1σ, one number or three."""
        self._update_vector("velocity", "m/s", VELOCITY, velocity, sigma, age)

    def update_zero_velocity(self, sigma: float = 0.1, age: float = 0.0) -> None:
        """Takes a velocity of zero, of a foot on the ground or a wheel at rest; sigma: 1σ along each axis, m/s."""
        deviation = _number("sigma", sigma, "m/s", positive=True)
        for i in range(3):
            self._update_row(ZERO_VELOCITY + i, 0.0, deviation, age)

    def _update_vector(self, name: str, unit: str, row: int, values: Triple, sigma: float | Triple, age: float) -> None:
        try:
            three = tuple(values)
            deviations = tuple(sigma) if isinstance(sigma, Sequence | ndarray) else (sigma,) * 3
        except TypeError:
            three = deviations = ()
        if len(three) != 3 or len(deviations) != 3:
            raise LevelheadError(
                f"{name} is {values!r} ± {sigma!r}; it must be three numbers in {unit}, σ one or three"
            )
        checked = [
            (_number(name, x, unit), _number("sigma", s, unit, positive=True))
            for x, s in zip(three, deviations, strict=True)
        ]
        for i, (value, deviation) in enumerate(checked):
            self._update_row(row + i, value, deviation, age)

    def _update_row(self, row: int, value: float, sigma: float, age: float) -> None:
        if self._filter.aiding is None:
            raise LevelheadError(f"{self._filter.name} takes neither position, velocity nor height; ESKF does")
        if not isnan(value):
            self._stepper.tick_aiding(self._place, row, value, sigma, _number("age", age, "s"))

    @property
    def nav_state(self) -> NavState | None:
        """Position, velocity (earth frame, m and m/s) and 1σ of both after the last sample; None before any reading."""
        if self._filter.aiding is None:
            return None
        said: NavState = self._filter.aiding.nav_state(self.params, self._stepper.state.run.state)
        if self._heading is not None:
            position, velocity = (Vec3(*self._heading.turn_vector(v)) for v in (said.position, said.velocity))
            said = said._replace(position=position, velocity=velocity)
        return said if said.aided else None

    def linear_acceleration(self, acc: Triple) -> Vec3:
        """Acceleration without gravity in m/s², sensor axes, of the last sample's specific force.

        Without the accelerometer's errors that the filter has found. Its 1σ is about g times that of the tilt.

        Args:
            acc: specific force of the last sample, m/s².
        """
        known, quat = self.calibration, self.quat
        try:
            force = Vec3(*(float(x) for x in acc))
        except (TypeError, ValueError):
            raise _sample_error((0.0, 0.0, 0.0), acc, None, 1.0) from None
        force = force if known is None else true_force(known.errors, force)
        return sub(force, scale(up(quat), GRAVITY))

    def earth_acceleration(self, acc: Triple) -> Vec3:
        """The same along the earth's axes (x east, y north, z up)."""
        return rotate(self.quat, self.linear_acceleration(acc))

    @property
    def numbers(self) -> tuple[float, ...]:
        """``output`` as plain numbers, cheapest of all: quat (4), bias (3), sigma (3), health."""
        numbers: Eleven = self._stepper.report(self._place)
        if self._heading is None:
            return numbers
        turn = self._heading
        return *turn.turn(numbers[:4]), *numbers[4:7], *turn.turn_sigma(numbers[7:10]), numbers[10]

    @property
    def output(self) -> Output:
        """Orientation, bias, σ and health after the last sample, at once: cheaper than one by one."""
        numbers = self.numbers
        return Output(
            quat=Quat(*numbers[:4]), bias=Vec3(*numbers[4:7]), sigma=Vec3(*numbers[7:10]), health=int(numbers[10])
        )

    @property
    def quat(self) -> Quat:
        """The orientation after the last sample."""
        return Quat(*self.output.quat)

    @property
    def euler(self) -> Euler:
        """Roll, pitch and yaw in radians after the last sample."""
        return to_euler(self.quat)

    @property
    def bias(self) -> Vec3 | None:
        """Estimated gyroscope bias in rad/s, or None if the filter estimates none."""
        return self.output.bias if estimates_bias(self._filter, self._guarded) else None

    @property
    def sigma(self) -> Vec3:
        """1σ of the attitude error about east, north and up in rad."""
        return self.output.sigma

    @property
    def health(self) -> int:
        """Bits of ``levelhead.filters.health`` for the last sample."""
        return int(self.output.health)

    @property
    def calibration(self) -> Calibration | None:
        """The filter's calibration of its sensor by now, or None if it learns nothing."""
        return read_calibration(self._filter, self._stepper.params, self._stepper.state, self._prior)

    @property
    def north(self) -> North | None:
        """Where magnetic north is by now, as ``Track.north``."""
        return north_of(self.calibration)

    @property
    def params(self) -> Params:
        """The parameters in use."""
        params: Params = self._stepper.params.filter
        return params

    def set(self, **changes: float) -> None:
        """Changes parameters from the next sample on: ``live.set(r_measure=0.5)``."""
        self._stepper.params = self._stepper.params._replace(filter=self.params._replace(**changes))

    def reset(self) -> None:
        """Forgets everything but the parameters and the prior; the next sample sets the start again."""
        begin = bind(self._filter, self._guarded).begin(self._stepper.params)
        self._stepper.state = keep_prior(self._filter, self._stepper.params, self._stepper.state, begin)
        self._time = None
        self._use_heading(None)

    def save(self) -> bytes:
        """The whole state as bytes, parameters included; ``Stream.restore`` continues from it, to the bit."""
        if self._corrected:
            raise LevelheadError(
                "a stream whose readings are corrected cannot be saved; save its prior or calibration instead"
            )
        return to_bytes(
            StreamState(
                settings=self._stepper.params,
                guarded=self._guarded,
                carry=self._stepper.state,
                time=self._time,
                heading=self._heading,
            )
        )

    @classmethod
    def restore(cls, data: bytes, *, engine: str = "auto") -> "Stream":
        """A stream that goes on where ``save`` left off, on any engine.

        Raises:
            LevelheadError: the bytes are not a saved stream, are damaged, or come from a version with another layout.
        """
        saved = from_bytes(data)
        stream = cls(saved.settings.filter, guard=saved.settings.guard if saved.guarded else None, engine=engine)
        stream._stepper.state = saved.carry
        stream._time = saved.time
        stream._use_heading(saved.heading)
        return stream


class AxisStream:
    """One angle and the gyroscope's rate about its axis, live, in the habit of the well-known Arduino class.

        kalman = AxisStream(Kalman(), angle=first_angle)
        angle = kalman.update(measured_angle, rate, dt)

    Any unit will do, as long as rate is in units of the angle per second and the parameters are in the same unit; with
    an angle in radians give ``period=2π``, with a quantity that is on no circle ``period=0``.

    The Arduino class's setAngle is ``kalman.angle = …``, getAngle(newAngle, newRate, dt) is ``update``, getRate is
    ``rate``, setQangle, setQbias and setRmeasure are ``kalman.set(q_angle=…, q_bias=…, r_measure=…)``.

    Args:
        params: a filter that works on one axis; default ``Kalman()``.
        angle: the angle to start from.
        period: length of the circle on which the angle lives; 0: on a line.
        engine: as for ``Stream``.
    """

    def __init__(
        self, params: FilterChoice | None = None, *, angle: float = 0.0, period: float = 360.0, engine: str = "auto"
    ) -> None:
        resolved = filters.resolve("Kalman" if params is None else params)
        self._filter = filters.of(resolved)
        if not period >= 0.0:
            raise LevelheadError(
                f"period is {period!r}; it must be 0 (a line) or the length of the circle, such as 360"
            )
        chosen = _live_engine(engine, has_axis(self._filter))
        self._stepper = axis_stepper(self._filter, resolved, float(angle), chosen)
        self._tick, self._place, self._period = self._stepper.tick, self._stepper.place, float(period)

    def update(self, angle: float, rate: float, dt: float) -> float:
        """Takes one measured angle and rate, ``dt`` seconds after the last, and returns the estimated angle.

        Raises:
            LevelheadError: dt is not greater than 0, or angle or rate is not finite; the sample is not taken.
        """
        try:
            return self._tick(self._place, self._period, angle, rate, dt)
        except (TypeError, ValueError):
            raise _pair_error(angle, rate, dt) from None

    @property
    def report(self) -> AxisReport:
        """The filter's full report after the last sample: level, rate, bias, variances, gain, innovation."""
        return bind_axis(self._filter).axis.read(self._stepper.state)

    @property
    def angle(self) -> float:
        """The estimated angle; set it to start from a known one."""
        return float(self.report.level)

    @angle.setter
    def angle(self, value: float) -> None:
        self._stepper.state = self._stepper.state._replace(level=float(value))

    @property
    def rate(self) -> float:
        """The rate without its bias."""
        return float(self.report.rate)

    @property
    def bias(self) -> float:
        """The estimated bias of the rate."""
        return float(self.report.bias)

    @property
    def params(self) -> Params:
        """The parameters in use."""
        params: Params = self._stepper.params
        return params

    def set(self, **changes: float) -> None:
        """Changes parameters from the next sample on: ``kalman.set(r_measure=0.5)``."""
        self._stepper.params = self.params._replace(**changes)
