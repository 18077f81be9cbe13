"""Chips that are not there: every register that the drivers touch, behind the same bus, fed by a recording.

They sleep, reset, count, overflow and run on clocks of their own like the real ones, and the bus can be made to fail:
``bus.nack``, ``bus.unplugged``, ``bus.stuck``; a wrong chip is one made with another ``identity``.
"""

from levelhead.sources.sensors.emulated.board import emulate_board
from levelhead.sources.sensors.emulated.bus import EmulatedBus
from levelhead.sources.sensors.emulated.world import World

__all__ = ["EmulatedBus", "World", "emulate_board"]
