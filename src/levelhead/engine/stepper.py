"""A filter in a loop: the state that stays between samples, in plain Python or in compiled memory.

Both kinds of loop have the same face: for a filter on an IMU ``tick(place, gyr, acc, dt)`` and
``tick_mag(place, gyr, acc, mag, dt)`` with tuples of three floats, ``report(place)``, and where the filter takes it
``tick_aid(place, row, value, sigma, age)`` for a number of position, velocity or height; for an axis filter
``tick(place, period, level, rate, dt)``, where ``place`` is where the loop keeps its state; and ``state`` and
``params`` (for an IMU the driver's Settings) that can be read and set between samples. A tick that is fed nonsense
(dt ≤ 0, for an axis also NaN) raises ValueError and leaves the state as it is.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

from levelhead.compiler import slots
from levelhead.compiler.compile import compiled
from levelhead.compiler.mark import bound, kernel
from levelhead.engine import native
from levelhead.engine.binding import bind, bind_axis
from levelhead.engine.driver import Settings, unbound
from levelhead.filters.contract import Filter
from levelhead.guard import Guard
from levelhead.kernels.vec3 import ZERO, Vec3

Triple = tuple[float, float, float]
Four = tuple[float, float, float, float]
Eleven = tuple[float, float, float, float, float, float, float, float, float, float, float]
LONGEST = 1e9  # s: what is longer is no interval between samples

advance = result = update_aiding = step = read = load = load_params = store = unbound
PARAMS_AT = 0  # bytes from the state to the parameters, which stand behind it in one piece of memory


@kernel
def tick_mag(at: int, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
    """One sample with a magnetometer, on the state and parameters in memory."""
    if not 0.0 < dt < LONGEST:
        raise ValueError("dt")
    settings = load_params(at + PARAMS_AT)
    carry = advance(
        settings,
        load(at),
        Vec3(gyr[0], gyr[1], gyr[2]),
        Vec3(acc[0], acc[1], acc[2]),
        Vec3(mag[0], mag[1], mag[2]),
        dt,
    )
    store(at, carry)
    q = result(settings, carry.run).quat
    return (q.w, q.x, q.y, q.z)


@kernel
def tick(at: int, gyr: Triple, acc: Triple, dt: float) -> Four:
    """One sample without a magnetometer: three numbers fewer to hand over from Python."""
    return tick_mag(at, gyr, acc, (0.0, 0.0, 0.0), dt)


@kernel
def report(at: int) -> Eleven:
    """Orientation, bias, σ and health of the state in memory; one flat tuple, because that is quick to hand over."""
    (w, x, y, z), (a, b, c), (u, v, s), health = result(load_params(at + PARAMS_AT), load(at).run)
    return (w, x, y, z, a, b, c, u, v, s, health + 0.0)


@kernel
def tick_aid(at: int, row: int, value: float, sigma: float, age: float) -> None:
    """One number of position, velocity or height, after a sample."""
    store(at, update_aiding(load_params(at + PARAMS_AT), load(at), row, value, sigma, age))


@kernel
def tick_axis(at: int, period: float, level: float, rate: float, dt: float) -> float:
    """One pair through an axis filter, on the state and parameters in memory."""
    if not (0.0 < dt < LONGEST and level - level == 0.0 and rate - rate == 0.0):
        raise ValueError("dt, level or rate")
    state = step(load_params(at + PARAMS_AT), load(at), level, rate, dt, period)
    store(at, state)
    level_after: float = read(state).level
    return level_after


def _plain(values: Any) -> Vec3:
    """Python floats: with NumPy's own scalars everything after them would be several times slower."""
    x, y, z = values
    return Vec3(float(x), float(y), float(z))


