"""Attitude filters against hand-written C: batch, with and without magnetometer, and whether the bits are the same."""

import ctypes
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from benchmarks.measure import options, show
from benchmarks.speed.one_axis import COLUMNS, row
from tests.reference.c_library import build, doubles

import levelhead as lh
from levelhead import filters
from levelhead.bench.inputs import imu_recording as made
from levelhead.bench.timing import Case, Table, time_interleaved
from levelhead.compiler.compile import compile_kernel
from levelhead.engine.binding import bind
from levelhead.engine.driver import Settings
from levelhead.guard import Guard

SOURCES = {"Mahony": ("mahony.c", ("kp", "ki", "k_mag", "max_bias")), "Madgwick": ("madgwick.c", ("beta", "zeta"))}
LIMIT = "ratio ≤ 1.2"


def c_run(name: str) -> Any:
    """The function ``run`` of the filter's C twin: run(params, n, t, gyr, acc, mag or NULL, quat, bias)."""
    run = build(SOURCES[name][0])
    pointer = ctypes.POINTER(ctypes.c_double)
    run.argtypes = [ctypes.c_void_p, ctypes.c_ssize_t, *[pointer] * 6]
    return run


def c_params(params: Any) -> Any:
    """A filter's parameters as its C twin takes them: doubles in a row."""
    names = SOURCES[type(params).__name__][1]
    return (ctypes.c_double * len(names))(*(getattr(params, name) for name in names))


def table(params: Any, recording: lh.Recording, repeats: int) -> Table:
    """C, the driver alone into the same kind of memory, and the public call, on one recording."""
    n = len(recording)
    flt = filters.of(params)
    start = lh.fuse(recording, params, engine="compiled", guard=None).quat[0]
    run, c_arguments = c_run(flt.name), c_params(params)
    mag = None if recording.mag is None else np.ascontiguousarray(recording.mag)
    inputs = [np.ascontiguousarray(array) for array in (recording.t, recording.gyr, recording.acc)]
    quat, bias = np.empty((n, 4)), np.empty((n, 3))
    quat[0] = start
    outs = [np.empty(4 * n), np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64)]
    driver = bind(flt, False)
    settings = Settings(params, Guard())
    machine, begin = compile_kernel(driver.run), driver.begin(settings)
    flat: Sequence[Any] = [array.ravel() for array in (*inputs, np.empty(0) if mag is None else mag)]

    def c() -> None:
        run(c_arguments, n, *map(doubles, inputs), None if mag is None else doubles(mag), doubles(quat), doubles(bias))

    six = "6-D" if mag is None else "9-D"
    hand, alone, public = time_interleaved(
        [
            Case("C -O3", c, n),
            Case(f"{flt.name}, driver alone", lambda: machine(settings, begin, flat[0][0] - 0.01, *flat, *outs), n),
            Case(f"fuse, {flt.name}", lambda: lh.fuse(recording, params, engine="compiled", guard=None), n),
        ],
        repeats,
    )
    same = np.array_equal(lh.fuse(recording, params, engine="compiled", guard=None).quat, quat)
    return Table(
        f"{flt.name}, {six}, {n:,} samples",
        COLUMNS,
        [row(hand), row(alone, hand, LIMIT), row(public, hand)],
        "No guard on either side. C looks for neither NaN nor a first sample, and writes quaternion and bias; "
        "levelhead also σ and health. "
        f"Quaternions {'the same, to the bit' if same else 'DIFFERENT'}.",
    )


def tables(samples: int, repeats: int) -> Iterator[Table]:
    """Both filters, without and with magnetometer."""
    for params in (lh.Mahony(), lh.Madgwick()):
        for mag in (False, True):
            yield table(params, made(samples, mag=mag), repeats)


def main() -> None:
    """Run all of it."""
    parser = options(__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000, help="samples of the batch (default 1,000,000)")
    given = parser.parse_args()
    show(list(tables(given.samples, given.repeats)), given.json)


if __name__ == "__main__":
    main()
