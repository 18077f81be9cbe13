"""Position, velocity and height beside the IMU: their errors fit σ, tilt gains, nothing jumps, bad readings pass."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference.aided import accelerated, flown, rms, tilt, turned

import levelhead as lh
from levelhead import simulate
from levelhead.filters.eskf import coarse_heading
from levelhead.filters.eskf import state as at
from levelhead.filters.health import AID_REJECTED
from levelhead.sources.formats import npz
from levelhead.units import GRAVITY

pytestmark = pytest.mark.slow

SEEDS = range(4)
START = 1000  # samples until the filter has settled


def until(recording, end):
    """Nothing beside the IMU after some time."""
    cut = {name: None if one is None else one.between(0.0, end) for name, one in beside(recording).items()}
    return replace(recording, **cut)


def beside(recording):
    return {"pressure": recording.pressure, "gnss": recording.gnss}


def test_height_by_barometer_and_its_sigma():
    ratios, climbs, with_it, without = [], [], [], []
    for seed in SEEDS:
        motion, rec = flown(seed)
        track = lh.fuse(replace(rec, pressure=simulate.pressure(motion, seed=seed)), "ESKF")
        off = (track.position - motion.position)[START:, 2]
        assert rms(off) < 0.5
        ratios.append(off / track.sigma_position[START:, 2])
        climbs.append((track.velocity - motion.velocity)[START:, 2])
        with_it.append(tilt(track, rec.truth)[START:])
        without.append(tilt(lh.fuse(rec, "ESKF"), rec.truth)[START:])
        assert not (track.health & AID_REJECTED).any()
    assert 0.5 < rms(np.concatenate(ratios)) < 1.5
    assert rms(np.concatenate(climbs)) < 0.1
    assert rms(np.concatenate(with_it)) < 1.02 * rms(np.concatenate(without))


def test_position_by_satellites_and_its_sigma():
    place, speed = [], []
    for seed in SEEDS:
        motion, rec = flown(seed)
        track = lh.fuse(replace(rec, gnss=simulate.gnss(motion, seed=seed)), "ESKF")
        off = (track.position - motion.position)[START:]
        assert (rms(off) < 1.0).all(), "less than half of a fix's"
        place.append(off / track.sigma_position[START:])
        speed.append((track.velocity - motion.velocity)[START:] / track.sigma_velocity[START:])
    assert 0.6 < rms(np.concatenate(place).ravel()) < 1.4
    assert 0.6 < rms(np.concatenate(speed).ravel()) < 1.6


def test_a_long_push_does_not_tilt_what_sees_its_velocity():
    for seed in SEEDS:
        _, rec = accelerated(seed)
        seen = tilt(lh.fuse(rec, "ESKF"), rec.truth)[START:]
        assert rms(seen) < 0.5
        assert seen.max() < 2.0


def test_after_aiding_nothing_jumps_and_sigma_grows():
    motion, rec = accelerated(1)
    full = lh.fuse(rec, "ESKF")
    track = lh.fuse(until(rec, 26.0), "ESKF")  # on the way, at 9 m/s
    np.testing.assert_array_equal(track.quat[:2600], full.quat[:2600])
    assert motion.velocity[2600, 0] > 5.0
    steps = np.abs(np.diff(track.velocity[2600:], axis=0)).max()
    assert steps < 0.5, "of which 0.03 are the body's own"
    turns = (track.as_rotation()[2601:] * track.as_rotation()[2600:-1].inv()).magnitude()
    assert np.degrees(turns).max() < 0.5
    assert tilt(track, rec.truth)[2600:].max() < 8.0
    sigma = track.sigma_position[2600:3500:100, 0]  # until it halts, which the filter sees and learns from
    assert (np.diff(sigma) > 0.0).all() and sigma[-1] > 2.0 * sigma[0]
    off = np.abs(track.position - motion.position)[2600:, 0] / track.sigma_position[2600:, 0]
    assert off.max() < 4.0


@pytest.mark.parametrize("name", ["pressure", "position", "velocity"])
def test_spikes_and_holes_do_no_harm(name):
    motion, rec = flown(2)
    rec = replace(rec, pressure=simulate.pressure(motion, seed=2), gnss=simulate.gnss(motion, seed=2))
    if name == "pressure":
        bad = rec.pressure.values.copy()
        bad[300::90] += 1200.0  # 100 m
        bad[305::90] = np.nan
        hit = replace(rec, pressure=lh.Pressure(rec.pressure.t, bad, rec.pressure.sigma))
    else:
        bad = getattr(rec.gnss, name).copy()
        bad[12::9] += 100.0
        bad[14::9, 1] = np.nan
        hit = replace(rec, gnss=replace(rec.gnss, **{name: bad}))
    clean, track = lh.fuse(rec, "ESKF"), lh.fuse(hit, "ESKF")
    assert (track.health & AID_REJECTED).any() and not (clean.health & AID_REJECTED).any()
    for key in ("quat", "position", "velocity", "sigma_position", "sigma_velocity"):
        assert np.isfinite(getattr(track, key)).all()
    assert (rms((track.position - motion.position)[START:]) < 1.5).all()
    assert rms(tilt(track, rec.truth)[START:]) < rms(tilt(clean, rec.truth)[START:]) + 0.2


def test_what_stays_far_off_is_believed_after_a_while():
    motion, rec = flown(3)
    air = simulate.pressure(motion, seed=3)
    jumped = lh.Pressure(air.t, air.values + np.where(air.t > 30.0, 300.0, 0.0), air.sigma)  # a window opens: 25 m
    track = lh.fuse(replace(rec, pressure=jumped), "ESKF")
    late = track.health[3500:] & AID_REJECTED
    assert (track.health[3000:3300] & AID_REJECTED).any() and not late.any()
    off = np.abs(track.position - motion.position)[3500:, 2]
    assert off.max() < 3.0, "it is the barometer that is off"


def test_a_gap_in_time_and_the_hour_after():
    motion, rec = flown(0, duration=40.0)
    rec = replace(rec, pressure=simulate.pressure(motion), gnss=simulate.gnss(motion))
    jump = 3600.0 * (rec.t > 20.0)
    gnss, air = rec.gnss, rec.pressure
    late = replace(
        rec,
        t=rec.t + jump,
        pressure=lh.Pressure(air.t + 3600.0 * (air.t > 20.0), air.values, air.sigma),
        gnss=replace(gnss, t=gnss.t + 3600.0 * (gnss.t > 20.0)),
    )
    track = lh.fuse(late, "ESKF")
    assert np.isfinite(track.position).all() and np.isfinite(track.quat).all()
    assert track.sigma_position[2010, 0] > 100.0
    assert (rms((track.position - motion.position)[2500:]) < 2.0).all()


@pytest.mark.full
def test_plain_compiled_and_streamed_are_the_same_bits():
    motion, rec = flown(1, duration=16.0)
    rec = replace(rec, pressure=simulate.pressure(motion, seed=1), gnss=simulate.gnss(motion, seed=1))
    plain, fast = (lh.fuse(rec, "ESKF", engine=engine) for engine in ("python", "compiled"))
    live = lh.Stream("ESKF", engine="compiled")
    k = j = 0
    for i, t in enumerate(rec.t):
        live.update(rec.gyr[i], rec.acc[i], rec.mag[i], t=t)
        seen = []
        while k < len(rec.pressure) and rec.pressure.t[k] <= t:
            at = rec.pressure.t[k]
            seen.append((at, 1, live.update_pressure, rec.pressure.values[k], rec.pressure.sigma[k]))
            k += 1
        while j < len(rec.gnss) and rec.gnss.t[j] <= t:
            at = rec.gnss.t[j]
            seen.append((at, 0, live.update_position, rec.gnss.position[j], rec.gnss.sigma_position[j]))
            seen.append((at, 0.5, live.update_velocity, rec.gnss.velocity[j], rec.gnss.sigma_velocity[j]))
            j += 1
        for at, _, see, value, sigma in sorted(seen, key=lambda one: one[:2]):
            see(value, sigma, age=t - at)
        assert tuple(live.quat) == tuple(fast.quat[i])
        if live.nav_state is not None:
            assert tuple(live.nav_state.position) == tuple(fast.position[i])
            assert tuple(live.nav_state.sigma_velocity) == tuple(fast.sigma_velocity[i])
    for key in ("quat", "sigma", "position", "velocity", "sigma_position", "sigma_velocity"):
        np.testing.assert_array_equal(getattr(plain, key), getattr(fast, key), err_msg=key)
    again = lh.Stream.restore(live.save(), engine="python")
    assert again.nav_state == live.nav_state


@pytest.mark.parametrize("age", [0.0, 0.05, 0.1])
@pytest.mark.parametrize(
    "see",
    [
        lambda live, age: live.update_zero_velocity(0.01, age=age),
        lambda live, age: live.update_velocity((0.0, 0.0, 0.0), 0.01, age=age),
    ],
    ids=["zero velocity", "velocity"],
)
def test_a_velocity_is_of_the_time_that_its_age_names(see, age):
    """Since it was zero a body that brakes with 2 m/s² has changed its velocity by 2 m/s² times the age."""
    live = lh.Stream(lh.ESKF(), guard=None)
    for i in range(150):
        live.update((0.0, 0.0, 0.0), (-2.0 * (i > 130), 0.0, GRAVITY), dt=0.01)
    see(live, age)
    velocity = live.nav_state.velocity
    np.testing.assert_allclose(velocity, [-2.0 * age, 0.0, 0.0], atol=0.02)


def test_without_any_of_it_a_track_has_no_position():
    _, rec = flown(0, duration=5.0)
    assert lh.fuse(rec, "ESKF").position is None
    motion, _ = flown(0, duration=5.0)
    assert lh.fuse(replace(rec, gnss=simulate.gnss(motion)), "EKF").position is None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.update_pressure(1013.0), r"pressure is 1013.0; it must be in Pa"),
        (lambda s: s.update_height("high", 1.0), r"height is 'high'; it must be a number, or NaN in m"),
        (lambda s: s.update_height(1.0, 0.0), r"sigma is 0.0; it must be a number more than 0 in m"),
        (lambda s: s.update_position((1.0, 2.0), 1.0), r"it must be three numbers in m"),
        (lambda s: s.update_velocity((1.0, 2.0, np.inf), 1.0), r"velocity is inf"),
        (lambda s: s.update_climb(1.0, 1.0, age=np.nan), r"age is nan; it must be a finite number in s"),
        (lambda s: lh.Stream("EKF", engine="python").update_climb(1.0, 1.0), r"EKF takes neither position, velocity"),
    ],
)
def test_a_stream_refuses_nonsense(call, words):
    stream = lh.Stream("ESKF", engine="python")
    stream.update((0, 0, 0), (0, 0, 9.81), dt=0.01)
    with pytest.raises(lh.LevelheadError, match=words):
        call(stream)
    assert stream.nav_state is None


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: lh.Pressure([0, 1], [1013.2, 1013.1]),
            r"pressure.values is 1013.2 at row 0; expected air pressure in Pa",
        ),
        (lambda: lh.Pressure([0, 0], [1e5, 1e5]), r"pressure.t does not increase at row 1"),
        (lambda: lh.Pressure([0, 1], [1e5, 1e5], -1.0), r"pressure.sigma is -1.0 at row 0; expected more than 0 Pa"),
        (lambda: lh.Gnss([0, 1]), r"neither position nor velocity"),
        (lambda: lh.Gnss([0, 1], [[0, 0, 0]]), r"gnss.position has shape \(1, 3\); expected \(2, 3\) in m"),
        (lambda: lh.Gnss([], np.empty((0, 3))), r"gnss.t is empty"),
    ],
)
def test_recordings_refuse_nonsense(make, words):
    with pytest.raises(lh.LevelheadError, match=words):
        make()


def test_true_north_turns_fixes_and_tracks_back_and_forth():
    motion, rec = flown(0, duration=20.0)
    fixes = simulate.gnss(motion)
    true = fixes.to_magnetic_north(-7.0)
    np.testing.assert_allclose(true.to_magnetic_north(7.0).position, fixes.position, atol=1e-9)
    track = lh.fuse(replace(rec, gnss=fixes), "ESKF").to_true_north(7.0)
    np.testing.assert_allclose(
        Rotation.from_euler("z", -7.0, degrees=True).apply(motion.position[-1].copy()), track.position[-1], atol=2.0
    )


def test_a_recording_with_all_of_it_survives_its_file(tmp_path):
    motion, rec = flown(0, duration=4.0)
    rec = replace(rec, pressure=simulate.pressure(motion), gnss=simulate.gnss(motion))
    npz.write_npz(rec, tmp_path / "a.npz")
    back = lh.read(tmp_path / "a.npz")
    for name in ("pressure", "gnss", "truth"):
        for key, values in vars(getattr(rec, name)).items():
            np.testing.assert_array_equal(getattr(getattr(back, name), key), values)
    part = back[100:200]
    assert part.pressure.t[0] >= part.t[0] and part.pressure.t[-1] <= part.t[-1]
    assert back[:10].gnss is None


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("off", [0.0, 90.0, 135.0, 180.0])
@pytest.mark.parametrize("style", ["drone", "car"])
def test_a_start_that_points_anywhere_finds_heading_with_the_first_clear_push(style, off, seed):
    motion = accelerated(seed)[0] if style == "car" else simulate.motion(seed, 30.0, 100.0, style=style)
    track, heading = turned(motion, seed, off)
    assert np.abs(heading[1100:]).max() < 6.0
    assert (np.abs(heading[100:]) < 4.0 * np.degrees(track.sigma[100:, 2])).all()
    assert np.degrees(track.sigma[2000:, 2]).max() < 4.0


def test_one_wrong_fix_does_not_turn_heading():
    def spoil(fixes):
        velocity = fixes.velocity.copy()
        velocity[20] += (0.0, 40.0, 0.0)
        return replace(fixes, velocity=velocity)

    motion = simulate.motion(1, 30.0, 100.0, style="drone")
    _, heading = turned(motion, 1, 135.0, spoil)
    assert np.abs(heading[1100:]).max() < 6.0


def test_regression_of_heading_is_least_squares():
    """Eq. 33 beside NumPy's solution of eq. 32, without forgetting."""
    rng = np.random.default_rng(5)
    push = rng.normal(size=12) + 1j * rng.normal(size=12)
    change = 0.9 * np.exp(2.5j) * push + (0.3 - 0.2j) + 0.1 * (rng.normal(size=12) + 1j * rng.normal(size=12))
    m = [0.0] * at.SIZE
    for one, other in zip(push, change, strict=True):
        m[at.VELOCITY_GAIN], m[at.VELOCITY_GAIN + 1] = one.real, one.imag
        coarse_heading.add_pair(m, 0.0, other.real, other.imag)
    design = np.stack([push, np.ones(12)], 1)
    (gain, _), residual, *_ = np.linalg.lstsq(design, change, rcond=None)
    sigma = np.sqrt(residual[0] / (2 * 12 - 4) / np.sum(np.abs(push - push.mean()) ** 2)) / abs(gain)
    found = coarse_heading.regress(m)
    np.testing.assert_allclose(found.angle, np.angle(gain), rtol=1e-12)
    np.testing.assert_allclose(found.sigma, coarse_heading.CORRELATED * sigma, rtol=1e-12)
    assert found.clear


@pytest.mark.parametrize("seed", [3, 4, 5])
@pytest.mark.parametrize(("style", "soon", "late"), [("drone", 5.0, 2.0), ("walking", 55.0, 20.0)])
def test_without_a_magnetometer_heading_is_learned_from_velocity(style, soon, late, seed):
    track, heading = turned(simulate.motion(seed, 60.0, 100.0, style=style), seed, 40.0)
    assert np.abs(heading[2000:]).max() < soon
    assert np.abs(heading[5000:]).max() < late
    assert (np.abs(heading[100:]) < 4.0 * np.degrees(track.sigma[100:, 2])).all()
