"""The orientation of one segment in a file of several: ``FILE.sto:SENSOR``, ``FILE.c3d:MARKER,MARKER,MARKER``."""

import re
from pathlib import Path

from levelhead.errors import LevelheadError, nearest
from levelhead.sources.formats.c3d import read_c3d
from levelhead.sources.formats.opensim import read_sto
from levelhead.track import Track

_NAMED = re.compile(r"(?P<file>.*\.(?P<kind>sto|c3d))(?::(?P<name>.*))?", re.IGNORECASE | re.DOTALL)


def split_name(log: Path) -> tuple[Path, str]:
    """The file, and the segment that is named in it, or ""; of another format all is the file."""
    found = _NAMED.fullmatch(str(log))
    return (Path(found["file"]), found["name"] or "") if found else (log, "")


def named_track(log: Path) -> Track | None:
    """The track of the segment that is named; None for a file of another format, or a C3D file where none is.

    Raises:
        LevelheadError: as ``read_sto`` and ``read_c3d``; orientations of which none is named, or one that the file
            lacks.
    """
    file, name = split_name(log)
    if file.suffix.lower() == ".c3d" and name:
        return read_c3d(file, [marker.strip() for marker in name.split(",")])
    if file.suffix.lower() != ".sto":
        return None
    tracks = read_sto(file)
    if not name:
        raise LevelheadError(f"{file} has {len(tracks)} sensors; name one: {file}:{next(iter(tracks), 'SENSOR')}")
    if name not in tracks:
        raise LevelheadError(f"{file} has no sensor {name}; {nearest(name, list(tracks))}")
    return tracks[name]
