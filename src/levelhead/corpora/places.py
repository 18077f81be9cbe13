"""Which recordings there are in folders, patterns and URLs, and their files on this machine.

All reading goes through fsspec, so that a folder, ``s3://bucket/prefix`` and ``https://…/log.csv`` are one case.
"""

import hashlib
import logging
import os
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import NamedTuple

from levelhead.errors import LevelheadError, require
from levelhead.open_types import JsonObject, ReadOnlyJson, Untyped
from levelhead.sources.formats import BY_SUFFIX, CONTAINERS

MANIFEST = "corpus.json"  # in a folder of results
IMU = "mav0/imu0/data.csv"  # in a recording as EuRoC and TUM-VI lay it out
BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
SUFFIXES = frozenset((*BY_SUFFIX, *CONTAINERS))
LISTS = re.compile(  # names of files about recordings that are not recordings
    r"(trials|index|problems|manifest|metadata|datapackage|dataset_description)\.json|(readme|licen[cs]e)\.txt|thumbs\.db",
    re.IGNORECASE,
)
SHOWN = 5  # of these, in a sentence
MIN_RECORDINGS = 2  # recordings in a zip that stand for themselves
STAMPS = ("ETag", "etag", "md5Hash", "checksum", "mtime", "LastModified", "last_modified", "updated", "modified")
GYR, ACC = re.compile(r"gyr", re.IGNORECASE), re.compile(r"acc", re.IGNORECASE)
MAGIC = re.compile(r"[*?[]")


class Source(NamedTuple):
    """One recording that is to be read.

    Attributes:
        name: its path below the place that was named, which is its name in the results.
        url: where it is: a local path, or a URL for fsspec.
        stamp: sixteen digits that change when the file does, by its store: size, and ETag or time.
        size: bytes.
    """

    name: str
    url: str
    stamp: str
    size: int


def list_sources(places: Iterable[str | os.PathLike[str]], storage: ReadOnlyJson | None = None) -> list[Source]:
    """The recordings in some places, by name.

    A folder in the layout of EuRoC, a ROS 2 bag, and a folder with the sensors of one recording in files of their own
    count as one recording each; folders of results are passed over, and files about recordings (``INDEX.json``) with a
    line in the log.

    Args:
        places: files, folders with all that is below them, patterns with ``*``, ``**`` and ``?``, or URLs of these.
        storage: options for fsspec's file system, such as ``{"anon": True}``.

    Raises:
        LevelheadError: a place that is not there or cannot be read, none that holds a recording, or two recordings
            with one name.
    """
    require("fsspec", "a corpus", "corpus")
    named = [os.fspath(place) for place in places]
    if not named:
        raise LevelheadError("there is no place to look into; give folders, patterns or URLs with recordings")
    found: dict[str, Source] = {}
    for place in named:
        for source in _list_place(place, storage or {}):
            found.setdefault(source.url, source)
    if not found:
        raise LevelheadError(
            f"no recordings match {' '.join(named)}; expected files that end in {' '.join(sorted(SUFFIXES))}"
        )
    names: dict[str, Source] = {}
    for source in found.values():
        if source.name in names:
            raise LevelheadError(
                f"two recordings are called {source.name}: {names[source.name].url} and {source.url}; name the folder "
                "above both, or run them into folders of their own"
            )
        names[source.name] = source
    return [names[name] for name in sorted(names)]


