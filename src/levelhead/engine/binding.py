"""Drivers bound to a filter, and which engine does the work: plain Python or compiled, with the same bits."""

import functools
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

ENGINES = ("auto", "python", "compiled")

# Samples from which compiled work is done sooner: Numba's start costs about 0.5 s with a warm cache, a sample of these
# filters 7 to 55 µs in plain Python; benchmarks/engines.py measures both.
WORTH_STARTING = 12_000
WORTH_WHEN_STARTED = 1_000


class Driver(NamedTuple):
    """The driver's functions for one filter: those that all engines call, and the phases of ``advance``."""

    begin: Callable[..., Any]
    advance: Callable[..., Any]
    result: Callable[..., Any]
    run: Callable[..., Any]
    aided: Callable[..., Any] | None  # these two of a filter that takes position, velocity or height
    run_aided: Callable[..., Any] | None
    phases: dict[str, Callable[..., Any]]


def guards(flt: Filter) -> bool:
    """Whether the guard stands in front of a filter: where an accelerometer corrects a gyroscope.

    A baseline shows what its sensor says.
    """
    return {"gyr", "acc"} <= flt.uses


def bind(flt: Filter, guarded: bool = True) -> Driver:
    """The plain-Python driver of a filter, with the guard in front of it or without."""
    return _bind(flt, guarded and guards(flt))


@functools.cache
def _bind(flt: Filter, guarded: bool) -> Driver:
    name = flt.name if guarded else f"{flt.name}_unguarded"
    own: dict[str, Any] = {
        "init": flt.init,
        "again": flt.calibration.restart if flt.calibration else bound(driver.afresh, name, init=flt.init),
        "step": flt.step,
        "due": flt.schedule.due if flt.schedule else driver.never,
        "correct": flt.schedule.correct if flt.schedule else driver.as_it_is,
        "output": flt.output,
        "gains": flt.gains or driver.no_gains,
        "loosen": flt.inflation.attitude if flt.inflation else driver.firm,
        "loosen_heading": (flt.inflation and flt.inflation.heading) or driver.firm,
        "calm": flt.at_rest or driver.as_before,
        "look": bound(guard.look, name, TELLS_FIELD="field" not in flt.handles) if guarded else driver.unguarded,
        "TAKES_BIAS": "bias" not in flt.handles,
        "perceived": bound(conditioning.perceived, name, sense=detectors.sensed if guarded else conditioning.unsensed),
        "OWN_SIGMA": flt.gains is None,
    }
    own["rate"] = bound(driver.rate, name, **own)
    own["stepped"] = bound(driver.stepped, name, **own)
    phases = {phase.__name__: bound(phase, name, **own) for phase in driver.PHASES}
    seldom = {key: apart(phases[key]) for key in ("started", "loosened", "accelerated")}
    advance = bound(driver.advance, name, **own, **(phases | seldom))
    begin = bound(driver.begin, name, **own)
    result = bound(driver.result, name, **own)
    rows = {"fed": bound(driver.fed, name, advance=advance), "told": bound(driver.told, name, result=result)}
    run = bound(driver.run, name, **rows)
    aided = run_aided = None
    if flt.aiding is not None:
        aided = bound(driver.aided, name, aid=flt.aiding.update)
        run_aided = bound(driver.run_aided, name, **rows, aided=aided, place=flt.aiding.nav_state)
    return Driver(begin, advance, result, run, aided, run_aided, phases | {"perceived": own["perceived"]})


def estimates_bias(flt: Filter, guarded: bool) -> bool:
    """Whether a track of the filter has a bias: its own, or what was read off at rest."""
    return "bias" in flt.estimates or (guarded and guards(flt))


@functools.cache
def bind_axis(flt: Filter) -> tuple[AxisFilter, Callable[..., Any]]:
    """A filter's axis kernels and its plain-Python axis driver."""
    if flt.axis is None:
        raise LevelheadError(f"{flt.name} needs an IMU; it does not work on one level and its rate")
    return flt.axis, bound(axis_driver.run_axis, flt.name, step=flt.axis.step, read=flt.axis.read)


def choose(engine: str, samples: int) -> str:
    """ "python" or "compiled": what ``engine="auto"`` means for so many samples.

    Raises:
        LevelheadError: no engine of that name.
    """
    if engine not in ENGINES:
        raise LevelheadError(f"there is no engine '{engine}'; {nearest(engine, ENGINES)}")
    if engine != "auto":
        return engine
    threshold = WORTH_WHEN_STARTED if "numba" in sys.modules else WORTH_STARTING
    return "compiled" if samples >= threshold else "python"


def engine_function(function: Callable[..., Any], engine: str) -> Callable[..., Any]:
    """The driver function itself, or its compiled twin."""
    return compiled(function) if engine == "compiled" else function
