"""Compiled twins: same bits, wrong sizes refused at compile time, a cache that is never stale and never crashes."""

import sys
import textwrap
import types

import numpy as np
import pytest

from levelhead.compiler import cache, mark
from levelhead.compiler import compile as jit
from levelhead.kernels import arrays, mat2, mat3, quat
from levelhead.kernels.mat2 import Mat2
from levelhead.kernels.mat3 import Mat3
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3

pytestmark = pytest.mark.compiled


@mark.kernel
def _mixture(a: Mat3, v: Vec3, q: Quat) -> Vec3:
    return quat.rotate(q, mat3.apply(mat3.inverse(mat3.mul(a, mat3.transpose(a))).matrix, v))


def test_compiled_gives_the_same_bits():
    arguments = (
        Mat3(2.0, 0.1, 0.3, -0.4, 3.0, 0.7, 0.2, -0.1, 1.7),
        Vec3(0.3, -1.1, 2.0),
        quat.exp(Vec3(0.1, 2.0, -0.3)),
    )
    assert jit.compile_kernel(_mixture)(*arguments) == _mixture(*arguments)


@mark.kernel
def _sum_of_different_sizes(a: Mat2, b: Mat3) -> Mat2:
    return mat2.add(a, b)  # type: ignore[arg-type]


@mark.kernel
def _three_by_three_of_a_vector(v: Vec3) -> Mat3:
    return mat3.transpose(v)  # type: ignore[arg-type]


def test_wrong_sizes_fail_when_compiled():
    import numba

    two, three, v = Mat2(1.0, 0.0, 0.0, 1.0), Mat3(*map(float, range(9))), Vec3(1.0, 2.0, 3.0)
    with pytest.raises(numba.core.errors.TypingError):
        jit.compile_kernel(_three_by_three_of_a_vector).compile((numba.typeof(v),))
    with pytest.raises(numba.core.errors.TypingError):
        jit.compile_kernel(_mixture).compile((numba.typeof(two), numba.typeof(v), numba.typeof(quat.IDENTITY)))
    assert mat3.transpose(three) == Mat3(0.0, 3.0, 6.0, 1.0, 4.0, 7.0, 2.0, 5.0, 8.0)


def test_the_hash_follows_every_kernel_that_is_reached(tmp_path, monkeypatch):
    def load(name, text):
        """Executed from its text: an import would take the byte code of a version written within the same second."""
        path = tmp_path / f"{name}.py"
        path.write_text(textwrap.dedent(text))
        module = types.ModuleType(name)
        monkeypatch.setitem(sys.modules, name, module)
        exec(compile(path.read_text(), str(path), "exec"), module.__dict__)
        return module

    callee = "from levelhead.compiler.mark import kernel\n\n@kernel\ndef inner(x):\n    return x + {}\n"
    outer = """
        import lh_test_callee
        from levelhead.compiler.mark import kernel

        @kernel
        def outer(x):
            return lh_test_callee.inner(x)
    """
    load("lh_test_callee", callee.format(1.0))
    before = jit.code_hash(load("lh_test_outer", outer).outer)
    load("lh_test_callee", callee.format(2.0))
    edited = load("lh_test_outer", outer).outer
    assert jit.code_hash(edited) != before
    assert jit.compile_kernel(edited)(1.0) == 3.0


@mark.kernel
def _less(x: float) -> float:
    return x - 1.0


@mark.kernel
def _double(x: float) -> float:
    return x + x


@mark.kernel
def _less_than_double(x: float) -> float:
    return _less(_double(x))


def test_the_hash_follows_which_kernel_calls_which():
    """Two copies that call the same two kernels the other way round are other code, made of the same parts."""
    one = mark.copy_kernel(_less_than_double, {"_less": _less, "_double": _double})
    two = mark.copy_kernel(_less_than_double, {"_less": _double, "_double": _less})
    assert (one(3.0), two(3.0)) == (5.0, 4.0)
    assert jit.code_hash(one) != jit.code_hash(two)
    assert jit.code_hash(one) == jit.code_hash(_less_than_double)


def test_the_hash_holds_no_address():
    """A nested code object and a set are constants whose ``repr`` differs between processes."""
    text = "def f(x):\n    return [y in {'a', 'b', 'c'} for y in x]\n"
    copies = []
    for _ in range(2):
        module = types.ModuleType("lh_test_nested")
        exec(compile(text, "nested.py", "exec"), module.__dict__)
        copies.append(mark.kernel(module.f))
    assert jit.code_hash(copies[0]) == jit.code_hash(copies[1])
    assert "0x" not in cache.fingerprint(copies[0])


@mark.kernel
def added(m, to, weight, at, count):
    arrays.add_scaled(m, to, weight, at, count)


@pytest.mark.parametrize("count", range(11))
def test_what_is_compiled_by_hand_rounds_as_the_kernel_does_and_keeps_within_its_bounds(count):
    before = np.random.default_rng(count).normal(size=40)
    plain, fast = before.tolist(), before.copy()
    arrays.add_scaled(plain, 3, -0.1, 20, count)
    jit.compile_kernel(added)(fast, 3, -0.1, 20, count)
    np.testing.assert_array_equal(fast, plain)
    expected = before.copy()
    expected[3 : 3 + count] += -0.1 * before[20 : 20 + count]
    np.testing.assert_array_equal(plain, expected)


WIDTH = 28  # a constant, so that registers hold the row
UNEVEN = 27


@mark.kernel
def subtracted(m, to, weight, step, row, stride, count):
    arrays.subtract_rows(m, to, weight, step, row, stride, count, WIDTH)


@mark.kernel
def subtracted_uneven(m, to, weight, step, row, stride, count):
    arrays.subtract_rows(m, to, weight, step, row, stride, count, UNEVEN)


@mark.kernel
def subtracted_as_wide(m, to, weight, step, row, stride, count, width):
    arrays.subtract_rows(m, to, weight, step, row, stride, count, width)


@pytest.mark.parametrize(
    ("kernel", "width", "more"),
    [
        (subtracted, WIDTH, ()),
        (subtracted_uneven, UNEVEN, ()),
        (subtracted_as_wide, WIDTH, (WIDTH,)),
        (subtracted_as_wide, UNEVEN, (UNEVEN,)),
    ],
)
@pytest.mark.parametrize("step", [1, 30])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_rows_are_subtracted_with_the_same_bits_and_within_their_bounds(step, count, kernel, width, more):
    before = np.random.default_rng(count).normal(size=400)
    plain, fast, meant = before.tolist(), before.copy(), before.tolist()
    place = (7, 250, step, 60, 30, count)
    arrays.subtract_rows(plain, *place, width)
    arrays.subtract_each_row(meant, *place, width)
    jit.compile_kernel(kernel)(fast, *place, *more)
    assert plain == fast.tolist() == meant
    rows = before[60 : 60 + 30 * count].reshape(count, 30)[:, :width]
    expected = before.copy()
    expected[7 : 7 + width] -= before[250 : 250 + step * count : step] @ rows
    np.testing.assert_allclose(plain, expected, atol=1e-14)


@mark.kernel
def copied(m, to, at, count):
    arrays.copy(m, to, at, count)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_copying_keeps_within_its_bounds(count):
    plain = [float(i) for i in range(20)]
    fast = np.array(plain)
    arrays.copy(plain, 3, 11, count)
    jit.compile_kernel(copied)(fast, 3, 11, count)
    assert plain == fast.tolist() == [*range(3), *range(11, 11 + count), *range(3 + count, 20)]
