"""Which parameters suit a recording: sweeps with their flat region, and when a gain has converged."""

from levelhead.tune.convergence import converged
from levelhead.tune.sweep import Sweep, sweep

__all__ = ["Sweep", "converged", "sweep"]
