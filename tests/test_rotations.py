"""Arrays of quaternions against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from levelhead import rotations
from levelhead.kernels import quat as kernel

A = Rotation.random(40, random_state=1)
B = Rotation.random(40, random_state=2)


def wxyz(rotation):
    return rotation.as_quat(scalar_first=True)


def assert_same(quat, rotation):
    """Up to the sign."""
    quat, wanted = np.atleast_2d(quat), np.atleast_2d(wxyz(rotation))
    np.testing.assert_allclose(np.abs(np.sum(quat * wanted, axis=1)), 1.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1.0, atol=1e-14)


def test_products_of_rows_and_constants():
    a, b = wxyz(A), wxyz(B)
    assert_same(rotations.product(a, b), A * B)
    assert_same(rotations.product(a[0], b, a[1]), A[0] * B * A[1])
    assert rotations.product(a[0], b[0]).shape == (1, 4)
    assert_same(rotations.relative_rotation(a, b), A.inv() * B)


def test_rows_are_what_the_kernel_of_one_sample_gives():
    a, b = wxyz(A), wxyz(B)
    rows = [kernel.multiply(kernel.Quat(*p), kernel.Quat(*q)) for p, q in zip(a.tolist(), b.tolist(), strict=True)]
    np.testing.assert_allclose(rotations.product(a, b), rows, atol=1e-15)


def test_vectors_and_matrices():
    vectors = np.random.default_rng(0).normal(size=(40, 3))
    np.testing.assert_allclose(rotations.rotate(wxyz(A), vectors), A.apply(vectors), atol=1e-14)
    np.testing.assert_allclose(rotations.rotate(wxyz(A), vectors[0]), A.apply(vectors[0]), atol=1e-14)
    np.testing.assert_allclose(rotations.matrix(wxyz(A)), A.as_matrix(), atol=1e-14)


def test_angles_of_either_sign():
    up = A.apply([0.0, 0.0, 1.0])[:, 2]
    for sign in (1.0, -1.0):
        np.testing.assert_allclose(rotations.angle(sign * wxyz(A)), A.magnitude(), atol=1e-14)
        np.testing.assert_allclose(rotations.tilt(sign * wxyz(A)), np.arccos(up), atol=1e-7)


def test_heading_turns_about_the_vertical_of_the_earth():
    assert_same(rotations.turn_heading(wxyz(A), 0.7), Rotation.from_euler("z", 0.7) * A)


def test_mean_weighs_and_ignores_signs():
    near = Rotation.from_rotvec(0.05 * np.random.default_rng(3).normal(size=(40, 3))) * A[0]
    signs = np.where(np.arange(40) % 2, -1.0, 1.0)[:, None]
    weights = np.linspace(0.0, 2.0, 40)
    assert_same(rotations.mean(signs * wxyz(near)), near.mean())
    assert_same(rotations.mean(signs * wxyz(near), weights), near.mean(weights))


def test_the_nearest_rotation_solves_wahbas_problem():
    a = np.random.default_rng(4).normal(size=(50, 3))
    b = A[0].apply(a) + 0.01 * np.random.default_rng(5).normal(size=(50, 3))
    wanted, _ = Rotation.align_vectors(b, a)
    np.testing.assert_allclose(rotations.nearest_rotation(b.T @ a), wanted.as_matrix(), atol=1e-12)
    flat = a * [1.0, 1.0, 0.0]  # of a plane, where the nearest orthogonal matrix may be a mirror
    assert np.linalg.det(rotations.nearest_rotation(-A[0].apply(flat).T @ flat)) == pytest.approx(1.0)


def test_vectors_matrices_and_frames_to_quaternions():
    assert_same(rotations.from_rotvec(A[0].as_rotvec()), A[0])
    assert_same(rotations.from_matrix(A[0].as_matrix()), A[0])
    np.testing.assert_allclose(rotations.rotvec(wxyz(A)), A.as_rotvec(), atol=1e-14)
    x, y, z = np.eye(3)
    frames = {"NED_TO_ENU": (y, x, -z), "NWU_TO_ENU": (y, -x, z), "FRD_TO_FLU": (x, -y, -z)}
    for name, axes in frames.items():
        for axis, wanted in zip(np.eye(3), axes, strict=True):
            np.testing.assert_allclose(rotations.rotate(getattr(rotations, name)[None], axis)[0], wanted, atol=1e-15)
