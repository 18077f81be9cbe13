"""The argument with which the gallery runs an example: the file for its picture."""

import tempfile
from pathlib import Path


def picture_file(settings: object, script: dict[str, str]) -> list[str]:
    """A file outside the tree; the gallery shows the open figure itself."""
    return [str(Path(tempfile.mkdtemp(prefix="gallery-")) / f"{Path(script['src_file']).stem}.png")]
