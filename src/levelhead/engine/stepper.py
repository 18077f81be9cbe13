"""A filter that is stepped sample by sample: the state between samples, in plain Python or in compiled memory.

Both kinds of stepper have the same members. For a filter on an IMU: ``tick(place, gyr, acc, dt)`` and ``tick_mag(place,
gyr, acc, mag, dt)`` with tuples of three floats, ``report(place)``, and where the filter takes aiding
``tick_aiding(place, row, value, sigma, age)``. For an axis filter: ``tick(place, period, level, rate, dt)``. ``place``
is where the stepper keeps its state; ``state`` and ``params`` (for an IMU the driver's Settings) can be read and set
between samples. A tick whose dt is not above 0 (for an axis also one with NaN) raises ValueError and leaves the state
as it is.
"""

import functools
from typing import Any, NamedTuple, Protocol

from levelhead.compiler import slots
from levelhead.compiler.borders import CompiledFunction
from levelhead.compiler.compile import compile_kernel
from levelhead.compiler.hooks import Bindings, declare, fill, rebind
from levelhead.compiler.mark import KernelFunction, compiled_only
from levelhead.compiler.tree import Tree
from levelhead.engine import driver, native
from levelhead.engine.axis_driver import hooks as axis
from levelhead.engine.binding import bind, bind_axis
from levelhead.engine.driver import Settings
from levelhead.filters.contract import Filter
from levelhead.guard import Guard
from levelhead.kernels.vec3 import ZERO, Vec3

Triple = tuple[float, float, float]
Four = tuple[float, float, float, float]
Eleven = tuple[float, float, float, float, float, float, float, float, float, float, float]
Place = Any  # the ``place`` of the same stepper: itself, an address, or a block of memory
MOST_DT = 1e9  # s: the longest interval between samples


class MemoryHooks(Protocol):
    """State and parameters in one piece of memory; ``at`` is its address."""

    PARAMS_AT: int  # bytes from the state to the parameters

    @staticmethod
    def load(at: int) -> Tree:
        """The state: the driver's Carry, or an axis filter's."""
        ...

    @staticmethod
    def store(at: int, state: Tree) -> None:
        """Writes the state."""
        ...

    @staticmethod
    def load_params(at: int) -> Tree:
        """The parameters: the driver's Settings, or an axis filter's."""
        ...


memory: MemoryHooks = declare(MemoryHooks)


