"""Drivers to the byte: what they write, what they make of bytes, and what they say when the bus fails."""

import math
import struct

import numpy as np
import pytest

import levelhead as lh
from levelhead.simulate.presets import CHIPS, MAGNETOMETERS
from levelhead.sources.sensors import (
    Port,
    SensorError,
    icm20948,
    icm42688,
    invensense,
    lsm6dso32,
    lsm6dsox,
    mpu6050,
    mpu9250,
)
from levelhead.sources.sensors.ak09916 import AK09916
from levelhead.sources.sensors.ak8963 import AK8963
from levelhead.sources.sensors.bmp280 import BMP280, Trim, compensate
from levelhead.sources.sensors.bmp390 import BMP390, PressureTrim
from levelhead.sources.sensors.bmp390 import compensate as compensate_390
from levelhead.sources.sensors.board import INERTIAL, parse_board
from levelhead.sources.sensors.compass import HMC5883L, QMC5883L
from levelhead.sources.sensors.discovery import find_chips, i2c_buses
from levelhead.sources.sensors.emulated import EmulatedBus, World
from levelhead.sources.sensors.emulated.barometer import EmulatedBMP280
from levelhead.sources.sensors.emulated.imus import EmulatedICM20948, EmulatedLSM6DSO32, EmulatedMPU6050
from levelhead.sources.sensors.emulated.magnetometers import EmulatedHMC5883L, EmulatedQMC5883L
from levelhead.sources.sensors.lis3mdl import LIS3MDL

BOARDS = ("mpu6050", "mpu9250", "lsm6dsox", "lsm6dso32", "icm20948", "icm42688")


class Memory:
    """A bus that is nothing but registers, and remembers what was written."""

    def __init__(self, **registers: int) -> None:
        self.bytes = {int(name[1:], 16): value for name, value in registers.items()}
        self.written: list[tuple[int, int]] = []

    def read_byte_data(self, i2c_addr, register):
        return self.bytes.get(register, 0)

    def write_byte_data(self, i2c_addr, register, value):
        self.written.append((register, value))

    def read_i2c_block_data(self, i2c_addr, register, length):
        return [self.bytes.get(register + i, 0) for i in range(length)]

    def close(self):
        pass


def nothing(seconds: float) -> None:
    pass


def test_mpu6050_is_set_up_as_its_register_map_says():
    bus = Memory(r75=0x68)
    chip = mpu6050.MPU6050(bus, rate=200.0, gyr_range=1000.0, acc_range=8.0, wait=nothing)
    chip.start()
    assert bus.written == [
        (0x6B, 0x80),  # reset
        (0x6B, 0x01),  # awake, clock from the gyroscope
        (0x1A, 0x02),  # DLPF 94 Hz, below half the rate
        (0x19, 4),  # 1 kHz / (1 + 4)
        (0x1B, 0x10),  # ±1000 °/s
        (0x1C, 0x10),  # ±8 g
        (0x23, 0x78),  # FIFO: gyroscope and accelerometer
        (0x6A, 0x04),  # FIFO reset
        (0x6A, 0x40),  # FIFO on
    ]


def test_lsm6dso32_is_set_up_as_its_data_sheet_says():
    bus = Memory(r0F=0x6C)
    lsm6dso32.LSM6DSO32(bus, rate=200.0, gyr_range=2000.0, acc_range=32.0, wait=nothing).start()
    assert bus.written == [
        (0x12, 0x01),  # reset
        (0x12, 0x44),  # block data update, address increment
        (0x10, 0x54),  # 208 Hz, ±32 g
        (0x11, 0x5C),  # 208 Hz, ±2000 °/s
        (0x09, 0x55),  # both into the FIFO at 208 Hz
        (0x0A, 0x00),  # bypass empties it
        (0x0A, 0x06),  # continuous
    ]


def test_icm20948_is_set_up_as_its_data_sheet_says():
    bus = Memory(r00=0xEA)
    icm20948.ICM20948(bus, rate=225.0, gyr_range=250.0, acc_range=2.0, wait=nothing).start()
    assert bus.written == [
        (0x7F, 0x00), (0x06, 0x80), (0x06, 0x01), (0x07, 0x00), (0x0F, 0x02),
        (0x7F, 0x20), (0x00, 4), (0x01, 0x19), (0x10, 0), (0x11, 4), (0x14, 0x19),  # 51.2 Hz filters
        (0x7F, 0x00), (0x69, 0x1F), (0x67, 0x1E), (0x03, 0x40), (0x68, 0x1F), (0x68, 0x00),
    ]  # fmt: skip


