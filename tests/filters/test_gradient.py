"""Madgwick and Mahony against their papers' equations, written out with matrices in tests/reference/attitude.py."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.filters import madgwick, mahony
from levelhead.kernels import vector_error
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import ZERO, Vec3

sys.path.insert(0, str(Path(__file__).parents[1] / "reference"))
import attitude as paper

G = 9.80665
OLD = 1e3  # s: no start any more
ROUNDS = 200
WHOLE = lh.Mahony(kp=1.0, ki=0.0, k_mag=2.0, whole_field=True)  # sees heading with cos² of the dip only


def unit(v):
    return v / np.linalg.norm(v)


def draws(seed, largest=70.0):
    """Attitude, and unit gravity and field as a sensor up to ``largest`` degrees away (and noisy) sees them."""
    rng = np.random.default_rng(seed)
    for _ in range(ROUNDS):
        q = unit(rng.normal(size=4))
        away = Rotation.from_rotvec(unit(rng.normal(size=3)) * np.radians(rng.uniform(1.0, largest)))
        true = Rotation.from_quat(q, scalar_first=True) * away
        dip = rng.uniform(-1.2, 1.2)
        a = unit(true.inv().apply([0, 0, 1.0]) + rng.normal(0, 0.05, 3))
        m = unit(true.inv().apply([0.0, np.cos(dip), np.sin(dip)]) + rng.normal(0, 0.05, 3))
        if largest > 90.0 or (paper.rotation(q) @ m)[1] > 0.0:  # a steep field misses north by more than its error
            yield q, a, m, rng


def state(module, q, bias=(0.0, 0.0, 0.0), age=OLD):
    return module.State(Quat(*map(float, q)), Vec3(*map(float, bias)), age)


def vec(v):
    return Vec3(*map(float, v))


def test_jacobians_are_the_slopes_of_their_functions():
    h = 1e-6
    for q, a, m, _ in draws(1):
        b = paper.reference(q, m)
        for f, jacobian in (
            (lambda p, a=a: paper.f_gravity(p, a), paper.j_gravity(q)),
            (lambda p, b=b, m=m: paper.f_field(p, b, m), paper.j_field(q, b)),
        ):
            slopes = np.stack([(f(q + h * e) - f(q - h * e)) / (2 * h) for e in np.eye(4)], axis=1)
            np.testing.assert_allclose(slopes, jacobian, atol=1e-8)


def test_the_special_objectives_are_the_general_one():
    for q, a, m, _ in draws(2):
        b = paper.reference(q, m)
        np.testing.assert_allclose(paper.f_gravity(q, a), paper.f_general(q, paper.UP, a), atol=1e-14)
        np.testing.assert_allclose(paper.f_field(q, b, m), paper.f_general(q, b, m), atol=1e-14)
        np.testing.assert_allclose(paper.f_general(q, b, m), paper.rotation(q).T @ b - m, atol=1e-14)


@pytest.mark.parametrize("with_mag", [False, True], ids=["6-D", "9-D"])
def test_the_cross_products_are_the_papers_gradient(with_mag):
    """(A) of the module against Jᵀ f literally, all four components, while no angle exceeds 90°."""
    for q, a, m, _ in draws(3, largest=30.0):
        (x, y, z), scalar = madgwick.descent_direction(Quat(*q), vec(a), vec(m) if with_mag else ZERO)
        ours = paper.product(q, 2.0 * np.array([scalar, -x, -y, -z]))
        np.testing.assert_allclose(ours, paper.gradient(q, a, m if with_mag else None), atol=5e-15)


@pytest.mark.parametrize("with_mag", [False, True], ids=["6-D", "9-D"])
def test_a_madgwick_step_is_the_papers(with_mag):
    beta, dt = 0.1, 0.01
    for q, a, m, _ in draws(4, largest=30.0):
        field = vec(m * 48.0) if with_mag else ZERO
        after = madgwick.step(madgwick.Madgwick(beta=beta), state(madgwick, q), ZERO, vec(a * G), field, dt)
        g = paper.gradient(q, a, m if with_mag else None)
        radial = 1.0 - beta * dt * (g @ q) / np.linalg.norm(g)  # the paper's step also changes the length of q first
        tangent = g - (g @ q) * q
        expected = unit(q - beta * dt * tangent / np.linalg.norm(g))
        np.testing.assert_allclose(after.quat, expected, atol=1e-14)
        np.testing.assert_allclose(after.quat, paper.madgwick(q, beta, dt, a, m if with_mag else None),
                                   atol=beta * dt * abs(radial - 1.0) + 1e-14)  # fmt: skip


def test_a_madgwick_step_never_goes_uphill():
    for q, a, m, rng in draws(5, largest=175.0):
        beta, dt = 10.0 ** rng.uniform(-3, 2), 10.0 ** rng.uniform(-3, 8)
        for field in (ZERO, vec(m)):
            after = madgwick.step(madgwick.Madgwick(beta=beta), state(madgwick, q), ZERO, vec(a), field, dt)

            b = paper.reference(q, m)

            def objective(p, field=field, b=b, a=a, m=m):
                gravity = paper.f_general(p, paper.UP, a)
                magnetic = paper.f_general(p, b, m) if field != ZERO else ZERO
                return np.dot(gravity, gravity) + np.dot(magnetic, magnetic)

            away = min(paper.rotation(q)[2] @ a, paper.rotation(q)[1] @ m)
            if away > 0.0:  # beyond a right angle the pull is longer than the slope
                assert objective(np.array(after.quat)) <= objective(q) + 1e-12


def test_madgwick_learns_the_bias_of_the_paper():
    """ω_ε = 2 q* ⊗ ∇f/|∇f|, eq. (47)."""
    params = madgwick.Madgwick(beta=0.1, zeta=0.02)
    for q, a, m, _ in draws(6, largest=30.0):
        after = madgwick.step(params, state(madgwick, q), ZERO, vec(a), vec(m), 0.01)
        g = paper.gradient(q, a, m)
        error = 2.0 * paper.product(q * [1, -1, -1, -1], g / np.linalg.norm(g))[1:]
        np.testing.assert_allclose(after.bias, 0.02 * error * 0.01, atol=1e-15)


@pytest.mark.parametrize("whole", [False, True], ids=["horizontal", "whole field"])
@pytest.mark.parametrize("with_mag", [False, True], ids=["6-D", "9-D"])
def test_a_mahony_step_is_the_papers(with_mag, whole):
    kp, ki, k_mag, dt = 0.7, 0.02, 0.4, 0.01
    params = mahony.Mahony(kp=kp, ki=ki, k_mag=k_mag, whole_field=whole, max_bias=600.0)
    for q, a, m, rng in draws(7, largest=30.0):
        bias, gyr = rng.normal(0, 0.01, 3), rng.normal(0, 2.0, 3)
        field = vec(48.0 * m) if with_mag else ZERO
        after = mahony.step(params, state(mahony, q, bias), vec(gyr), vec(a * G), field, dt)
        turn = Rotation.from_rotvec((gyr - bias) * dt).as_quat(scalar_first=True)
        ahead = paper.product(q, turn)
        gravity = paper.mahony_correction(ahead, a)
        magnetic = (paper.mahony_correction(ahead, a, m, k_mag, whole) if with_mag else gravity) - gravity
        np.testing.assert_allclose(after.bias, bias - ki * dt * (gravity + magnetic), atol=1e-15)
        k = kp * dt / (1.0 + kp * dt)
        k_field = k if whole else kp * dt / (1.0 + kp * k_mag * dt)  # times k_mag, which is in the correction
        rho = k * gravity + k_field * magnetic
        expected = unit(ahead + 0.5 * paper.product(ahead, np.array([0.0, *rho])))
        np.testing.assert_allclose(after.quat, expected, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("params", [lh.Madgwick(), lh.Mahony(), WHOLE], ids=repr)
@pytest.mark.parametrize("yaw", range(-170, 181, 50))
@pytest.mark.parametrize("tilted", [(0, 0), (40, -70), (-60, 130)])
def test_heading_is_pulled_to_north_in_every_octant(params, yaw, tilted):
    """Starts 60° wrong in heading (a magnet at the first sample); the field is dipped and the sensor tilted."""
    true = Rotation.from_euler("ZYX", [yaw, *tilted], degrees=True).inv()
    n = 6000
    mag = np.tile(true.apply([0.0, 19.0, -45.0]), (n, 1))
    mag[0] = true.apply(Rotation.from_euler("z", 60, degrees=True).apply([0.0, 19.0, -45.0]))
    rec = lh.Recording(np.arange(n) / 100, np.zeros((n, 3)), np.tile(true.apply([0, 0, G]), (n, 1)), mag)
    error = lh.fuse(rec, params).as_rotation() * true
    assert np.degrees(error[0].magnitude()) == pytest.approx(60.0, abs=1e-6)
    assert np.degrees(error[-1].magnitude()) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("params", [lh.Madgwick(zeta=0.01), lh.Mahony(), lh.Mahony(whole_field=True)], ids=repr)
@pytest.mark.parametrize("dt", [1e-9, 1e-4, 0.5, 0.6, 1e3, 1e9])
def test_any_interval_is_sound(params, dt):
    module = madgwick if isinstance(params, lh.Madgwick) else mahony
    for q, a, m, rng in draws(8, largest=180.0):
        for age in (0.0, 1.0, OLD):
            current = state(module, q, age=age)
            for field in (ZERO, vec(m)):
                for force in (ZERO, vec(a * G)):
                    for _ in range(3):
                        current = module.step(params, current, vec(rng.normal(0, 1, 3)), force, field, dt)
                    assert np.isfinite([*current.quat, *current.bias, current.age]).all()
                    assert np.linalg.norm(current.quat) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("params", [lh.Madgwick(), lh.Mahony()], ids=repr)
def test_a_fault_of_180_degrees_is_forgotten_in_time(params):
    """The sensor has been turned over about an axis that its gyroscope did not see: the worst that can be wrong."""
    flt = lh.filters.of(params)
    rng = np.random.default_rng(3)
    rate, before = 100.0, 3000
    after = int(rate * max(flt.settles)) + 500
    n = before + after
    t = np.arange(n) / rate
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1]):
        for first in (Rotation.identity(), Rotation.from_euler("ZYX", [30, 20, 40], degrees=True)):
            for noise in (0.0, 0.002):
                second = first * Rotation.from_rotvec(np.pi * unit(np.array(axis, float)))
                gravity, field = (
                    np.repeat([first.inv().apply(v), second.inv().apply(v)], [before, after], axis=0)
                    + rng.normal(0, noise, (n, 3))
                    for v in ([0.0, 0.0, 1.0], [0.0, 0.39, -0.92])
                )
                for mag in (None, 50.0 * field):
                    rec = lh.Recording(t, rng.normal(0, noise, (n, 3)), G * gravity, mag)
                    error = lh.fuse(rec, params).as_rotation() * second.inv()
                    up = error.apply([0.0, 0.0, 1.0])
                    tilt = np.degrees(np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]))
                    assert tilt[before + int(rate * flt.settles.tilt) :].max() < 2.0, (axis, noise, mag is None)
                    if mag is not None:
                        total = np.degrees(error.magnitude())
                        assert total[before + int(rate * flt.settles.heading) :].max() < 2.5, (axis, noise)


def test_pulls():
    rng = np.random.default_rng(9)
    for _ in range(100):
        s, e = unit(rng.normal(size=3)), unit(rng.normal(size=3))
        found = np.array(vector_error.direction_error(vec(s), vec(e)))
        expected = np.cross(s, e)
        np.testing.assert_allclose(found, expected if s @ e >= 0 else unit(expected), atol=1e-14)
        opposite = np.array(vector_error.direction_error(vec(s), vec(-s)))
        assert np.linalg.norm(opposite) == pytest.approx(1.0) and abs(opposite @ s) < 1e-9
    assert vector_error.direction_error(ZERO, vec([0, 0, 1])) == ZERO
    assert vector_error.heading_error(Quat(1.0, 0.0, 0.0, 0.0), vec([0, 0, 1]), vec([0, 0, -45])) == ZERO


def test_turns_and_nudges_are_products():
    rng = np.random.default_rng(10)
    for _ in range(100):
        q = unit(rng.normal(size=4))
        rotvec = unit(rng.normal(size=3)) * 10.0 ** rng.uniform(-6, 0.5)
        exact = Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec(rotvec)
        found = np.array(vector_error.rotate(Quat(*q), *rotvec))
        np.testing.assert_allclose(found * np.sign(found @ q), _near(exact, found) * np.sign(found @ q), atol=1e-15)
        step = unit(q + 0.5 * paper.product(q, np.array([0.0, *rotvec])))
        np.testing.assert_allclose(vector_error.correct(Quat(*q), vec(rotvec)), step, atol=1e-14)


def _near(exact, found):
    wanted = exact.as_quat(scalar_first=True)
    return wanted if wanted @ found > 0 else -wanted


@pytest.mark.slow
def test_gains_are_what_a_sample_takes():
    """The share of a small innovation that a step takes, measured; Madgwick's is a mean over noise."""
    dt = 0.01
    params = lh.Mahony(kp=0.8, ki=0.05, k_mag=0.3)
    level = mahony.State(Quat(1.0, 0.0, 0.0, 0.0), ZERO, OLD)
    gains = mahony.gains(params, level, dt)
    small = 1e-4
    acc = Rotation.from_euler("x", small).inv().apply([0, 0, G])
    after = mahony.step(params, level, ZERO, vec(acc), ZERO, dt)
    assert 2 * after.quat.x / small == pytest.approx(gains.tilt, rel=1e-3)
    assert -after.bias.x / small == pytest.approx(gains.tilt_bias, rel=1e-3)
    field = Rotation.from_euler("z", small).inv().apply([0, 19.0, -45.0])
    after = mahony.step(params, level, ZERO, vec([0, 0, G]), vec(field), dt)
    assert 2 * after.quat.z / small == pytest.approx(gains.heading, rel=1e-3)
    assert -after.bias.z / small == pytest.approx(gains.heading_bias, rel=1e-3)

    rng = np.random.default_rng(0)
    level = madgwick.State(Quat(1.0, 0.0, 0.0, 0.0), ZERO, OLD)
    innovation = 0.02
    taken = []
    for noise in rng.normal(0, madgwick.NOISE, (20_000, 2)):
        force = vec(G * unit(np.array([-noise[1], innovation + noise[0], 1.0])))
        taken.append(2 * madgwick.step(lh.Madgwick(), level, ZERO, force, ZERO, dt).quat.x / innovation)
    assert np.mean(taken) == pytest.approx(madgwick.gains(lh.Madgwick(), level, dt).tilt, rel=0.15)
