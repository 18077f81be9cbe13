"""The prior that a run starts with, and the calibration that it ends with."""

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.driver import Carry, Settings
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.kernels.vec3 import ZERO


def apply_prior(flt: Filter, carry: Carry, prior: Calibration | None) -> Carry:
    """The carry before the first sample, with lists, after a filter has taken the prior.

    Raises:
        LevelheadError: the prior is no Calibration, or the filter estimates no calibration.
    """
    if prior is None:
        return carry
    if not isinstance(prior, Calibration):
        raise LevelheadError(
            f"prior is {type(prior).__name__}; expected a Calibration: Track.calibration or Calibration.read(path)"
        )
    if flt.calibration is None:
        who = " or ".join(one.name for one in filters.ALL if one.calibration)
        raise LevelheadError(f"{flt.name} learns no calibration, so it takes no prior; {who} does")
    state = flt.calibration.with_prior(carry.run.state, prior.prior())
    return carry._replace(run=carry.run._replace(state=state))


def keep_prior(flt: Filter, settings: Settings, carry: Carry, begin: Carry) -> Carry:
    """``begin``, the carry before the first sample, with the prior that ``carry`` (with lists) was given."""
    if flt.calibration is None:
        return begin
    state = flt.calibration.restart(settings.filter, carry.run.state, ZERO, ZERO, ZERO)
    return begin._replace(run=begin.run._replace(state=state))


def read_calibration(flt: Filter, settings: Settings, carry: Carry) -> Calibration | None:
    """The filter's present estimate of its sensor's errors; None if it estimates none."""
    if flt.calibration is None:
        return None
    return Calibration.from_estimates(flt.calibration.estimate(settings.filter, carry.run.state))
