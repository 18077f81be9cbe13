"""From numbers to a simulation and back, and from a real still recording to filters."""

import dataclasses

import numpy as np
import pytest

import levelhead as lh
from levelhead import LevelheadError, NoiseModel, measure_noise, simulate
from levelhead.noise.assessment import ROWS, _instability, noise_verdict
from levelhead.noise.measure import longest
from levelhead.noise.model import Coefficient, TriadNoise
from levelhead.signals.rest import still_stretches

pytest.importorskip("scipy")
KINDS = ("white_noise_density", "bias_instability", "random_walk")


def still(model, seed, duration=600.0, rate=50.0):
    return simulate.observe(simulate.motion(0, duration, rate, style="still"), model.imu(), seed)


@pytest.fixture(scope="module")
def measured():
    """The model of a sensor whose three noises all show in ten minutes."""
    errors = simulate.TriadErrors(white_noise_density=2e-4, flicker_noise=2e-4, random_walk=2e-5)
    forces = simulate.TriadErrors(white_noise_density=2e-3, flicker_noise=2e-3, random_walk=2e-4)
    board = simulate.Imu(errors, forces)
    return measure_noise(simulate.observe(simulate.motion(0, 1200.0, 50.0, style="still"), board, 99))


@pytest.mark.full
@pytest.mark.slow
def test_what_is_simulated_from_a_file_is_measured_again(measured, tmp_path):
    """20 seeds, 6 axes, 3 kinds: the file's numbers lie within the new 95 % intervals as often as that says."""
    measured.save(tmp_path / "noise.json")
    model = NoiseModel.read(tmp_path / "noise.json")
    inside = dict.fromkeys(KINDS, 0)
    for seed in range(20):
        again = measure_noise(still(model, seed))
        for name, triad in again.triads.items():
            for kind in KINDS:
                put, got = getattr(getattr(model, name), kind).value, getattr(triad, kind)
                inside[kind] += int(((got.low <= put) & (put <= got.high)).sum())
    assert all(count >= 107 for count in inside.values()), inside  # of 120; 114 ± 2.4 are expected


@pytest.mark.slow
def test_a_file_keeps_every_bit(measured, tmp_path):
    measured.save(tmp_path / "noise.json")
    assert NoiseModel.read(tmp_path / "noise.json").to_dict() == measured.to_dict()


@pytest.mark.slow
def test_filters_take_it(measured):
    n = np.degrees(np.sqrt(np.mean(measured.gyr.white_noise_density.value**2)))
    for params in (lh.ESKF(), lh.EKF()):
        assert measured.parameters(params).gyr_noise == pytest.approx(n)
    kalman = measured.parameters(lh.Kalman())
    assert kalman.q_angle == pytest.approx(n**2)
    tilt = np.degrees(measured.acc.density * 50.0**0.5 / 9.80665)
    assert measured.parameters(lh.Kalman(r_measure=1e-4)).r_measure == pytest.approx(tilt**2)
    assert kalman.r_measure == lh.Kalman().r_measure > tilt**2  # it stands for motion as well
    assert measured.parameters(lh.EKF()).acc_noise == lh.EKF().acc_noise
    assert measured.parameters(lh.ESKF()).acc_noise == pytest.approx(measured.acc.density)
    with pytest.raises(LevelheadError, match="Mahony has no noise to set"):
        measured.parameters(lh.Mahony())


def test_the_walk_of_a_filter_reaches_the_flat_part(measured):
    """At the τ where white noise and bias instability are equal, the Allan deviation of the walk is that of both."""
    alone = dataclasses.replace(
        measured.gyr, random_walk=dataclasses.replace(measured.gyr.random_walk, value=np.zeros(3))
    )
    flat = np.sqrt(2.0 * np.log(2.0) / np.pi * np.mean(alone.bias_instability.value**2))
    tau = (alone.density / flat) ** 2
    assert alone.walk * np.sqrt(tau / 3.0) == pytest.approx(flat)


def test_the_longest_still_stretch_is_found():
    """20 s still, 20 s in motion, 40 s still."""
    part = simulate.recording("LSM6DSO32", "still", 100.0, 100.0, seed=1)
    moved = simulate.recording("LSM6DSO32", "hand", 30.0, 100.0, seed=1)
    gyr, acc = part.gyr.copy(), part.acc.copy()
    gyr[2000:4000], acc[2000:4000] = moved.gyr[800:2800], moved.acc[800:2800]
    made = lh.Recording(part.t, gyr, acc)
    found = longest(made)
    assert (found.start, found.end) == pytest.approx((4000, 10_000), abs=100)
    assert len(still_stretches(made)) == 2


@pytest.mark.slow
def test_a_recording_that_moves_in_part_is_measured_at_rest_and_says_so():
    still = simulate.recording("LSM6DSO32", "still", 60.0, 50.0, seed=1)
    moving = simulate.recording("LSM6DSO32", "hand", 30.0, 50.0, seed=1)
    both = lh.Recording(
        np.concatenate([still.t, still.t[-1] + 0.02 + moving.t]), np.vstack([still.gyr, moving.gyr]),
        np.vstack([still.acc, moving.acc]),
    )  # fmt: skip
    model = lh.measure_noise(both)
    assert 50.0 < model.duration < 65.0 and model.recorded == pytest.approx(90.0, abs=0.1)
    assert "the longest stretch at rest, " in noise_verdict(model)[0]
    assert "moved" not in " ".join(noise_verdict(lh.measure_noise(still)))


