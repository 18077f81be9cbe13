"""Files that appear whole or not at all, and folders that one process writes into at a time."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from levelhead.errors import LevelheadError

LOCK = ".lock"


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path in the folder of ``path``; it takes the name ``path`` when the block succeeds.

    When the block fails, the temporary file goes away and whatever stood at ``path`` before stays as it was.

    Raises:
        LevelheadError: ``path`` is a folder, or its folder is missing or cannot be written.

    >>> with atomic_path("track.csv") as temporary:  # doctest: +SKIP
    ...     temporary.write_text("t,yaw")
    """
    target = Path(path)
    if target.is_dir():
        raise LevelheadError(f"cannot write {target}: it is a folder; expected the name of a file")
    if not target.parent.is_dir():
        raise LevelheadError(f"cannot write {target}: there is no folder {target.parent}; make it first")
    try:
        # The suffix stays, because some writers (numpy.savez, matplotlib) look at it. Importing tempfile takes longer.
        temporary = target.parent / f".{target.stem[:40]}-{os.urandom(8).hex()}{target.suffix}"
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    except OSError as error:
        raise LevelheadError(f"cannot write {target}: {error.strerror or error}") from None
    try:
        yield temporary
        temporary.chmod(_mode(target))
        os.replace(temporary, target)
    except OSError as error:
        raise LevelheadError(f"cannot write {target}: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Keeps other processes out of the folder; the lock ends with the process, however that ends.

    Raises:
        LevelheadError: another process has it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    with (folder / LOCK).open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise LevelheadError(f"another run is writing into {folder}; wait for it, or name another folder") from None
        yield


def _mode(target: Path) -> int:
    """The permissions of the file to be replaced, or those of the umask for a new one (``temporary`` has 0600)."""
    if target.exists():
        return target.stat().st_mode & 0o777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask
