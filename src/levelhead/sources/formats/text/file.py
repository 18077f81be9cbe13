"""A text file as its dialects see it: its first lines, its encoding, and all of its lines on demand."""

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.formats.text.cells import is_comment, lines_of
from levelhead.sources.formats.text.encoding import Encoding, find_encoding

HEAD = 1 << 18  # bytes that must hold preamble, header and the first lines of numbers


@dataclass(frozen=True)
class TextFile:
    """A text file.

    Attributes:
        path: where it lies.
        display_path: its name in errors; it differs from ``path`` for a file that was unpacked from another.
        encoding: how the bytes are text.
        head: the whole lines at its start.
        unwrapped: the text, where its lines were unwrapped in memory; None: that of ``path``.
        end: bytes before the zeros at its end, which a recorder leaves that loses power.
    """

    path: Path
    display_path: str
    encoding: Encoding
    head: tuple[str, ...]
    unwrapped: str | None = None
    end: int = 0

    @cached_property
    def content(self) -> list[str]:
        """The lines of the head that are neither blank nor comments."""
        return [line for line in self.head if line.strip() and not is_comment(line)]

    @property
    def size(self) -> int:
        """Bytes of the file, or letters of the unwrapped text."""
        return os.path.getsize(self.path) if self.unwrapped is None else len(self.unwrapped)

    def text(self) -> str:
        """All of the text."""
        if self.unwrapped is not None:
            return self.unwrapped
        return self.path.read_bytes()[self.encoding.skip : self.end].decode(self.encoding.name, "replace")

    @property
    def zeros(self) -> Conclusion | None:
        """The zeros at its end, if there are any."""
        count = os.path.getsize(self.path) - self.end
        return Conclusion("file.lines", "zeros", count, Basis.NUMBERS) if count else None

    def lines(self) -> list[str]:
        """All lines of the text."""
        return lines_of(self.text())

    def with_text(self, text: str) -> "TextFile":
        """The same file with the text that is left when its lines are unwrapped.

        Raises:
            LevelheadError: no text is left.
        """
        _require_text(text, self.display_path)
        head = lines_of(text[:HEAD])
        if len(text) > HEAD:
            head.pop()
        return replace(self, encoding=Encoding("utf-8"), head=tuple(head), unwrapped=text)


def open_text(path: str | os.PathLike[str], display_path: str | None = None) -> TextFile:
    """A text file, of which the head is read.

    Raises:
        LevelheadError: empty or binary.
    """
    display_path = os.fspath(path) if display_path is None else display_path
    with open(path, "rb") as file:
        head = file.read(HEAD)
        cut = len(head) == HEAD and bool(file.read(1))
    _require_text(head.rstrip(b"\0"), display_path)
    encoding = find_encoding(head, display_path)
    end = os.path.getsize(path) if encoding.name.startswith("utf-16") else _find_end(path)
    lines = lines_of(head[encoding.skip : end].decode(encoding.name, "replace"))
    if cut and end > len(head):
        lines.pop()
    if not lines:
        raise LevelheadError(f"{display_path} is not a text file with columns; expected lines of numbers")
    return TextFile(Path(path), display_path, encoding, tuple(lines), end=end)


def _find_end(path: str | os.PathLike[str]) -> int:
    """The bytes of a file before the zeros at its end."""
    end = os.path.getsize(path)
    with open(path, "rb") as file:
        while end > 0:
            begin = max(0, end - HEAD)
            file.seek(begin)
            if left := len(file.read(end - begin).rstrip(b"\0")):
                return begin + left
            end = begin
    return end


def _require_text(text: str | bytes, display_path: str) -> None:
    if not text.strip():
        raise LevelheadError(f"{display_path} is empty; expected a header and one line of numbers per sample")