def test_mpu9250_is_set_up_as_its_register_map_says():
    bus = Memory(r75=0x73)  # an MPU-9255
    mpu9250.MPU9250(bus, rate=200.0, gyr_range=1000.0, acc_range=8.0, wait=nothing).start()
    assert bus.written == [
        (0x6B, 0x80), (0x6B, 0x01), (0x37, 0x02), (0x1A, 2), (0x1D, 2), (0x19, 4), (0x1B, 0x10), (0x1C, 0x10),
        (0x23, 0x78), (0x6A, 0x04), (0x6A, 0x40),
    ]  # fmt: skip


def test_lsm6dsox_has_other_codes_for_its_accelerometer():
    bus = Memory(r0F=0x6C)
    lsm6dsox.LSM6DSOX(bus, rate=104.0, gyr_range=250.0, acc_range=4.0, wait=nothing).start()
    assert (0x10, 0x48) in bus.written and (0x11, 0x40) in bus.written


def test_icm42688_is_set_up_as_its_data_sheet_says():
    bus = Memory(r75=0x47)
    icm42688.ICM42688(bus, rate=200.0, gyr_range=500.0, acc_range=4.0, wait=nothing).start()
    assert bus.written == [
        (0x76, 0x00), (0x11, 0x01),
        (0x4F, 0x47), (0x50, 0x47), (0x52, 0x11),  # 200 Hz; ±500 °/s; ±4 g; 400 Hz / 4
        (0x4E, 0x0F), (0x5F, 0x07), (0x16, 0x40), (0x4B, 0x02),
    ]  # fmt: skip


def test_a_sensor_that_was_just_switched_on_gives_no_row():
    invalid = struct.pack(">B6hBH", 0x68, 1, 2, 3, -32768, -32768, -32768, 0, 0)
    valid = struct.pack(">B6hBH", 0x68, 1, 2, 8192, 4, 5, 6, 0, 0)
    assert icm42688.rows([invalid, valid]) == ([((4, 5, 6), (1, 2, 8192))], [])


def test_lis3mdl_and_ak8963_are_set_up_as_their_data_sheets_say():
    bus = Memory(r0F=0x3D, r27=0x08)
    chip = LIS3MDL(bus, mag_range=8.0, wait=nothing)
    chip.start()
    assert bus.written == [(0x21, 0x04), (0x20, 0x7C), (0x21, 0x20), (0x23, 0x0C), (0x24, 0x40), (0x22, 0x00)]
    for i, byte in enumerate(struct.pack("<3h", 3421, -3421, 342)):
        bus.bytes[0xA8 + i] = byte  # with the bit that lets the address increase
    assert chip.read() == pytest.approx((100.0, -100.0, 9.997), abs=1e-3)
    bus = Memory(r00=0x48, r02=0x01, r10=128, r11=256 - 64, r12=128)
    chip = AK8963(bus, wait=nothing)
    chip.start()
    assert bus.written == [(0x0B, 1), (0x0A, 0x0F), (0x0A, 0x00), (0x0A, 0x16)]
    for i, byte in enumerate(struct.pack("<3h", 100, 200, 300)):
        bus.bytes[0x03 + i] = byte
    assert chip.read() == pytest.approx((200 * 0.15 * 1.25, 15.0, -45.0))  # y, x, −z; the second is 25 % larger


@pytest.mark.parametrize("dps, g, gyr, acc", [(250, 2, 131.0, 16384.0), (2000, 16, 16.4, 2048.0)])
def test_mpu6050_burst_by_hand(dps, g, gyr, acc):
    chip = mpu6050.MPU6050(Memory(r75=0x68), gyr_range=dps, acc_range=g, wait=nothing)
    assert (chip.gyr_scale, chip.acc_scale) == pytest.approx((math.radians(1.0 / gyr), 9.80665 / acc), rel=1e-15)
    found = mpu6050.output(struct.pack(">7h", 100, -200, 16384, -521, 131, -262, 32767))
    assert found.gyr == (131, -262, 32767) and found.acc == (100, -200, 16384)
    assert found.temperature == pytest.approx(35.0, abs=0.01)  # the register map's -521: 36.53 - 521/340


