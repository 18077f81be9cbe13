"""The walk of a foot while it happens: stances and position, sample by sample."""

from levelhead.engine.stream import Stream
from levelhead.filters.contract import NavState
from levelhead.filters.parameters import FilterChoice
from levelhead.guard.stance import begin_stance, step_stance
from levelhead.kernels.vec3 import Vec3
from levelhead.sample import Triple


class StanceDetector:
    """Whether a foot stands, from the last 0.1 s by the likelihood ratio of ``guard.stance``, whose noises follow the
    walk. Exported C has the same.

    It is late by half of that; ``gait`` of a recording is not.

    Attributes:
        standing: whether the foot stands now.
        begins: whether it has stood for 0.06 s with this sample, and not before.
        stood: s for which it stands.
        swung: s since it stood for 0.06 s.
    """

    def __init__(self) -> None:
        self._stance = begin_stance()

    @property
    def standing(self) -> bool:  # noqa: D102
        return self._stance.sigma > 0.0

    @property
    def begins(self) -> bool:  # noqa: D102
        return self._stance.begins

    @property
    def stood(self) -> float:  # noqa: D102
        return max(0.0, self._stance.stood)

    @property
    def swung(self) -> float:  # noqa: D102
        return self._stance.swung

    def update(self, gyr: Triple, acc: Triple, dt: float) -> float | None:
        """Takes a sample (rad/s, m/s², s) and gives 1σ of a zero velocity in m/s where the foot stands, else None."""
        rate, force = Vec3(*(float(x) for x in gyr)), Vec3(*(float(x) for x in acc))
        self._stance = step_stance(self._stance, rate, force, float(dt))
        return self._stance.sigma or None


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