def _list_place(place: str, storage: ReadOnlyJson) -> list[Source]:
    import fsspec

    try:
        system, path = fsspec.core.url_to_fs(place, **storage)
        root, files = _files(system, path)
    except (ImportError, ValueError) as error:
        raise LevelheadError(f"{place} cannot be read: {error}") from None
    except Exception as error:  # every store has errors of its own
        raise LevelheadError(
            f"there is nothing at {place} that could be read ({type(error).__name__}: {error}); expected a folder, "
            "a pattern or a URL with recordings"
        ) from None
    whole = {_bare(file): file for file in files}
    bare = {_bare(file): info for file, info in files.items()}
    results = {str(PurePosixPath(file).parent) for file in bare if PurePosixPath(file).name == MANIFEST}
    local = _is_local(system)
    _say_lists([file for file in bare if LISTS.fullmatch(PurePosixPath(file).name)])
    sources = []
    for member, parts in _recordings(bare, results).items():
        name = str(PurePosixPath(member).relative_to(_bare(root)))
        url = member if local else _url(system, member, whole)
        size = sum(int(info.get("size") or 0) for info in parts)
        one = Source(name, url, _stamp(parts), size)
        inside = _list_zip(one) if local and member.lower().endswith(".zip") else []
        sources += inside or [one]
    return sources


def _bare(file: str) -> str:
    """A path without the scheme that some stores put before it."""
    return file.partition("://")[2] or file


def _url(system: Untyped, member: str, whole: Mapping[str, str]) -> str:
    """The URL of a recording, a file or a folder, in a store whose files have these bare paths."""
    file = next(file for bare, file in whole.items() if bare == member or bare.startswith(f"{member}/"))
    scheme = file[: len(file) - len(_bare(file))]
    return f"{scheme}{member}" if scheme else str(system.unstrip_protocol(member))


def _list_zip(archive: Source) -> list[Source]:
    """The recordings in a zip, if there are several; a zip with the parts of one stays one."""
    from levelhead.sources.pipeline import list_recordings

    if not zipfile.is_zipfile(archive.url):
        return []
    with zipfile.ZipFile(archive.url) as inside:
        files: dict[str, JsonObject] = {
            info.filename: {"size": info.file_size, "checksum": info.CRC}
            for info in inside.infolist()
            if not info.is_dir()
        }
    members = _recordings(files, set())
    if len(members) < MIN_RECORDINGS:
        return []
    alone = list_recordings(Path(archive.url))
    if len(alone) < MIN_RECORDINGS:
        return []
    return [
        Source(
            f"{archive.name}/{member}",
            f"zip://{member}::{archive.url}",
            _stamp(parts),
            sum(int(info["size"]) for info in parts),
        )
        for member, parts in members.items()
        if str(PurePosixPath(member).with_suffix("")) in alone
    ]


def _say_lists(files: list[str]) -> None:
    if files:
        more = f" and {len(files) - SHOWN} more" if len(files) > SHOWN else ""
        logging.getLogger("levelhead").warning(
            "passed over, because by their names they are about recordings and hold none: %s%s",
            ", ".join(files[:SHOWN]),
            more,
        )


def _files(system: Untyped, path: str) -> tuple[str, dict[str, JsonObject]]:
    """The folder that names are relative to, and all files below a path with their store's facts."""
    if not MAGIC.search(path):
        if system.isfile(path) and not _is_page(path):
            return path.rpartition("/")[0] or "/", {path: system.info(path)}
        found = _find(system, path)
        if not found and not system.exists(path):
            raise FileNotFoundError("not found")
        return path.rstrip("/") or "/", found
    parts = PurePosixPath(path).parts
    fixed = next(i for i, part in enumerate(parts) if MAGIC.search(part))
    root = str(PurePosixPath(*parts[:fixed])) if fixed else ""
    found = {}
    for match, info in system.glob(path, detail=True).items():
        found |= system.find(match, detail=True) if info["type"] == "directory" else {match: info}
    return root, found


def _is_page(path: str) -> bool:
    """Whether a path is that of a web page, which may be the list of a folder."""
    return "://" in path and PurePosixPath(path).suffix.lower() not in SUFFIXES


def _find(system: Untyped, path: str) -> dict[str, JsonObject]:
    """All files below a folder; folders of this machine that cannot be read are named in the log."""
    found: dict[str, JsonObject] = system.find(path, detail=True)
    unreadable: list[str] = []
    if _is_local(system):
        for _ in os.walk(path, onerror=lambda error: unreadable.append(str(error.filename))):
            pass
    if unreadable:
        logging.getLogger("levelhead").warning("passed over, because they cannot be read: %s", ", ".join(unreadable))
    return found


