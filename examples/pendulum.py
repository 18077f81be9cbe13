"""
Balance an inverted pendulum
============================

A rod stands on a cart that a motor accelerates, with an MPU-6050 on the rod. One process simulates all of it in
steps of 1 ms: the rod moves the emulated chip, the node reads the chip's registers, and a PID subscribes to the
node's orientation. For three seconds a hand holds the rod while the node measures the gyroscope's bias. Later the
rod is pushed.

::

    python examples/pendulum.py          # draws docs/pictures/pendulum.png
"""

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead.live import Node
from levelhead.simulate import imu
from levelhead.sources.sensors.board import assemble_board, parse_board
from levelhead.sources.sensors.emulated import emulate_board
from levelhead.sources.sensors.emulated.base import word

GRAVITY = 9.81  # m/s²
LENGTH, SENSOR = 0.35, 0.10  # m from the pivot to the rod's centre of mass, and to the sensor
STEP, RATE = 1e-3, 200.0  # s of the simulation; Hz of the node
HELD, PUSHED, END = 3.0, 8.0, 14.0  # s: the hand lets go; a push; the end
LEAN, PUSH = 0.05, 0.8  # rad, while held; rad/s of the push
STRONGEST = 20.0  # m/s² that the motor can do


@dataclass
class Rod:
    """Angle of the rod (rad, about x, 0: upright), place of the cart (m, along y), and what the chip feels of both.

    It stands where an emulated chip expects its ``World``.
    """

    seed: int = 0
    t: float = 0.0
    angle: float = LEAN
    rate: float = 0.0
    place: float = 0.0
    speed: float = 0.0
    push: float = 0.0  # m/s², the motor's
    force: tuple[float, float, float] = (0.0, 0.0, GRAVITY)
    temperature: float = 25.0
    pressure: float = 101325.0
    noise: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.noise = np.random.default_rng(self.seed)
        chip = imu("MPU-6050")
        self.loud = [np.asarray(one.white_noise_density) * math.sqrt(RATE) for one in (chip.acc, chip.gyr)]
        self.bias = self.noise.normal(0.0, np.broadcast_to(chip.gyr.turn_on_bias, 3))
        self.move(0.0)

    def clock(self) -> float:
        """Seconds; the node and the chip live by it."""
        return self.t

    def sleep(self, seconds: float) -> None:
        """The world goes on while somebody sleeps."""
        for _ in range(max(1, round(seconds / STEP))):
            self.move(STEP)

    def move(self, dt: float) -> None:
        """One step of l·φ'' = g·sin φ + a·cos φ, with a the acceleration of the pivot."""
        s, c = math.sin(self.angle), math.cos(self.angle)
        held = self.t < HELD
        a = 0.0 if held else self.push
        turn = 0.0 if held else (GRAVITY * s + a * c) / LENGTH
        if self.t < PUSHED <= self.t + dt:
            self.rate += PUSH
        self.rate += turn * dt
        self.angle += self.rate * dt
        self.speed += a * dt
        self.place += self.speed * dt
        self.t += dt
        east, up = a - SENSOR * (c * turn - s * self.rate**2), GRAVITY - SENSOR * (s * turn + c * self.rate**2)
        self.force = (0.0, c * east + s * up, -s * east + c * up)  # in the frame of the rod

    # What an emulated chip asks of its world

    def since(self, at: float) -> float:
        """Seconds from the beginning, which is 0."""
        return at

    def row(self, seconds: float) -> int:
        """There is no recording, only the present."""
        return 0

    def rows(self, order: str, acc_scale: float, gyr_scale: float) -> "Rod._Present":
        """What a FIFO takes in, whenever it does."""
        return Rod._Present(self, order, acc_scale, gyr_scale)

    class _Present:
        def __init__(self, rod: "Rod", order: str, acc_scale: float, gyr_scale: float) -> None:
            self._of = rod, order, acc_scale, gyr_scale

        def __getitem__(self, row: int) -> bytes:
            rod, order, acc_scale, gyr_scale = self._of
            acc = np.array(rod.force) + rod.noise.normal(0.0, rod.loud[0])
            gyr = np.array([rod.rate, 0.0, 0.0]) + rod.bias + rod.noise.normal(0.0, rod.loud[1])
            return b"".join(word(order, x) for x in [*(acc / acc_scale), *(gyr / gyr_scale)])


