"""Nodes on emulated chips with a clock that only goes on when somebody sleeps: minutes in a second, and no luck."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from levelhead.live import Node
from levelhead.live.open import closed_motion
from levelhead.sources.sensors.board import assemble_board, parse_board
from levelhead.sources.sensors.emulated import EmulatedBus, World, emulate_board


class Clock:
    """Seconds; sleeping moves them, and ``extra`` is added to the next sleep."""

    def __init__(self) -> None:
        self.now, self.extra = 1000.0, 0.0
        self.after: list[tuple[float, Callable[[], None]]] = []

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + self.extra
        self.extra = 0.0
        while self.after and self.after[0][0] <= self.now:
            self.after.pop(0)[1]()

    def at(self, seconds: float, what: Callable[[], None]) -> None:
        """Does something after so many seconds from the beginning."""
        self.after.append((1000.0 + seconds, what))
        self.after.sort(key=lambda one: one[0])


class Rig(NamedTuple):
    """A node with everything around it."""

    node: Node
    clock: Clock
    wires: EmulatedBus
    orientations: Any
    raw: Any
    health: Any

    def drain(self, subscription) -> list:
        """All messages that wait."""
        found = []
        while (message := subscription.get(timeout=0.0)) is not None:
            found.append(message)
        return found

    def events(self) -> list[str]:
        """Names of the events so far; "-name" where a state ended."""
        return [("" if event.on else "-") + event.name for event in self.drain(self.health)]


@pytest.fixture(scope="session")
def felt():
    """What the chips feel: 8 s still, then a hand, there and back."""
    return closed_motion(parse_board("icm20948"), 200.0, "hand", 1, half=15.0)


@pytest.fixture
def rig(felt) -> Callable[..., Rig]:
    """Makes a node on an emulated board; the clocks of the chip and of the host differ by half a percent."""

    def make(text: str = "mpu6050", felt=felt, **options) -> Rig:
        clock = Clock()
        wires = emulate_board(parse_board(text), World(felt, clock), drift=0.005)
        board = assemble_board(parse_board(text), wires, clock=clock, wait=clock.sleep)
        node = Node(board, clock=clock, sleep=clock.sleep, **options)
        queues = [
            node.bus.subscribe(topic, history=100_000, max_age=math.inf)
            for topic in ("imu/orientation", "imu/raw", "imu/health")
        ]
        return Rig(node, clock, wires, *queues)

    return make
