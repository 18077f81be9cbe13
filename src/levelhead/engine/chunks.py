"""A recording larger than memory, chunk after chunk through one filter."""

from collections.abc import Iterable, Iterator

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD, Batch
from levelhead.engine.binding import choose_engine
from levelhead.engine.native import has_imu
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice, Params
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
    params = filters.default() if params is None else filters.resolve(params)
    chosen = choose_engine(engine, LONG, has_imu(filters.of(params), guard is not None))
    return _fuse_chunks(chunks, params, guard, chosen, prior)


def _fuse_chunks(
    chunks: Iterable[Recording], params: Params, guard: Guard | None, engine: str, prior: Calibration | None
) -> Iterator[Track]:
    batch: Batch | None = None
    for chunk in chunks:
        if batch is None:
            batch = Batch(chunk, params, guard, engine, prior)
        else:
            batch.follow(chunk)
        batch.advance(len(chunk))
        yield batch.track()
    if batch is None:
        raise LevelheadError("there is no chunk; expected at least one recording")
