"""Drivers bound to a filter, and which engine does the work, with the same bits.

"native" is the C that was compiled with the package, for the filters of the house; "compiled" the code that Numba
compiles on this machine; "python" the kernels as they stand.
"""

import functools
import importlib.util
import sys
from dataclasses import dataclass
from typing import NamedTuple

from levelhead import guard
from levelhead.compiler.compile import compile_kernel
from levelhead.compiler.hooks import Bindings, fill, rebind
from levelhead.compiler.mark import KernelFunction, with_globals
from levelhead.engine import axis_driver, conditioning, driver
from levelhead.errors import LevelheadError, nearest
from levelhead.filters.contract import AxisFilter, Filter
from levelhead.guard import detectors

ENGINES = ("auto", "native", "compiled", "python")

# Samples from which compiled work is done sooner: Numba's start costs about 0.5 s with a warm cache, a sample of these
# filters 7 to 55 µs in plain Python; benchmarks/speed/engines.py measures both.
SAMPLES_COLD = 12_000
SAMPLES_WARM = 1_000


@dataclass(frozen=True, eq=False)
class Driver:
    """The driver's functions for one filter, each bound when it is asked for: a native engine needs ``begin`` only."""

    name: str
    pairs: Bindings  # for ``rebind``: the driver's namespaces, and those with the filter's functions
    takes_aiding: bool

    def _bound(self, kernel: KernelFunction) -> KernelFunction:
        return rebind(kernel, self.pairs, self.name)

    @functools.cached_property
    def begin(self) -> KernelFunction:
        """``driver.begin``."""
        return self._bound(driver.begin)

    @functools.cached_property
    def advance(self) -> KernelFunction:
        """``driver.advance``."""
        return self._bound(driver.advance)

    @functools.cached_property
    def result(self) -> KernelFunction:
        """``driver.result``."""
        return self._bound(driver.result)

    @functools.cached_property
    def run(self) -> KernelFunction:
        """``driver.run``."""
        return self._bound(driver.run)

    @functools.cached_property
    def update_aiding(self) -> KernelFunction | None:
        """``driver.update_aiding`` of a filter that takes position, velocity or height."""
        return self._bound(driver.update_aiding) if self.takes_aiding else None

    @functools.cached_property
    def run_with_aiding(self) -> KernelFunction | None:
        """``driver.run_with_aiding`` of a filter that takes position, velocity or height."""
        return self._bound(driver.run_with_aiding) if self.takes_aiding else None


def is_guarded(flt: Filter) -> bool:
    """Whether a filter has the guard in front of it: where an accelerometer corrects a gyroscope.

    A baseline shows its sensor as it is.
    """
    return {"gyr", "acc"} <= flt.uses


def bind(flt: Filter, guarded: bool = True) -> Driver:
    """The plain-Python driver of a filter, with the guard in front of it or without."""
    return _bind(flt, guarded and is_guarded(flt))


@functools.cache
def _bind(flt: Filter, guarded: bool) -> Driver:
    name = flt.name if guarded else f"{flt.name}_unguarded"
    detect = detectors.detect if guarded else None
    accepted = detectors.accepted_rate if guarded else None
    mean = detectors.mean_rate if guarded else None
    pairs: Bindings = (
        (driver.hooks, _hooks(flt, guarded, name)),
        (
            conditioning.detectors,
            fill(conditioning.detectors, name, detect=detect, accepted_rate=accepted, interval_rate=mean),
        ),
    )
    if flt.aiding is not None:
        pairs += ((driver.aiding, fill(driver.aiding, name, **flt.aiding._asdict())),)
    return Driver(name, pairs, flt.aiding is not None)


def _hooks(flt: Filter, guarded: bool, name: str) -> driver.Hooks:
    """The functions of this filter for the driver; None: the declaration's default."""
    schedule, inflation, calibration = flt.schedule, flt.inflation, flt.calibration
    filled: driver.Hooks = fill(
        driver.hooks,
        name,
        OWN_SIGMA=flt.gains is None,
        HAS_VELOCITY=inflation is not None and inflation.velocity is not None,
        TAKES_BIAS="bias" not in flt.handles,
        init=flt.init,
        step=flt.step,
        output=flt.output,
        restart=calibration and calibration.restart,
        due=schedule and schedule.due,
        correct=schedule and schedule.correct,
        gains=flt.gains,
        inflate=inflation and inflation.attitude,
        inflate_heading=inflation and inflation.heading,
        inflate_velocity=inflation and inflation.velocity,
        at_rest=flt.at_rest,
        gate=_gate("field" not in flt.handles) if guarded else None,
    )
    return filled


@functools.cache
def _gate(gates_field: bool) -> KernelFunction:
    return with_globals(guard.gate, "field" if gates_field else "others", GATES_FIELD=gates_field)


def estimates_bias(flt: Filter, guarded: bool) -> bool:
    """Whether a track of the filter has a bias: its own, or the bias measured at rest."""
    return "bias" in flt.estimates or (guarded and is_guarded(flt))


class AxisDriver(NamedTuple):
    """The axis driver for one filter; ``pairs`` as in ``Driver``."""

    pairs: Bindings
    axis: AxisFilter
    run: KernelFunction


@functools.cache
def bind_axis(flt: Filter) -> AxisDriver:
    """A filter's axis kernels and its plain-Python axis driver.

    Raises:
        LevelheadError: the filter needs an IMU.
    """
    if flt.axis is None:
        raise LevelheadError(f"{flt.name} needs an IMU; it does not work on one level and its rate")
    hooks = fill(axis_driver.hooks, flt.name, step=flt.axis.step, read=flt.axis.read)
    pairs = ((axis_driver.hooks, hooks),)
    return AxisDriver(pairs, flt.axis, rebind(axis_driver.run_axis, pairs, flt.name))


def check_engine(engine: str) -> None:
    """Refuses an unknown engine.

    Raises:
        LevelheadError: no engine of that name, or Numba is missing.
    """
    if engine not in ENGINES:
        raise LevelheadError(f"there is no engine '{engine}'; {nearest(engine, ENGINES)}")
    if engine == "compiled" and not numba_installed():
        raise LevelheadError("the engine 'compiled' needs Numba: pip install 'levelhead[numba]'")


@functools.cache
def numba_installed() -> bool:
    """Whether there is Numba to compile with; it is not imported."""
    return "numba" in sys.modules or importlib.util.find_spec("numba") is not None


def choose_engine(engine: str, samples: int, native: bool = False) -> str:
    """ "native", "compiled" or "python": the meaning of ``engine="auto"`` for so many samples.

    ``native``: whether the filter has a native engine.

    Raises:
        LevelheadError: no engine of that name, or not for this filter or on this machine.
    """
    check_engine(engine)
    if engine == "native" and not native:
        raise LevelheadError(
            "there is no native engine for it: only for the filters of the house, where the package was built with a C "
            "compiler; use 'auto', 'compiled' or 'python'"
        )
    if engine != "auto":
        return engine
    if native or not numba_installed():
        return "native" if native else "python"
    threshold = SAMPLES_WARM if "numba" in sys.modules else SAMPLES_COLD
    return "compiled" if samples >= threshold else "python"


def for_engine(function: KernelFunction, engine: str) -> KernelFunction:
    """The driver function itself, or its compiled twin."""
    return compile_kernel(function) if engine == "compiled" else function
