"""Chips on an I²C bus: drivers, clocks, axes, and emulators of every chip for tests and for life without hardware.

    with open_board("mpu6050+hmc5883l", rate=200) as board:
        for sample in board.poll():
            ...

A driver needs a ``Bus``: four methods with smbus2's own signatures, which ``smbus2.SMBus`` has and
``emulated.EmulatedBus`` as well.
"""

from levelhead.axis_map import AxisMap, find_axes
from levelhead.sources.sensors.board import CHIPS, Board, assemble_board, open_board
from levelhead.sources.sensors.bus import Bus, Port, SensorError, open_bus
from levelhead.sources.sensors.sample_clock import SampleClock

__all__ = [
    "CHIPS",
    "AxisMap",
    "Board",
    "Bus",
    "Port",
    "SampleClock",
    "SensorError",
    "assemble_board",
    "find_axes",
    "open_board",
    "open_bus",
]
