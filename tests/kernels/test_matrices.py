"""The small matrices against NumPy."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from levelhead.kernels import mat2, mat3
from levelhead.kernels.vec3 import Vec3

NUMBER = st.floats(-1e3, 1e3, allow_subnormal=False)
CASES = [(mat2, mat2.Mat2, mat2.Vec2, 2), (mat3, mat3.Mat3, Vec3, 3)]
SIZES = pytest.mark.parametrize(("module", "matrix", "vector", "n"), CASES, ids=["2x2", "3x3"])


def full(m, n):
    return np.array(m).reshape(n, n)


@SIZES
@given(data=st.data())
def test_products_sums_transpose_and_determinant(module, matrix, vector, n, data):
    a, b = (matrix(*data.draw(st.tuples(*[NUMBER] * n**2))) for _ in range(2))
    v = vector(*data.draw(st.tuples(*[NUMBER] * n)))
    A, B = full(a, n), full(b, n)
    scale = 1e-12 * (1.0 + np.abs(A).max()) * (1.0 + np.abs(B).max())
    np.testing.assert_allclose(full(module.mul(a, b), n), A @ B, atol=scale)
    np.testing.assert_array_equal(full(module.add(a, b), n), A + B)
    np.testing.assert_array_equal(full(module.sub(a, b), n), A - B)
    np.testing.assert_array_equal(full(module.transpose(a), n), A.T)
    np.testing.assert_allclose(module.apply(a, v), A @ np.array(v), atol=1e-12 * (1 + np.abs(A).max()) * 1e3)
    assert module.det(a) == pytest.approx(np.linalg.det(A), abs=1e-11 * (1.0 + np.abs(A).max()) ** n)


@SIZES
@given(data=st.data())
def test_inverse_of_a_well_conditioned_matrix(module, matrix, vector, n, data):
    a = matrix(*data.draw(st.tuples(*[NUMBER] * n**2)))
    A = full(a, n)
    assume(np.abs(A).max() > 1e-3 and np.linalg.cond(A) < 1e5)
    inverse = module.inverse(a)
    assert inverse.ok
    np.testing.assert_allclose(full(inverse.matrix, n) @ A, np.eye(n), atol=1e-7)


@SIZES
@given(data=st.data())
def test_a_singular_matrix_is_reported_and_never_divided_through(module, matrix, vector, n, data):
    row = data.draw(st.tuples(*[st.integers(-50, 50)] * n))
    factors = data.draw(st.tuples(*[st.integers(-5, 5)] * n))
    a = matrix(*(float(f * x) for f in factors for x in row))  # rank one
    inverse = module.inverse(a)
    assert not inverse.ok
    assert all(x == 0.0 for x in inverse.matrix)


def test_zero_matrix_and_nearly_singular_matrix():
    assert not mat2.inverse(mat2.Mat2(0.0, 0.0, 0.0, 0.0)).ok
    assert not mat3.inverse(mat3.Mat3(*([0.0] * 9))).ok
    assert not mat2.inverse(mat2.Mat2(1.0, 1.0, 1.0, 1.0 + 1e-15)).ok
    assert mat2.inverse(mat2.Mat2(1e-200, 0.0, 0.0, 1e-100)).ok, "small is not singular"
