"""The sensor model: each effect alone, exactly or within the bounds of its statistics."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levelhead import simulate
from levelhead.errors import LevelheadError
from levelhead.simulate import Bumps, Imu, Iron, TriadErrors, Vibration
from levelhead.simulate.triad_errors import digitise

G = 9.80665


@pytest.fixture(scope="module")
def hand():
    return simulate.motion(1, 30)


@pytest.fixture(scope="module")
def still():
    return simulate.motion(0, 200, 100, style="still")


def test_a_perfect_sensor_reads_the_truth(hand):
    recording = simulate.observe(hand, Imu(mag=TriadErrors()))
    np.testing.assert_array_equal(recording.gyr, hand.gyr)
    np.testing.assert_array_equal(recording.acc, hand.specific_force)
    np.testing.assert_allclose(recording.mag, hand.to_body(np.array([0.0, 19.0, -45.0])), atol=1e-12)
    np.testing.assert_allclose(recording.truth.quat, hand.quat, atol=1e-15)
    assert not recording.truth.bias.any()
    assert recording.truth.north


@pytest.mark.parametrize("rate", [100.0, 400.0])
def test_white_noise_density_comes_back_from_a_still_recording(rate):
    motion = simulate.motion(0, 100, rate, style="still")
    recording = simulate.observe(motion, Imu(gyr=TriadErrors(white_noise_density=(1e-4, 2e-4, 3e-4))), 5)
    n = len(recording)
    found = np.std(recording.gyr, axis=0) / np.sqrt(rate)
    # The relative deviation of an estimated σ is 1/√(2n); four of them.
    np.testing.assert_allclose(found, [1e-4, 2e-4, 3e-4], rtol=4.0 / np.sqrt(2 * n))


def test_an_accelerometer_at_rest_is_off_by_bias_and_noise(still):
    triad = TriadErrors(white_noise_density=0.004, turn_on_bias=0.3)
    recording = simulate.observe(still, Imu(acc=triad), 2)
    drawn = recording.meta["true_errors"]["acc"]
    rest = recording.acc - [0.0, 0.0, G] - drawn["turn_on_bias"]
    assert np.std(rest) == pytest.approx(0.04, rel=0.03)
    assert np.abs(rest.mean(axis=0)).max() < 4 * 0.04 / np.sqrt(len(still))


def test_truth_bias_is_all_of_the_gyroscope_bias(hand):
    triad = TriadErrors(turn_on_bias=0.05, bias_instability=1e-3, correlation_time=5.0, random_walk=1e-3)
    recording = simulate.observe(hand, Imu(gyr=triad), 3)
    np.testing.assert_allclose(recording.gyr - recording.truth.bias, hand.gyr, atol=1e-15)
    assert np.ptp(recording.truth.bias, axis=0).min() > 1e-3


@pytest.mark.slow
def test_turn_on_bias_has_the_stated_deviation():
    motion = simulate.motion(0, 0.02, 100, style="still")
    imu = Imu(gyr=TriadErrors(turn_on_bias=(0.1, 0.2, 0.3)))
    biases = np.array([simulate.observe(motion, imu, seed).truth.bias[0] for seed in range(1000)])
    np.testing.assert_allclose(biases.std(axis=0), [0.1, 0.2, 0.3], rtol=0.08)
    np.testing.assert_allclose(biases.mean(axis=0), 0.0, atol=0.03)


def test_matrix_holds_scale_factor_and_misalignment(hand):
    recording = simulate.observe(hand, Imu(gyr=TriadErrors(scale_factor=0.02, misalignment=0.01)), 4)
    matrix = recording.meta["true_errors"]["gyr"]["matrix"]
    np.testing.assert_allclose(recording.gyr, hand.gyr @ matrix.T, atol=1e-14)
    solved = np.linalg.lstsq(hand.gyr, recording.gyr, rcond=None)[0].T
    np.testing.assert_allclose(solved, matrix, atol=1e-12)


@pytest.mark.slow
def test_matrix_has_the_stated_deviations():
    motion = simulate.motion(0, 0.02, 100, style="still")
    imu = Imu(gyr=TriadErrors(scale_factor=0.02, misalignment=0.01))
    matrices = [simulate.observe(motion, imu, seed).meta["true_errors"]["gyr"]["matrix"] for seed in range(600)]
    spread = np.std(matrices, axis=0)
    np.testing.assert_allclose(np.diag(spread), 0.02, rtol=0.12)
    np.testing.assert_allclose(spread[~np.eye(3, dtype=bool)], 0.01, rtol=0.12)


def test_saturation_is_exact(hand):
    recording = simulate.observe(hand, Imu(gyr=TriadErrors(full_scale=1.0)))
    np.testing.assert_array_equal(recording.gyr, np.clip(hand.gyr, -1.0, 1.0))
    assert (recording.gyr == 1.0).any()
    assert (recording.gyr == -1.0).any()


def test_quantisation_is_exact(hand):
    recording = simulate.observe(hand, Imu(acc=TriadErrors(quantisation=0.25)))
    np.testing.assert_array_equal(recording.acc, np.rint(hand.specific_force / 0.25) * 0.25)


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20),
    st.floats(0.01, 1e4),
    st.integers(1, 1 << 16),
)
def test_digitised_values_are_codes_within_full_scale(values, full_scale, codes):
    bit = full_scale / codes
    out = digitise(np.array(values), full_scale, bit)
    assert np.abs(out).max() <= full_scale * (1 + 1e-12)
    np.testing.assert_allclose(out / bit, np.rint(out / bit), atol=1e-6)
    inside = np.abs(values) < full_scale
    assert np.abs(out - values)[inside].max(initial=0.0) <= bit * (0.5 + 1e-6)


def test_a_full_scale_between_two_codes_is_not_exceeded():
    np.testing.assert_array_equal(digitise(np.array([-9.0, 9.0]), 1.0, 0.3), [-3 * 0.3, 3 * 0.3])


def test_vibration_is_a_sine_along_its_direction(still):
    shake = Vibration(amplitude=2.0, frequency=10.0, direction=(0.0, 3.0, 4.0))
    shaken = simulate.observe(still, Imu(acc=TriadErrors(vibration=shake)), 6).acc - [0.0, 0.0, G]
    assert not shaken[:, 0].any()
    along = shaken @ [0.0, 0.6, 0.8]
    assert np.sqrt(2.0) * np.std(along) == pytest.approx(2.0, rel=1e-3)
    np.testing.assert_allclose(shaken @ [0.0, 0.8, -0.6], 0.0, atol=1e-12)
    spectrum = np.abs(np.fft.rfft(along))
    assert np.fft.rfftfreq(len(along), 0.01)[spectrum.argmax()] == pytest.approx(10.0)


def test_vibration_decays(still):
    shake = Vibration(amplitude=1.0, frequency=7.0, decay=20.0)
    shaken = simulate.observe(still, Imu(acc=TriadErrors(vibration=shake))).acc[:, 2] - G
    early, late = np.std(shaken[:1000]), np.std(shaken[2000:3000])
    assert late / early == pytest.approx(np.exp(-1.0), rel=0.02)


def test_bumps_are_half_sines_at_the_stated_rate(still):
    triad = TriadErrors(bumps=Bumps(per_minute=30.0, amplitude=5.0, duration=0.1))
    shocks = np.linalg.norm(simulate.observe(still, Imu(acc=triad), 8).acc - [0.0, 0.0, G], axis=1)
    begins = np.flatnonzero(np.diff(shocks > 1e-9, prepend=False) & (shocks > 1e-9))
    assert 70 <= len(begins) <= 130  # Poisson around 100, some overlapping
    alone = [b for b, after in pairwise(begins) if after - b > 25]
    width = [np.flatnonzero(shocks[b : b + 25] > 1e-9).max() + 1 for b in alone]
    assert np.median(width) == 10
    assert np.median([shocks[b : b + 10].max() for b in alone]) == pytest.approx(5.0, rel=0.02)


def test_hard_and_soft_iron(hand):
    iron = Iron((10.0, -20.0, 5.0), ((1.1, 0.02, 0.0), (0.02, 0.9, 0.01), (0.0, 0.01, 1.05)))
    recording = simulate.observe(hand, Imu(mag=TriadErrors(), iron=iron), field=(0.0, 20.0, -40.0))
    field = hand.to_body(np.array([0.0, 20.0, -40.0]))
    np.testing.assert_allclose(recording.mag, field @ np.array(iron.soft).T + iron.hard, atol=1e-12)


def test_declination_means_that_y_is_not_magnetic_north(hand):
    assert not simulate.observe(hand, Imu(mag=TriadErrors()), field=(2.0, 19.0, -45.0)).truth.north


def test_same_seed_same_bits_and_other_seed_other_bits():
    one, two, other = (simulate.recording("ICM-20948", "hand", 5.0, seed=seed) for seed in (3, 3, 4))
    for name in ("gyr", "acc", "mag"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert (getattr(one, name) != getattr(other, name)).any()
    np.testing.assert_array_equal(one.truth.bias, two.truth.bias)


def test_sensors_and_axes_are_independent(still):
    noisy = TriadErrors(white_noise_density=0.01)
    recording = simulate.observe(still, Imu(noisy, noisy, noisy), 9)
    columns = np.hstack([recording.gyr, recording.acc, recording.mag])
    correlation = np.corrcoef(columns.T) - np.eye(9)
    assert np.abs(correlation).max() < 4.5 / np.sqrt(len(still))


def test_effects_have_streams_of_their_own(hand):
    """Switching one effect off leaves the numbers of all others."""
    full = simulate.imu("MPU-6050").gyr
    full = replace(full, quantisation=0.0, full_scale=np.inf)
    with_walk = simulate.observe(hand, Imu(gyr=full), 1)
    without = simulate.observe(hand, Imu(gyr=replace(full, random_walk=0.0)), 1)
    noise = [recording.gyr - recording.truth.bias for recording in (with_walk, without)]
    np.testing.assert_allclose(noise[0], noise[1], atol=1e-14)


def test_inputs_are_not_touched(hand):
    before = hand.gyr.copy()
    simulate.observe(hand, simulate.imu("MPU-6050"), 1)
    np.testing.assert_array_equal(hand.gyr, before)


@pytest.mark.parametrize(
    "make",
    [
        lambda: TriadErrors(white_noise_density=-1.0),
        lambda: TriadErrors(turn_on_bias=(1.0, 2.0)),
        lambda: TriadErrors(correlation_time=0.0),
        lambda: TriadErrors(full_scale=np.nan),
        lambda: TriadErrors(random_walk=np.inf),
        lambda: Vibration(-1.0, 10.0),
        lambda: Vibration(1.0, 10.0, (0.0, 0.0, 0.0)),
        lambda: Vibration(1.0, 10.0, decay=0.0),
        lambda: Bumps(-1.0, 1.0),
        lambda: Bumps(1.0, 1.0, 0.0),
        lambda: Iron((1.0, 2.0)),
        lambda: Iron((1.0, 2.0, np.nan)),
        lambda: simulate.observe(simulate.motion(0, 1), Imu(), -1),
        lambda: simulate.observe(simulate.motion(0, 1), Imu(), field=(1.0, 2.0)),
    ],
)
def test_bad_values_raise_one_sentence(make):
    with pytest.raises(LevelheadError, match=r"expected [^\n]+$"):
        make()
