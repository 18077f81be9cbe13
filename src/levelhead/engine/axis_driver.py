"""The driver for one "noisy level + drifting rate" pair; a kernel, bound to an axis filter as `driver` is."""

from typing import Any

from levelhead.compiler.mark import kernel
from levelhead.engine.driver import unbound

step = read = unbound


@kernel
def run_axis(params: Any, state: Any, t: Any, level: Any, rate: Any, period: float, out: Any) -> Any:
    """From the state at sample 0 through all samples; ``out`` takes the report of each, row after row."""
    row = read(state)
    width = len(row)
    for k in range(width):
        out[k] = row[k]
    for i in range(1, len(t)):
        state = step(params, state, level[i], rate[i], t[i] - t[i - 1], period)
        row = read(state)
        for k in range(width):
            out[width * i + k] = row[k]
    return state
