"""One whole recording through one filter."""

from collections.abc import Callable
from typing import Any

import numpy as np

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.compiler.tree import native, plain
from levelhead.engine.aiding_inputs import aiding_inputs, no_aiding
from levelhead.engine.binding import bind, bind_axis, choose_engine, estimates_bias, for_engine
from levelhead.engine.driver import Carry, Settings
from levelhead.engine.native import FilterMemory, axis_run, has_axis, has_imu
from levelhead.engine.prior import apply_prior, correct_recording, read_calibration
from levelhead.errors import LevelheadError
from levelhead.filters.contract import AxisReport
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.recording import Array, Recording, real_array, time_array
from levelhead.track import Track, is_relative

NO_MAG = np.empty(0)
NO_MAG.flags.writeable = False  # like a recording's arrays, so that one compiled version serves both
DEFAULT_GUARD = Guard()
STRETCH = 1 << 18  # samples between two calls of progress


def fuse(
    recording: Recording,
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    prior: Calibration | None = None,
    progress: Callable[[float], None] | None = None,
) -> Track:
    """Orientation of the sensor for every sample of a recording.

    Pressure and GNSS of the recording are used by a filter that takes them (ESKF): the track then has position and
    velocity. The others leave them aside.

    Args:
        recording: the sensors' readings in SI units.
        params: which filter, by its Params object (``Kalman(r_measure=0.1)``), its class, or its name. None: the best
            one there is.
        guard: the thresholds of rest, saturation and disturbance; None: the filter sees every reading as it is.
        engine: "native" (C, compiled with the package), "compiled" (Numba), "python", or "auto": the fastest that there
            is for the filter; the bits do not depend on it.
        prior: the calibration of the same sensor by an earlier run (``Track.calibration``, ``Calibration.read``), for a
            filter that learns: ``ESKF``.
        progress: called now and then with the fraction done, 0 to 1.

    Returns:
        A Track with the stamps of the recording.

    Raises:
        LevelheadError: no such filter or engine, or a prior for a filter that learns nothing.
    """
    batch = Batch(recording, params, guard, engine, prior)
    n = len(recording)
    stretch = n if progress is None else STRETCH
    for start in range(0, n, stretch):
        batch.advance(min(start + stretch, n))
        if progress is not None:
            progress(batch.done / n)
    return batch.track()


class Batch:
    """A recording on its way through a filter, a stretch at a time; arguments as for ``fuse``."""

    def __init__(
        self,
        recording: Recording,
        params: FilterChoice | None,
        guard: Guard | None,
        engine: str,
        prior: Calibration | None,
    ) -> None:
        if not isinstance(recording, Recording):
            raise LevelheadError(
                f"fuse takes a Recording, not {type(recording).__name__}; levelhead.read(path) makes one"
            )
        self._guarded, self._prior = guard is not None, prior
        params = filters.default() if params is None else filters.resolve(params)
        self.filter = filters.of(params)
        bound = bind(self.filter, self._guarded)
        self._settings = Settings(params, guard or DEFAULT_GUARD)
        self._engine = choose_engine(engine, len(recording), has_imu(self.filter, self._guarded))
        self._bound, self._aided, self._located, self._forgets = bound, False, False, False
        self._take(recording)
        self._carry = apply_prior(self.filter, bound.begin(self._settings), prior)
        if self._engine == "native":
            self._machine = FilterMemory(self.filter, self._guarded, self._settings, self._carry)
        if self._engine == "compiled":
            self._carry = native(self._carry)
        self._last = float(recording.t[0])

    @property
    def carry(self) -> Carry:
        """Where the filter is, with lists."""
        carry: Carry = self._machine.state if self._engine == "native" else plain(self._carry)
        return carry

    def resume(self, carry: Carry, last: float) -> None:
        """Goes on from there with the first sample, as if a recording that ended at ``last`` s had been done.

        Raises:
            LevelheadError: the recording begins before.
        """
        self._require_later(self._recording, last)
        if self._engine == "native":
            self._machine.state = carry
        else:
            self._carry = native(carry) if self._engine == "compiled" else carry
        self._last = last

    def _take(self, recording: Recording) -> None:
        """Inputs and outputs for the samples of a recording."""
        self._given = recording
        self._located = self._located or recording.gnss is not None
        recording = self._recording = correct_recording(recording, self._prior)
        self._aiding = aiding_inputs(recording) if self._bound.takes_aiding else None
        if self._aiding is None and self._aided:
            self._aiding = no_aiding(len(recording))
        mag = NO_MAG if recording.mag is None else recording.mag.reshape(-1)
        self._inputs = [recording.t, recording.gyr.reshape(-1), recording.acc.reshape(-1), mag]
        self._outputs, self._widths = allocate_outputs(len(recording)), [4, 3, 3, 1]
        if self._aiding is not None:
            self._aided = True
            self._outputs.append(np.empty(12 * len(recording)))
            self._widths.append(12)
        if self._engine != "native":
            run = self._bound.run if self._aiding is None else self._bound.run_with_aiding
            assert run is not None
            self._run = for_engine(run, self._engine)
        self.done = 0

    def follow(self, recording: Recording) -> None:
        """Goes on with the recording that follows the one before, whose samples are all done.

        Raises:
            LevelheadError: it begins before the other ended, or only one of the two has a magnetometer.
        """
        self._require_later(recording, self._last)
        if (recording.mag is None) != (self._recording.mag is None):
            raise LevelheadError(
                f"only one of two chunks has a magnetometer, at {recording.t[0]:.6f} s; give NaN where readings are "
                "missing"
            )
        self._take(recording)

    @staticmethod
    def _require_later(recording: Recording, last: float) -> None:
        if not recording.t[0] > last:
            raise LevelheadError(
                f"a chunk begins at {recording.t[0]:.6f} s, after one that ended at {last:.6f} s; expected later "
                "samples"
            )

    def forget(self, longest: int) -> None:
        """Keeps the outputs of the last stretch only, of at most so many samples: there is no track in the end."""
        self._forgets = True
        self._outputs = [a[: longest * k].copy() for a, k in zip(self._outputs, self._widths, strict=True)]

    def advance(self, stop: int) -> None:
        """The samples from where the last stretch ended up to ``stop``."""
        part: Columns = [a[self.done * k : stop * k] for a, k in zip(self._inputs, (1, 3, 3, 3), strict=True)]
        part += [] if self._aiding is None else [*self._aiding.part(self.done, stop)]
        first = 0 if self._forgets else self.done
        last = first + stop - self.done
        into = [a[first * k : last * k] for a, k in zip(self._outputs, self._widths, strict=True)]
        if self._engine == "native":
            self._machine.filter.run(self._last, *part, *into)
        elif self._engine == "compiled":
            self._carry = self._run(self._settings, self._carry, self._last, *part, *into)
        else:
            lists = [a.tolist() for a in into]
            self._carry = self._run(self._settings, self._carry, self._last, *(a.tolist() for a in part), *lists)
            for array, values in zip(into, lists, strict=True):
                array[:] = values
        self._last, self.done = float(self._recording.t[stop - 1]), stop

    @property
    def calibration(self) -> Calibration | None:
        """The filter's calibration of its sensor by now; None if it learns nothing."""
        return read_calibration(self.filter, self._settings, self.carry, self._prior)

    def track(self) -> Track:
        """The track, when all samples are done."""
        n = len(self._recording)
        quat, bias, sigma = self._outputs[:3]
        return Track(
            self._recording.t,
            quat.reshape(n, 4),
            bias.reshape(n, 3) if estimates_bias(self.filter, self._guarded) else None,
            sigma.reshape(n, 3),
            self._outputs[3],
            self._settings.filter,
            calibration=self.calibration,
            readings=self._given,
            relative=is_relative(self._settings.filter, self._given.mag is not None, self._located),
            **(navigation_fields(self._outputs[4].reshape(n, 4, 3)) if self._aided else {}),
        )


