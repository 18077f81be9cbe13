"""The walk of a foot while it happens: stances and position, sample by sample."""

from collections import deque

import numpy as np

from levelhead.engine.stream import Stream
from levelhead.filters.contract import NavState
from levelhead.filters.parameters import FilterChoice
from levelhead.gaits.stance import ARM, LASTING, LEAST, LONGEST, MOVING, SHORTEST, STANDING, WINDOW, likelihood
from levelhead.kernels.elapsed import has_elapsed
from levelhead.recording import Array
from levelhead.sample import Triple
from levelhead.units import GRAVITY

MEMORY = 3.0  # s of stance, or of swing, over which the noises are averaged


class StanceDetector:
    """Whether a foot stands, from the last 0.1 s by the likelihood ratio of ``stance``, whose noises follow the walk.

    It is late by half of that; ``gait`` of a recording is not.

    Attributes:
        standing: whether the foot stands now.
        begins: whether it has stood for 0.06 s with this sample, and not before.
        stood: s for which it stands.
        swung: s since it stood for 0.06 s.
    """

    def __init__(self) -> None:
        self.standing = self.begins = False
        self.stood = self.swung = 0.0
        self._readings: deque[tuple[float, ...]] = deque()
        self._time = 0.0
        self._still, self._moving = np.array(STANDING), np.array(MOVING)

    def update(self, gyr: Triple, acc: Triple, dt: float) -> float | None:
        """Takes a sample (rad/s, m/s², s) and gives 1σ of a zero velocity in m/s where the foot stands, else None."""
        dt = dt if self._readings else 0.0  # before the first sample nothing is known
        self._readings.append((dt, *(float(x) for x in gyr), *(float(x) for x in acc)))
        self._time += dt
        while len(self._readings) > 3 and self._time - self._readings[0][0] >= WINDOW:
            self._time -= self._readings.popleft()[0]
        window = np.array(self._readings)[:, 1:]
        turn = float(np.mean(np.sum(window[:, :3] ** 2, axis=1)))
        mean = float(np.linalg.norm(window[:, 3:].mean(axis=0)))
        force = max(float(np.mean(np.sum(window[:, 3:] ** 2, axis=1))) - 2.0 * GRAVITY * mean + GRAVITY**2, 0.0)
        whole = self._time >= WINDOW - dt and bool(np.isfinite(window).all())
        statistic, limit = likelihood(force, turn, self._still, self._moving)
        self.standing = whole and bool(statistic < limit)
        before, self.stood = self.stood, self.stood + dt if self.standing else 0.0
        stands = self.standing and has_elapsed(self.stood, dt, SHORTEST)
        self.begins = stands and not has_elapsed(before, dt, SHORTEST)
        self.swung = 0.0 if stands else self.swung + dt
        if whole:
            self._follow(np.array([force, turn]) / 3.0, dt)
        return ARM * float(self._still[1]) * max(1.0, LASTING / dt) ** 0.5 if self.standing else None

    def _follow(self, variance: Array, dt: float) -> None:
        """The noises of stance and swing, as means over their last seconds; who waits is quieter than a stance."""
        share = dt / (MEMORY + dt)
        if not self.standing:
            self._moving = np.sqrt(self._moving**2 + share * (variance - self._moving**2))
        elif self.stood < LONGEST:
            self._still = np.sqrt(self._still**2 + share * (variance - self._still**2))
        self._still = np.maximum(self._still, LEAST)
        self._moving = np.maximum(self._moving, 2.0 * self._still)


class GaitStream:
    """``Stream`` with a zero velocity at each sample of a stance, which ``StanceDetector`` finds.

    Args:
        params: a filter that takes aiding; None: ESKF.

    Attributes:
        stream: the orientation.
        detector: the stance of now.

    Raises:
        LevelheadError: a filter that takes no zero velocity.
    """

    def __init__(self, params: FilterChoice | None = None) -> None:
        self.stream = Stream(params)
        self.detector = StanceDetector()
        self._stamp: float | None = None

    @property
    def standing(self) -> bool:
        """Whether the foot stands now."""
        return self.detector.standing

    def update(
        self, gyr: Triple, acc: Triple, mag: Triple | None = None, dt: float | None = None, t: float | None = None
    ) -> NavState | None:
        """Takes a sample, as ``Stream.update``, and gives position and velocity with 1σ; None before the first stance.

        Position goes with the square of ``dt``. Where a link loses samples give the stamps ``t``.

        Raises:
            LevelheadError: as ``Stream.update``.
        """
        self.stream.update(gyr, acc, mag, dt, t)
        if dt is None:
            assert t is not None
            before, self._stamp = self._stamp, float(t)
            dt = 0.0 if before is None else float(t) - before
        if (sigma := self.detector.update(gyr, acc, dt)) is not None:
            self.stream.update_zero_velocity(sigma)
        return self.stream.nav_state