class PlainLoop:
    """The loop in plain Python."""

    def __init__(self, flt: Filter, settings: Settings, guarded: bool) -> None:
        driver = bind(flt, guarded)
        self.params: Any = settings
        self.state = driver.begin(settings)
        self.place = self
        self._advance, self._result, self._update_aiding = driver.advance, driver.result, driver.update_aiding

    @staticmethod
    def tick_aid(place: Any, row: int, value: float, sigma: float, age: float) -> None:
        """One number of position, velocity or height."""
        place.state = place._update_aiding(place.params, place.state, row, value, sigma, age)

    @staticmethod
    def tick(place: Any, gyr: Triple, acc: Triple, dt: float) -> Four:
        """One sample without a magnetometer."""
        return PlainLoop.tick_mag(place, gyr, acc, ZERO, dt)

    @staticmethod
    def tick_mag(place: Any, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
        """One sample."""
        if not 0.0 < dt < LONGEST:
            raise ValueError("dt")
        place.state = place._advance(place.params, place.state, _plain(gyr), _plain(acc), _plain(mag), dt)
        quat: Four = place._result(place.params, place.state.run).quat
        return quat

    @staticmethod
    def report(place: Any) -> Eleven:
        """What the filter says now."""
        quat, bias, sigma, health = place._result(place.params, place.state.run)
        said: Eleven = (*quat, *bias, *sigma, float(health))
        return said


class PlainAxisLoop:
    """The loop of an axis filter in plain Python."""

    def __init__(self, flt: Filter, params: Any, level: float) -> None:
        self._axis, _ = bind_axis(flt)
        self.params = params
        self.state = self._axis.init(params, level)
        self.place = self

    @staticmethod
    def tick(place: Any, period: float, level: float, rate: float, dt: float) -> float:
        """One pair."""
        if not (0.0 < dt < LONGEST and level - level == 0.0 and rate - rate == 0.0):
            raise ValueError("dt, level or rate")
        place.state = place._axis.step(place.params, place.state, level, rate, dt, period)
        return float(place._axis.read(place.state).level)


class Machine(NamedTuple):
    """The machine code of a filter's ticks, and how its state and parameters lie in memory."""

    ticks: dict[str, Any]
    states: slots.Slot
    parameters: slots.Slot


class CompiledLoop:
    """The loop in machine code, compiled (or fetched from the cache) here so that no sample waits for it."""

    tick: Callable[..., Any]
    tick_mag: Callable[..., Any]
    report: Callable[..., Any]
    tick_aid: Callable[..., Any]

    def __init__(self, machine: Machine, state: Any, params: Any) -> None:
        self._machine = machine
        self._memory, self.place = slots.allocate(machine.states.size + machine.parameters.size)
        self.state, self.params = state, params
        for name, entry in machine.ticks.items():
            setattr(self, name, entry)

    @property
    def state(self) -> Any:
        """The filter's whole state."""
        return self._machine.states.read(self._memory, 0)

    @state.setter
    def state(self, value: Any) -> None:
        self._machine.states.write(self._memory, 0, value)

    @property
    def params(self) -> Any:
        """The filter's parameters."""
        return self._params

    @params.setter
    def params(self, value: Any) -> None:
        self._params = value
        self._machine.parameters.write(self._memory, self._machine.states.size, value)


def _machine(name: str, state: Any, params: Any, ticks: dict[str, tuple[Any, str]], **kernels: Any) -> Machine:
    """Compiles ``ticks``, name -> (kernel, arguments), bound to ``kernels`` and to slots for state and parameters.

    A tick may call those that stand before it.
    """
    states, parameters = slots.slot(state), slots.slot(params)
    own = kernels | {
        "load": states.load,
        "store": states.store,
        "load_params": parameters.load,
        "PARAMS_AT": states.size,
    }
    entries = {}
    for key, (function, arguments) in ticks.items():
        own[key] = bound(function, name, **own)
        entries[key] = slots.entry_point(compiled(own[key], releases_gil=False), arguments)
    return Machine(entries, states, parameters)


@functools.cache
def imu_machine(flt: Filter, guarded: bool) -> Machine:
    """The compiled ticks of a filter on an IMU."""
    driver, settings = bind(flt, guarded), Settings(flt.params(), Guard())
    ticks: dict[str, tuple[Any, str]] = {
        "tick_mag": (tick_mag, "ivvvf"),
        "tick": (tick, "ivvf"),
        "report": (report, "i"),
    }
    kernels = {"advance": driver.advance, "result": driver.result}
    if driver.update_aiding is not None:
        ticks["tick_aid"] = (tick_aid, "iifff")
        kernels["update_aiding"] = driver.update_aiding
    name = flt.name if guarded else f"{flt.name}_unguarded"
    return _machine(name, driver.begin(settings), settings, ticks, **kernels)


@functools.cache
def axis_machine(flt: Filter) -> Machine:
    """The compiled tick of an axis filter."""
    axis, _ = bind_axis(flt)
    params = flt.params()
    ticks = {"tick": (tick_axis, "iffff")}
    return _machine(f"{flt.name}_axis", axis.init(params, 0.0), params, ticks, step=axis.step, read=axis.read)


class NativeLoop:
    """The loop in the C that was compiled with the package."""

    tick: Callable[..., Any]
    tick_mag: Callable[..., Any]
    report: Callable[..., Any]
    tick_aid: Callable[..., Any]

    def __init__(self, machine: native.Machine, params: Any) -> None:
        self._machine, self._params, self.place = machine, params, machine.filter
        for name in ("tick", "tick_mag", "report", "tick_aid"):
            if hasattr(machine.filter, name):
                setattr(self, name, getattr(type(machine.filter), name))

    @property
    def state(self) -> Any:
        """The filter's whole state."""
        return self._machine.state

    @state.setter
    def state(self, value: Any) -> None:
        self._machine.state = value

    @property
    def params(self) -> Any:
        """The filter's parameters."""
        return self._params

    @params.setter
    def params(self, value: Any) -> None:
        self._params = value
        self._machine.set_params(value)


def loop(flt: Filter, settings: Settings, guarded: bool, engine: str) -> PlainLoop | CompiledLoop | NativeLoop:
    """A loop for a filter on an IMU; ``engine`` "native", "compiled" or "python"."""
    if engine == "python":
        return PlainLoop(flt, settings, guarded)
    begin = bind(flt, guarded).begin(settings)
    if engine == "native":
        return NativeLoop(native.Machine(flt, guarded, settings, begin), settings)
    return CompiledLoop(imu_machine(flt, guarded), begin, settings)


def axis_loop(flt: Filter, params: Any, level: float, engine: str) -> PlainAxisLoop | CompiledLoop | NativeLoop:
    """A loop for an axis filter; ``engine`` "native", "compiled" or "python"."""
    if engine == "python":
        return PlainAxisLoop(flt, params, level)
    axis, _ = bind_axis(flt)
    begin = axis.init(params, level)
    if engine == "native":
        return NativeLoop(native.Machine(flt, None, params, begin), params)
    return CompiledLoop(axis_machine(flt), begin, params)
