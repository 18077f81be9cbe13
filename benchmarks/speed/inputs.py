"""The data that the benchmarks of one axis run on; whole sensors are in ``levelhead.bench.inputs``."""

import numpy as np
from numpy.typing import NDArray

from levelhead.bench.inputs import DT

Array = NDArray[np.float64]


def axis(n: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Time (n,) in s, a measured angle in ° and its rate in °/s, 100 Hz; read-only, as levelhead keeps arrays."""
    noise = np.random.default_rng(seed)
    t = np.arange(n) * DT
    level = 30.0 * np.sin(t) + noise.normal(0.0, 1.0, n)
    rate = 30.0 * np.cos(t) + 2.0 + noise.normal(0.0, 0.1, n)
    for array in (t, level, rate):
        array.flags.writeable = False
    return t, level, rate