def test_a_recording_that_moves_is_refused():
    with pytest.raises(LevelheadError, match=r"still for \d+ s at most in 60 s; noise needs 20 s"):
        measure_noise(simulate.recording("MPU-6050", "hand", 60.0))


def test_an_hour_is_not_in_two_minutes():
    with pytest.raises(LevelheadError, match="needs 10800 s at rest; the recording was still for 120 s"):
        measure_noise(simulate.recording("MPU-6050", "still", 120.0, 50.0), tau=3600.0)


def test_a_stuck_axis_is_named():
    rec = simulate.recording("MPU-6050", "still", 60.0, 50.0)
    gyr = rec.gyr.copy()
    gyr[:, 1] = 0.01
    with pytest.raises(LevelheadError, match="gyr y has the same reading throughout"):
        measure_noise(lh.Recording(rec.t, gyr, rec.acc))


@pytest.mark.slow
def test_missing_samples_are_bridged_and_losses_refused():
    rec = simulate.recording("MPU-6050", "still", 120.0, 50.0, seed=2)
    keep = np.random.default_rng(0).uniform(size=len(rec)) > 0.02
    lossy = lh.Recording(rec.t[keep], rec.gyr[keep], rec.acc[keep])
    whole, bridged = measure_noise(rec), measure_noise(lossy)
    np.testing.assert_allclose(bridged.gyr.density, whole.gyr.density, rtol=0.05)
    keep &= np.random.default_rng(1).uniform(size=len(rec)) > 0.2
    with pytest.raises(LevelheadError, match="readings missing"):
        measure_noise(lh.Recording(rec.t[keep], rec.gyr[keep], rec.acc[keep]))


@pytest.mark.slow
def test_three_minutes_of_a_real_sensor(data_dir):
    path = data_dir / "repoimu" / "TStick_Test01_Static.csv"
    allantools = pytest.importorskip("allantools")
    rec = lh.read(path)
    model = measure_noise(rec)
    assert model.duration > 175.0
    deviation = allantools.oadev(rec.gyr[:, 0], rate=100.0, data_type="freq", taus=[1.0])[1][0]
    assert model.gyr.white_noise_density.value[0] == pytest.approx(deviation, rel=0.1)
    assert not model.gyr.bias_instability.low.any()


@pytest.mark.slow
def test_a_magnetometer_without_a_unit_is_left_out():
    recording = simulate.recording("ICM-20948", "still", 30.0, 50.0)
    assert measure_noise(recording).mag is not None
    bare = dataclasses.replace(recording, meta=recording.meta | {"units": {"mag": "relative"}})
    assert measure_noise(bare).mag is None


@pytest.mark.parametrize("bits", [0.5, 1.5, 2.4])
def test_rounding_is_subtracted(bits):
    """White noise rounded to steps of so many σ: N within 8 %, where it would be 16 % to 25 % too large at 2.4."""
    random = np.random.default_rng(1)
    values = random.standard_normal((12_000, 3)) * 0.02 + [0.013, 0.2, 9.81]
    step = bits * 0.02
    rounded = np.round(values / step) * step
    model = lh.measure_noise(lh.Recording(np.arange(12_000) / 100.0, 1e-3 * values, rounded))
    assert model.acc.white_noise_density.value == pytest.approx(0.002, rel=0.08)
    assert model.gyr.rounding == 0.0
    said = [line for line in noise_verdict(model) if "N is without the rounding" in line]
    assert len(said) == (bits > 1.0)


def test_noise_below_a_bit_is_said():
    random = np.random.default_rng(1)
    values = np.round(random.standard_normal((12_000, 3)) * 0.02 / 0.08) * 0.08 + [0.0, 0.0, 9.81]
    model = lh.measure_noise(lh.Recording(np.arange(12_000) / 100.0, 1e-3 * values, values))
    assert any("so that N is of the rounding: set a smaller full scale" in line for line in noise_verdict(model))


def test_numbers_are_printed_in_the_units_of_data_sheets():
    def three(value):
        return Coefficient(*(np.full(3, factor * value) for factor in (1.0, 0.1, 0.8, 1.2)))

    gyr = TriadNoise.of(
        100.0, {
            "white_noise_density": three(np.radians(0.01)), "bias_instability": three(np.radians(10.0 / 3600.0)),
            "random_walk": three(np.radians(1e-4)), "quantisation_noise": three(0.0),
        }
    )  # fmt: skip
    cells = {row.words: row.cells(gyr)[0] for row in ROWS if row.name == "gyr"}
    assert cells["white noise N"] == "0.01 ± 0.001" and cells["bias instability B"] == "10 ± 1"
    assert cells["white noise as angle random walk"] == "0.6 ± 0.06"
    assert _instability("gyr", gyr, 600.0).startswith("gyroscope: bias instability x 10, y 10, z 10 deg/h")