def test_the_words_of_other_chips_by_hand():
    chip = lsm6dso32.LSM6DSO32(Memory(), gyr_range=250, acc_range=4, wait=nothing)
    assert (chip.gyr_scale, chip.acc_scale) == pytest.approx((math.radians(8.75e-3), 9.80665e-3 * 0.122), rel=1e-15)
    found = lsm6dso32.output(struct.pack("<7h", 256, 100, -200, 300, 1000, -2000, 8197))
    assert found == ((100, -200, 300), (1000, -2000, 8197), 26.0)
    bus = Memory(r0A=ord("H"), r0B=ord("4"), r0C=ord("3"), r09=1)
    for i, byte in enumerate(struct.pack(">3h", 100, -300, 200)):  # x, z, y
        bus.bytes[0x03 + i] = byte
    assert HMC5883L(bus, wait=nothing).read() == pytest.approx([100 / 10.9, 200 / 10.9, -300 / 10.9])
    bus = Memory(r06=1)
    for i, byte in enumerate(struct.pack("<3h", 3000, -1500, 600)):
        bus.bytes[i] = byte
    assert QMC5883L(bus, wait=nothing).read() == pytest.approx([100.0, -50.0, 20.0])
    bus = Memory(r10=1)
    for i, byte in enumerate(struct.pack("<3h", 100, -200, 300)):
        bus.bytes[0x11 + i] = byte
    assert AK09916(bus, wait=nothing).read() == pytest.approx([15.0, 30.0, -45.0])  # y and z the other way


def test_scale_factors_are_those_of_the_simulator_s_data_sheets():
    """Two tables from the same documents, for different purposes, must not drift apart."""
    sheets = {chip.name: chip for chip in CHIPS}

    def bits(counts):
        return {full_scale: 1.0 / value for full_scale, value in counts.items()}

    for name, gyr, acc in (
        ("MPU-6050", bits(invensense.GYR_COUNTS), bits(invensense.ACC_COUNTS)),
        ("ICM-20948", bits(invensense.GYR_COUNTS), bits(invensense.ACC_COUNTS)),
        ("LSM6DSO32", lsm6dso32.GYR_BITS, lsm6dso32.ACC_BITS),
    ):
        assert {k: s.bit for k, s in sheets[name].gyr.scales.items()} == pytest.approx(gyr)
        assert {k: s.bit for k, s in sheets[name].acc.scales.items()} == pytest.approx(acc)
    for mag in (HMC5883L, QMC5883L):
        assert {k: s.bit for k, s in MAGNETOMETERS[mag.name].scales.items()} == pytest.approx(
            {k: 1 / v for k, v in mag.COUNTS.items()}
        )
    assert MAGNETOMETERS["AK09916"].scales[4900].bit == AK09916.SCALE


def test_bmp280_compensation_is_the_data_sheet_s_example():
    trim = Trim(27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)
    pressure, temperature = compensate(trim, 415148, 519888)
    assert pressure == pytest.approx(100653.27, abs=0.005)
    assert temperature == pytest.approx(25.08, abs=0.005)
    assert Trim.unpack(struct.pack("<HhhHhhhhhhhh", *trim)) == trim


@pytest.mark.parametrize("pressure, temperature", [(101325.0, 25.0), (95000.0, -5.0), (30000.0, 60.0)])
def test_bmp280_through_the_bus(bench, pressure, temperature):
    one = bench("mpu6050+bmp280")
    one.world.pressure, one.world.temperature = pressure, temperature
    baro = BMP280(one.bus, clock=one.clock, wait=one.clock.wait)
    baro.start()
    assert baro.read() is None  # nothing was measured yet
    one.clock.wait(0.05)
    found = baro.read()
    assert found.pressure == pytest.approx(pressure, abs=0.3) and found.temperature == pytest.approx(
        temperature, abs=0.01
    )
    assert baro.read() is None  # not twice


