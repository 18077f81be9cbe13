"""The language of kernels, piece by piece: what it means in C, and what is refused, with file and line."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.c_kernel import called, translated

from levelhead import filters
from levelhead.compiler.mark import instance, kernel
from levelhead.errors import LevelheadError
from levelhead.export import ExportConfig, files
from levelhead.export.graph import FLOAT, INT
from levelhead.guard import Guard
from levelhead.kernels.vec3 import Vec3

GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
N = 4
HALF = 0.5  # of everything


class Pair(NamedTuple):
    """Two numbers."""

    first: float  # the one
    second: float


class Grown(NamedTuple):
    """What a filter with a large covariance carries: arrays, made once and written in place."""

    p: Any
    row: Any
    total: float


class Big(NamedTuple):
    """Too large to be handed over by value."""

    a: Vec3
    b: Vec3
    c: Vec3
    d: Vec3


@kernel
def arithmetic(a: float, b: float) -> float:
    return (a - (b - 2.0 * a)) / (1.0 + a * a) - -b * HALF


@kernel
def decided(a: float, b: float) -> float:
    if not a < b <= 3.0 or (a == 1.0 and b != 2.0):
        found = a if a > 0.0 else -a
    elif a > -2.0:
        found = b
    else:
        a, b = b, a
        found = a - b
    return found


@kernel
def counted(a: float, n: int) -> float:
    total = 0.0
    for i in range(2, 20, 3):
        for j in range(i):
            if j >= n:
                total += a * i
        total -= 1
    for i in range(5, 0, -2):
        total *= i
    return total


@kernel
def bits(n: int, m: int) -> int:
    flags = 1 | 4
    if n & flags:
        flags |= m
    return flags - (n & 2) + max(n, m, 3) - min(n, m) + abs(n)


@kernel
def extremes(a: float, b: float) -> Pair:
    return Pair(second=max(a, b, 0.5), first=min(a, b, abs(a)))


@kernel
def several(a: float, b: float) -> float:
    pair = extremes(a, b)
    x, y = pair
    first, _ = extremes(y, x)
    (p, q), z = Pair(x, y), b
    return first * 3.0 + pair[1] - x + p * z - q


@kernel
def swapped(a: float, b: float):
    for _ in range(3):
        a, b = b, a + b
    return a, b * 1.0


@kernel
def unbundled(a: float, b: float) -> float:
    u, v = swapped(a, b)
    return u - 2.0 * v


@kernel
def summed(big: Big, a: float) -> float:
    first, _, c, _ = big
    x, y, z = c
    return first.x + x * y - z * a


@kernel
def enlarged(a: float, b: float) -> float:
    big = Big(Vec3(a, b, 1.0), Vec3(b, a, 2.0), Vec3(a, a, b), Vec3(1.0, 2.0, 3.0))
    if a > 0.0:
        big = Big(big.b, big.a, big.d, big.c)
    return summed(big, a) + summed(Big(big.d, big.c, big.b, big.a), b)


class Bigger(NamedTuple):
    """Two of them."""

    left: Big
    right: Big
    count: float


@kernel
def bigger(a: float, b: float) -> Bigger:
    u, v = Vec3(a, b, 1.0), Vec3(b, 2.0, a)
    return Bigger(Big(u, v, u, v), Big(v, v, u, u), a)


@kernel
def wandering(a: float, b: float) -> float:
    """A large part of one thing, then of another: no copies are needed, but for what changes from turn to turn."""
    first = bigger(a, b)
    big, _, total = first
    if a > b:
        second = bigger(b, a)
        big = second.right
        total += summed(big, 1.0)
    else:
        _, big, _ = bigger(total, b)
    kept = first.left
    for i in range(4):
        turn = bigger(a + i, b)
        total += summed(kept, b)
        kept = turn.right
    last = first.left
    for i in range(3):
        total += summed(last, a) * i
        last = first.right
    return total + summed(big, 2.0) + summed(kept, 3.0) + turn.count


@kernel
def same(big: Big, a: float) -> Big:
    """Nothing is done: in C the address comes back."""
    return big


@kernel
def rolled(big: Big, a: float) -> Big:
    return Big(big.b, big.c, big.d, Vec3(a, big.a.x + 1.0, a))


@kernel
def passed_on(a: float, b: float) -> float:
    """What calls give to one variable, over and over, while others keep what it was."""
    first = bigger(a, b)
    big = first.left
    total = 0.0
    for i in range(5):
        kept = big
        other = same(big, a)
        if a * i > b:
            big = rolled(big, a)
            big = rolled(big, b)
        elif a > 0.0:
            big = same(big, b)
        else:
            big = Big(big.d, big.a, big.b, big.c)
        total += summed(big, 1.0) + 3.0 * summed(kept, a) + 5.0 * summed(other, b) * i
        other = same(kept, b)
        big = rolled(big, total)
        total += summed(other, 0.5) + same(big, a).b.y
    last = rolled(big, a)
    big = same(last, b)
    return total + summed(big, 2.0) + summed(first.left, 3.0) + last.d.x


@kernel
def made(a: float) -> Grown:
    p = np.empty((N, N))
    for i in range(N):
        for j in range(N):
            p[i, j] = a if i == j else 0.0
    return Grown(p, np.zeros(N), 0.0)


@kernel
def grown(state: Grown, a: float) -> Grown:
    p, row, total = state
    for i in range(N):
        row[i] += p[i, i] * a
        for j in range(i + 1, N):
            p[i, j] = p[j, i] = row[i] - i * a
    for i in range(N):
        total += p[i][N - 1]
    return Grown(p, row, total)


@kernel
def both(a: float, b: float) -> Pair:
    """Arrays are where they are: what a callee writes is seen by all."""
    state = grown(made(a), b)
    state = grown(state, a)
    p = state.p
    return Pair(state.total, p[0, 3] + state.row[2])


@kernel
def to_n(a: float) -> float:
    total = 0.0
    for _ in range(N):
        total += a
    return total


to_seven = instance(to_n, "to_seven", N=7)


@kernel
def instances(a: float, b: float) -> float:
    """A kernel and an instance of it with another constant."""
    return to_n(a) + to_seven(b)


RNG = np.random.default_rng(0)
FLOATS = [(1.0, 2.0), (2.0, 1.0), (-3.0, 3.0), (-1.0, 4.0), (0.0, -0.0), *RNG.normal(0, 3, (20, 2)).tolist()]


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize(
    "function",
    [arithmetic, decided, extremes, several, unbundled, enlarged, wandering, passed_on, both, instances],
    ids=lambda f: f.__name__,
)
def test_it_means_the_same_in_c(function):
    run = called(function, [FLOAT, FLOAT])
    for a, b in FLOATS:
        wanted = function(a, b)
        found = run(a, b)
        assert repr(found) == repr(tuple(map(float, wanted)) if isinstance(wanted, tuple) else float(wanted))


@pytest.mark.compiled
@GCC
def test_whole_numbers_and_loops():
    run, flags = called(counted, [FLOAT, INT]), called(bits, [INT, INT])
    for n in range(-3, 25):
        assert run(0.1, n) == counted(0.1, n)
        assert flags(n, 7 - n) == bits(n, 7 - n)


def test_what_is_written_for_people_is_kept():
    """Docstrings, names of constants and the order of operations that somebody thought of."""
    _, _, text = translated(both, FLOAT, FLOAT)
    assert "/* Arrays are where they are: what a callee writes is seen by all. */" in text
    assert "double p[4][4];" in text and "double row[4];" in text
    assert "row[i] = row[i] + p[i][i] * " in text
    _, _, text = translated(arithmetic, FLOAT, FLOAT)
    assert "static const double TEST_LANGUAGE_HALF = 0.5; /* of everything */" in text
    assert "return (a - (b - 2.0 * a)) / (1.0 + a * a) - -b * TEST_LANGUAGE_HALF;" in text


def refused(function, *kinds):
    with pytest.raises(LevelheadError) as caught:
        translated(function, *kinds)
    said = str(caught.value)
    line = function.__code__.co_firstlineno
    where, _, words = said.partition(": ")
    path, _, number = where.rpartition(":")
    assert path == __file__ and line <= int(number) <= line + 8, said
    return int(number) - line, words


@kernel
def power(a: float) -> float:
    b = a + 1.0
    return b**2


@kernel
def listed(a: float) -> float:
    return sum([a, a])


@kernel
def endless(a: float) -> float:
    while a > 0.0:
        a -= 1.0
    return a


@kernel
def over_values(a: Vec3) -> float:
    total = 0.0
    for x in a:
        total += x
    return total


@kernel
def two_kinds(a: float) -> float:
    b = Vec3(a, a, a)
    if a > 0.0:
        b = a
    return a + b.x


@kernel
def recursive(a: float) -> float:
    return recursive(a - 1.0) if a > 0.0 else a


@kernel
def texts(a: float) -> float:
    word = "text"
    return a if word else 0.0


@kernel
def unknown(a: float) -> float:
    return np.sin(a)


@kernel
def too_few(a: float) -> Vec3:
    return Vec3(a, a)


@kernel
def sized(a: float, n: int) -> float:
    p = np.empty(n)
    return p[0] + a


@kernel
def behind_the_loop(a: float) -> float:
    for i in range(3):
        a += i
    return a + i


@kernel
def no_such_field(a: Vec3) -> float:
    return a.w


REFUSED = [
    (power, [FLOAT], 3, "Pow"),
    (listed, [FLOAT], 2, "sum is not a kernel"),
    (endless, [FLOAT], 2, "While is outside of the kernel language"),
    (over_values, [Vec3], 3, "a loop over something else than range"),
    (two_kinds, [FLOAT], 4, "b is Vec3 before and float here"),
    (texts, [FLOAT], 2, "'text' is not a number"),
    (unknown, [FLOAT], 2, "np.sin is not a kernel"),
    (too_few, [FLOAT], 2, "Vec3 has 3 fields, each to be given once"),
    (sized, [FLOAT, INT], 2, "the shape n is not made of constants"),
    (behind_the_loop, [FLOAT], 4, "i has no value here"),
    (no_such_field, [Vec3], 2, "Vec3 has no w"),
]


@pytest.mark.parametrize("function, kinds, line, words", REFUSED, ids=lambda value: getattr(value, "__name__", ""))
def test_what_is_outside_of_the_language_is_refused_with_file_and_line(function, kinds, line, words):
    at, said = refused(function, *kinds)
    assert words in said and at == line


def test_a_kernel_that_calls_itself_is_refused():
    assert "calls itself" in refused(recursive, FLOAT)[1]


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
@pytest.mark.parametrize("real", ["double", "float"])
def test_every_filter_is_inside_of_the_language(flt, real):
    """The guard of the language: a kernel that cannot be translated fails here, with its file and line."""
    for axis in (False, True) if flt.axis else (False,):
        for guard in (Guard(), None):
            written = files(ExportConfig(flt.params(), guard, real, axis))
            assert all(text.isprintable() or "\n" in text for text in written.values())
            source = next(text for name, text in written.items() if name.endswith(".c") and "selftest" not in name)
            assert "malloc" not in source and f"static {'double' if real == 'float' else 'float'}" not in source
