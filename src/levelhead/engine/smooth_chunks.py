"""The smoother over a recording larger than memory: its arrays lie in files that are mapped into memory.

The forward run and the way back are those of ``smoothing``, over arrays of the whole recording, so bits are the same. A
sample takes 168 bytes in these files, which the system writes out and drops as it needs memory; the regular saves of
the forward run go to a file too. Another process can go on with the files of one that was ended. Pressure and GNSS are
left aside, with a warning.
"""

import logging
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np

from levelhead.calibration import Calibration
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.engine.column_files import ColumnFiles, MappedFile
from levelhead.engine.prior import correct_recording
from levelhead.engine.smoother_kernels import FlatTrack
from levelhead.engine.smoothing import Smoother, Stretch, offline_params, turn_north
from levelhead.errors import LevelheadError
from levelhead.filters.parameters import FilterChoice, Params
from levelhead.guard import Guard
from levelhead.open_types import JsonObject
from levelhead.recording import Recording
from levelhead.track import Track, is_relative

WIDTHS = {"t": 1, "gyr": 3, "acc": 3, "mag": 3}  # of the inputs
MADE = {"quat": 4, "bias": 3, "sigma": 3, "health": 1}
STRETCHES = "stretches"
START = 8  # bytes of where one begins
OFTEN = 64  # stretches between two releases of mapped memory


class SavedStretches:
    """Stretches in a file, as a list has them in memory; ``count`` of them are there already, and ``size`` is that of
    a Carry.
    """

    def __init__(self, file: BinaryIO, size: int, count: int = 0) -> None:
        self._file, self._count, self._size = file, count, START + size
        file.truncate(count * self._size)

    def append(self, stretch: Stretch) -> None:
        """One more."""
        self._file.seek(self._count * self._size)
        self._file.write(stretch.start.to_bytes(START, "little") + stretch.carry)
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Stretch:
        self._file.seek(index * self._size)
        data = self._file.read(self._size)
        return Stretch(int.from_bytes(data[:START], "little"), data[START:])


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
        progress: called regularly with the finished fraction of the work after reading, 0 to 1.

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
    with TemporaryDirectory(prefix=".levelhead-smooth-", dir=folder) as name:
        run = ChunkSmoother(Path(name), params, guard, engine, prior)
        try:
            for chunk in chunks:
                run.read(chunk)
            run.smooth(progress)
        except OSError as error:
            place = Path(name).parent
            raise LevelheadError(f"{place}: {error.strerror}; smoothing needs 168 bytes for a sample") from None
        yield from run.tracks()


