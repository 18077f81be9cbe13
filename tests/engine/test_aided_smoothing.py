"""The smoother with position, velocity and height: against least squares over all blocks at once, and against truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.reference.aided import accelerated, flown, rms, tilt, turned
from tests.reference.engines import NATIVE, skip_second_compilation
from tests.reference.hard import assert_same

import levelhead as lh
from levelhead import simulate
from levelhead.engine import binding, smoothing
from levelhead.engine.driver import Settings
from levelhead.filters import health
from levelhead.filters.eskf import rts, rts_aided
from levelhead.filters.eskf import state as at

NATIVE_ONLY = NATIVE.marks[0]
TIME = 0.25  # s, a block
START = 1000  # samples until the filter has settled


def transition(rng):
    """S F S, and F − 1 of the driven states as it is kept."""
    couplings = np.zeros((at.DRIVEN, at.ROW))
    velocity, attitude = couplings[:3], couplings[3:]
    velocity[:, at.ACC_BIAS : at.ACC_BIAS + 3] = rng.normal(0, 0.3, (3, 3))
    velocity[:, at.ATTITUDE : at.ATTITUDE + 3] = rng.normal(0, 0.5, (3, 3))
    attitude[:, at.GYR_BIAS : at.BODY_VELOCITY] = rng.normal(0, 0.3, (3, at.BODY_VELOCITY - at.GYR_BIAS))
    f, half = np.eye(at.N), np.eye(at.N)
    f[at.VELOCITY : at.VELOCITY + at.DRIVEN] += couplings[:, : at.N]
    for i in range(3):
        half[at.POSITION + i, at.VELOCITY + i] = 0.5 * TIME
    return half @ f @ half, couplings


def wide(matrix):
    full = np.zeros((at.ROW, at.ROW))
    full[: at.N, : at.N] = matrix
    return full.ravel()


def packed(matrix):
    """As it is kept: the upper triangle, each row from a multiple of four on."""
    full = wide(matrix).reshape(at.ROW, at.ROW)
    return np.concatenate([row[i - i % 4 :] for i, row in enumerate(full)])


@pytest.mark.parametrize("reset", [False, True])
def test_the_way_back_is_least_squares_over_all_blocks(reset):
    """A chain of Gaussian states; the closed solution knows no filter. A first fix may set the position of block 3."""
    rng, n, count = np.random.default_rng(5), at.N, 5
    root = rng.normal(0, 0.3, (n, n))
    p, mean = root @ root.T + 0.1 * np.eye(n), np.zeros(n)
    size = n * count
    information, right = np.zeros((size, size)), np.zeros(size)
    information[:n, :n] = np.linalg.inv(p)
    blocks, means, corrections = np.zeros(rts_aided.BLOCK_SIZE * count), [mean], [np.zeros(n)]
    blocks[rts.BLOCK_P : rts.BLOCK_P + rts.TRIANGLE] = packed(p)
    for k in range(1, count):
        f, couplings = transition(rng)
        q = np.diag(rng.uniform(0.01, 0.1, n))
        lasting = np.ones(at.ROW)
        if reset and k == 3:
            lasting[at.POSITION : at.POSITION + 3] = 0.0
        keep = np.diag(lasting[:n])
        gone = np.diag(1.0 - lasting[:n]) * 4.0  # variance of what is set to zero
        f_all, q_all = f @ keep, q + f @ gone @ f.T
        ahead, mean = f_all @ p @ f_all.T + q_all, f_all @ mean
        h, r = rng.normal(size=(6, n)), np.diag(rng.uniform(0.1, 1.0, 6))
        y = rng.normal(size=6)
        gain = ahead @ h.T @ np.linalg.inv(h @ ahead @ h.T + r)
        x, p = gain @ (y - h @ mean), ahead - gain @ h @ ahead
        mean = mean + x
        here, before = slice(n * k, n * (k + 1)), slice(n * (k - 1), n * k)
        weight = np.linalg.inv(q_all)
        information[here, here] += weight + h.T @ np.linalg.inv(r) @ h
        information[before, before] += f_all.T @ weight @ f_all
        information[here, before] -= weight @ f_all
        information[before, here] -= f_all.T @ weight
        right[here] += h.T @ np.linalg.inv(r) @ y
        b = rts_aided.BLOCK_SIZE * k
        for place, values in (
            (rts.BLOCK_P, packed(p)),
            (rts.BLOCK_PREDICTED, packed(ahead)),
            (rts_aided.BLOCK_F, -couplings.ravel()),
            (rts.BLOCK_X, x),
            (rts_aided.BLOCK_LASTING, lasting),
            (rts_aided.BLOCK_TIME, [TIME]),
        ):
            blocks[b + place : b + place + len(values)] = values
        means.append(mean)
        corrections.append(x)
    solution, covariance = np.linalg.solve(information, right).reshape(count, n), np.linalg.inv(information)
    m = np.zeros(rts.SIZE)
    m[rts.NOW : rts.NOW + rts.WHOLE] = wide(p)
    np.testing.assert_allclose(mean, solution[-1], atol=1e-9)
    for k in range(count - 2, -1, -1):
        rts_aided.back(blocks, rts_aided.BLOCK_SIZE * k, m)
        np.testing.assert_allclose(means[k] + m[rts.SMOOTHED : rts.SMOOTHED + n], solution[k], atol=1e-8)
        found = m[rts.NOW : rts.NOW + rts.WHOLE].reshape(at.ROW, at.ROW)[:n, :n]
        part = slice(n * k, n * (k + 1))
        np.testing.assert_allclose(found, covariance[part, part], atol=1e-8)


def outage(fixes, start, stop):
    keep = (fixes.t <= start) | (fixes.t >= stop)
    names = ("t", "position", "velocity", "sigma_position", "sigma_velocity")
    return replace(fixes, **{name: getattr(fixes, name)[keep] for name in names})


def both(recording, engine="auto"):
    return lh.fuse(recording, "ESKF", engine=engine), lh.smooth(recording, engine=engine)


def test_in_plain_python_it_is_better_than_online_and_needs_no_compiler():
    motion, recording = flown(0, duration=12.0)
    recording = replace(recording, gnss=simulate.gnss(motion, seed=0), pressure=simulate.pressure(motion, seed=0))
    online, smoothed = both(recording, "python")
    assert rms(smoothed.position - motion.position).max() < 0.8 * rms(online.position - motion.position).max()
    assert rms(smoothed.velocity - motion.velocity).mean() < 0.8 * rms(online.velocity - motion.velocity).mean()
    assert (smoothed.sigma_position.mean(axis=0) < online.sigma_position.mean(axis=0)).all()


def test_without_any_aiding_there_is_no_position():
    _, recording = flown(0, duration=3.0)
    assert lh.smooth(recording).position is None


def test_chunks_say_that_they_leave_pressure_and_gnss_aside(caplog):
    motion, recording = flown(0, duration=3.0)
    with caplog.at_level("WARNING", "levelhead"):
        tracks = list(lh.smooth_chunks([replace(recording, pressure=simulate.pressure(motion, seed=0))]))
    assert "without pressure and GNSS" in caplog.text and tracks[0].position is None


@NATIVE_ONLY
def test_a_drone_and_a_car_with_a_receiver():
    errors = {"online": [], "smoothed": []}
    ratios = []
    for seed in range(3):
        motion, recording = flown(seed)
        drone = replace(recording, gnss=simulate.gnss(motion, seed=seed), pressure=simulate.pressure(motion, seed=seed))
        for truth, one in ((motion, drone), accelerated(seed)):
            for name, track in zip(errors, both(one), strict=True):
                place, speed = track.position - truth.position, track.velocity - truth.velocity
                errors[name].append([rms(place).mean(), rms(speed).mean(), tilt(track, truth)[START:].mean()])
            settled = (place[START:] / track.sigma_position[START:], speed[START:] / track.sigma_velocity[START:])
            ratios.append([rms(part).mean() for part in settled])
    online, smoothed = (np.mean(errors[name], axis=0) for name in errors)
    assert (smoothed[:2] < 0.8 * online[:2]).all() and smoothed[2] < online[2]
    ratio = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert ((ratio > 0.5) & (ratio < 1.5)).all()


@NATIVE_ONLY
def test_a_barometer_alone():
    motion, recording = flown(1)
    online, smoothed = both(replace(recording, pressure=simulate.pressure(motion, seed=1)))
    height, climb = motion.position[:, 2], motion.velocity[:, 2]
    assert rms(smoothed.velocity[:, 2] - climb) < 0.8 * rms(online.velocity[:, 2] - climb)
    assert rms(smoothed.position[:, 2] - height) < 1.05 * rms(online.position[:, 2] - height)


@NATIVE_ONLY
def test_a_receiver_that_is_lost_for_20_s_is_bridged():
    off, ratios, late = [], [], slice(3200, 3800)
    for seed in range(3):
        motion, recording = accelerated(seed)
        tracks = both(replace(recording, gnss=outage(recording.gnss, 25.0, 45.0)))
        off.append([np.linalg.norm(track.position - motion.position, axis=1)[late].mean() for track in tracks])
        ratios.append((tracks[1].position - motion.position)[late] / tracks[1].sigma_position[late])
    online, smoothed = np.mean(off, axis=0)
    assert smoothed < 0.5 * online
    assert rms(np.concatenate(ratios)).max() < 1.5


@NATIVE_ONLY
@pytest.mark.parametrize("off", [0.0, 90.0, 180.0])
def test_a_start_that_points_backwards_is_right_from_the_first_sample(off):
    motion = simulate.motion(1, 30.0, 100.0, style="drone")
    turn = Rotation.from_euler("z", off, degrees=True)
    fixes = simulate.gnss(motion, seed=1)
    fixes = replace(fixes, position=turn.apply(fixes.position.copy()), velocity=turn.apply(fixes.velocity.copy()))
    recording = replace(simulate.observe(motion, simulate.imu("LSM6DSO32"), 1), gnss=fixes)
    track = lh.smooth(recording)
    truth = turn * Rotation.from_quat(motion.quat.copy(), scalar_first=True)
    heading = np.degrees((track.as_rotation() * truth.inv()).as_rotvec()[:, 2])
    _, online = turned(motion, 1, off)
    assert np.abs(heading).max() < 6.0 and rms(heading) < rms(online)
    assert (np.abs(heading) < 4.0 * np.degrees(track.sigma[:, 2])).all()
    place = (track.position - turn.apply(motion.position.copy()))[101:]  # the first fix comes after a second
    assert (np.abs(place) < 4.0 * track.sigma_position[101:]).all()


@NATIVE_ONLY
@pytest.mark.parametrize("gap", [False, True])
def test_a_barometer_leaves_heading_alone(gap):
    """Whose start is 0 by definition; a tilt that is set anew turns it by rounding, which is no heading found."""
    motion, recording = accelerated(0, gnss=False)
    keep = np.r_[0:2500, 2700:6000] if gap else np.arange(6000)
    blind = lh.Recording(recording.t[keep], recording.gyr[keep], recording.acc[keep])
    track = lh.smooth(replace(blind, pressure=simulate.pressure(motion, seed=0)))
    truth = Rotation.from_quat(motion.quat[keep].copy(), scalar_first=True)
    heading = np.degrees((track.as_rotation() * truth.inv()).as_rotvec()[:, 2])
    assert abs(heading[0]) < 0.1 and track.sigma_heading[40] < 0.01  # once the first block has found the vertical
    assert (np.abs(heading) < 4.0 * np.degrees(track.sigma_heading) + 0.1).all()


@NATIVE_ONLY
@pytest.mark.parametrize("seed", [3, 4])
def test_somebody_who_walks_on_the_spot_is_not_turned_around(seed):
    """Steps are as fast as long blocks would be."""
    motion = simulate.motion(seed, 60.0, 100.0, style="walking")
    recording = simulate.observe(motion, simulate.imu("LSM6DSO32"), seed)
    recording = replace(recording, gnss=simulate.gnss(motion, seed=seed), pressure=simulate.pressure(motion, seed=seed))
    online, track = both(recording)
    truth = Rotation.from_quat(motion.quat.copy(), scalar_first=True)
    heading = np.degrees((track.as_rotation() * truth.inv()).as_rotvec()[:, 2])
    assert np.abs(heading).max() < 40.0 and (np.abs(heading) < 4.0 * np.degrees(track.sigma[:, 2])).all()
    assert rms(track.position - motion.position).mean() < rms(online.position - motion.position).mean()


MEASURED = {"pressure": (), "position": ("position",), "all": ("position", "velocity")}  # by the receiver


def hard_flight(sensors, with_mag):
    """A drone with a gap, missing readings, an outage of the receiver, whose frame is turned, and fixes far off.

    The first fix comes with the last sample of a block, which is kept as it was before.
    """
    motion, recording = flown(2, duration=10.0)
    keep = np.r_[0:500, 700:1000]
    gyr, acc = recording.gyr.copy(), recording.acc.copy()
    gyr[300] = acc[200:205] = np.nan
    fixes, air = simulate.gnss(motion, simulate.Receiver(rate=5.0), 2), simulate.pressure(motion, seed=2)
    seen = (fixes.t < 2.0) | (fixes.t > 4.0)
    turn = Rotation.from_euler("z", 150.0, degrees=True)
    place, speed = turn.apply(fixes.position[seen]), turn.apply(fixes.velocity[seen])
    place[7:10] += 40.0
    place[12] = np.nan
    read = {name: values for name, values in (("position", place), ("velocity", speed)) if name in MEASURED[sensors]}
    return lh.Recording(
        recording.t[keep], gyr[keep], acc[keep], recording.mag[keep] if with_mag else None,
        pressure=None if sensors == "position" else air,
        gnss=lh.Gnss(fixes.t[seen] + 0.018, **read, sigma_position=2.0, sigma_velocity=0.1) if read else None,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("guard", [lh.Guard(), None], ids=["guarded", "unguarded"])
@pytest.mark.parametrize("with_mag", [True, False], ids=["mag", "no mag"])
@pytest.mark.parametrize("sensors", MEASURED)
@pytest.mark.parametrize("engine", [NATIVE, pytest.param("compiled", marks=pytest.mark.full)])
def test_the_same_bits(engine, sensors, with_mag, guard, monkeypatch):
    """In several stretches, so that runs forward are repeated; where velocity finds heading, also from a new start."""
    skip_second_compilation(engine, guard)
    recording = hard_flight(sensors, with_mag)
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 40)
    turn_start, starts = smoothing.Smoother._turn_start, []

    def noted(self, end):
        starts.append(turn_start(self, end))
        return starts[-1]

    monkeypatch.setattr(smoothing.Smoother, "_turn_start", noted)
    tracks = [lh.smooth(recording, guard=guard, engine=one) for one in ("python", engine)]
    assert_same(*tracks)
    turned = sensors == "all" and not with_mag
    assert [start is None for start in starts] == ([False, True, False, True] if turned else [True, True])
    assert np.isfinite(tracks[0].sigma_position).all()
    for bit in (health.GAP, health.GYR_MISSING, health.ACC_MISSING, health.AID_REJECTED):
        assert (tracks[0].health & bit).any()
    known = [track.calibration.gyr_matrix for track in tracks]
    np.testing.assert_array_equal(known[0].value, known[1].value)


@NATIVE_ONLY
def test_auto_needs_no_numba(monkeypatch):
    motion, recording = flown(0, duration=3.0)
    monkeypatch.setattr(smoothing, "numba_installed", lambda: False)
    monkeypatch.setattr(smoothing, "for_engine", None)
    track = lh.smooth(replace(recording, gnss=simulate.gnss(motion, seed=0)))
    assert len(track.position) == 300


@NATIVE_ONLY
def test_the_extension_refuses_what_does_not_fit():
    from levelhead.engine import native

    module, rows = native.extension(), np.zeros(3)
    with pytest.raises(TypeError, match="14 arguments instead of 17"):
        module.correct_stretch("ESKF_aided", 1, 1, *[rows] * 11)
    with pytest.raises(TypeError, match="17 arguments instead of 14"):
        module.correct_stretch("ESKF", 1, 1, *[rows] * 14)
    flt = lh.filters.of(lh.ESKF())
    bound = smoothing.bind_aided_smoother(flt, True)
    settings = Settings(lh.ESKF(), lh.Guard())
    run = native.NativeSmoother("ESKF_aided", bound.flt, True, settings, binding.bind(bound.flt).begin(settings))
    with pytest.raises(TypeError, match="10 arguments instead of 16"):
        run._machine.filter.forward(0.0, 0, *[rows] * 8)
    blocks = [np.zeros(bound.parts.width), np.zeros(1)]
    sensors = [np.zeros(1), rows, rows, np.zeros(0), np.zeros(4), np.zeros(1, np.uint32)]
    readings = [np.zeros(2, np.int64), np.zeros(0, np.int64), *[np.zeros(0)] * 3]
    with pytest.raises(ValueError, match="an array of 24 bytes instead of 96"):
        run._machine.filter.forward(0.0, 0, *sensors, *blocks, *readings, rows)


@NATIVE_ONLY
def test_stretches_change_nothing(monkeypatch):
    motion, recording = flown(2, duration=6.0)
    recording = replace(recording, gnss=simulate.gnss(motion, seed=2))
    whole = lh.smooth(recording)
    monkeypatch.setattr(smoothing, "MOST_BLOCKS", 8)
    cut = lh.smooth(recording)
    for name in ("quat", "bias", "sigma", "position", "velocity", "sigma_position", "sigma_velocity"):
        np.testing.assert_allclose(getattr(cut, name), getattr(whole, name), atol=1e-7, err_msg=name)
