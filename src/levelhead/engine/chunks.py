"""A recording larger than memory, chunk after chunk through one filter."""

from collections.abc import Iterable, Iterator

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD, Batch
from levelhead.engine.binding import choose_engine
from levelhead.engine.driver import Settings
from levelhead.engine.native import has_imu
from levelhead.engine.prior import read_calibration
from levelhead.engine.serialization import StreamState, from_bytes, to_bytes
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.recording import Recording
from levelhead.track import Track

LONG = 1_000_000_000  # samples, for which "auto" chooses the engine


def fuse_chunks(
    chunks: Iterable[Recording],
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    prior: Calibration | None = None,
) -> Iterator[Track]:
    """The track of each chunk of one recording, with the same bits as ``fuse`` of all of it in one piece.

    A generator: a chunk is taken when its track is asked for, so ``chunks`` may read a file of any length
    (``lh.read_chunks``). The calibration of a track is that at its chunk's end. Readings of pressure or GNSS between
    two chunks belong to the later one; from the first chunk that has any, tracks have position and velocity.

    Args:
        chunks: recordings, each of which begins after the one before ended; all with a magnetometer, or none.
        params: the filter, as for ``fuse``.
        guard: as for ``fuse``.
        engine: as for ``fuse``.
        prior: as for ``fuse``.

    Raises:
        LevelheadError: as ``fuse``; no chunk, or one that does not follow.
    """
    return _tracks(chunks, ChunkRun(params, guard, engine, prior))


def _tracks(chunks: Iterable[Recording], run: "ChunkRun") -> Iterator[Track]:
    empty = True
    for chunk in chunks:
        yield run.track(chunk)
        empty = False
    if empty:
        raise LevelheadError("there is no chunk; expected at least one recording")


class ChunkRun:
    """A filter on its way through chunks, which can be saved after any of them; arguments as for ``fuse_chunks``.

    Args:
        saved: the result of ``save`` in an earlier process: the run goes on from there, with the same bits.

    Raises:
        LevelheadError: as ``fuse_chunks``, or ``saved`` comes from a version whose filter keeps another state.
    """

    def __init__(
        self,
        params: FilterChoice | None,
        guard: Guard | None,
        engine: str,
        prior: Calibration | None,
        saved: bytes | None = None,
    ) -> None:
        self._params = filters.default() if params is None else filters.resolve(params)
        self._guard, self._prior = guard, prior
        self._engine = choose_engine(engine, LONG, has_imu(filters.of(self._params), guard is not None))
        self._saved = None if saved is None else from_bytes(saved)
        self._batch: Batch | None = None
        self._last: float | None = None if self._saved is None else self._saved.time

    def track(self, chunk: Recording) -> Track:
        """The track of the next chunk.

        Raises:
            LevelheadError: it does not follow the one before.
        """
        if self._batch is not None:
            self._batch.follow(chunk)
        else:
            self._batch = Batch(chunk, self._params, self._guard, self._engine, self._prior)
            if self._saved is not None:
                assert self._saved.time is not None
                self._batch.resume(self._saved.carry, self._saved.time)
        self._batch.advance(len(chunk))
        self._last = float(chunk.t[-1])
        return self._batch.track()

    @property
    def _state(self) -> StreamState:
        """The state after the last chunk."""
        if self._batch is None:
            assert self._saved is not None
            return self._saved
        settings = Settings(self._params, self._guard or DEFAULT_GUARD)
        return StreamState(settings=settings, guarded=self._guard is not None, carry=self._batch.carry, time=self._last)

    def save(self) -> bytes:
        """Where the run is after at least one chunk, without pressure and GNSS, for ``saved``."""
        return to_bytes(self._state)

    @property
    def calibration(self) -> Calibration | None:
        """The filter's calibration of its sensor by now; None if it learns nothing."""
        return read_calibration(filters.of(self._params), self._state.settings, self._state.carry, self._prior)