def test_bmp390_coefficients_by_hand():
    """The powers of two of the data sheet's table in 8.4, one coefficient at a time."""
    data = struct.pack("<HHbhhbbHHbbhbb", 1, 2, 3, 16385, 16386, 4, 5, 6, 7, 8, 9, 10, 11, 12)
    trim = PressureTrim.unpack(data)
    assert trim == (
        256.0, 2 / 2**30, 3 / 2**48, 1 / 2**20, 2 / 2**29, 4 / 2**32, 5 / 2**37, 48.0, 7 / 64, 8 / 256, 9 / 2**15,
        10 / 2**48, 11 / 2**48, 12 / 2**65,
    )  # fmt: skip
    found = compensate_390(PressureTrim(*(0.0,) * 7, 100.0, *(0.0,) * 6)._replace(p1=0.5, t2=1.0, p9=0.25), 4, 3)
    assert found == (100.0 + 2.0 + 4.0, 3.0)


@pytest.mark.parametrize("pressure, temperature", [(101325.0, 25.0), (95000.0, -5.0), (30000.0, 60.0)])
def test_bmp390_through_the_bus(bench, pressure, temperature):
    one = bench("mpu6050+bmp390")
    one.world.pressure, one.world.temperature = pressure, temperature
    baro = BMP390(one.bus, wait=one.clock.wait)
    baro.start()
    assert baro.read() is None  # nothing was measured yet
    one.clock.wait(0.05)
    found = baro.read()
    assert found.pressure == pytest.approx(pressure, abs=0.1)
    assert found.temperature == pytest.approx(temperature, abs=0.001)
    assert baro.read() is None  # not twice


@pytest.mark.parametrize("text", BOARDS)
@pytest.mark.parametrize("gyr_range, acc_range", [(500.0, 4.0), (2000.0, 16.0)])
def test_what_the_chip_feels_is_what_the_driver_says(bench, recording, text, gyr_range, acc_range):
    """Through all registers, to half a bit: every sample once, none left out, none made up."""
    one = bench(text, gyr_range=gyr_range, acc_range=acc_range)
    one.board.start()
    samples = []
    for pause in np.random.default_rng(3).uniform(0.002, 0.02, 400).tolist():
        one.clock.wait(pause)
        samples += one.board.poll()
    began = next(iter(one.bus.chips.values())).since - one.world.began
    driver = one.board.drivers[0]
    whole = int((one.clock.now - one.world.began - began) * driver.rate)
    skipped = 9 if text == "icm42688" else 0  # while its gyroscope starts up, 45 ms
    expected = [one.world.at(began + k / driver.rate) for k in range(1 + skipped, whole + 1)]
    assert len(samples) == whole - skipped
    for name, scale in (("gyr", driver.gyr_scale), ("acc", driver.acc_scale)):
        have = np.array([getattr(sample, name) for sample in samples])
        want = (
            np.clip(np.round(np.array([getattr(moment, name) for moment in expected]) / scale), -32768, 32767) * scale
        )
        np.testing.assert_allclose(have, want, rtol=1e-14)
    assert one.board.lost == one.board.retried == 0


@pytest.mark.parametrize(
    "text, mag",
    [
        ("mpu6050+hmc5883l", 75.0),
        ("mpu6050+qmc5883l", 100.0),
        ("icm20948", 100.0),
        ("mpu9250", 100.0),
        ("lsm6dsox+lis3mdl", 80.0),
    ],
)
def test_a_magnetometer_beside_it(bench, recording, text, mag):
    one = bench(text)
    one.board.start()
    fields = []
    for _ in range(400):
        one.clock.wait(0.005)
        fields += [sample.mag for sample in one.board.poll() if sample.mag is not None]
    assert 0.8 * 2.0 * mag <= len(fields) <= 1.01 * 2.0 * mag  # in 2 s, and never one twice
    error = np.array(fields[:20]) - recording.mag[:20].mean(axis=0)  # still at the beginning
    assert np.abs(error.mean(axis=0)).max() < 0.5


@pytest.mark.parametrize("text", BOARDS)
def test_a_transfer_that_fails_now_and_then_is_tried_again(bench, text):
    one = bench(text)
    one.board.start()
    count = 0
    for i in range(200):
        if i % 10 == 0:
            one.bus.nack = 1  # hits the question how much there is
        one.clock.wait(0.005)
        count += len(one.board.poll())
    assert one.board.retried == 20 and one.board.failed == 0 and one.board.lost == 0
    assert count == pytest.approx(one.board.rate, abs=1.0)


