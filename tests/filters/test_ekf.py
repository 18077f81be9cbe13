"""The extended Kalman filter against its textbook twin, its exact model, and what it promises of gates and magnets."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference import ekf as textbook

import levelhead as lh
from levelhead.engine.batch import Batch
from levelhead.filters import health, mekf
from levelhead.filters.mekf import measurements
from levelhead.guard import Guard
from levelhead.kernels.vec3 import ZERO, Vec3

G = 9.80665
FIELD = np.array([0.0, 19.0, -45.0])


def matrix(p):
    """The covariance's 21 numbers as a matrix."""
    a = [[p.axx, p.axy, p.axz], [p.axy, p.ayy, p.ayz], [p.axz, p.ayz, p.azz]]
    c = np.array([[p.cxx, p.cxy, p.cxz], [p.cyx, p.cyy, p.cyz], [p.czx, p.czy, p.czz]])
    b = [[p.bxx, p.bxy, p.bxz], [p.bxy, p.byy, p.byz], [p.bxz, p.byz, p.bzz]]
    return np.block([[np.array(a), c], [c.T, np.array(b)]])


def vec(v):
    return ZERO if v is None else Vec3(*map(float, v))


def tilt_between(a, b):
    """Degrees between the verticals of two tracks."""
    one, two = (track.as_rotation().inv().apply([0.0, 0.0, 1.0]) for track in (a, b))
    return np.degrees(2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(one - two, axis=1), 0.0, 1.0)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("wild", [False, True], ids=["motion", "faults"])
