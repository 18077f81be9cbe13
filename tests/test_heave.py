"""Heave beside its truth: one wave in closed form, random seas seen by a simulated chip, and what is no sea."""

import math

import numpy as np
import pytest

import levelhead as lh
from levelhead import simulate
from levelhead.cli import main
from levelhead.heave import estimate_heave
from levelhead.rotations import rotate

RATE = 25.0
EIGHT = np.arange(0.0, 100.0, 0.04)  # s: eight waves of 12 s


def float_on(height, period, seed, duration=150.0):
    motion = simulate.buoy(duration, RATE, height=height, period=period, seed=seed)
    return motion, simulate.observe(motion, simulate.imu("LSM6DSO32"), seed)


@pytest.fixture(scope="module")
def sea():
    motion, recording = float_on(1.5, 7.0, 3)
    return motion, lh.fuse(recording)


def test_the_buoy_agrees_with_itself_and_its_water():
    motion = simulate.buoy(60.0, 100.0, height=1.0, period=5.0, seed=1)
    inner = slice(2, -2)
    for value, rate in ((motion.position, motion.velocity), (motion.velocity, motion.acceleration)):
        np.testing.assert_allclose(np.gradient(value, 0.01, axis=0)[inner], rate[inner], atol=2e-3)
    gentle = simulate.buoy(60.0, 100.0, height=0.2, period=5.0, seed=1)  # force is along the surface's normal
    assert np.abs(gentle.specific_force[:, :2]).max() < 0.1 * np.abs(gentle.acceleration[:, :2]).max()
    long = simulate.buoy(900.0, 4.0, height=1.0, period=5.0, seed=1)
    assert 4.0 * long.position[:, 2].std() == pytest.approx(1.0, rel=0.1)


@pytest.mark.parametrize("period", [2.5, 14.0])
def test_one_wave_is_found_with_its_amplitude_and_without_delay(period):
    t = np.arange(0.0, 200.0, 0.05)
    omega = 2.0 * math.pi / period
    truth = 0.8 * np.sin(omega * t)
    noise = np.random.default_rng(1).normal(0.0, 0.02, len(t))
    found = estimate_heave(t, -(omega**2) * truth + noise + 0.05)
    inner = slice(len(t) // 8, -len(t) // 8)
    np.testing.assert_allclose(found.value[inner], truth[inner], atol=0.03 * 0.8)
    np.testing.assert_allclose(found.velocity[inner], 0.8 * omega * np.cos(omega * t[inner]), atol=0.03 * 0.8 * omega)
    assert found.mean_period == pytest.approx(period, rel=0.01)


def test_a_random_sea_with_missing_rows(sea):
    motion, track = sea
    found = track.heave()
    error = found.value - motion.position[:, 2]
    assert np.sqrt(np.mean(error**2)) < 0.05 * 1.5 / 4.0
    assert np.sqrt(np.mean((error / found.sigma) ** 2)) < 1.3
    assert np.mean(np.abs(error) > 4.0 * found.sigma) < 0.01
    assert found.significant_height == pytest.approx(4.0 * motion.position[:, 2].std(), rel=0.02)
    up = track.earth_acceleration().value[:, 2].copy()
    up[1500:1520] = np.nan
    holed = estimate_heave(track.t, up)
    assert np.isfinite(holed.value).all() and holed.sigma[1510] > 1.2 * holed.sigma[1800]
    np.testing.assert_allclose(track.to_frame("NED").heave().value, found.value, atol=1e-12)


def test_the_heave_of_a_point_beside_the_sensor(sea):
    motion, track = sea
    arm = np.array([4.0, -1.0, 2.0])
    truth = motion.position[:, 2] + rotate(motion.quat, arm)[:, 2]
    found = track.heave(arm=tuple(arm))
    error = found.value - (truth - truth.mean())
    assert np.sqrt(np.mean(error**2)) < 0.08
    assert np.sqrt(np.mean((error / found.sigma) ** 2)) < 1.5
    with pytest.raises(lh.LevelheadError, match=r"arm has shape \(2,\)"):
        track.heave(arm=(1.0, 2.0))


def test_heave_while_it_happens(sea):
    """With the sea of an earlier log; its error is within its σ, and it is not late."""
    motion, track = sea
    live = lh.HeaveFilter(lh.Sea(height=1.5, period=5.6))
    said = np.array([live.update(a, 1.0 / RATE) for a in track.earth_acceleration().value[:, 2]])[1000:]
    truth = motion.position[1000:, 2]
    error = said[:, 0] - truth
    assert np.sqrt(np.mean(error**2)) < 0.15 * truth.std()
    assert np.sqrt(np.mean((error / said[:, 2]) ** 2)) < 1.6
    lags = [np.mean(said[10:-10, 0] * np.roll(truth, k)[10:-10]) for k in range(-10, 11)]
    assert abs(int(np.argmax(lags)) - 10) <= 2  # 0.08 s of 7 s


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: lh.fuse(simulate.recording("BMI160", "still", duration=60)).heave(), "shows no waves"),
        (lambda: lh.fuse(float_on(1.0, 6.0, 1)[1][: int(8 * RATE)]).heave(), "the log lasts 7.96 s; heave needs 10"),
        (lambda: estimate_heave(EIGHT, np.sin(EIGHT * math.pi / 6.0)), "7.8 waves of 12.9 s; heave needs 10"),
        (lambda: lh.HeaveFilter(lh.Sea(height=0.0, period=6.0)), "expected numbers above 0"),
        (lambda: lh.HeaveFilter(lh.Sea(1.0, 6.0)).update(0.0, 0.0), "expected dt above 0"),
    ],
    ids=["table", "seconds", "few", "flat", "dt"],
)
def test_what_is_no_sea_is_refused(wrong, message):
    with pytest.raises(lh.LevelheadError, match=message):
        wrong()


def test_a_log_with_heave_in_its_track(sea, tmp_path, capsys):
    _, track = sea
    log = tmp_path / "buoy.csv"
    rows = np.column_stack([track.t, track.readings.gyr, track.readings.acc])
    head = "t [s],gx [rad/s],gy [rad/s],gz [rad/s],ax [m/s²],ay [m/s²],az [m/s²]"
    np.savetxt(log, rows, delimiter=",", header=head, comments="")
    assert main(["fuse", str(log), "--heave", "--no-plot", "-o", str(tmp_path)]) == 0
    assert "heave         significant height 1." in capsys.readouterr().out
    table = np.genfromtxt(tmp_path / "buoy-track.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["heave_m"], track.heave().value, atol=1e-3)
