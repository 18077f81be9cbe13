"""Containers of a recording's files: a file, a pipe, a folder, an archive (zip, tar), a packed file."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import IO, NamedTuple

from levelhead.errors import LevelheadError

PACKED = {".gz": "gzip", ".bz2": "bz2", ".xz": "lzma"}  # modules whose ``open`` unpacks
TARS = (".tar", ".tgz", ".tbz2", ".txz")  # beside .tar.gz and the like
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
    elif (copy := _copier_of(path, suffixes)) is not None:
        import tempfile  # longer than reading a short log, and only packed ones need it

        with tempfile.TemporaryDirectory(prefix="levelhead-") as folder:
            yield copy(Path(folder))
    else:
        yield [Member(path, path.stem, str(path))]


def _copier_of(path: Path, suffixes: frozenset[str]) -> Callable[[Path], list[Member]] | None:
    """The function that copies the files in an archive, a packed file or a pipe into a folder; None: it is a file."""
    endings = [suffix.lower() for suffix in path.suffixes[-2:]] or [""]
    last = endings[-1]
    if last == ".zip":
        return lambda folder: _extract(path, _list_zip(path), folder, suffixes)
    if last in TARS or (endings[0] == ".tar" and last in PACKED):
        return lambda folder: _extract(path, _list_tar(path), folder, suffixes)
    if last in PACKED:
        return lambda folder: [_unpack(path, folder)]
    return (lambda folder: [_drain(path, folder)]) if path.is_fifo() else None


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


class ArchiveFile(NamedTuple):
    """A file in an archive: its name, its size, and the size from which it came, in bytes."""

    name: str
    size: int
    packed_size: int
    open: Callable[[], IO[bytes]]


def _list_zip(path: Path) -> Iterator[ArchiveFile]:
    import zipfile
    from functools import partial

    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            if not info.is_dir():
                yield ArchiveFile(info.filename, info.file_size, info.compress_size, partial(archive.open, info))


def _list_tar(path: Path) -> Iterator[ArchiveFile]:
    """Its regular files; the packed size is that of the whole archive, as members are packed together."""
    import tarfile
    from functools import partial

    def content(info: tarfile.TarInfo) -> IO[bytes]:
        file = archive.extractfile(info)
        assert file is not None  # of a regular file
        return file

    whole = path.stat().st_size
    with tarfile.open(path) as archive:
        for info in archive:
            if info.isreg():
                yield ArchiveFile(info.name, info.size, whole, partial(content, info))


def _extract(path: Path, entries: Iterator[ArchiveFile], folder: Path, suffixes: frozenset[str]) -> list[Member]:
    """Its files that end in one of ``suffixes``, under names of our choice."""
    import tarfile
    import zipfile
    from zlib import error as bad_stream

    try:
        found = list(_extract_each(path, entries, folder, suffixes))
    except LevelheadError:
        raise
    except (zipfile.BadZipFile, tarfile.TarError, bad_stream, NotImplementedError, RuntimeError, EOFError, ValueError,
            OSError, _xz_error()) as error:  # fmt: skip
        if isinstance(error, OSError) and error.errno is not None:  # of the disk; those of contents have no number
            raise
        kind = "zip" if path.suffix.lower() == ".zip" else "tar"
        raise LevelheadError(f"{path} is not a {kind} archive, or it is damaged or encrypted") from error
    if not found:
        raise LevelheadError(
            f"{path} is an archive without a file that levelhead reads; expected one per sensor, or one"
        )
    return found


def _xz_error() -> type[Exception]:
    try:
        from lzma import LZMAError
    except ImportError:  # this Python was built without it
        return EOFError
    return LZMAError


def _extract_each(
    path: Path, entries: Iterator[ArchiveFile], folder: Path, suffixes: frozenset[str]
) -> Iterator[Member]:
    count = total = 0
    for i, entry in enumerate(entries):
        inner = Path(entry.name)
        hidden = any(part.startswith((".", "__")) for part in inner.parts)
        if hidden or inner.suffix.lower() not in suffixes:
            continue
        count, total = count + 1, total + entry.size
        if count > MAX_FILES or total > MAX_BYTES:
            raise LevelheadError(f"{path} holds more than {MAX_FILES} files or {MAX_BYTES >> 30} GiB; unpack it")
        if entry.size > max(1 << 20, MAX_RATIO * entry.packed_size):
            raise LevelheadError(f"{path}: {entry.name} would grow {MAX_RATIO}-fold; it is not unpacked")
        target = folder / f"{i}{inner.suffix.lower()}"  # never a path of the archive's choice
        with entry.open() as packed, open(target, "wb") as file:
            _copy(packed, file, entry.size, path)
        yield Member(target, str(inner.with_suffix("")), f"{path}: {entry.name}")


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
    except (OSError, EOFError, _xz_error()) as error:
        raise LevelheadError(f"{path} is not packed with {path.suffix[1:]}, or it is damaged") from error
    return Member(target, Path(path.stem).stem, str(path))


def _drain(path: Path, folder: Path) -> Member:
    """A pipe as a file: formats look at its start first, and a pipe gives each byte once."""
    target = folder / "0"  # the first bytes name the format
    with open(path, "rb") as pipe, open(target, "wb") as file:
        _copy(pipe, file, MAX_BYTES, path)
    return Member(target, path.stem, str(path))


def _copy(packed: IO[bytes], file: IO[bytes], most: int, path: Path) -> None:
    """Unpacks, but never more than was promised."""
    left = most
    while block := packed.read(1 << 20):
        left -= len(block)
        if left < 0:
            raise LevelheadError(f"{path} holds more than {most} bytes; it is not read")
        file.write(block)
