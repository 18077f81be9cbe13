"""The C that ``levelhead export`` writes, against the same recurrence by hand and against the compiled driver."""

import ctypes
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, show
from benchmarks.speed.filters_c import c_params as attitude_params
from benchmarks.speed.filters_c import c_run
from benchmarks.speed.inputs import axis
from benchmarks.speed.one_axis import COLUMNS, c_params, row
from tests.reference.c_library import STRICT, build, doubles

import levelhead as lh
from levelhead import filters
from levelhead.bench.inputs import imu_recording as made
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.compiler.compile import compile_kernel
from levelhead.engine.binding import bind, bind_axis
from levelhead.engine.driver import Settings
from levelhead.export import ExportConfig, write
from levelhead.guard import Guard

FLAGS = (*STRICT, "-fno-semantic-interposition")  # a board has no shared libraries
LIMIT = "ratio ≤ 1.1"
AXIS = """#include "{name}.c"
void run(const void *unused, ptrdiff_t n, const double *t, const double *level, const double *rate, double period,
         {name}_report *out)
{{
    (void)unused;
    {name} filter;
    {name}_init(&filter, level[0]);
    for (ptrdiff_t i = 1; i < n; i++) {name}_update(&filter, level[i], rate[i], t[i] - t[i - 1], period, out + i);
}}
"""
IMU = """#include "{name}.c"
static void taken(const double *from, {real} *to)
{{
    for (int k = 0; k < 3; k++) to[k] = ({real})from[k];
}}
void run(const void *unused, ptrdiff_t n, const double *t, const double *gyr, const double *acc, const double *mag,
         double *quat, double *bias)
{{
    (void)unused;
    static {name} filter;
    {name}_init(&filter);
    for (ptrdiff_t i = 0; i < n; i++) {{
        {real} g[3], a[3], m[3];
        taken(gyr + 3 * i, g), taken(acc + 3 * i, a), taken(mag ? mag + 3 * i : acc, m);
        {name}_update(&filter, g, a, mag ? m : 0, ({real})(i ? t[i] - t[i - 1] : 0.01));
        const {name}_output out = {name}_read(&filter);
        quat[4 * i] = out.quat.w, quat[4 * i + 1] = out.quat.x, quat[4 * i + 2] = out.quat.y;
        quat[4 * i + 3] = out.quat.z;
        bias[3 * i] = out.bias.x, bias[3 * i + 1] = out.bias.y, bias[3 * i + 2] = out.bias.z;
    }}
}}
"""


def exported(config: ExportConfig) -> Any:
    """The exported filter in a loop, with the signature of the yardstick."""
    with tempfile.TemporaryDirectory() as name:
        write(config, Path(name))
        loop = (AXIS if config.axis else IMU).format(name=config.name, real=config.real)
        (Path(name) / "run.c").write_text("#include <stddef.h>\n" + loop, encoding="utf-8")
        return build("run.c", FLAGS, Path(name))


def attitude_run(config: ExportConfig) -> Any:
    """The exported filter of an IMU: run(None, n, t, gyr, acc, mag or None, quat, bias)."""
    run = exported(config)
    run.argtypes = [ctypes.c_void_p, ctypes.c_ssize_t, *[ctypes.POINTER(ctypes.c_double)] * 6]
    return run


def axis_table(params: Any, source: str, samples: int, repeats: int) -> Table:
    """One axis on the circle of 360°."""
    data = axis(samples)
    t, level, rate = data
    _, flt, driver = bind_axis(filters.of(params))
    width = len(flt.report._fields)  # type: ignore[attr-defined]
    outs = [np.zeros(samples * width) for _ in range(3)]
    hand, generated = build(source), exported(ExportConfig(params, axis=True))
    machine, state = compile_kernel(driver), flt.init(params, float(level[0]))
    arguments = (samples, *map(doubles, data), 360.0)
    name = type(params).__name__
    by_hand, by_export, by_numba = time_interleaved(
        [
            Case("C by hand", lambda: hand(ctypes.byref(c_params(params)), *arguments, doubles(outs[0])), samples),
            Case(f"{name}, exported", lambda: generated(None, *arguments, doubles(outs[1])), samples),
            Case(f"{name}, driver alone", lambda: machine(params, state, t, level, rate, 360.0, outs[2]), samples),
        ],
        repeats,
    )
    same = all(np.array_equal(outs[0][width:].view(np.int64), out[width:].view(np.int64)) for out in outs[1:])
    return Table(
        f"{name}, one axis, {samples:,} samples",
        COLUMNS,
        [row(by_hand), row(by_export, by_hand, LIMIT), row(by_numba, by_hand)],
        f"gcc {' '.join(STRICT)}. The exported update also looks whether dt, level and rate are numbers. "
        f"Bits {'the same' if same else 'DIFFERENT'}.",
    )


def imu_table(params: Any, mag: bool, samples: int, repeats: int) -> Table:
    """An IMU without the guard, which the yardstick does not have either."""
    recording = made(samples, mag=mag)
    flt = filters.of(params)
    hand, generated = c_run(flt.name), attitude_run(ExportConfig(params, None))
    field = None if recording.mag is None else np.ascontiguousarray(recording.mag)
    inputs = [np.ascontiguousarray(array) for array in (recording.t, recording.gyr, recording.acc)]
    quats, biases = [np.empty((samples, 4)) for _ in range(2)], [np.empty((samples, 3)) for _ in range(2)]
    quats[0][0] = lh.fuse(recording[:1], params, guard=None, engine="python").quat[0]
    at = [*map(doubles, inputs), None if field is None else doubles(field)]
    driver = bind(flt, False)
    settings = Settings(params, Guard())
    machine, begin = compile_kernel(driver.run), driver.begin(settings)
    outs = [np.empty(k * samples) for k in (4, 3, 3)] + [np.empty(samples, np.int64)]
    flat = [*(array.ravel() for array in inputs), np.empty(0) if field is None else field.ravel()]
    by_hand, by_export, by_numba = time_interleaved(
        [
            Case(
                "C by hand",
                lambda: hand(attitude_params(params), samples, *at, doubles(quats[0]), doubles(biases[0])),
                samples,
            ),
            Case(
                f"{flt.name}, exported",
                lambda: generated(None, samples, *at, doubles(quats[1]), doubles(biases[1])),
                samples,
            ),
            Case(
                f"{flt.name}, driver alone",
                lambda: machine(settings, begin, flat[0][0] - 0.01, *flat, *outs),
                samples,
            ),
        ],
        repeats,
    )
    same = np.array_equal(quats[0], quats[1])
    return Table(
        f"{flt.name}, {'9-D' if mag else '6-D'}, {samples:,} samples",
        COLUMNS,
        [row(by_hand), row(by_export, by_hand), row(by_numba, by_hand)],
        "No guard. By hand neither missing readings nor sigma are looked after; the exported filter and the driver do "
        f"both. Quaternions {'the same, to the bit' if same else 'DIFFERENT'}.",
    )


def tables(samples: int, repeats: int) -> Iterator[Table]:
    """One axis, then whole IMUs."""
    for one, source in ((lh.Kalman(), "kalman.c"), (lh.Complementary(), "complementary.c")):
        yield axis_table(one, source, samples, repeats)
    for params in (lh.Mahony(), lh.Madgwick()):
        for mag in (False, True):
            yield imu_table(params, mag, samples, repeats)


def main() -> None:
    """Run all of it."""
    parser = options(__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000, help="samples of the batch (default 1,000,000)")
    given = parser.parse_args()
    show(list(tables(given.samples, given.repeats)), given.json)


if __name__ == "__main__":
    main()
