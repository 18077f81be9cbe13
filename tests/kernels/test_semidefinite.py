"""Semidefinite systems against NumPy."""

import numpy as np
import pytest

from levelhead.kernels.semidefinite import factor, solve


def system(rng, n, unknown=()):
    """A positive semidefinite matrix in which some rows and columns are zero."""
    root = rng.normal(size=(n, n + 2))
    root[list(unknown)] = 0.0
    return root @ root.T


@pytest.mark.parametrize("unknown", [(), (0,), (2, 5), (6,)])
def test_solution_in_the_space_that_is_known(unknown):
    rng = np.random.default_rng(1)
    a, b = system(rng, 7, unknown), rng.normal(size=(7, 3))
    low, x = np.zeros((7, 9)), np.zeros((7, 9))
    low[:, :7], x[:, :3] = a, b
    low, x = low.ravel().tolist(), x.ravel().tolist()
    factor(low, 9, 7)
    solve(low, 9, 7, x, 3)
    lower = np.tril(np.reshape(low, (7, 9))[:, :7])
    np.testing.assert_allclose(lower @ lower.T, a, atol=1e-12)
    np.testing.assert_allclose(np.reshape(x, (7, 9))[:, :3], np.linalg.pinv(a) @ b, atol=1e-10)


def test_a_direction_without_doubt_is_left_out():
    """Rank 1: the second pivot is zero to working precision, and no infinity comes of it."""
    low, x = [4.0, 2.0, 2.0, 1.0], [2.0, 0.0, 1.0, 0.0]
    factor(low, 2, 2)
    solve(low, 2, 2, x, 1)
    np.testing.assert_allclose(np.array([[4.0, 2.0], [2.0, 1.0]]) @ [x[0], x[2]], [2.0, 1.0])
