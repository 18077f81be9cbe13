"""What a run knows of its sensor before it, and what it has learned by its end."""

from typing import Any

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.driver import Carry, Settings
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.kernels.vec3 import ZERO


def primed(flt: Filter, carry: Carry, prior: Calibration | None) -> Carry:
    """A carry before the first sample, in lists, that knows what an earlier run has learned.

    Raises:
        LevelheadError: the prior is no Calibration, or the filter learns nothing of its sensor.
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
    told = flt.calibration.with_prior(carry.run.state, prior.prior())
    return carry._replace(run=carry.run._replace(state=told))


def forgotten(flt: Filter, settings: Settings, carry: Carry, begin: Carry) -> Carry:
    """``begin``, the carry before any sample, with the prior that a carry (in lists) had."""
    if flt.calibration is None:
        return begin
    state = flt.calibration.restart(settings.filter, carry.run.state, ZERO, ZERO, ZERO)
    return begin._replace(run=begin.run._replace(state=state))


def learned(flt: Filter, settings: Settings, carry: Any) -> Calibration | None:
    """What the filter has learned of its sensor by now; None if it learns nothing."""
    if flt.calibration is None:
        return None
    return Calibration.learned(flt.calibration.estimate(settings.filter, carry.run.state))
