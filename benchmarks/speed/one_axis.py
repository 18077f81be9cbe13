"""Cost of a sample on one axis: levelhead against hand-written C and the tutorial loop.

Nanoseconds of CPU time per sample (fastest repeat), and the median over the repeats of the ratio to the yardstick
of each table.
"""

import ctypes
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from benchmarks.measure import options, show
from benchmarks.speed.inputs import axis
from tests.reference.c_library import NATIVE, STRICT, KalmanParams, build, doubles

import levelhead as lh
from levelhead import filters
from levelhead.bench.timing import Case, Table, Timing, time_interleaved
from levelhead.compiler.compile import compile_kernel
from levelhead.engine.binding import bind_axis

COLUMNS = {"case": "case", "ns": "ns/sample", "ratio": "ratio", "to": "to", "target": "target"}
TUTORIAL = 5_000


def row(timing: Timing, yardstick: Timing | None = None, target: str = "", invert: bool = False) -> dict[str, Any]:
    """One line of a table; ``invert``: how many times faster than the yardstick instead of the ratio to it."""
    ratio = to = None
    if yardstick is not None:
        ratio = yardstick.over(timing) if invert else timing.over(yardstick)
        to = f"× faster than {yardstick.name}" if invert else yardstick.name
    return {"case": timing.name, "ns": timing.least, "median_ns": timing.median, "ratio": ratio, "to": to,
            "target": target}  # fmt: skip


def tutorial(t: Sequence[float], level: Sequence[float], rate: Sequence[float], params: Any) -> list[float]:
    """The loop of many lessons: 2×2 NumPy matrices, one product after the other."""
    x = np.array([[level[0]], [0.0]])
    p = np.diag([params.p_angle, params.p_bias])
    h = np.array([[1.0, 0.0]])
    r = np.array([[params.r_measure]])
    found = [level[0]]
    for i in range(1, len(t)):
        dt = t[i] - t[i - 1]
        f = np.array([[1.0, -dt], [0.0, 1.0]])
        b = np.array([[dt], [0.0]])
        q = np.array([[params.q_angle, 0.0], [0.0, params.q_bias]]) * dt
        x = f @ x + b * rate[i]
        p = f @ p @ f.T + q
        s = h @ p @ h.T + r
        k = p @ h.T @ np.linalg.inv(s)
        x = x + k @ (np.array([[level[i]]]) - h @ x)
        p = (np.eye(2) - k @ h) @ p
        found.append(float(x[0, 0]))
    return found


def c_params(params: Any) -> Any:
    """A filter's parameters as its C twin takes them."""
    if isinstance(params, lh.Kalman):
        names = [name for name, _ in KalmanParams._fields_]
        return KalmanParams(*(getattr(params, name) for name in names))
    return ctypes.c_double(params.tau)


def axis_cases(
    params: Any, source: str, data: Sequence[Any], period: float
) -> tuple[list[Case], Callable[[], dict[str, bool]]]:
    """C twice, the driver alone into the same kind of memory, then C and the public call into fresh memory; and a check
    that all of them give the same bits.
    """
    t, level, rate = data
    n = len(t)
    _, flt, driver = bind_axis(filters.of(params))
    fields = len(flt.report._fields)
    outs = {name: np.empty(n * fields) for name in ("driver", "C", "C native")}
    run, state = compile_kernel(driver), flt.init(params, float(level[0]))
    arguments = (ctypes.byref(c_params(params)), n, doubles(t), doubles(level), doubles(rate), period)
    plain, native = build(source, STRICT), build(source, NATIVE)

    def same() -> dict[str, bool]:
        report = lh.fuse_axis(t, level, rate, params, period=period, engine="compiled")
        public = np.stack(report, axis=1).ravel()
        return {name: np.array_equal(public.view(np.int64), out.view(np.int64)) for name, out in outs.items()}

    name = type(params).__name__
    cases = [
        Case("C -O3", lambda: plain(*arguments, doubles(outs["C"])), n),
        Case("C -O3 -march=native", lambda: native(*arguments, doubles(outs["C native"])), n),
        Case("C -O3, fresh memory", lambda: plain(*arguments, doubles(np.empty(n * fields))), n),
        Case(f"{name}, driver alone", lambda: run(params, state, t, level, rate, period, outs["driver"]), n),
        Case(f"{name}, fuse_axis", lambda: lh.fuse_axis(t, level, rate, params, period=period, engine="compiled"), n),
    ]
    return cases, same


def axis_tables(samples: int, repeats: int) -> Iterator[Table]:
    """One-axis filters against C, and the tutorial loop."""
    data = axis(samples)
    for params, source, goal in (
        (lh.Kalman(), "kalman.c", "ratio ≤ 1.2"),
        (lh.Complementary(), "complementary.c", "≤ 5 ns"),
    ):
        for period in (0.0, 360.0):
            cases, same = axis_cases(params, source, data, period)
            c, native, fresh, driver, public = time_interleaved(cases, repeats)
            where = "on a line" if period == 0.0 else "on the circle of 360°"
            yield Table(
                f"{type(params).__name__}, one axis, {samples:,} samples, {where}",
                COLUMNS,
                [row(c), row(native, c), row(fresh, c), row(driver, c, goal), row(driver, native, goal),
                 row(public, c), row(public, fresh, goal)],
                "fuse_axis allocates its outputs, hence C into fresh memory. Bits against fuse_axis: "
                + ", ".join(f"{name} {'the same' if equal else 'DIFFERENT'}" for name, equal in same().items()),
            )  # fmt: skip
    short = [column[:TUTORIAL] for column in data]
    lists = [column.tolist() for column in short]
    params = lh.Kalman()
    away = np.abs(np.array(tutorial(*lists, params)) - lh.fuse_axis(*short, params, engine="python").level).max()
    loop, public = time_interleaved(
        [
            Case("tutorial loop, 2×2 NumPy products", lambda: tutorial(*lists, params), TUTORIAL),
            Case("Kalman, fuse_axis", lambda: lh.fuse_axis(*data, params, engine="compiled"), samples),
        ],
        repeats,
    )
    yield Table(
        "Kalman, one axis, against the tutorial loop",
        COLUMNS,
        [row(loop), row(public, loop, "≥ 1000 × faster", invert=True)],
        f"Same filter: the levels differ by at most {away:.1e}°.",
    )


def main() -> None:
    """Run all of it."""
    parser = options(__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000, help="samples of the batches (default 1,000,000)")
    given = parser.parse_args()
    show(list(axis_tables(given.samples, given.repeats)), given.json)


if __name__ == "__main__":
    main()