@dataclass
class Pid:
    """Acceleration of the cart that keeps an angle; the cart itself is led back slowly by leaning."""

    p: float = 60.0
    i: float = 40.0
    d: float = 9.0
    sum: float = 0.0

    def __call__(self, angle: float, rate: float, place: float, speed: float, dt: float) -> float:
        """Angle and rate in rad and rad/s, place and speed of the cart (its wheels know) in m and m/s; m/s²."""
        wanted = max(-0.1, min(0.1, 0.06 * place + 0.09 * speed))
        error = angle - wanted
        self.sum = max(-0.1, min(0.1, self.sum + error * dt))
        return max(-STRONGEST, min(STRONGEST, -(self.p * error + self.i * self.sum + self.d * rate)))


def balance(by: str = "node", seed: int = 0) -> dict[str, np.ndarray]:
    """A run, steered by the node's orientation or by the tilt that the accelerometer alone says.

    Returns:
        (n,) arrays: t (s), angle (true, rad), said (what steered, rad), sigma (rad; NaN: none), place (m).
    """
    rod, pid = Rod(seed), Pid()
    wanted = parse_board("mpu6050")
    board = assemble_board(wanted, emulate_board(wanted, rod), rate=RATE, clock=rod.clock, wait=rod.sleep)
    on_the_spot = lh.ESKF(
        body_velocity=0.1
    )  # m/s, 1σ: the cart balances where it stands, nobody carries the sensor about
    node = Node(board, on_the_spot, rate=RATE, clock=rod.clock, sleep=rod.sleep)
    orientations, raws = node.bus.subscribe("imu/orientation"), node.bus.subscribe("imu/raw")
    log: list[tuple[float, ...]] = []
    node.begin()
    while rod.t < END and abs(rod.angle) < 1.2:
        rod.sleep(1.0 / RATE)
        node.tick()
        raw, message = raws.latest(timeout=0.0), orientations.latest(timeout=0.0)
        if raw is None or message is None or not message.valid:
            continue
        if by == "node":
            angle, sigma = message.euler.roll, math.hypot(*message.sigma[:2])
        else:
            angle, sigma = math.atan2(raw.acc[1], raw.acc[2]), math.nan
        if rod.t > HELD:
            rate = raw.gyr[0] - message.bias[0]
            rod.push = pid(angle, rate, rod.place, rod.speed, 1.0 / RATE)
        log.append((rod.t, rod.angle, angle, sigma, rod.place))
    node.close()
    return dict(zip(("t", "angle", "said", "sigma", "place"), np.array(log).T, strict=True))


def picture(path: Path) -> None:
    """Both runs."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, (above, below) = pyplot.subplots(2, 1, figsize=(9, 5.5), sharex=True, layout="constrained")
    node, alone = balance("node"), balance("accelerometer")
    degrees = np.degrees
    above.fill_between(
        node["t"], degrees(node["said"] - 2 * node["sigma"]), degrees(node["said"] + 2 * node["sigma"]),
        color="tab:blue", alpha=0.25, label="the node's orientation ± 2σ",
    )  # fmt: skip
    above.plot(node["t"], degrees(node["said"]), color="tab:blue", lw=1.0)
    above.plot(node["t"], degrees(node["angle"]), color="black", lw=0.8, label="the rod")
    above.set(ylabel="lean [°]", title="Steered by the node", ylim=(-12, 12))
    below.plot(alone["t"], degrees(alone["said"]), color="tab:orange", lw=0.8, label="the accelerometer's tilt")
    below.plot(alone["t"], degrees(alone["angle"]), color="black", lw=1.0, label="the rod")
    below.set(
        xlabel="t [s]", ylabel="lean [°]", title="The same controller, steered by the accelerometer", ylim=(-75, 75)
    )
    for axes in (above, below):
        axes.axvline(HELD, color="grey", lw=0.8, ls=":")
        axes.axvline(PUSHED, color="grey", lw=0.8, ls=":")
        axes.legend(loc="upper right", fontsize=8)
        axes.grid(alpha=0.3)
    above.text(HELD, -11, " the hand lets go", fontsize=8)
    above.text(PUSHED, -11, " a push", fontsize=8)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = (
        Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "pictures" / "pendulum.png"
    )
    picture(target)
    sys.stdout.write(f"written: {target}\n")
