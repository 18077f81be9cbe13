"""From a recording at rest to its noise."""

from collections.abc import Callable

import numpy as np

from levelhead.engine.threads import map_in_order
from levelhead.errors import LevelheadError, require
from levelhead.noise.allan import AllanCurve, allan_curve
from levelhead.noise.fit import NAMES, fit
from levelhead.noise.model import UNITS, Coefficient, NoiseModel, TriadNoise
from levelhead.noise.rounding import rounding_ratio, rounding_step, without_rounding
from levelhead.noise.temperature import temperature_drift
from levelhead.recording import Array, Recording, median
from levelhead.signals.rest import StillStretch, still_stretches

MIN_REST = 20.0  # s at rest, below which there is nothing to say
MAX_MISSING = 0.05  # share of samples that may be missing and are interpolated
LONGEST_GAP = 1.0  # s


def measure_noise(
    recording: Recording, *, tau: float | None = None, progress: Callable[[float], None] = lambda fraction: None
) -> NoiseModel:
    """The noise of a sensor from the longest stretch of a recording in which it was still.

    Args:
        recording: at rest, the longer the better: 3 times the longest averaging time that is asked for.
        tau: longest averaging time in s; by default a third of the stretch.
        progress: called with the fraction done.

    Returns:
        A NoiseModel with Allan deviations, coefficients and their 95 % intervals; without a magnetometer whose readings
        have no unit.

    Raises:
        LevelheadError: never still for 20 s, too short for ``tau``, a silent sensor, or SciPy is missing.
    """
    require("scipy", "the fit of noise", "scipy")
    part = recording[slice(*longest(recording))]
    if tau is not None and not tau > 0.0:
        raise LevelheadError(f"tau is {tau:g} s; expected an averaging time of more than 0 s")
    if tau is not None and tau > part.duration / 3.0:
        raise LevelheadError(
            f"an averaging time of {tau:g} s needs {3.0 * tau:g} s at rest; the recording was still for "
            f"{part.duration:.0f} s: ask for at most {part.duration / 3.0:.0f} s or record for longer"
        )
    there = [name for name in UNITS if getattr(part, name) is not None and not (name == "mag" and lacks_unit(part))]
    triads = {}
    for i, name in enumerate(there):

        def report(fraction: float, done: int = i) -> None:
            progress((done + fraction) / len(there))

        triads[name] = _triad(name, part, tau, report)
    source = str(recording.meta.get("source", ""))
    return NoiseModel(triads["gyr"], triads["acc"], triads.get("mag"), part.duration, source, recording.duration)


def lacks_unit(recording: Recording) -> bool:
    """Whether the magnetometer's readings have no unit: a direction, or counts of unknown size."""
    return bool(recording.meta.get("units", {}).get("mag") == "relative")


def longest(recording: Recording) -> StillStretch:
    """The longest stretch at rest.

    Raises:
        LevelheadError: there is none of 20 s.
    """
    found = max(still_stretches(recording), key=lambda one: one.end - one.start, default=StillStretch(0, 0))
    seconds = (found.end - found.start) / max(recording.rate, 1e-9)
    if seconds < MIN_REST:
        raise LevelheadError(
            f"the sensor was still for {seconds:.0f} s at most in {recording.duration:.0f} s; noise needs {MIN_REST:g} "
            "s at rest, better an hour: put it on a table, and do not touch it"
        )
    return found


def _triad(name: str, part: Recording, tau: float | None, report: Callable[[float], None]) -> TriadNoise:
    """The noise of one sensor."""
    values, interval = uniform(name, part.t, getattr(part, name))
    axes = [np.ascontiguousarray(column) for column in values.T]
    still = [i for i, column in enumerate(axes) if column.min() == column.max()]
    if still:
        raise LevelheadError(
            f"{name} {'xyz'[still[0]]} has the same reading throughout: an axis that is stuck or coarser than its "
            "noise; expected readings that differ"
        )
    count = len(values) if tau is None else round(tau / interval)
    done = np.zeros(3)

    def curve(axis: int) -> AllanCurve:
        def axis_report(fraction: float) -> None:
            done[axis] = fraction
            report(float(done.mean()))

        return allan_curve(axes[axis], interval, count, axis_report)

    curves = list(map_in_order(curve, range(3)))  # NumPy lets other Python threads run while it adds
    fits = [fit(curve) for curve in curves]
    parts = {
        kind: Coefficient(
            *(np.array([getattr(one, of)[i] for one in fits]) for of in ("value", "sigma", "low", "high"))
        )
        for i, kind in enumerate(NAMES)
    }
    steps = np.array([rounding_step(column) for column in axes])
    ratios = np.array([rounding_ratio(column, step) for column, step in zip(axes, steps, strict=True)])
    white = parts["white_noise_density"]
    less = [without_rounding(one, steps, ratios, 1.0 / interval) for one in (white.value, white.low, white.high)]
    parts["white_noise_density"] = Coefficient(less[0], white.sigma, less[1], less[2])
    warmth = part.temperature
    drift = None if warmth is None else temperature_drift(getattr(part, name), warmth)
    return TriadNoise.of(1.0 / interval, parts, tuple(curves), tuple(fits), drift, float(ratios.max()))


def uniform(name: str, t: Array, values: Array) -> tuple[Array, float]:
    """(n, 3) readings on the sensor's own even clock and the interval in s; single missing ones are interpolated.

    Raises:
        LevelheadError: a gap of more than 1 s, or more than 5 % are missing.
    """
    if not np.isfinite(np.add.reduce(values.reshape(-1))):
        there = np.isfinite(values).all(axis=1)
        t, values = t[there], values[there]
    if len(t) < 100:
        raise LevelheadError(f"{name} has {len(t)} readings at rest; expected at least 100")
    steps = np.diff(t)
    usual = median(steps)
    if float(steps.max()) < 1.5 * usual:
        return values, float(t[-1] - t[0]) / (len(t) - 1)
    places = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / usual), 1.0))])
    count = int(places[-1]) + 1
    gap = float(steps.max())
    if gap > max(LONGEST_GAP, 3.0 * usual) or count - len(t) > MAX_MISSING * count:
        raise LevelheadError(
            f"{name} at rest has {count - len(t)} of {count} readings missing and a gap of {gap:.1f} s; expected at "
            f"most {100 * MAX_MISSING:g} % and {LONGEST_GAP:g} s: record again without losses"
        )
    interval = float(t[-1] - t[0]) / (count - 1)
    if count == len(t):
        return values, interval
    even = np.arange(count)
    return np.stack([np.interp(even, places, column) for column in values.T], axis=1), interval
