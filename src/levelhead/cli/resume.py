"""The state of a long run beside its result, from which the same command continues.

The folder ``.NAME.unfinished`` holds the finished columns, and ``state.json`` the request, its file and its progress;
that file is replaced whole, after the columns are on the disk. So ``kill -9`` or a power cut at any time loses the work
since the last state, and no more.
"""

import json
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from levelhead.atomic import lock_folder
from levelhead.errors import LevelheadError
from levelhead.json_file import read_json, write_json
from levelhead.open_types import JsonObject
from levelhead.version import VERSION

FORMAT = "levelhead unfinished 1"
STATE = "state.json"
EVERY = 10.0  # s between two states


class UnfinishedRun:
    """The folder of a run.

    Attributes:
        folder: its path.
        state: the last one kept; None: the run begins.
        complete: whether nothing can fail any more but the disk.
    """

    def __init__(self, folder: Path, log: JsonObject, asked: JsonObject) -> None:
        self.folder, self.complete = folder, False
        self._facts: JsonObject = {"log": log, "asked": asked}
        self._before = time.monotonic()
        self.state: JsonObject | None = None
        if (folder / STATE).exists():
            self._take(read_json(folder / STATE, FORMAT, "state of a run", "the state that levelhead saved"))

    def _take(self, found: JsonObject) -> None:
        """The state of an earlier run, if it is one of this.

        Raises:
            LevelheadError: it was asked for something else.
        """
        wanted: JsonObject = json.loads(json.dumps(self._facts))
        if found["levelhead"] != VERSION:
            self._begin_anew(f"is of levelhead {found['levelhead']}, and this is {VERSION}")
        elif found["log"] != wanted["log"]:
            self._begin_anew(f"is of another state of {wanted['log']['path']}")
        elif found["asked"] != wanted["asked"]:
            before, now = found["asked"], wanted["asked"]
            key = next(key for key in {**now, **before} if before.get(key) != now.get(key))
            words = [facts.get(key) if facts.get(key) is not None else "nothing" for facts in (before, now)]
            raise LevelheadError(
                f"{self.folder} holds an unfinished run with {key} {words[0]}, not {words[1]}; finish it with the same "
                "options, or remove that folder, or name another -o"
            )
        else:
            self.state = found["state"]

    def _begin_anew(self, why: str) -> None:
        sys.stderr.write(f"levelhead: the unfinished run in {self.folder} {why}; the run starts again\n")
        (self.folder / STATE).unlink()

    def save(self, state: Callable[[], JsonObject], now: bool = False) -> None:
        """Keeps the state every ``EVERY`` seconds, or now."""
        if now or time.monotonic() - self._before >= EVERY:
            self.state = state()
            write_json(self.folder / STATE, FORMAT, self._facts | {"state": self.state})
            self._before = time.monotonic()


@contextmanager
def open_unfinished(target: Path, log: Path, asked: JsonObject) -> Iterator[UnfinishedRun]:
    """The folder for the run that makes ``target``: removed when that succeeds, or fails because of the log.

    Args:
        target: the result.
        log: the file that is read; a file of another size or time is another one.
        asked: all that the result depends on.

    Raises:
        LevelheadError: an unfinished run of something else, another process at work, or a full disk.
    """
    folder = target.with_name(f".{target.name}.unfinished")
    about = log.stat()
    facts = {"path": str(log.resolve()), "bytes": about.st_size, "modified_ns": about.st_mtime_ns}
    try:
        folder.mkdir(exist_ok=True)
        with lock_folder(folder):
            run = UnfinishedRun(folder, facts, asked)
            try:
                yield run
            except BaseException as error:
                if run.state is None or (isinstance(error, LevelheadError) and not run.complete):
                    shutil.rmtree(folder)
                else:
                    sys.stderr.write(
                        f"levelhead: results so far are in {folder}; the same command continues from there\n"
                    )
                raise
            shutil.rmtree(folder)
    except OSError as error:
        raise LevelheadError(f"{folder}: {error.strerror or error}") from None
