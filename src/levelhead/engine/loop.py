"""A filter in a loop: the state that stays between samples, in plain Python or in compiled memory.

Both kinds of loop have the same face: for a filter on an IMU ``tick(gyr, acc, mag, dt)`` with tuples of three floats,
for an axis filter ``tick(level, rate, dt)``, and ``state`` and ``params`` that can be read and set between samples. A
tick that is fed nonsense (dt ≤ 0, for an axis also NaN) leaves the state as it is and returns NaN.
"""

import functools
from collections.abc import Callable
from math import nan
from typing import Any

from levelhead.engine import memory
from levelhead.engine.binding import bind, bind_axis
from levelhead.engine.driver import unbound
from levelhead.filters.contract import Filter
from levelhead.kernels.jit import bound, compiled, kernel
from levelhead.kernels.vec3 import Vec3

Triple = tuple[float, float, float]
Four = tuple[float, float, float, float]
LONGEST = 1e9  # s: what is longer is no interval between samples

advance = result = step = read = load = load_params = store = unbound


@kernel
def tick(at: int, params_at: int, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
    """One sample through the driver, on the state and parameters in memory."""
    if not 0.0 < dt < LONGEST:
        return (nan, nan, nan, nan)
    params = load_params(params_at)
    carry = advance(
        params,
        load(at),
        Vec3(gyr[0], gyr[1], gyr[2]),
        Vec3(acc[0], acc[1], acc[2]),
        Vec3(mag[0], mag[1], mag[2]),
        dt,
    )
    store(at, carry)
    q = result(params, carry).quat
    return (q.w, q.x, q.y, q.z)


@kernel
def tick_axis(at: int, params_at: int, period: float, level: float, rate: float, dt: float) -> float:
    """One pair through an axis filter, on the state and parameters in memory."""
    if not (0.0 < dt < LONGEST and level - level == 0.0 and rate - rate == 0.0):
        return nan
    state = step(load_params(params_at), load(at), level, rate, dt, period)
    store(at, state)
    level_after: float = read(state).level
    return level_after


class PlainLoop:
    """The loop in plain Python."""

    def __init__(self, flt: Filter, params: Any) -> None:
        driver = bind(flt)
        self.params = params
        self.state = driver.begin(params)
        self._advance, self._result = driver.advance, driver.result

    def tick(self, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
        """One sample."""
        if not 0.0 < dt < LONGEST:
            return (nan, nan, nan, nan)
        self.state = self._advance(self.params, self.state, Vec3(*gyr), Vec3(*acc), Vec3(*mag), dt)
        quat: Four = self._result(self.params, self.state).quat
        return quat


class PlainAxisLoop:
    """The loop of an axis filter in plain Python."""

    def __init__(self, flt: Filter, params: Any, level: float, period: float) -> None:
        self._axis, _ = bind_axis(flt)
        self._period = period
        self.params = params
        self.state = self._axis.init(params, level)

    def tick(self, level: float, rate: float, dt: float) -> float:
        """One pair."""
        if not (0.0 < dt < LONGEST and level - level == 0.0 and rate - rate == 0.0):
            return nan
        self.state = self._axis.step(self.params, self.state, level, rate, dt, self._period)
        return float(self._axis.read(self.state).level)


class CompiledLoop:
    """The loop in machine code, compiled (or fetched from the cache) here so that no sample waits for it."""

    def __init__(self, machine: tuple[Any, memory.Slot, memory.Slot], state: Any, params: Any, *fixed: float) -> None:
        entry, self._states, self._parameters = machine
        self._memory, self._at = memory.allocate(self._states.size)
        self._params_memory, self._params_at = memory.allocate(self._parameters.size)
        self.state, self.params = state, params
        self.tick: Callable[..., Any] = functools.partial(entry, self._at, self._params_at, *fixed)

    @property
    def state(self) -> Any:
        """The filter's whole state."""
        return self._states.peek(self._at)

    @state.setter
    def state(self, value: Any) -> None:
        self._states.poke(self._at, value)

    @property
    def params(self) -> Any:
        """The filter's parameters."""
        return self._params

    @params.setter
    def params(self, value: Any) -> None:
        self._params = value
        self._parameters.poke(self._params_at, value)


@functools.cache
def _machine(flt: Filter) -> tuple[Any, memory.Slot, memory.Slot]:
    driver = bind(flt)
    params = flt.params()
    states = memory.slot(driver.begin(params), f"{flt.name}_state")
    parameters = memory.slot(params, f"{flt.name}_params")
    function = bound(
        tick, flt.name, advance=driver.advance, result=driver.result,
        load=states.load, store=states.store, load_params=parameters.load,
    )  # fmt: skip
    return memory.entry_point(compiled(function, releases_gil=False), "iivvvf"), states, parameters


@functools.cache
def _axis_machine(flt: Filter) -> tuple[Any, memory.Slot, memory.Slot]:
    axis, _ = bind_axis(flt)
    params = flt.params()
    states = memory.slot(axis.init(params, 0.0), f"{flt.name}_axis")
    parameters = memory.slot(params, f"{flt.name}_params")
    function = bound(
        tick_axis, flt.name, step=axis.step, read=axis.read,
        load=states.load, store=states.store, load_params=parameters.load,
    )  # fmt: skip
    return memory.entry_point(compiled(function, releases_gil=False), "iiffff"), states, parameters


def loop(flt: Filter, params: Any, engine: str) -> PlainLoop | CompiledLoop:
    """A loop for a filter on an IMU; ``engine`` "python" or "compiled"."""
    if engine == "python":
        return PlainLoop(flt, params)
    return CompiledLoop(_machine(flt), bind(flt).begin(params), params)


def axis_loop(flt: Filter, params: Any, level: float, period: float, engine: str) -> PlainAxisLoop | CompiledLoop:
    """A loop for an axis filter; ``engine`` "python" or "compiled"."""
    if engine == "python":
        return PlainAxisLoop(flt, params, level, period)
    axis, _ = bind_axis(flt)
    return CompiledLoop(_axis_machine(flt), axis.init(params, level), params, period)