@pytest.mark.parametrize("text", BOARDS)
def test_faults_of_the_bus_have_names(bench, text):
    one = bench(text)
    one.board.start()
    for fault, kind, words in (
        ({"unplugged": True}, "bus_error", "does not answer"),
        ({"stuck": "low"}, "bus_stuck", "a line is held down"),
        ({"stuck": "high"}, "implausible", "nothing but zeros or ones"),
    ):
        for name, value in fault.items():
            setattr(one.bus, name, value)
        one.clock.wait(0.01)
        with pytest.raises(SensorError, match=words) as caught:
            one.board.poll()
        assert caught.value.kind == kind
        one.bus.unplugged, one.bus.stuck = False, None
    one.board.restart()
    one.clock.wait(0.05)
    assert one.board.poll()


@pytest.mark.parametrize("text", ["mpu6050+hmc5883l+bmp280", "mpu6050+qmc5883l"])
def test_a_chip_beside_it_that_fails_is_said_and_the_rest_goes_on(bench, text):
    one = bench(text)
    one.board.start()
    others = {address: one.bus.chips.pop(address) for address in list(one.bus.chips) if address != 0x68}
    count, kinds = 0, set()
    for _ in range(200):
        one.clock.wait(0.005)
        samples = one.board.poll()
        count += len(samples)
        kinds |= {kind for kind, _ in one.board.troubles()}
        assert all(sample.mag is None and sample.pressure is None for sample in samples)
    assert count == pytest.approx(200, abs=1) and kinds == {"bus_error"} and one.board.lost == 0
    for chip in others.values():
        chip.reset()  # back, as after power-up
    one.bus.chips |= others
    fields = []
    for _ in range(400):
        one.clock.wait(0.005)
        fields += [sample.mag for sample in one.board.poll() if sample.mag is not None]
    assert len(fields) > 40 and one.board.troubles() == []


@pytest.mark.parametrize("text", BOARDS)
def test_a_fifo_that_ran_over_is_said_and_never_torn(bench, text):
    one = bench(text)
    one.board.start()
    one.clock.wait(0.05)
    before = one.board.poll()
    one.clock.wait(5.0)
    assert one.board.poll() == []
    assert one.board.lost == 1 and [kind for kind, _ in one.board.troubles()] == ["samples_lost"]
    assert one.board.troubles() == []
    one.clock.wait(0.05)
    after = one.board.poll()
    assert after[0].t > before[-1].t + 4.0
    for sample in after:  # torn rows would be far from anything that was simulated
        assert abs(np.linalg.norm(sample.acc) - 9.8) < 8.0


def test_a_transfer_that_breaks_off_in_a_fifo_loses_it_and_says_so(bench):
    one = bench("mpu6050")
    one.board.start()
    one.clock.wait(0.05)
    read = one.bus.read_i2c_block_data

    def break_off(address, register, length):
        if register == mpu6050.FIFO_R_W:
            one.bus.nack = 1
        return read(address, register, length)

    one.bus.read_i2c_block_data = break_off
    assert one.board.poll() == [] and one.board.lost == 1
    one.bus.read_i2c_block_data = read
    one.clock.wait(0.05)
    assert len(one.board.poll()) == 10


@pytest.mark.parametrize("text", BOARDS)
def test_a_chip_that_lost_its_power_gives_no_samples(bench, text):
    """After a brown-out it sleeps: nothing new comes, and no zeros."""
    one = bench(text)
    one.board.start()
    one.clock.wait(0.05)
    assert one.board.poll()
    next(iter(one.bus.chips.values())).reset()
    for _ in range(5):
        one.clock.wait(0.05)
        assert one.board.poll() == []
    with pytest.raises(SensorError, match="nothing but zeros or ones"):
        one.board.drivers[0].port.burst(INERTIAL[text].args[0].output_register + 2, 12)


@pytest.mark.parametrize(
    "chip, driver, said",
    [
        (lambda w: EmulatedMPU6050(w, identity=0x70), mpu6050.MPU6050, "identity 0x70; expected 0x68, a MPU-6050"),
        (lambda w: EmulatedLSM6DSO32(w, identity=0x69), lsm6dso32.LSM6DSO32, "expected 0x6c, a LSM6DSO32"),
        (lambda w: EmulatedICM20948(w, identity=0x71), icm20948.ICM20948, "expected 0xea, a ICM-20948"),
        (lambda w: EmulatedHMC5883L(w, identity=b"H44"), HMC5883L, "has identity 0x34; expected 0x33"),
        (lambda w: EmulatedQMC5883L(w, identity=0x00), QMC5883L, "expected 0xff, a QMC5883L"),
        (lambda w: EmulatedBMP280(w, identity=0x60), BMP280, "has identity 0x60; expected 0x58, a BMP280"),
    ],
)  # fmt: skip
def test_another_chip_at_the_address_is_refused(bench, chip, driver, said):
    one = bench("mpu6050")
    with pytest.raises(SensorError, match=said) as caught:
        driver(EmulatedBus(chip(one.world)), wait=one.clock.wait).start()
    assert caught.value.kind == "wrong_chip"