def test_it_is_the_textbook_with_full_matrices(seed, wild):
    """Random rates, accelerations and intervals; with faults also readings turned over, missing ones and a gap."""
    rng = np.random.default_rng(seed)
    params = (
        lh.EKF(block=0)
        if seed % 2
        else lh.EKF(block=0, gate=2.0, gate_time=0.1, bias_walk=0.05, acc_tau=0.5, mag_noise=5.0)
    )
    true = Rotation.random(rng=rng)
    bias = rng.normal(0, 0.02, 3)
    acc, mag = true.inv().apply([0, 0, G]), true.inv().apply(FIELD)
    state = mekf.init(params, ZERO, vec(acc), vec(mag))
    twin = textbook.Textbook(params, Rotation.from_quat(state.quat, scalar_first=True), True)
    assert (twin.attitude * true.inv()).magnitude() < 1e-9
    refused = 0
    for k in range(400):
        dt = rng.uniform(0.002, 0.03)
        if wild and k == 250:
            dt = 2.0
        rate = np.array([1.0, 2.0, 0.5]) * np.sin(0.02 * k + np.array([0, 1, 2]))
        true = true * Rotation.from_rotvec(rate * dt)
        upside_down = wild and 100 <= k < 140
        acc = true.inv().apply([0, 0, -G if upside_down else G]) + rng.normal(0, 1.0, 3)
        mag = true.inv().apply(FIELD * (-1.0 if wild and 180 <= k < 220 else 1.0)) + rng.normal(0, 1.0, 3)
        if wild:
            acc, mag = (None if rng.random() < 0.2 else v for v in (acc, mag))
        gyr = rate + bias + rng.normal(0, 0.02, 3)
        state = mekf.step(params, state, vec(gyr), vec(acc), vec(mag), dt)
        if mekf.due(params, state, dt):
            state = mekf.correct(params, state, dt)
        twin.step(gyr, acc, mag, dt)
        refused += state.health != 0
        off = twin.attitude.inv() * Rotation.from_quat(state.quat, scalar_first=True)
        assert off.magnitude() < 1e-10, k
        np.testing.assert_allclose(state.bias, twin.bias, rtol=0, atol=1e-10)
        np.testing.assert_allclose(matrix(state.p), twin.p, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(state.force, twin.force, rtol=0, atol=1e-10)
    if seed % 2 == 0:  # the narrow gate
        assert (refused > 0) == wild
    expected = np.minimum(np.sqrt(np.diag(twin.p)[:3]), np.pi / np.sqrt(3.0))
    np.testing.assert_allclose(mekf.output(params, state).sigma, expected, rtol=1e-9)


def test_the_jacobians_are_those_of_the_exact_model():
    """By finite differences: the true attitude is exp(θ) of the estimated one, the true bias b^ + β."""
    rng = np.random.default_rng(0)
    dt, small = 1e-3, 1e-5
    estimate, rate = Rotation.random(rng=rng), rng.normal(0, 1, 3)
    after = estimate * Rotation.from_rotvec(rate * dt)

    def error_after(x):
        true = Rotation.from_rotvec(x[:3]) * estimate * Rotation.from_rotvec((rate - x[3:]) * dt)
        return np.concatenate([(true * after.inv()).as_rotvec(), x[3:]])

    def seen(x):
        true = Rotation.from_rotvec(x[:3]) * estimate
        force = estimate.apply(true.inv().apply([0.0, 0.0, 1.0]))
        field = estimate.apply(true.inv().apply(FIELD))
        up = measurements.tilt_innovation(vec(force))
        return np.array([up.x, up.y, measurements.heading_innovation(float(field[0]), float(field[1]))])

    def jacobian(function):
        return np.stack([(function(small * e) - function(-small * e)) / (2 * small) for e in np.eye(6)], axis=1)

    # F is of first order: what it leaves out is half the turn within the interval, of the interval
    np.testing.assert_allclose(jacobian(error_after), textbook.transition(after, dt), atol=dt * dt * 2.0)
    h = jacobian(seen)
    np.testing.assert_allclose(h[:2], textbook.tilt_rows(), atol=1e-9)
    assert h[2] == pytest.approx([0.0, 45.0 / 19.0, 1.0, 0.0, 0.0, 0.0], abs=1e-8)
    # θ_y shows in the heading by the tangent of the dip; the filter leaves it out, lest a magnet tilt the horizon
    np.testing.assert_array_equal(textbook.heading_row()[0], [0, 0, 1, 0, 0, 0])


@pytest.mark.slow
def test_the_covariance_stays_symmetric_and_positive():
    """100 000 samples: three minutes' bursts of fast turns, rest, missing sensors, at 500 Hz."""
    rng = np.random.default_rng(4)
    run, last, n = None, 0.0, 10_000
    for part in range(10):
        t = last + np.cumsum(rng.uniform(0.001, 0.003, n))
        gyr = rng.normal(0, 5.0 if part % 2 else 0.01, (n, 3))
        acc = np.array([0, 0, G]) + rng.normal(0, 5.0 if part % 2 else 0.01, (n, 3))
        mag = FIELD + rng.normal(0, 20.0 if part % 3 else 0.1, (n, 3))
        acc[rng.random(n) < 0.3 * (part > 6)] = np.nan
        mag[rng.random(n) < 0.9 * (part > 4)] = np.nan
        recording = lh.Recording(t, gyr, acc, mag)
        if run is None:
            run = Batch(recording, lh.EKF(), Guard(), "auto", None)
        else:
            run.follow(recording)
        run.advance(n)
        last = float(t[-1])
        p = matrix(run.carry.run.state.p)
        values = np.linalg.eigvalsh(p / np.sqrt(np.outer(np.diag(p), np.diag(p))))  # as correlations: units apart
        assert values.min() > 1e-9, part
        assert run.track().sigma.min() > 0.0


def wrong_for(seconds, what, rate=100.0):
    """At rest, and from second 10 on one sensor's vector turned over for some seconds."""
    n = int(30 * rate)
    rng = np.random.default_rng(1)
    acc, mag = np.tile([0, 0, G], (n, 1)), np.tile(FIELD, (n, 1))
    wrong = slice(int(10 * rate), int((10 + seconds) * rate))
    if what == "acc":
        acc[wrong] = Rotation.from_euler("x", 150, degrees=True).apply([0, 0, G])
    else:
        mag[wrong] = Rotation.from_euler("z", 80, degrees=True).apply(FIELD)
    noise = rng.normal(0, 0.002, (3, n, 3))
    return lh.Recording(np.arange(n) / rate, noise[0], acc + noise[1], mag + noise[2])


def longest(bits):
    """The most samples in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bits.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))


@pytest.mark.slow
@pytest.mark.parametrize(("what", "bit"), [("acc", health.ACC_REJECTED), ("mag", health.MAG_REJECTED)])
def test_the_gate_refuses_and_lets_go_in_bounded_time(what, bit):
    params = lh.EKF(acc_tau=0.1, mag_noise=1.0)  # with 30 °/√Hz no field is 5 σ off: the guard refuses it instead
    short = lh.fuse(wrong_for(0.8, what), params, guard=None)
    refused = (short.health & bit) != 0
    assert refused[1000:1080].mean() > 0.7 and not refused[:1000].any()
    assert np.degrees(short.as_rotation().magnitude()).max() < 5.0
    lasting = lh.fuse(wrong_for(20.0, what), params, guard=None)
    refused = (lasting.health & bit) != 0
    assert 0 < longest(refused) <= 1 + params.gate_time * 100
    assert np.degrees(lasting.as_rotation().magnitude())[-1] > 60.0, "it is believed in the end"


def wild_field(n):
    """A magnet in somebody's hand: nothing of the earth's field is left."""
    wild = np.cumsum(np.random.default_rng(6).normal(0, 10, (n, 3)), axis=0) + FIELD
    wild[n // 2 :] *= -30.0
    return wild


@pytest.mark.slow
@pytest.mark.parametrize("guard", [Guard(), None], ids=["guarded", "unguarded"])
def test_no_magnet_tilts_the_horizon_of_a_body_at_rest(guard):
    """Only noise, which the error of heading turns with the earth frame while it is averaged there."""
    rng = np.random.default_rng(2)
    n = 3000
    still = lh.Recording(np.arange(n) / 100, rng.normal(0, 0.002, (n, 3)), rng.normal(0, 0.05, (n, 3)) + [0, 0, G])
    with_field = lh.Recording(still.t, still.gyr, still.acc, wild_field(n))
    six, nine = (lh.fuse(rec, lh.EKF(), guard=guard) for rec in (still, with_field))
    assert tilt_between(six, nine).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("guard", [Guard(), None], ids=["guarded", "unguarded"])
def test_what_a_magnet_makes_of_the_bias_tilts_a_turning_body_by_less_than_a_degree(guard):
    """Heading is wrong by as much as it likes; the bias learned from it is another axis's when the body has turned."""
    motion = lh.simulate.recording("BMI160", "hand", 60.0, seed=3)
    with_field = lh.Recording(motion.t, motion.gyr, motion.acc, wild_field(len(motion)))
    six, nine = (lh.fuse(rec, lh.EKF(), guard=guard) for rec in (motion, with_field))
    assert tilt_between(six, nine).max() < 1.0
    assert np.degrees((six.as_rotation().inv() * nine.as_rotation()).magnitude()).max() > 20.0
