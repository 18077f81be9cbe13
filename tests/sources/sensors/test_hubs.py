"""BNO055 and BNO085 to the byte: sensors and their own orientation, what is missed, and what is not them."""

import math
import struct

import numpy as np
import pytest

import levelhead as lh
from levelhead.rotations import rotate
from levelhead.sources.sensors import AxisMap, SensorError
from levelhead.sources.sensors.bno055 import BNO055
from levelhead.sources.sensors.bno085 import BNO085, split_reports
from levelhead.sources.sensors.board import parse_board
from levelhead.sources.sensors.discovery import find_chips
from levelhead.sources.sensors.emulated import EmulatedBus
from levelhead.sources.sensors.emulated.hubs import EmulatedBNO055

pytest.importorskip("smbus2", reason="smbus2 is not installed (extra levelhead[live])")

HUBS = ("bno055", "bno085")


class Registers:
    """A bus that is nothing but registers."""

    def __init__(self, memory: dict[int, int]) -> None:
        self.memory, self.written = memory, []

    def read_byte_data(self, i2c_addr, register):
        return self.memory.get(register, 0)

    def write_byte_data(self, i2c_addr, register, value):
        self.written.append((register, value))

    def read_i2c_block_data(self, i2c_addr, register, length):
        return [self.memory.get(register + i, 0) for i in range(length)]

    def close(self):
        pass


class Packets:
    """A bus with a hub that gives packets which were made by hand, a header or all of it at a time."""

    def __init__(self, *packets: bytes) -> None:
        self.packets, self.written = list(packets), []

    def i2c_rdwr(self, *messages):
        for message in messages:
            if not message.flags & 1:
                self.written.append(bytes(message))
                continue
            data = self.packets[0] if self.packets else bytes(4)
            for i in range(message.len):
                message.buf[i] = data[i : i + 1]
            if message.len > 4:
                assert message.len == len(data)
                self.packets.pop(0)

    def close(self):
        pass


def nothing(seconds: float) -> None:
    pass


def test_bno055_is_set_up_and_read_as_its_data_sheet_says():
    bus = Registers({0x00: 0xA0})
    chip = BNO055(bus, clock=lambda: 5.0, wait=nothing)
    chip.start()
    assert bus.written == [(0x07, 0), (0x3D, 0), (0x3F, 0x20), (0x3E, 0), (0x3B, 0), (0x3D, 0x0C)]
    words = (100, -200, 981, 320, -640, 800, 16, -32, 48, 0, 0, 0, 8192, -8192, 8192, 8192)
    for i, byte in enumerate(struct.pack("<16h", *words)):
        bus.memory[0x08 + i] = byte
    found = chip.drain()
    assert found.rows == [(pytest.approx([math.radians(n) for n in (1, -2, 3)]), pytest.approx([1.0, -2.0, 9.81]))]
    assert found.mag == (20.0, -40.0, 50.0) and found.attitude == (0.5, -0.5, 0.5, 0.5)
    assert chip.drain().rows == []  # the same bytes at the same time


def packet(channel: int, cargo: bytes) -> bytes:
    return struct.pack("<HBB", len(cargo) + 4, channel, 0) + cargo


def test_bno085_is_set_up_and_read_as_its_manual_says():
    product = bytes.fromhex("f8 01 03 02 18 a6 98 00 72 01 00 00 07 00 00 00")
    bus = Packets(packet(0, bytes(300)), packet(1, b"\x01"), packet(2, product))
    chip = BNO085(bus, rate=100.0, wait=nothing)
    chip.start()
    assert [one.hex(" ") for one in bus.written] == [
        "05 00 01 00 01",  # reset
        "06 00 02 00 f9 00",  # product
        "15 00 02 01 fd 01 00 00 00 10 27 00 00 00 00 00 00 00 00 00 00",  # accelerometer every 10,000 µs
        "15 00 02 02 fd 07 00 00 00 10 27 00 00 00 00 00 00 00 00 00 00",
        "15 00 02 03 fd 05 00 00 00 10 27 00 00 00 00 00 00 00 00 00 00",
        "15 00 02 04 fd 03 00 00 00 10 27 00 00 00 00 00 00 00 00 00 00",
    ]
    base = bytes.fromhex("fb 0c 00 00 00")
    force = bytes.fromhex("01 00 03 00") + struct.pack("<3h", 256, -512, 2511)
    rate = bytes.fromhex("07 00 03 00") + struct.pack("<6h", 512, -1024, 256, 1, 2, 3)
    turn = bytes.fromhex("05 00 03 00") + struct.pack("<5h", 8192, -8192, 8192, 8192, 123)
    field = bytes.fromhex("03 00 03 00") + struct.pack("<3h", 320, -640, 800)
    bus.packets = [packet(3, base + force + rate + turn + field), packet(3, base + rate[:1] + b"\x01" + rate[2:])]
    found = chip.drain()
    assert found.rows == [((1.0, -2.0, 0.5), (1.0, -2.0, 2511 / 256))]
    assert found.mag == (20.0, -40.0, 50.0) and found.attitude == (0.5, 0.5, -0.5, 0.5) and not found.lost
    bus.packets = [packet(3, base + rate[:1] + b"\x04" + rate[2:])]  # two between were not seen
    found = chip.drain()
    assert found.lost and math.isnan(found.rows[0][1][0])  # no specific force came for the one before
    assert list(split_reports(base + b"\x99" + rate)) == [base]  # a report that is not known hides what follows
    assert list(split_reports(rate[:-1])) == []