def test_the_emulated_bus_keeps_smbus_s_limits(bench):
    one = bench("mpu6050")
    with pytest.raises(ValueError, match="32"):
        one.bus.read_i2c_block_data(0x68, 0x74, 33)
    with pytest.raises(OSError, match="Remote I/O"):
        one.bus.read_byte_data(0x10, 0)
    assert one.bus.read_byte_data(0x68, 0x75) == 0x68
    port = Port(one.bus, 0x10, "nobody", wait=nothing)
    with pytest.raises(SensorError):
        port.write(0, 1)
    assert (port.retried, port.failed) == (3, 1)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: mpu6050.MPU6050(Memory(), gyr_range=300), "gyr range 300 deg/s does not exist; the MPU-6050 has 250"),
        (lambda: lsm6dso32.LSM6DSO32(Memory(), acc_range=2), "acc range 2 g does not exist; the LSM6DSO32 has 4, 8"),
        (lambda: mpu6050.MPU6050(Memory(), rate=3000), "cannot give 3000 samples a second; expected 3.90625 to 1000"),
        (lambda: parse_board("mpu6051"), "there is no driver for 'mpu6051'; did you mean 'mpu6050'?"),
        (lambda: parse_board("hmc5883l"), "'hmc5883l' is not a board"),
        (lambda: parse_board("mpu6050+icm20948"), "is not a board"),
        (lambda: parse_board("mpu6050@one"), "there is no bus behind @"),
    ],
)  # fmt: skip
def test_what_does_not_exist_is_refused(make, said):
    with pytest.raises(lh.LevelheadError) as caught:
        make()
    assert said in str(caught.value)


def test_a_board_in_words():
    assert parse_board("mpu6050") == ("mpu6050", None, None, 1, None)
    assert parse_board("MPU-6050+HMC5883L+bmp280@0:0x69") == ("mpu6050", "hmc5883l", "bmp280", 0, 0x69)
    assert parse_board("icm20948").mag == "ak09916"


@pytest.mark.parametrize(
    "text", ["mpu6050+hmc5883l+bmp280", "lsm6dsox+lis3mdl+bmp390", "mpu6050@1:0x69", "icm20948", "mpu9250", "icm42688"]
)
def test_chips_on_a_bus_are_found_without_writing(bench, text):
    one = bench(text)
    wanted = parse_board(text)
    writes = []
    one.bus.write_byte_data = lambda *what: writes.append(what)
    found = {chip.name for chip in find_chips(one.bus)}
    expected = {wanted.inertial, wanted.mag, wanted.baro} - {None}
    assert (
        found == expected - {"ak09916", "ak8963"} and writes == []
    )  # behind a bypass they answer once their host runs
    next(iter(one.bus.chips.values())).identity = 0x11
    next(iter(one.bus.chips.values())).reset()
    assert "" in {chip.name for chip in find_chips(one.bus)}  # another chip at the address


def test_buses_of_the_machine(tmp_path):
    for name in ("i2c-1", "i2c-10", "i2c-", "tty0"):
        (tmp_path / name).touch()
    assert i2c_buses(tmp_path) == [1, 10]


def test_the_world_is_the_recording_over_and_over():
    """A row begins at its stamp, though 0.29 s times 100 Hz is a bit below 29, and the first follows on the last."""
    n = 300
    gyr = np.arange(3.0 * n).reshape(n, 3)
    world = World(lh.Recording(np.arange(n) / 100.0, gyr, gyr + 0.5), lambda: 0.0)
    assert [world.row(k / 100.0) for k in range(2 * n)] == [*range(n), *range(n)]
    assert world.row(0.299) == 29
    assert world.at(0.29).gyr == tuple(gyr[29]) and world.at(0.29 + n / 100.0).acc == tuple(gyr[29] + 0.5)