def navigation_fields(table: Array) -> dict[str, Any]:
    """A track's position and velocity from rows of position, velocity and 1σ of both, (n, 4, 3)."""
    names = ("position", "velocity", "sigma_position", "sigma_velocity")
    return {name: table[:, k] for k, name in enumerate(names)}


Columns = list[Any]  # of a track, an array each: floats, but uint32 for health


def allocate_outputs(n: int) -> Columns:
    """Flat arrays for quat, bias, sigma and health of n samples, in one piece.

    Memory that comes and goes in several pieces from several threads is given back to the system between two
    recordings; getting it anew takes a third as long as the filter.
    """
    floats = np.empty(10 * n + (n + 1) // 2)
    return [floats[: 4 * n], floats[4 * n : 7 * n], floats[7 * n : 10 * n], floats[10 * n :].view(np.uint32)[:n]]


def fuse_axis(
    t: Array,
    level: Array,
    rate: Array,
    params: FilterChoice | None = None,
    *,
    period: float = 0.0,
    engine: str = "auto",
) -> AxisReport:
    """One "noisy level + drifting rate" pair through a one-axis filter, in any unit.

    An angle and the gyroscope's rate about its axis, a price and its trend, GPS speed and the accelerometer: whatever
    is measured with noise while its rate is known up to a slowly drifting bias.

    Args:
        t: (n,) time, strictly increasing, in the time unit of the rate.
        level: (n,) measured level.
        rate: (n,) measured rate, in units of the level per unit of time.
        params: a filter that works on one axis (``Kalman()``, ``Complementary()``, ``BiasRateKalman()``); its
            parameters are in the unit of the level. Default: ``Kalman()``.
        period: length of the circle if the level lives on one (360 for degrees); 0: on a line.
        engine: as for ``fuse``.

    Returns:
        The filter's report with an array (n,) in each field, such as ``level``, ``rate`` (bias-free), ``bias``, and for
        ``Kalman`` ``p_level``, ``p_cross``, ``p_bias``, ``gain_level``, ``gain_bias``, ``innovation``.

    Raises:
        LevelheadError: lengths differ, values missing, or the filter needs an IMU.
    """
    params = filters.resolve("Kalman" if params is None else params)
    _, axis, run = bind_axis(filters.of(params))
    t = time_array(t)
    columns = []
    for name, values in (("level", level), ("rate", rate)):
        column = real_array(name, values, (len(t),), "any one unit")
        if np.isnan(np.add.reduce(column)) and np.isnan(column).any():
            row = int(np.isnan(column).argmax())
            raise LevelheadError(f"{name} is NaN at row {row}; a one-axis filter needs every sample: leave the row out")
        columns.append(column)
    if period < 0.0:
        raise LevelheadError(f"period is {period:g}; it must be 0 (a line) or the length of the circle, such as 360")
    flt = filters.of(params)
    chosen = choose_engine(engine, len(t), has_axis(flt))
    state = axis.init(params, float(columns[0][0]))
    width = len(axis.report._fields)  # type: ignore[attr-defined]
    if chosen != "python":
        out = np.empty(len(t) * width)
        chosen_run = axis_run(flt) if chosen == "native" else for_engine(run, chosen)
        chosen_run(params, state, t, *columns, float(period), out)
        return axis.report(*out.reshape(len(t), width).T)
    rows = [0.0] * (len(t) * width)
    run(params, state, t.tolist(), *(c.tolist() for c in columns), float(period), rows)
    return axis.report(*np.array(rows).reshape(len(t), width).T)