@compiled_only
def tick_mag(at: int, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
    """One sample with a magnetometer, on the state and parameters in memory."""
    if not 0.0 < dt < MOST_DT:
        raise ValueError("dt")
    settings = memory.load_params(at + memory.PARAMS_AT)
    carry = driver.advance(
        settings,
        memory.load(at),
        Vec3(gyr[0], gyr[1], gyr[2]),
        Vec3(acc[0], acc[1], acc[2]),
        Vec3(mag[0], mag[1], mag[2]),
        dt,
    )
    memory.store(at, carry)
    q = driver.result(settings, carry.run).quat
    return (q.w, q.x, q.y, q.z)


@compiled_only
def tick(at: int, gyr: Triple, acc: Triple, dt: float) -> Four:
    """One sample without a magnetometer: three numbers fewer to hand over from Python."""
    return tick_mag(at, gyr, acc, (0.0, 0.0, 0.0), dt)


@compiled_only
def report(at: int) -> Eleven:
    """Orientation, bias, σ and health of the state in memory; one flat tuple, because that is quick to hand over."""
    settings = memory.load_params(at + memory.PARAMS_AT)
    (w, x, y, z), (a, b, c), (u, v, s), health = driver.result(settings, memory.load(at).run)
    return (w, x, y, z, a, b, c, u, v, s, health + 0.0)


@compiled_only
def tick_aiding(at: int, row: int, value: float, sigma: float, age: float) -> None:
    """One number of position, velocity or height, after a sample."""
    settings = memory.load_params(at + memory.PARAMS_AT)
    memory.store(at, driver.update_aiding(settings, memory.load(at), row, value, sigma, age))


@compiled_only
def tick_axis(at: int, period: float, level: float, rate: float, dt: float) -> float:
    """One pair through an axis filter, on the state and parameters in memory."""
    if not (0.0 < dt < MOST_DT and level - level == 0.0 and rate - rate == 0.0):
        raise ValueError("dt, level or rate")
    params = memory.load_params(at + memory.PARAMS_AT)
    state = axis.step(params, memory.load(at), level, rate, dt, period)
    memory.store(at, state)
    level_after: float = axis.read(state).level
    return level_after


def _plain(values: Triple) -> Vec3:
    """Python floats: with NumPy's own scalars everything after them would be several times slower."""
    x, y, z = values
    return Vec3(float(x), float(y), float(z))


class PlainStepper:
    """A stepper in plain Python."""

    def __init__(self, flt: Filter, settings: Settings, guarded: bool) -> None:
        bound = bind(flt, guarded)
        self.params: Tree = settings
        self.state = bound.begin(settings)
        self.place = self
        self._advance, self._result, self._update_aiding = bound.advance, bound.result, bound.update_aiding

    @staticmethod
    def tick_aiding(place: Place, row: int, value: float, sigma: float, age: float) -> None:
        """One number of position, velocity or height."""
        place.state = place._update_aiding(place.params, place.state, row, value, sigma, age)

    @staticmethod
    def tick(place: Place, gyr: Triple, acc: Triple, dt: float) -> Four:
        """One sample without a magnetometer."""
        return PlainStepper.tick_mag(place, gyr, acc, ZERO, dt)

    @staticmethod
    def tick_mag(place: Place, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
        """One sample."""
        if not 0.0 < dt < MOST_DT:
            raise ValueError("dt")
        place.state = place._advance(place.params, place.state, _plain(gyr), _plain(acc), _plain(mag), dt)
        quat: Four = place._result(place.params, place.state.run).quat
        return quat

    @staticmethod
    def report(place: Place) -> Eleven:
        """Orientation, bias, σ and health of the state."""
        result = place._result(place.params, place.state.run)
        numbers: Eleven = (*result.quat, *result.bias, *result.sigma, float(result.health))
        return numbers


class PlainAxisStepper:
    """The stepper of an axis filter in plain Python."""

    def __init__(self, flt: Filter, params: Tree, level: float) -> None:
        self._axis = bind_axis(flt).axis
        self.params = params
        self.state = self._axis.init(params, level)
        self.place = self

    @staticmethod
    def tick(place: Place, period: float, level: float, rate: float, dt: float) -> float:
        """One pair."""
        if not (0.0 < dt < MOST_DT and level - level == 0.0 and rate - rate == 0.0):
            raise ValueError("dt, level or rate")
        place.state = place._axis.step(place.params, place.state, level, rate, dt, period)
        return float(place._axis.read(place.state).level)


class CompiledTicks(NamedTuple):
    """The machine code of a filter's ticks, and how its state and parameters lie in memory."""

    ticks: dict[str, CompiledFunction]
    states: slots.Slot
    parameters: slots.Slot


class CompiledStepper:
    """A stepper in machine code, compiled or read from the cache by the constructor, so that no sample waits for it."""

    tick: CompiledFunction
    tick_mag: CompiledFunction
    report: CompiledFunction
    tick_aiding: CompiledFunction

    def __init__(self, compiled_ticks: CompiledTicks, state: Tree, params: Tree) -> None:
        self._ticks = compiled_ticks
        self._memory, self.place = slots.allocate(compiled_ticks.states.size + compiled_ticks.parameters.size)
        self.state, self.params = state, params
        for name, entry in compiled_ticks.ticks.items():
            setattr(self, name, entry)

    @property
    def state(self) -> Tree:
        """The filter's whole state."""
        return self._ticks.states.read(self._memory, 0)

    @state.setter
    def state(self, value: Tree) -> None:
        self._ticks.states.write(self._memory, 0, value)

    @property
    def params(self) -> Tree:
        """The filter's parameters."""
        return self._params

    @params.setter
    def params(self, value: Tree) -> None:
        self._params = value
        self._ticks.parameters.write(self._memory, self._ticks.states.size, value)


def _compile_ticks(
    name: str, state: Tree, params: Tree, ticks: dict[str, tuple[KernelFunction, str]], pairs: Bindings
) -> CompiledTicks:
    """Compiles ``ticks``, name -> (function, arguments), with ``pairs`` and slots for state and parameters bound."""
    states, parameters = slots.slot(state), slots.slot(params)
    own = fill(
        memory,
        name,
        PARAMS_AT=states.size,
        load=states.load,
        store=states.store,
        load_params=parameters.load,
    )
    entries = {}
    for key, (function, arguments) in ticks.items():
        bound = rebind(function, (*pairs, (memory, own)), name)
        entries[key] = slots.entry_point(compile_kernel(bound, releases_gil=False), arguments)
    return CompiledTicks(entries, states, parameters)


@functools.cache
def imu_ticks(flt: Filter, guarded: bool) -> CompiledTicks:
    """The compiled ticks of a filter on an IMU."""
    bound, settings = bind(flt, guarded), Settings(flt.params(), Guard())
    ticks: dict[str, tuple[KernelFunction, str]] = {
        "tick_mag": (tick_mag, "ivvvf"),
        "tick": (tick, "ivvf"),
        "report": (report, "i"),
    }
    if flt.aiding is not None:
        ticks["tick_aiding"] = (tick_aiding, "iifff")
    return _compile_ticks(bound.name, bound.begin(settings), settings, ticks, bound.pairs)


@functools.cache
def axis_ticks(flt: Filter) -> CompiledTicks:
    """The compiled tick of an axis filter."""
    bound, params = bind_axis(flt), flt.params()
    state = bound.axis.init(params, 0.0)
    return _compile_ticks(f"{flt.name}_axis", state, params, {"tick": (tick_axis, "iffff")}, bound.pairs)


class NativeStepper:
    """A stepper in the C that was compiled with the package."""

    tick: CompiledFunction
    tick_mag: CompiledFunction
    report: CompiledFunction
    tick_aiding: CompiledFunction

    def __init__(self, machine: native.FilterMemory, params: Tree) -> None:
        self._machine, self._params, self.place = machine, params, machine.filter
        for name in ("tick", "tick_mag", "report", "tick_aiding"):
            if hasattr(machine.filter, name):
                setattr(self, name, getattr(type(machine.filter), name))

    @property
    def state(self) -> Tree:
        """The filter's whole state."""
        return self._machine.state

    @state.setter
    def state(self, value: Tree) -> None:
        self._machine.state = value

    @property
    def params(self) -> Tree:
        """The filter's parameters."""
        return self._params

    @params.setter
    def params(self, value: Tree) -> None:
        self._params = value
        self._machine.set_params(value)


def imu_stepper(
    flt: Filter, settings: Settings, guarded: bool, engine: str
) -> PlainStepper | CompiledStepper | NativeStepper:
    """A stepper for a filter on an IMU; ``engine`` "native", "compiled" or "python"."""
    if engine == "python":
        return PlainStepper(flt, settings, guarded)
    begin = bind(flt, guarded).begin(settings)
    if engine == "native":
        return NativeStepper(native.FilterMemory(flt, guarded, settings, begin), settings)
    return CompiledStepper(imu_ticks(flt, guarded), begin, settings)


def axis_stepper(
    flt: Filter, params: Tree, level: float, engine: str
) -> PlainAxisStepper | CompiledStepper | NativeStepper:
    """A stepper for an axis filter; ``engine`` "native", "compiled" or "python"."""
    if engine == "python":
        return PlainAxisStepper(flt, params, level)
    begin = bind_axis(flt).axis.init(params, level)
    if engine == "native":
        return NativeStepper(native.FilterMemory(flt, None, params, begin), params)
    return CompiledStepper(axis_ticks(flt), begin, params)