@pytest.mark.parametrize("text", HUBS)
def test_what_the_chip_feels_is_what_the_driver_says(bench, recording, text):
    one = bench(text)
    one.board.start()
    chip = next(iter(one.bus.chips.values()))
    samples = []
    for _ in range(800):
        one.clock.wait(0.005)
        samples += one.board.poll()
    rate, start = one.board.rate, one.world.since(chip.since)
    assert len(samples) == pytest.approx(rate * 4.0, abs=4) and one.board.lost == 0
    moments = [one.world.at(start + k / rate) for k in range(1, len(samples) + 1)]
    bits = {"bno055": (math.radians(1 / 16), 0.01), "bno085": (2.0**-9, 2.0**-8)}[text]
    for name, bit in zip(("gyr", "acc"), bits, strict=True):
        have = np.array([getattr(sample, name) for sample in samples])
        np.testing.assert_allclose(have, [getattr(moment, name) for moment in moments], atol=0.51 * bit)
    quats = np.array([sample.attitude for sample in samples])
    rows = [one.world.row(start + k / rate) for k in range(1, len(samples) + 1)]
    np.testing.assert_allclose(quats, recording.truth.quat[rows], atol=0.51 * 2.0**-14)
    assert len([one for one in samples if one.mag is not None]) == pytest.approx(
        {"bno055": 80, "bno085": 400}[text], abs=4
    )
    assert np.diff([sample.t for sample in samples])[50:] == pytest.approx(1.0 / rate, abs=0.3 / rate)


@pytest.mark.parametrize("text", HUBS)
def test_samples_that_the_host_was_too_late_for_are_said(bench, text):
    one = bench(text)
    one.board.start()
    for _ in range(20):
        one.clock.wait(0.005)
        one.board.poll()
    one.clock.wait(1.0)
    one.board.poll()
    one.clock.wait(0.005)
    one.board.poll()
    assert one.board.lost >= 1 and {kind for kind, _ in one.board.troubles()} == {"samples_lost"}


@pytest.mark.parametrize("text", HUBS)
def test_faults_of_the_bus_have_names(bench, text):
    one = bench(text)
    one.board.start()
    for fault, kind in (({"unplugged": True}, "bus_error"), ({"stuck": "low"}, "bus_stuck"), ({"stuck": "high"}, "implausible")):  # fmt: skip # noqa: E501
        for name, value in fault.items():
            setattr(one.bus, name, value)
        one.clock.wait(0.02)
        with pytest.raises(SensorError) as caught:
            one.board.poll()
        assert caught.value.kind == kind
        one.bus.unplugged, one.bus.stuck = False, None
    one.bus.nack = 2
    one.clock.wait(0.02)
    one.board.poll()
    assert one.board.retried >= 2
    one.board.restart()
    one.clock.wait(0.05)
    assert one.board.poll()
    next(iter(one.bus.chips.values())).reset()  # it lost its power
    for _ in range(5):
        one.clock.wait(0.02)
        try:
            assert one.board.poll() == []
        except SensorError as error:
            assert error.kind == "implausible"


def test_a_mounting_turns_the_chip_s_own_orientation_as_well(bench, recording):
    axes = AxisMap.parse("-y,x,z")
    one, turned = bench("bno085"), bench("bno085", axes=axes)
    found = []
    for bench_ in (one, turned):
        bench_.board.start()
        bench_.clock.wait(0.05)
        found.append(bench_.board.poll()[-1])
    plain, mounted = found
    for quat, force in ((plain.attitude, plain.acc), (mounted.attitude, mounted.acc)):
        up = rotate(np.array([quat]), np.array([force]))[0]
        assert up == pytest.approx(rotate(np.array([plain.attitude]), np.array([plain.acc]))[0], abs=1e-9)
    assert mounted.acc == pytest.approx(axes.turn(plain.acc))


@pytest.mark.parametrize("text", HUBS)
def test_hubs_are_found_on_a_bus(bench, text):
    one = bench(text)
    assert [chip.name for chip in find_chips(one.bus)] == [text]


def test_another_chip_at_the_address_and_ranges_that_do_not_exist(bench):
    one = bench("bno055")
    with pytest.raises(SensorError, match="has identity 0xa1; expected 0xa0, a BNO055"):
        BNO055(EmulatedBus(EmulatedBNO055(one.world, identity=0xA1)), wait=one.clock.wait).start()
    with pytest.raises(SensorError, match="sends no identity; expected a BNO085"):
        BNO085(Packets(), wait=nothing).start()
    with pytest.raises(lh.LevelheadError, match="needs a bus with i2c_rdwr"):
        BNO085(Registers({}), wait=nothing).start()
    with pytest.raises(lh.LevelheadError, match="acc range 16 g does not exist; the BNO055 has 4"):
        bench("bno055", acc_range=16.0)
    with pytest.raises(lh.LevelheadError, match="cannot give 1000 samples a second; expected 25 to 400"):
        bench("bno085", rate=1000.0)
    assert parse_board("bno055@1:0x29").address == 0x29
