"""A filter whose state holds arrays, written in place, through the whole export: no such filter may be special."""

import ctypes
from math import inf
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.hard import assert_same, hard_recording

import levelhead as lh
from levelhead import filters
from levelhead.compiler.mark import kernel
from levelhead.export import ExportConfig, files
from levelhead.filters.contract import Filter, Output, Settling
from levelhead.filters.parameters import Param, parameters
from levelhead.kernels import quat, slerp, triad
from levelhead.kernels.quat import Quat
from levelhead.kernels.tilt import is_present
from levelhead.kernels.vec3 import ZERO, Vec3

N = 3  # errors


@parameters()
class Matrices(NamedTuple):
    """A covariance as a matrix."""

    noise: Annotated[float, Param("rad²/s", "how fast it grows", low=0.0)] = 0.01


class State(NamedTuple):
    """The attitude, its covariance, and a gain to work in."""

    quat: Quat
    p: Any  # (3, 3), rad²
    k: Any
    seen: int


@kernel
def init(params: Matrices, gyr: Vec3, acc: Vec3, mag: Vec3) -> State:
    """All of it unknown."""
    p = np.zeros((N, N))
    for i in range(N):
        p[i, i] = 0.5
    return State(triad.initial_attitude(acc, mag), p, np.empty(N), 0)


@kernel
def grow(p: Any, by: float) -> float:
    """The diagonal, in place; the trace comes back."""
    trace = 0.0
    for i in range(N):
        p[i, i] += by
        for j in range(i):
            p[i, j] = p[j, i] = 0.99 * p[j, i] + 1e-3 * by
        trace += p[i, i]
    return trace


@kernel
def step(params: Matrices, state: State, gyr: Vec3, acc: Vec3, mag: Vec3, dt: float) -> State:
    """Turn, grow, and shrink again where there is gravity."""
    attitude, p, k, seen = state
    attitude = quat.integrate(attitude, gyr, dt)
    trace = grow(p, params.noise * dt)
    if is_present(acc):
        for i in range(N):
            k[i] = p[i, 0] / (p[0, 0] + 0.1)
        for i in range(N):
            for j in range(N):
                p[i, j] -= 0.5 * k[i] * k[j] * p[0, 0]
        attitude = slerp.level(attitude, acc, k[0] / (1.0 + trace))
        seen += 1
    return State(attitude, p, k, seen)


@kernel
def output(params: Matrices, state: State) -> Output:
    """The diagonal as σ² would be too small a thing to root here."""
    return Output(state.quat, ZERO, Vec3(state.p[0, 0], state.p[1, 1], state.p[2, 1]), state.seen & 0)


FILTER = Filter(
    name="Matrices",
    params=Matrices,
    init=init,
    step=step,
    output=output,
    estimates=frozenset({"tilt", "sigma"}),
    uses=frozenset({"gyr", "acc"}),
    citation="nobody",
    settles=Settling(10.0, inf),
)


@pytest.fixture(autouse=True)
def _listed(monkeypatch):
    """One more filter in the list."""
    monkeypatch.setattr(filters, "ALL", (*filters.ALL, FILTER))


@pytest.mark.compiled
@pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
@pytest.mark.parametrize("guard", [lh.Guard(), None], ids=["guarded", "alone"])
@c_engine.EVERY_COMPILER
def test_the_same_bits(guard, compiler):
    program = c_engine.built(ExportConfig(Matrices(noise=0.02), guard), compiler)
    recording = hard_recording(True)
    found = program.fuse(recording)
    assert_same(lh.fuse(recording, Matrices(noise=0.02), guard=guard, engine="python"), found)
    assert np.ptp(found.sigma) > 0.1


@pytest.mark.compiled
@pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
def test_a_copy_has_arrays_of_its_own():
    program = c_engine.built(ExportConfig(Matrices(), None))
    one, two = (ctypes.create_string_buffer(program.size) for _ in range(2))
    readings = [(ctypes.c_double * 3)(*values) for values in ((0.1, 0.2, 0.3), (0.5, 0.1, 9.7))]

    def update(filter_):
        program.function("update")(filter_, *readings, None, ctypes.c_double(0.01))

    program.function("init")(one)
    for _ in range(5):
        update(one)
    two.raw = one.raw
    for _ in range(3):
        update(one)
    kept = bytes(one)
    for _ in range(3):
        update(two)
    update(two)
    assert bytes(one) == kept, "the copy went on without touching the first"
    update(one)
    matrix = 12 * 8  # the arrays lie at the end
    assert bytes(one)[-matrix:] == bytes(two)[-matrix:]


@pytest.mark.slow
def test_how_it_is_written():
    written = files(ExportConfig(Matrices()))
    header, source = written["lh_matrices.h"], written["lh_matrices.c"]
    assert "    double p[3][3]; /* (3, 3), rad² */\n    double k[3];" in header
    assert "0.5 * carry->run.state.k[i] * carry->run.state.k[j] * carry->run.state.p[0][0];" in source
