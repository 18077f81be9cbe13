"""The smoother over a recording larger than memory: its arrays lie in files that are mapped into memory.

The forward run and the way back are those of ``smoothing``, over arrays of the whole recording, so bits are the same. A
sample takes 168 bytes in these files, which the system writes out and drops as it needs memory; what the forward run
saves now and then goes to a file too.
"""

import mmap
import os
import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np

from levelhead import filters
from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.prior import correct_recording
from levelhead.engine.smoother_kernels import FlatTrack
from levelhead.engine.smoothing import Smoother, Stretch, offline_params
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.recording import Array, Recording
from levelhead.track import Track

WIDTHS = {"t": 1, "gyr": 3, "acc": 3, "mag": 3}  # of the inputs
OFTEN = 16  # stretches between two times that what is mapped is given back to the system


class MappedFile:
    """A file that an array lies in."""

    def __init__(self, path: Path, count: int) -> None:
        """An array of ``count`` zeros, or of the numbers that the file holds."""
        with path.open("r+b" if path.exists() else "w+b") as file:
            file.truncate(max(count, 1) * 8)
            self._map = mmap.mmap(file.fileno(), 0)
        self.array: Array = np.frombuffer(self._map, np.float64, count)

    def release(self) -> None:
        """Takes its pages out of this process's memory; the file keeps them."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self._map.madvise(mmap.MADV_DONTNEED)


class SavedStretches:
    """Stretches in a file, as a list has them in memory."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._places = file, list[int]()

    def append(self, stretch: Stretch) -> None:
        """One more."""
        self._places.append(self._file.seek(0, os.SEEK_END))
        pickle.dump(stretch, self._file)

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, index: int) -> Stretch:
        self._file.seek(self._places[index])
        stretch: Stretch = pickle.load(self._file)
        return stretch


def smooth_chunks(
    chunks: Iterable[Recording],
    params: FilterChoice | None = None,
    *,
    guard: Guard | None = DEFAULT_GUARD,
    engine: str = "auto",
    prior: Calibration | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Track]:
    """The track of each chunk of one recording, with the same bits as ``smooth`` of all of it in one piece.

    All chunks are read before the first track comes, since every estimate uses all of them.

    Args:
        chunks: recordings, each of which begins after the one before ended; all with a magnetometer, or none.
        params: as for ``smooth``.
        guard: as for ``smooth``.
        engine: as for ``smooth``; plain Python takes memory by the sample.
        prior: as for ``smooth``.
        folder: where the files are made, 168 bytes for a sample, and removed; None: where the system has such files.
        progress: called now and then with the fraction done of what follows reading, 0 to 1.

    Raises:
        LevelheadError: as ``smooth``; no chunk, or one that does not follow; a full disk.
    """
    resolved = offline_params(params)
    return _smooth_chunks(chunks, resolved, guard, engine, prior, folder, progress)


def _smooth_chunks(
    chunks: Iterable[Recording],
    params: Params,
    guard: Guard | None,
    engine: str,
    prior: Calibration | None,
    folder: str | os.PathLike[str] | None,
    progress: Callable[[float], None] | None,
) -> Iterator[Track]:
    with TemporaryDirectory(prefix=".levelhead-smooth-", dir=folder) as name, ExitStack() as stack:
        place = Path(name)
        try:
            first, edges = _write(chunks, prior, place)
            n = edges[-1]
            inputs = [MappedFile(place / role, n * width) for role, width in WIDTHS.items() if (place / role).exists()]
            made = [MappedFile(place / f"made{width}", width * n) for width in (4, 3)]
            sigma, health = MappedFile(place / "sigma", 3 * n), MappedFile(place / "health", n)
            stretches = SavedStretches(stack.enter_context(place.joinpath("stretches").open("w+b")))
        except OSError as error:
            raise LevelheadError(f"{place.parent}: {error.strerror}; smoothing needs 168 bytes for a sample") from None
        files = [*inputs, *made, sigma, health]
        run = Smoother(first, filters.of(params).smoothing.offline(params), guard, prior, engine)  # type: ignore[union-attr]
        arrays, bits = [one.array for one in files], health.array.view(np.uint32)[:n]
        run.take(arrays[: len(inputs)], FlatTrack(*arrays[-4:-1]), bits)
        count = 0

        def report(fraction: float) -> None:
            nonlocal count
            count += 1
            if count % OFTEN == 0:
                for one in files:
                    one.release()
            if progress is not None:
                progress(fraction)

        calibration = run.run(stretches, report)
        quat, bias = (one.array.reshape(n, -1) for one in made)
        for start, stop in zip([0, *edges], edges, strict=False):
            part = slice(start, stop)
            yield Track(
                inputs[0].array[part].copy(), quat[part].copy(), bias[part].copy(),
                sigma.array.reshape(n, 3)[part].copy(), bits[part].copy(), params, calibration=calibration,
            )  # fmt: skip
            for one in files:
                one.release()


def _write(chunks: Iterable[Recording], prior: Calibration | None, place: Path) -> tuple[Recording, list[int]]:
    """Writes a file for each sensor; the first chunk as it was, and the sample after each chunk.

    Raises:
        LevelheadError: no chunk, or one that does not follow.
    """
    first: Recording | None = None
    edges: list[int] = []
    last = -np.inf
    for chunk in chunks:
        if not chunk.t[0] > last:
            raise LevelheadError(
                f"a chunk begins at {chunk.t[0]:.6f} s, after one that ended at {last:.6f} s; expected later samples"
            )
        if first is not None and (chunk.mag is None) != (first.mag is None):
            raise LevelheadError(
                f"only one of two chunks has a magnetometer, at {chunk.t[0]:.6f} s; give NaN where readings are missing"
            )
        first = first or chunk
        last = float(chunk.t[-1])
        edges.append((edges[-1] if edges else 0) + len(chunk))
        corrected = correct_recording(chunk, prior)
        for role in WIDTHS:
            values: Array | None = getattr(corrected, role)
            if values is not None:
                with place.joinpath(role).open("ab") as file:
                    np.ascontiguousarray(values, np.float64).tofile(file)
    if first is None:
        raise LevelheadError("there is no chunk; expected at least one recording")
    return first, edges