def _is_local(system: Untyped) -> bool:
    return "file" in (system.protocol if isinstance(system.protocol, tuple) else (system.protocol,))


def _recordings(files: Mapping[str, JsonObject], results: set[str]) -> dict[str, list[JsonObject]]:
    """Path of each recording -> its files."""
    folders: dict[str, list[str]] = {}
    for file in files:
        folders.setdefault(str(PurePosixPath(file).parent), []).append(file)
    whole = {file.removesuffix(f"/{IMU}") for file in files if file.endswith(f"/{IMU}")}
    whole |= {folder for folder, inside in folders.items() if _is_one_recording(folder, inside)}
    found: dict[str, list[JsonObject]] = {}
    for file in sorted(files):
        above = [str(parent) for parent in PurePosixPath(file).parents]
        if any(parent in results for parent in above):
            continue
        owner = next((parent for parent in above if parent in whole), None)
        if owner is not None:
            found.setdefault(owner, []).append(files[file])
        elif _is_log(PurePosixPath(file)):
            found[file] = [files[file]]
    return found


def _can_be_log(file: PurePosixPath) -> bool:
    return file.suffix.lower() in SUFFIXES and not file.name.startswith(".")


def _is_log(file: PurePosixPath) -> bool:
    return _can_be_log(file) and not LISTS.fullmatch(file.name)


def _is_one_recording(folder: str, files: Sequence[str]) -> bool:
    """Whether the files of a folder are one recording: a ROS 2 bag, or a file for each sensor."""
    stems = [PurePosixPath(file).stem for file in files if PurePosixPath(file).suffix.lower() in SUFFIXES]
    if any(PurePosixPath(file).name == BAG for file in files):
        return True
    if not (any(map(GYR.search, stems)) and any(map(ACC.search, stems))):
        return False
    if not Path(folder).is_dir():
        return True  # in a store: its names are all that is known
    from levelhead.sources.pipeline import is_one_recording

    return is_one_recording(Path(folder))


def _stamp(parts: Sequence[JsonObject]) -> str:
    said = [[str(info.get("size")), *(str(info[key]) for key in STAMPS if info.get(key) is not None)] for info in parts]
    return hashlib.sha256(repr(said).encode()).hexdigest()[:16]


@contextmanager
def local_copy(source: Source, storage: ReadOnlyJson) -> Iterator[Path]:
    """The recording as a path on this machine: itself, or a copy that is removed afterwards.

    A copy keeps the name of its file and of its folder, which show to which data set it belongs.
    """
    if "://" not in source.url:
        yield Path(source.url)
        return
    import fsspec

    system, path = fsspec.core.url_to_fs(source.url, **storage)
    with TemporaryDirectory(prefix="levelhead-") as folder:
        target = Path(folder, *PurePosixPath(path).parts[-2:])
        target.parent.mkdir(parents=True, exist_ok=True)
        system.get(path, str(target), recursive=system.isdir(path))
        yield target


def is_gone(url: str, storage: ReadOnlyJson) -> bool:
    """Whether a recording that was run is no longer there; a store that does not answer proves nothing."""
    if "://" not in url:
        return not Path(url).exists()
    import fsspec

    try:
        system, path = fsspec.core.url_to_fs(url, **storage)
        return not system.exists(path)
    except FileNotFoundError:
        return True  # the zip around it
    except Exception:  # every store has errors of its own
        return False


def file_digest(path: Path) -> str:
    """SHA-256 of a file, or of all files of a folder, by name."""
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    whole = hashlib.sha256()
    for part in sorted(path.rglob("*")):
        if part.is_file():
            whole.update(f"{part.relative_to(path)}\0{file_digest(part)}\0".encode())
    return whole.hexdigest()
