"""A clock that only goes on when told, and boards on an emulated bus."""

from collections.abc import Callable
from typing import NamedTuple

import pytest

from levelhead import simulate
from levelhead.sources.sensors.board import Board, assemble_board, parse_board
from levelhead.sources.sensors.emulated import EmulatedBus, World, emulate_board


class Clock:
    """Seconds; ``wait`` moves them."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += seconds


class Bench(NamedTuple):
    """A board on a bench."""

    board: Board
    bus: EmulatedBus
    clock: Clock
    world: World


@pytest.fixture(scope="session")
def recording():
    return simulate.recording("ICM-20948", "hand", duration=20.0, rate=200.0)


@pytest.fixture
def bench(recording) -> Callable[..., Bench]:
    """Makes a board of words on an emulated bus, not started."""

    def make(text: str, drift: float = 0.0, **options) -> Bench:
        clock = Clock()
        world = World(recording, clock)
        bus = emulate_board(parse_board(text), world, drift=drift)
        return Bench(assemble_board(parse_board(text), bus, clock=clock, wait=clock.wait, **options), bus, clock, world)

    return make