class ChunkSmoother:
    """The smoother with its files in a folder: ``read`` each chunk, ``smooth``, then ``tracks``.

    Arguments as for ``smooth_chunks``, and:

    Args:
        place: the folder.
        save: called regularly with the state to keep, ready for JSON, when the files are on the disk; None: never.
        saved: the last state of an earlier process, whose files are in the folder: the work goes on from there.
    """

    def __init__(
        self,
        place: Path,
        params: Params,
        guard: Guard | None,
        engine: str,
        prior: Calibration | None,
        save: Callable[[Callable[[], JsonObject]], None] | None = None,
        saved: JsonObject | None = None,
    ) -> None:
        self._place, self._params, self._guard, self._engine, self._prior = place, params, guard, engine, prior
        self._save, self._saved = save, saved or {}
        self._edges: list[int] = list(self._saved.get("edges", ()))
        self._inputs: ColumnFiles | None = None
        self._last = -np.inf
        self._warned = False
        if self._edges:
            self._inputs = ColumnFiles(place, {name: WIDTHS[name] for name in self._saved["sensors"]}, self._edges[-1])
            self._last = float(self._inputs.read("t", self._edges[-1] - 1, self._edges[-1])[0])

    @property
    def rows(self) -> int:
        """How many samples have been read."""
        return self._edges[-1] if self._edges else 0

    @property
    def has_read_all(self) -> bool:
        """Whether an earlier process has read all chunks."""
        return "stretches" in self._saved

    def read(self, chunk: Recording) -> None:
        """Takes the next chunk.

        Raises:
            LevelheadError: it does not follow.
            OSError: the disk is full.
        """
        corrected = correct_recording(chunk, self._prior)
        columns = {name: values for name in WIDTHS if (values := getattr(corrected, name)) is not None}
        if not chunk.t[0] > self._last:
            raise LevelheadError(
                f"a chunk begins at {chunk.t[0]:.6f} s, after one that ended at {self._last:.6f} s; expected later "
                "samples"
            )
        if (chunk.pressure or chunk.gnss or chunk.zero_velocity) is not None and not self._warned:
            self._warned = True
            logging.getLogger("levelhead").warning(
                "the smoother works by chunks without pressure and GNSS; with them a recording is smoothed in one piece"
            )
        if self._inputs is None:
            self._inputs = ColumnFiles(self._place, {name: WIDTHS[name] for name in columns})
        if (chunk.mag is not None) != ("mag" in self._inputs.names):
            raise LevelheadError(
                f"only one of two chunks has a magnetometer, at {chunk.t[0]:.6f} s; give NaN where readings are missing"
            )
        self._inputs.append(columns)
        self._last = float(chunk.t[-1])
        self._edges.append(self._inputs.rows)
        if self._save is not None:
            self._save(self._read_state)

    def _read_state(self) -> JsonObject:
        assert self._inputs is not None
        self._inputs.flush()
        return {"edges": self._edges, "sensors": self._inputs.names}

    def smooth(self, progress: Callable[[float], None] | None) -> None:
        """There and back.

        Raises:
            LevelheadError: there was no chunk.
            OSError: the disk is full.
        """
        if self._inputs is None:
            raise LevelheadError("there is no chunk; expected at least one recording")
        n, names = self.rows, self._inputs.names
        beginning = Recording(**{name: self._inputs.read(name, 0, self._edges[0]) for name in names})  # type: ignore[arg-type]
        widths = {name: WIDTHS[name] for name in names} | MADE
        self._files = {name: MappedFile(self._place / name, n * width) for name, width in widths.items()}
        run = Smoother(beginning, self._params, self._guard, self._prior, self._engine)
        arrays = {name: file.array for name, file in self._files.items()}
        self._bits = arrays["health"].view(np.uint32)[:n]
        run.take([arrays[name] for name in names], FlatTrack(*(arrays[name] for name in list(MADE)[:3])), self._bits)
        path, back = self._place / STRETCHES, self._saved.get("back")
        with path.open("r+b" if path.exists() else "w+b") as file:
            stretches = SavedStretches(file, len(run.begin.carry), self._saved.get("stretches", 0))
            if back is not None:
                run.memory = [float.fromhex(word) for word in self._saved["memory"]]
            self.calibration = run.run(stretches, progress, self._keeper(run, stretches, file), back)
        self._turn = run.turn

    def _keeper(self, run: Smoother, stretches: SavedStretches, file: BinaryIO) -> Callable[[int | None], None]:
        """The end of each stretch: memory is given back, and the state kept."""
        count = 0

        def state(following: int | None) -> JsonObject:
            file.flush()
            os.fsync(file.fileno())
            for one in self._files.values():
                one.flush()
            on_the_way = {"edges": self._edges, "sensors": list(self._files)[: -len(MADE)], "stretches": len(stretches)}
            if following is None:
                return on_the_way
            return on_the_way | {"back": following, "memory": [value.hex() for value in run.memory]}

        def advance(following: int | None) -> None:
            nonlocal count
            count += 1
            if count % OFTEN == 0:
                self._release()
            if self._save is not None:
                self._save(lambda: state(following))

        return advance

    def _release(self) -> None:
        for one in self._files.values():
            one.release()

    def tracks(self) -> Iterator[Track]:
        """The track of each chunk."""
        arrays = {name: self._files[name].array.reshape(self.rows, -1) for name in ("t", *MADE)}
        relative = is_relative(self._params, "mag" in self._files)
        for start, stop in zip([0, *self._edges], self._edges, strict=False):
            part = {name: array[start:stop].copy() for name, array in arrays.items()}
            track = Track(
                part["t"].reshape(-1), part["quat"], part["bias"], part["sigma"], self._bits[start:stop].copy(),
                self._params, calibration=self.calibration, relative=relative,
            )  # fmt: skip
            yield turn_north(track, self._turn)
            self._release()
