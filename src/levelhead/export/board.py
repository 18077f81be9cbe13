"""Boards of makers: whether the sketch fits, by its memory on an AVR, before anybody compiles it.

Static memory is known to the byte: it is the filter's struct beside Wire and Serial. Flash and stack are estimated from
the operations of the kernels that are exported; `benchmarks/speed/boards.py` measures both, and a test runs
sketches against the estimate. Processors of 32 bits hold every filter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from levelhead.errors import LevelheadError, nearest
from levelhead.export.axis_api import AxisApi
from levelhead.export.c_api import MACHINES
from levelhead.export.chips import find_chip
from levelhead.export.config import LEAN, ExportConfig
from levelhead.export.imu_api import ImuApi
from levelhead.export.kinds import Machine
from levelhead.export.magnetometers import find_magnetometer


@dataclass(frozen=True)
class TargetBoard:
    """A board, with the bytes that a sketch may use."""

    title: str
    flash: int
    ram: int
    machine: Machine


WORD32, AVR = MACHINES[1:]
BOARDS = {  # flash less the boot loader; data sheets of the chips and boards.txt of the Arduino cores
    "uno": TargetBoard("Uno (ATmega328P)", 32_256, 2_048, AVR),
    "nano": TargetBoard("Nano (ATmega328P)", 30_720, 2_048, AVR),
    "nano-every": TargetBoard("Nano Every (ATmega4809)", 49_152, 6_144, AVR),
    "mega": TargetBoard("Mega (ATmega2560)", 253_952, 8_192, AVR),
    "m0": TargetBoard("Zero (SAMD21, Cortex-M0+)", 262_144, 32_768, WORD32),
    "m4": TargetBoard("Feather M4 (SAMD51, Cortex-M4F)", 507_904, 196_608, WORD32),
    "rp2040": TargetBoard("Pico (RP2040, Cortex-M0+)", 2_093_056, 262_144, WORD32),
    "esp32": TargetBoard("ESP32", 1_310_720, 327_680, WORD32),
}
SKETCH_FLASH, SKETCH_RAM, SKETCH_STACK = 9_500, 490, 260  # of Wire, Serial and the sketch itself, on an AVR
FIELD_FLASH, FIELD_RAM, FIELD_STACK = 1_400, 16, 40  # of the magnetometer, more
OPERATION, MOVE = 22, 37  # bytes of flash, of an operation in software with its operands, and of a number moved
AXIS_FLASH, AXIS_STACK = 6_300, 280  # of the largest filter of one axis
SYSTEM32 = 8_192  # bytes of RAM that a core of 32 bits keeps for itself, at least

Api = ImuApi | AxisApi


@dataclass(frozen=True)
class Memory:
    """Bytes that a sketch takes."""

    flash: int
    static: int
    stack: int

    @property
    def ram(self) -> int:
        """Static memory and stack."""
        return self.static + self.stack


def memory(api: Api, board: TargetBoard) -> Memory:
    """The memory of the sketch with a filter on a board; the filter's C has been written before."""
    real = 8 if api.config.real == "double" and board.machine.real == 8 else 4
    filter_size = api.size(Machine("", real, board.machine.alignment))
    if isinstance(api, AxisApi):
        flash, stack = AXIS_FLASH, AXIS_STACK
    else:
        operations, moves = api.program.counts()
        flash, stack = OPERATION * operations + MOVE * moves, 410 + operations // 7
    if board.machine is not AVR:
        return Memory(flash, filter_size + SYSTEM32, 2 * stack)
    if find_magnetometer(api.config, find_chip(api.config.chip).name):
        flash, filter_size, stack = flash + FIELD_FLASH, filter_size + FIELD_RAM, stack + FIELD_STACK
    return Memory(flash + SKETCH_FLASH, filter_size + SKETCH_RAM, stack + SKETCH_STACK)


def fits(api: Api, board: TargetBoard) -> bool:
    """Whether the sketch fits."""
    needed = memory(api, board)
    return needed.flash <= board.flash and needed.ram <= board.ram


def fitting(api: Api) -> str:
    """The boards that hold the sketch, in words."""
    return ", ".join(board.title.partition(" (")[0] for board in BOARDS.values() if fits(api, board))


def find_board(name: str) -> TargetBoard:
    """A board by its name.

    Raises:
        LevelheadError: there is none of that name.
    """
    if name not in BOARDS:
        raise LevelheadError(f"there is no board '{name}'; {nearest(name, list(BOARDS))}")
    return BOARDS[name]


def require_fit(api: Api, board: TargetBoard) -> None:
    """Refuses a sketch that a board cannot hold.

    Raises:
        LevelheadError: with its need, the memory of the board, and a filter that fits.
    """
    if fits(api, board):
        return
    needed = memory(api, board)
    said = (
        f"{api.config.flt.name} does not fit a {board.title}: the sketch takes about {needed.flash:,} bytes of flash "
        f"(of {board.flash:,}) and {needed.ram:,} of RAM (of {board.ram:,}), {needed.static:,} of them static"
    )
    raise LevelheadError(f"{said}; {_advice(api, board)}")


def _advice(api: Api, board: TargetBoard) -> str:
    for words, config in _smaller(api.config):
        smaller = ImuApi(config)
        smaller.write()
        if fits(smaller, board):
            return f"it fits with {words}"
    return f"take one of {fitting(api) or 'no board known here'}, or Mahony --lean --without mag"


def _smaller(config: ExportConfig) -> Iterator[tuple[str, ExportConfig]]:
    """The same filter with less around it."""
    if config.axis or not isinstance(config.params, tuple) or config.flt.name == "ESKF":
        return
    yield "--guard off", replace(config, guard=None)
    yield "--lean", replace(config, guard=None, without=config.without | LEAN)
    yield "--lean --without mag", replace(config, guard=None, without=config.without | LEAN | {"mag"})
