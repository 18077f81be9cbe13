"""Arrays of a whole recording in files, a file for each column: appended chunk by chunk, or mapped into memory."""

import mmap
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from levelhead.recording import Array

NUMBER = 8  # bytes


class ColumnFiles:
    """Files in a folder that grow by some rows at a time.

    Args:
        folder: that they are in.
        widths: name of a column -> numbers in a row of it.
        rows: how many the files have; later bytes of an ended process are cut off.
    """

    def __init__(self, folder: Path, widths: Mapping[str, int], rows: int = 0) -> None:
        self.rows, self._folder, self._widths = rows, folder, dict(widths)
        for name, width in widths.items():
            with folder.joinpath(name).open("r+b" if rows else "wb") as file:
                file.truncate(rows * width * NUMBER)

    @property
    def names(self) -> list[str]:
        """Of the columns."""
        return list(self._widths)

    def append(self, columns: Mapping[str, NDArray[np.generic]]) -> None:
        """Some rows more: (n, width) or (n,) floats, or (n,) whole numbers that are not negative."""
        for name, values in columns.items():
            wide = values.astype(np.uint64 if values.dtype.kind == "u" else np.float64, copy=False)
            with self._folder.joinpath(name).open("ab") as file:
                file.write(np.ascontiguousarray(wide).data)
        self.rows += len(next(iter(columns.values())))

    def flush(self) -> None:
        """Has the appended columns written to the disk."""
        for name in self._widths:
            with self._folder.joinpath(name).open("rb") as file:
                os.fsync(file.fileno())

    def read(self, name: str, start: int, stop: int) -> Array:
        """Some rows of a column of floats: (n, width), or (n,) where a row is one number."""
        width = self._widths[name]
        place = start * width * NUMBER
        values = np.fromfile(self._folder / name, np.float64, (stop - start) * width, offset=place)
        return values if width == 1 else values.reshape(-1, width)


class MappedFile:
    """A file that an array lies in."""

    def __init__(self, path: Path, count: int) -> None:
        """An array of ``count`` zeros, or of the numbers that the file holds."""
        with path.open("r+b" if path.exists() else "w+b") as file:
            file.truncate(max(count, 1) * NUMBER)
            self._map = mmap.mmap(file.fileno(), 0)
        self.array: Array = np.frombuffer(self._map, np.float64, count)

    def flush(self) -> None:
        """Has it written to the disk."""
        self._map.flush()

    def release(self) -> None:
        """Takes its pages out of this process's memory; the file keeps them."""
        if hasattr(mmap, "MADV_DONTNEED"):
            self._map.madvise(mmap.MADV_DONTNEED)
