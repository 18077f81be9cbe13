"""
Hold a height
=============

ESKF combines a barometer and an accelerometer into height and climb rate, and a PID turns both into thrust. The
barometer alone has 0.2 m of noise. The comparison is the same controller with a low-passed barometer.

::

    python examples/altitude_hold.py          # draws docs/pictures/altitude-hold.png
"""

import math
import sys
from pathlib import Path

import numpy as np

import levelhead as lh

GRAVITY = 9.81  # m/s²
RATE, BARO_EVERY = 200.0, 8  # Hz; samples of the IMU for one of the barometer (25 Hz)
END, CLIMB, DESCENT = 60.0, 10.0, 35.0  # s: the end, and when another height is wanted
NOISE_ACC, NOISE_GYR, NOISE_BARO = 0.05, 0.003, 2.6  # 1σ of a sample: m/s², rad/s, Pa
PASCALS_PER_METRE = 12.0
STRONGEST = 6.0  # m/s² that the motors can add or take


def wanted_height(t: float) -> float:
    """m."""
    return 0.0 if t < CLIMB else 3.0 if t < DESCENT else 1.5


def gust(t: float, random: np.random.Generator) -> float:
    """m/s² of wind: a blow at 20 s, a lull at 45 s, and turbulence."""
    return 3.0 * (20.0 < t < 22.0) - 2.5 * (45.0 < t < 47.0) + random.normal(0.0, 0.5)


class Pid:
    """Thrust (m/s²) for a height."""

    def __init__(self) -> None:
        self.sum = 0.0

    def __call__(self, error: float, climb: float, dt: float) -> float:
        """``error``: wanted minus measured height, m; ``climb``: m/s."""
        self.sum = max(-3.0, min(3.0, self.sum + error * dt))
        return max(-STRONGEST, min(STRONGEST, 4.0 * error + 1.2 * self.sum - 3.5 * climb))


def fly(by: str = "filter", seed: int = 0) -> dict[str, np.ndarray]:
    """A flight, steered by the filter's height and climb rate, or by the barometer alone.

    Returns:
        (n,) arrays: t (s), wanted, height, estimate, sigma (m; NaN: none).
    """
    random = np.random.default_rng(seed)
    stream, pid, dt = lh.Stream(lh.ESKF()), Pid(), 1.0 / RATE
    height = climb = thrust = estimate = rate = drift = 0.0
    sigma, first = math.nan, None
    bias = random.normal(0.0, 0.05)
    log = []
    for i in range(round(END * RATE)):
        t = i * dt
        acceleration = thrust + gust(t, random) - 0.3 * climb
        if t < 3.0:  # on the ground
            acceleration = height = climb = 0.0
        climb += acceleration * dt
        height += climb * dt
        lean = 0.05 * math.sin(2.0 * t) * (t > 3.0)  # rad: it wobbles
        force = GRAVITY + acceleration
        acc = np.array([0.0, force * math.sin(lean), force * math.cos(lean) + bias]) + random.normal(0, NOISE_ACC, 3)
        gyr = np.array([0.1 * math.cos(2.0 * t) * (t > 3.0), 0.0, 0.0]) + random.normal(0, NOISE_GYR, 3)
        stream.update(tuple(gyr.tolist()), tuple(acc.tolist()), dt=dt)
        if i % BARO_EVERY == 0:
            drift += random.normal(0.0, 0.02)
            pascals = 101325.0 - PASCALS_PER_METRE * height + drift + random.normal(0.0, NOISE_BARO)
            stream.update_pressure(pascals, sigma=NOISE_BARO)
            first = pascals if first is None else first
            measured, share = (first - pascals) / PASCALS_PER_METRE, BARO_EVERY * dt / 0.3
            if by == "barometer":
                before = estimate
                estimate += share * (measured - estimate)
                rate += share * ((estimate - before) / (BARO_EVERY * dt) - rate)
        state = stream.nav_state
        if by == "filter" and state is not None:
            estimate, rate, sigma = state.position.z, state.velocity.z, state.sigma_position.z
        thrust = pid(wanted_height(t) - estimate, rate, dt) if t > 3.0 else 0.0
        log.append((t, wanted_height(t), height, estimate, sigma))
    return dict(zip(("t", "wanted", "height", "estimate", "sigma"), np.array(log).T, strict=True))


def error(flight: dict[str, np.ndarray]) -> float:
    """RMS m from the wanted height, but for 5 s after each change of it."""
    t = flight["t"]
    settled = (t > 5.0) & ~((t > CLIMB) & (t < CLIMB + 5.0)) & ~((t > DESCENT) & (t < DESCENT + 5.0))
    return float(np.sqrt(np.mean((flight["height"] - flight["wanted"])[settled] ** 2)))


def picture(path: Path) -> None:
    """Both flights."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, both = pyplot.subplots(2, 1, figsize=(9, 5.5), sharex=True, layout="constrained")
    for axes, by in zip(both, ("filter", "barometer"), strict=True):
        flight = fly(by)
        axes.plot(flight["t"], flight["estimate"], color="tab:blue", lw=0.8, label=f"height by the {by}")
        axes.plot(flight["t"], flight["height"], color="black", lw=1.0, label="height")
        axes.plot(flight["t"], flight["wanted"], color="tab:red", lw=0.8, ls="--", label="wanted")
        axes.set(ylabel="height [m]", title=f"Steered by the {by}: {error(flight):.2f} m RMS")
        axes.legend(loc="upper left", fontsize=8)
        axes.grid(alpha=0.3)
    both[1].set(xlabel="t [s]")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/pictures/altitude-hold.png")
    picture(target)
    sys.stdout.write(f"written: {target}\n")
