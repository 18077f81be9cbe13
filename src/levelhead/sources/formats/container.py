"""Containers of a recording's files: a file, a folder, a zip, a packed file."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import IO, NamedTuple

from levelhead.errors import LevelheadError

PACKED = {".gz": "gzip", ".bz2": "bz2", ".xz": "lzma"}  # modules whose ``open`` unpacks
MAX_FILES = 400
MAX_BYTES = 4 << 30  # unpacked, of all members together
MAX_RATIO = 300  # unpacked to packed, of one member of 1 MiB or more: beyond it is a bomb
DEPTH = 3  # folders in folders


class Member(NamedTuple):
    """One file of a recording: its place, its name beside the others, its name in errors."""

    path: Path
    name: str
    display_path: str


@contextmanager
def members(path: Path, suffixes: frozenset[str]) -> Iterator[list[Member]]:
    """The files in ``path`` that end in one of ``suffixes``; a single file is always one.

    Raises:
        LevelheadError: a damaged or dangerous archive, too many files, nothing to read.
    """
    if path.is_dir():
        yield _in_folder(path, suffixes)
    elif path.suffix.lower() == ".zip":
        import tempfile  # longer than reading a short log, and only packed ones need it

        with tempfile.TemporaryDirectory(prefix="levelhead-") as folder:
            yield _unzip(path, Path(folder), suffixes)
    elif path.suffix.lower() in PACKED:
        import tempfile

        with tempfile.TemporaryDirectory(prefix="levelhead-") as folder:
            yield [_unpack(path, Path(folder))]
    else:
        yield [Member(path, path.stem, str(path))]


def _in_folder(path: Path, suffixes: frozenset[str]) -> list[Member]:
    found = []
    for file in sorted(path.rglob("*")):
        inner = file.relative_to(path)
        if len(inner.parts) > DEPTH or any(part.startswith((".", "__")) for part in inner.parts):
            continue
        if file.is_file() and file.suffix.lower() in suffixes:
            found.append(Member(file, str(inner.with_suffix("")), str(file)))
        if len(found) > MAX_FILES:
            raise LevelheadError(f"{path} is a folder with more than {MAX_FILES} files; name one of them")
    if not found:
        raise LevelheadError(f"{path} is a folder without a file that levelhead reads; expected one per sensor, or one")
    return found


def _unzip(path: Path, folder: Path, suffixes: frozenset[str]) -> list[Member]:
    import zipfile

    found: list[Member] = []
    total = 0
    try:
        with zipfile.ZipFile(path) as archive:
            for i, info in enumerate(archive.infolist()):
                inner = Path(info.filename)
                hidden = any(part.startswith((".", "__")) for part in inner.parts)
                if info.is_dir() or hidden or inner.suffix.lower() not in suffixes:
                    continue
                total += info.file_size
                if len(found) >= MAX_FILES or total > MAX_BYTES:
                    raise LevelheadError(
                        f"{path} holds more than {MAX_FILES} files or {MAX_BYTES >> 30} GiB; unpack it"
                    )
                if info.file_size > max(1 << 20, MAX_RATIO * info.compress_size):
                    raise LevelheadError(f"{path}: {info.filename} would grow {MAX_RATIO}-fold; it is not unpacked")
                target = folder / f"{i}{inner.suffix.lower()}"  # never a path of the archive's choice
                with archive.open(info) as packed, open(target, "wb") as file:
                    _copy(packed, file, info.file_size, path)
                found.append(Member(target, str(inner.with_suffix("")), f"{path}: {info.filename}"))
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
        if isinstance(error, LevelheadError):
            raise
        raise LevelheadError(f"{path} is not a zip archive, or it is damaged or encrypted") from error
    if not found:
        raise LevelheadError(
            f"{path} is a zip archive without a file that levelhead reads; expected one per sensor, or one"
        )
    return found


def _unpack(path: Path, folder: Path) -> Member:
    module = PACKED[path.suffix.lower()]
    target = folder / f"0{Path(path.stem).suffix.lower() or '.txt'}"
    try:
        unpacker = import_module(module)
    except ImportError:
        raise LevelheadError(f"{path}: this Python was built without {module}; unpack the file first") from None
    try:
        with unpacker.open(path) as packed, open(target, "wb") as file:
            _copy(packed, file, MAX_BYTES, path)
    except (OSError, EOFError, getattr(unpacker, "LZMAError", EOFError)) as error:
        raise LevelheadError(f"{path} is not packed with {path.suffix[1:]}, or it is damaged") from error
    return Member(target, Path(path.stem).stem, str(path))


def _copy(packed: IO[bytes], file: IO[bytes], most: int, path: Path) -> None:
    """Unpacks, but never more than was promised."""
    left = most
    while block := packed.read(1 << 20):
        left -= len(block)
        if left < 0:
            raise LevelheadError(f"{path} unpacks to more than its declared size; it is not read")
        file.write(block)
