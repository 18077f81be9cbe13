"""Files of JSON that levelhead writes and reads again: whole or not at all, with a name of their format."""

import os
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.version import VERSION

MAX_BYTES = 1_000_000  # bytes: no such file is so large


def write_json(path: str | os.PathLike[str], form: str, content: JsonObject) -> None:
    """Writes ``content`` with the name of its format and levelhead's version.

    Raises:
        LevelheadError: the path cannot be written.
    """
    import json  # a stream does without both

    from levelhead.atomic import atomic_path

    whole = {"format": form, "levelhead": VERSION} | content
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_json(path: str | os.PathLike[str], form: str, kind: str, source: str) -> JsonObject:
    """The object that ``write_json`` wrote, numbers to the last bit.

    Args:
        path: the file.
        form: the name of its format.
        kind: the kind of such a file, for messages, such as "calibration".
        source: the right input, such as "the JSON that levelhead saved".

    Raises:
        LevelheadError: no such file, not such a file, or one of another format.
    """
    whole = read_object(path, kind, source)
    if not isinstance(whole.get("format"), str):
        raise LevelheadError(f"{path} is not a {kind}; expected {source}")
    if whole["format"] != form:
        raise LevelheadError(f"{path} has the format '{whole['format'][:60]}'; this version reads '{form}'")
    return whole


def read_object(path: str | os.PathLike[str], kind: str, source: str) -> JsonObject:
    """The JSON object in a file, which may be written by hand and name no format; arguments as for ``read_json``.

    Raises:
        LevelheadError: no such file, or not such a file.
    """
    import json

    path = Path(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ValueError
        whole = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LevelheadError(f"cannot read the {kind} {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise LevelheadError(f"{path} is not a {kind}; expected {source}") from None
    if not isinstance(whole, dict):
        raise LevelheadError(f"{path} is not a {kind}; expected {source}")
    return whole
