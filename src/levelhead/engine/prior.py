"""The prior that a run starts with, and the calibration that it ends with."""

from collections.abc import Callable, Mapping

import numpy as np

from levelhead import filters
from levelhead.calibration import Calibration, TemperatureCurve
from levelhead.engine.driver import Carry, Settings
from levelhead.engine.stepper import Four
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.kernels.correction import SensorErrors, correct_readings, is_absent
from levelhead.kernels.vec3 import ZERO, Vec3
from levelhead.recording import Recording
from levelhead.sample import Triple

Tick = Callable[..., Four]  # of a stepper: its place, readings and dt


def apply_prior(flt: Filter, carry: Carry, prior: Calibration | None) -> Carry:
    """The carry before the first sample, with lists, after a filter has taken the prior.

    Raises:
        LevelheadError: the prior is not a Calibration, or the filter estimates no calibration.
    """
    if prior is None:
        return carry
    if not isinstance(prior, Calibration):
        raise LevelheadError(
            f"prior is {type(prior).__name__}; expected a Calibration: Track.calibration or Calibration.read(path)"
        )
    if flt.calibration is None:
        who = " or ".join(one.name for one in filters.ALL if one.calibration)
        raise LevelheadError(f"{flt.name} learns no calibration, so it has no prior; {who} does")
    state = flt.calibration.with_prior(carry.run.state, prior.prior())
    return carry._replace(run=carry.run._replace(state=state))


def correct_recording(recording: Recording, prior: Calibration | None) -> Recording:
    """The recording without the errors that a prior has and no filter learns: matrices of accelerometer and
    magnetometer, and the change of biases with temperature.
    """
    if not isinstance(prior, Calibration):
        return recording
    fixed, recording = prior.matrices(), prior.at_reference(recording)
    return recording if fixed is None else fixed.apply(recording)


def correct_ticks(tick: Tick, tick_mag: Tick, errors: SensorErrors) -> tuple[Tick, Tick]:
    """The same two functions of one live sample, for readings that have these errors."""

    def plain(place: object, gyr: Triple, acc: Triple, dt: float) -> Four:
        better = correct_readings(errors, Vec3(*gyr), Vec3(*acc), ZERO)
        return tick(place, tuple(better.gyr), tuple(better.acc), dt)

    def with_mag(place: object, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
        better = correct_readings(errors, Vec3(*gyr), Vec3(*acc), Vec3(*mag))
        return tick_mag(place, tuple(better.gyr), tuple(better.acc), tuple(better.mag), dt)

    return plain, with_mag


class Warmth:
    """Readings of a live sensor without the change of its biases with temperature; until one is given, as they are.

    Args:
        curves: "gyr" and "acc" to their curves.
    """

    def __init__(self, curves: Mapping[str, TemperatureCurve]) -> None:
        self._curves = curves
        self._change: dict[str, Triple] = {"gyr": (0.0, 0.0, 0.0), "acc": (0.0, 0.0, 0.0)}

    def set(self, temperature: float) -> None:
        """The temperature of the samples that follow, °C."""
        for name, curve in self._curves.items():
            x, y, z = curve.change(np.array([temperature]))[0].tolist()
            self._change[name] = x, y, z

    def correct_ticks(self, tick: Tick, tick_mag: Tick) -> tuple[Tick, Tick]:
        """The same two functions of one live sample, for readings at this temperature."""

        def plain(place: object, gyr: Triple, acc: Triple, dt: float) -> Four:
            return tick(place, self.less("gyr", gyr), self.less("acc", acc), dt)

        def with_mag(place: object, gyr: Triple, acc: Triple, mag: Triple, dt: float) -> Four:
            return tick_mag(place, self.less("gyr", gyr), self.less("acc", acc), mag, dt)

        return plain, with_mag

    def less(self, name: str, values: Triple) -> Triple:
        """Readings of "gyr" or "acc" without this change; the zero vector of a silent sensor as it is."""
        (x, y, z), (a, b, c) = values, self._change[name]
        if name == "acc" and is_absent(Vec3(x, y, z)):
            return values
        return x - a, y - b, z - c


def keep_prior(flt: Filter, settings: Settings, carry: Carry, begin: Carry) -> Carry:
    """``begin``, the carry before the first sample, with the prior that ``carry`` (with lists) was given."""
    if flt.calibration is None:
        return begin
    state = flt.calibration.restart(settings.filter, carry.run.state, ZERO, ZERO, ZERO)
    return begin._replace(run=begin.run._replace(state=state))


def read_calibration(
    flt: Filter, settings: Settings, carry: Carry, prior: Calibration | None = None
) -> Calibration | None:
    """The filter's present estimate of its sensor's errors, with the prior's matrices; None if it estimates none."""
    if flt.calibration is None:
        return None
    return Calibration.from_estimates(flt.calibration.estimate(settings.filter, carry.run.state)).with_matrices(prior)
