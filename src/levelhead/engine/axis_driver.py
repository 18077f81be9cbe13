"""The driver for one "noisy level + drifting rate" pair; a kernel, bound to an axis filter as ``driver`` is."""

from typing import Any, Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import kernel


class AxisHooks(Protocol):
    """What the driver calls of an axis filter."""

    @staticmethod
    def step(params: Any, state: Any, level: float, rate: float, dt: float, period: float) -> Any:
        """The state one pair and ``dt`` seconds later."""
        ...

    @staticmethod
    def read(state: Any) -> Any:
        """The filter's report, a NamedTuple of floats."""
        ...


hooks: AxisHooks = declare(AxisHooks)


@kernel
def run_axis(params: Any, state: Any, t: Any, level: Any, rate: Any, period: float, out: Any) -> Any:
    """From the state at sample 0 through all samples; ``out`` takes the report of each, row after row."""
    row = hooks.read(state)
    width = len(row)
    for k in range(width):
        out[k] = row[k]
    for i in range(1, len(t)):
        state = hooks.step(params, state, level[i], rate[i], t[i] - t[i - 1], period)
        row = hooks.read(state)
        for k in range(width):
            out[width * i + k] = row[k]
    return state
