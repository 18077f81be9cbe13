"""Parameters for a recording: sweeps with their flat region, and when a gain has converged."""

from levelhead.tune.convergence import find_convergence
from levelhead.tune.sweep import Sweep, sweep

__all__ = ["Sweep", "find_convergence", "sweep"]
