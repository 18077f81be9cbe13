"""The loop over lanes becomes vector instructions: without them it would have the same bits, and cost several times
more."""

import platform
import re
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from levelhead.compiler import lane_slots
from levelhead.compiler.compile import OPTIONS, _copy_twin, compile_kernel
from levelhead.compiler.mark import compiled_only, with_globals
from levelhead.compiler.slots import entry_point

PACKED = {  # products of several doubles at once
    "x86_64": r"\bv?mulpd\b",
    "AMD64": r"\bv?mulpd\b",
    "aarch64": r"\bfmul[\t ].*\.2d|\bfmul\.2d",
    "arm64": r"\bfmul[\t ].*\.2d|\bfmul\.2d",
}
MACHINE = platform.machine()

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(MACHINE not in PACKED, reason=f"no name of a packed product is known for {MACHINE}"),
]

each: Any = None
load: Any = None
store: Any = None


class Pair(NamedTuple):
    """What each lane has."""

    x: float
    y: float


@compiled_only
def one_lane(at: int, lane: int, scale: float, shift: float) -> None:
    pair = load(at, lane)
    store(at, lane, Pair(pair.x * scale + shift, pair.x * pair.y))


@compiled_only
def all_lanes(at: int, scale: float, shift: float) -> None:
    each(one_lane, at, scale, shift)


@pytest.fixture(scope="module")
def functions():
    """The place of the lanes' values, and the same work on one lane and on all of them."""
    place = lane_slots.lane_rows(Pair(0.0, 0.0), 0)
    one = with_globals(one_lane, "test", load=place.load, store=place.store)
    return place, one, with_globals(all_lanes, "test", each=lane_slots.over_lanes(), one_lane=one)


def assembly(function, letters):
    """The machine code of a function for this processor as text, not from the cache."""
    dispatcher = numba.njit(**OPTIONS)(_copy_twin(function, function.__qualname__, lanes=True))
    entry_point(dispatcher, letters)
    return "\n".join(dispatcher.inspect_asm().values())


def test_a_loop_over_lanes_multiplies_several_at_once(functions):
    _, one, every = functions
    assert re.search(PACKED[MACHINE], assembly(every, "iff"))
    assert not re.search(PACKED[MACHINE], assembly(one, "iiff")), "one lane has nothing to multiply at once"


def test_that_loop_has_the_bits_of_numpy(functions):
    place, _, every = functions
    table, at = lane_slots.allocate(place.end)
    x, y = before = np.random.default_rng(1).normal(size=(2, lane_slots.LANES))
    table[:] = before
    compile_kernel(every)(at, 0.1, -3.0)
    np.testing.assert_array_equal(table, [x * 0.1 + -3.0, x * y])
