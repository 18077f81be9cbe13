"""The driver for one "noisy level + drifting rate" pair; a kernel, bound to an axis filter as ``driver`` is."""

from typing import Protocol

from levelhead.compiler.hooks import declare
from levelhead.compiler.mark import kernel
from levelhead.filters.contract import AxisReport, FilterState
from levelhead.filters.parameters import Params
from levelhead.kernels.arrays import Floats


class AxisHooks(Protocol):
    """The functions of an axis filter that the driver calls."""

    @staticmethod
    def step(params: Params, state: FilterState, level: float, rate: float, dt: float, period: float) -> FilterState:
        """The state one pair and ``dt`` seconds later."""
        ...

    @staticmethod
    def read(state: FilterState) -> AxisReport:
        """The filter's report, a NamedTuple of floats."""
        ...


hooks: AxisHooks = declare(AxisHooks)


@kernel
def run_axis(
    params: Params, state: FilterState, t: Floats, level: Floats, rate: Floats, period: float, out: Floats
) -> FilterState:
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
