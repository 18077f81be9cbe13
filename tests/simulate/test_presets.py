"""The chips hold what their data sheets print, in SI units."""

import math

import numpy as np
import pytest

from levelhead import simulate
from levelhead.errors import LevelheadError

G = 9.80665
CHIPS = [chip.name for chip in simulate.CHIPS]


def test_mpu_6050_against_its_product_specification():
    """PS-MPU-6000A-00 rev 3.4, sections 6.1 and 6.2."""
    imu = simulate.imu("MPU-6050", gyr_range=250, acc_range=2)
    assert imu.gyr.quantisation == pytest.approx(math.radians(1 / 131))
    assert imu.gyr.full_scale == pytest.approx(math.radians(250), rel=1e-3)
    assert imu.gyr.white_noise_density == pytest.approx(math.radians(0.005) / math.sqrt(2))
    assert np.multiply(imu.gyr.turn_on_bias, 3) == pytest.approx([math.radians(20)] * 3)
    assert imu.gyr.scale_factor == pytest.approx(0.01)
    assert imu.gyr.misalignment == pytest.approx(0.02 / 3)
    assert imu.acc.quantisation == pytest.approx(G / 16384)
    assert imu.acc.full_scale == pytest.approx(2 * G, rel=1e-4)
    assert imu.acc.white_noise_density == pytest.approx(400e-6 * G / math.sqrt(2))
    assert np.multiply(imu.acc.turn_on_bias, 3) == pytest.approx([0.05 * G, 0.05 * G, 0.08 * G])
    assert imu.mag is None


def test_total_rms_noise_of_the_data_sheet():
    """Section 6.1: 0.05 °/s rms in a bandwidth of 100 Hz, which is a rate of 200 Hz; 0.005 °/s/√Hz gives just that."""
    motion = simulate.motion(0, 60, 200, style="still")
    gyr = simulate.observe(motion, simulate.imu("MPU-6050", gyr_range=250), 1).gyr
    assert np.degrees(np.std(gyr, axis=0)) == pytest.approx([0.05] * 3, rel=0.03)


def test_one_sided_density_of_the_spectrum_is_the_data_sheets():
    from scipy.signal import welch

    motion = simulate.motion(0, 120, 200, style="still")
    acc = simulate.observe(motion, simulate.imu("LSM6DSO32", acc_range=4), 1).acc
    frequency, power = welch(acc[:, 0], 200.0, nperseg=512)
    assert np.sqrt(np.mean(power[(frequency > 5) & (frequency < 90)])) / G == pytest.approx(120e-6, rel=0.03)


def test_noise_density_follows_the_full_scale():
    densities = [simulate.imu("LSM6DSO32", acc_range=g).acc.white_noise_density for g in (4, 8, 16, 32)]
    assert np.array(densities) * math.sqrt(2) / G == pytest.approx([120e-6, 130e-6, 160e-6, 220e-6])


@pytest.mark.parametrize(
    ("name", "lsb"), [("HMC5883L", 100 / 1090), ("QMC5883L", 100 / 3000), ("AK09916", 0.15), ("qmc-5883l", 100 / 3000)]
)
def test_magnetometers(name, lsb):
    imu = simulate.imu("MPU-6050", mag=name)
    assert imu.mag.quantisation == pytest.approx(lsb)
    assert 40 < imu.mag.full_scale < 6000  # µT: the earth's field fits


def test_hmc5883l_noise_is_two_milligauss_at_75_hz():
    assert simulate.imu(mag="HMC5883L").mag.white_noise_density * math.sqrt(75) == pytest.approx(0.2)


@pytest.mark.parametrize("name", CHIPS)
def test_every_chip_records_and_stays_within_its_range(name):
    imu = simulate.imu(name)
    recording = simulate.recording(name, "walking", 5.0)
    assert np.abs(recording.gyr).max() <= imu.gyr.full_scale
    assert np.abs(recording.acc).max() <= imu.acc.full_scale
    codes = recording.gyr / imu.gyr.quantisation
    np.testing.assert_allclose(codes, np.rint(codes), atol=1e-6)
    assert recording.valid.all()
    assert recording.meta["sensor"] == name
    assert recording.meta["motion"] == "walking"


@pytest.mark.parametrize("name", CHIPS)
def test_every_legal_range_works(name):
    chip = next(chip for chip in simulate.CHIPS if chip.name == name)
    for gyr_range in chip.gyr.scales:
        for acc_range in chip.acc.scales:
            imu = simulate.imu(name, gyr_range=gyr_range, acc_range=acc_range)
            assert imu.gyr.full_scale >= math.radians(gyr_range) * 0.998
            assert imu.acc.full_scale >= acc_range * G * 0.998


@pytest.mark.parametrize("name", ["mpu6050", "MPU-6050", "mpu_6050", "Mpu 6050"])
def test_names_are_forgiving(name):
    assert simulate.imu(name) == simulate.imu("MPU-6050")


def test_icm_20948_brings_its_magnetometer():
    assert simulate.recording("icm20948", duration=1.0).mag is not None


def test_unknown_names_name_the_nearest():
    with pytest.raises(LevelheadError, match="did you mean 'MPU-6050'"):
        simulate.imu("MPU-6500x")
    with pytest.raises(LevelheadError, match="did you mean 'HMC5883L'"):
        simulate.imu(mag="HMC5833")


def test_a_range_that_does_not_exist_names_those_that_do():
    with pytest.raises(LevelheadError, match="the chip has 4, 8, 16, 32"):
        simulate.imu("LSM6DSO32", acc_range=2)


def test_iron_without_a_magnetometer_is_refused():
    with pytest.raises(LevelheadError, match="no magnetometer"):
        simulate.imu("BMI160", iron=simulate.Iron())


def test_recording_defaults():
    recording = simulate.recording()
    assert len(recording) == 6000
    assert recording.mag is None
    assert recording.truth.bias.shape == (6000, 3)
    with_mag = simulate.recording(duration=2.0, mag="HMC5883L", iron=simulate.Iron((300.0, 0.0, 0.0)))
    assert with_mag.meta["sensor"] == "MPU-6050 + HMC5883L"
    assert with_mag.mag[:, 0].mean() > 150.0
