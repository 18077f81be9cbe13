"""Parameters for recordings: searches, sweeps with their flat region, and when a gain has converged."""

from levelhead.tune.convergence import find_convergence
from levelhead.tune.sweep import Sweep, sweep
from levelhead.tune.tune_filter import tune_filter
from levelhead.tune.tuning_result import Tuning

__all__ = ["Sweep", "Tuning", "find_convergence", "sweep", "tune_filter"]
