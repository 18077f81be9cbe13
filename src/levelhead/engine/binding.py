"""Drivers bound to a filter, and which engine does the work, with the same bits.

"native" is the C that was compiled with the package, for the filters of the house; "compiled" what Numba compiles on
this machine; "python" the kernels as they stand.
"""

import functools
import importlib.util
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

from levelhead import guard
from levelhead.compiler.compile import compiled
from levelhead.compiler.mark import apart, bound
from levelhead.engine import axis_driver, conditioning, driver
from levelhead.errors import LevelheadError, nearest
from levelhead.filters.contract import AxisFilter, Filter
from levelhead.guard import detectors

ENGINES = ("auto", "native", "compiled", "python")

# Samples from which compiled work is done sooner: Numba's start costs about 0.5 s with a warm cache, a sample of these
# filters 7 to 55 µs in plain Python; benchmarks/engines.py measures both.
SAMPLES_COLD = 12_000
SAMPLES_WARM = 1_000


class Driver(NamedTuple):
    """The driver's functions for one filter: those that all engines call, and the phases of ``advance``."""

    begin: Callable[..., Any]
    advance: Callable[..., Any]
    result: Callable[..., Any]
    run: Callable[..., Any]
    update_aiding: Callable[..., Any] | None  # these two of a filter that takes position, velocity or height
    run_with_aiding: Callable[..., Any] | None
    phases: dict[str, Callable[..., Any]]


def is_guarded(flt: Filter) -> bool:
    """Whether the guard stands in front of a filter: where an accelerometer corrects a gyroscope.

    A baseline shows what its sensor says.
    """
    return {"gyr", "acc"} <= flt.uses


def bind(flt: Filter, guarded: bool = True) -> Driver:
    """The plain-Python driver of a filter, with the guard in front of it or without."""
    return _bind(flt, guarded and is_guarded(flt))


@functools.cache
def _bind(flt: Filter, guarded: bool) -> Driver:
    name = flt.name if guarded else f"{flt.name}_unguarded"
    own: dict[str, Any] = {
        "init": flt.init,
        "again": flt.calibration.restart if flt.calibration else bound(driver.default_restart, name, init=flt.init),
        "step": flt.step,
        "due": flt.schedule.due if flt.schedule else driver.never_due,
        "correct": flt.schedule.correct if flt.schedule else driver.keep_uncorrected,
        "output": flt.output,
        "gains": flt.gains or driver.no_gains,
        "loosen": flt.inflation.attitude if flt.inflation else driver.keep_variance,
        "loosen_heading": (flt.inflation and flt.inflation.heading) or driver.keep_variance,
        "calm": flt.at_rest or driver.keep_state,
        "look": bound(guard.look, name, TELLS_FIELD="field" not in flt.handles) if guarded else driver.no_gate,
        "TAKES_BIAS": "bias" not in flt.handles,
        "condition": bound(
            conditioning.condition, name, detect=detectors.sensed if guarded else conditioning.no_detectors
        ),
        "OWN_SIGMA": flt.gains is None,
    }
    own["unbiased_rate"] = bound(driver.unbiased_rate, name, **own)
    own["step_gated"] = bound(driver.step_gated, name, **own)
    phases = {phase.__name__: bound(phase, name, **own) for phase in driver.PHASES}
    seldom = {key: apart(phases[key]) for key in ("start", "inflate", "step_accelerated")}
    advance = bound(driver.advance, name, **own, **(phases | seldom))
    begin = bound(driver.begin, name, **own)
    result = bound(driver.result, name, **own)
    rows = {
        "process_row": bound(driver.process_row, name, advance=advance),
        "write_row": bound(driver.write_row, name, result=result),
    }
    run = bound(driver.run, name, **rows)
    update_aiding = run_with_aiding = None
    if flt.aiding is not None:
        update_aiding = bound(driver.update_aiding, name, aid=flt.aiding.update)
        run_with_aiding = bound(
            driver.run_with_aiding, name, **rows, update_aiding=update_aiding, place=flt.aiding.nav_state
        )
    return Driver(begin, advance, result, run, update_aiding, run_with_aiding, phases | {"condition": own["condition"]})


def estimates_bias(flt: Filter, guarded: bool) -> bool:
    """Whether a track of the filter has a bias: its own, or what was read off at rest."""
    return "bias" in flt.estimates or (guarded and is_guarded(flt))


@functools.cache
def bind_axis(flt: Filter) -> tuple[AxisFilter, Callable[..., Any]]:
    """A filter's axis kernels and its plain-Python axis driver."""
    if flt.axis is None:
        raise LevelheadError(f"{flt.name} needs an IMU; it does not work on one level and its rate")
    return flt.axis, bound(axis_driver.run_axis, flt.name, step=flt.axis.step, read=flt.axis.read)


def check_engine(engine: str) -> None:
    """Refuses what is no engine.

    Raises:
        LevelheadError: no engine of that name, or Numba is not installed.
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
    """ "native", "compiled" or "python": what ``engine="auto"`` means for so many samples.

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


def for_engine(function: Callable[..., Any], engine: str) -> Callable[..., Any]:
    """The driver function itself, or its compiled twin."""
    return compiled(function) if engine == "compiled" else function
