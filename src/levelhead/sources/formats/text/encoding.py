"""Bytes as text: UTF-8, UTF-16 with its mark, or an older code page."""

import codecs
from importlib.util import find_spec
from typing import NamedTuple

from levelhead.errors import LevelheadError
from levelhead.sources.conclusions import Basis, Conclusion

MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
_DEGREES = (("gb18030", b"\xa1\xe3"), ("cp949", b"\xa1\xc6/"), ("cp932", b"\x81\x8b/"))  # "°", "°/" of the east
MIN_LETTERS = 40  # letters beyond ASCII, below which a language is unclear
NOISE = 200  # bytes before the first line of a log of a serial port
GUESS_BYTES = 1 << 16  # bytes from which a code page is guessed


class Encoding(NamedTuple):
    """How a file spells its text.

    Attributes:
        name: Python's name of the codec.
        skip: bytes of the mark at the start of the file.
        conclusion: set if it was inferred.
    """

    name: str
    skip: int = 0
    conclusion: Conclusion | None = None


def find_encoding(head: bytes, source: str) -> Encoding:
    """The encoding of a file that begins with ``head``.

    Raises:
        LevelheadError: binary data.
    """
    for mark, name in MARKS:
        if head.startswith(mark):
            return Encoding(name, len(mark))
    if b"\0" in head.rstrip(b"\0"):  # a recorder that lost power leaves zeros at the end
        for name, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[0::2])):
            if len(zeros) > 8 and zeros.count(0) > 0.9 * len(zeros):
                return Encoding(name, 0, Conclusion("file.encoding", "zero_bytes", name, Basis.NUMBERS))
        if not _is_mostly_text(head):
            raise LevelheadError(f"{source} is not a text file with columns; expected lines of numbers")
        return Encoding("utf-8")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return _code_page(head)
    return Encoding("utf-8")


def _is_mostly_text(head: bytes) -> bool:
    """Whether zeros stand in the first line only, in the noise of a port before the first words of a board."""
    start, _, rest = head.partition(b"\n")
    return b"\0" not in rest.rstrip(b"\0") and len(start) < NOISE and rest.isascii()


def _code_page(head: bytes) -> Encoding:
    """The older code page that fits; Windows' western one where nothing shows it, since numbers are the same in all."""
    name = next((page for page, sign in _DEGREES if sign in head), "cp1252")  # ° and µ of the west
    if sum(sign > 127 for sign in head) >= MIN_LETTERS and find_spec("charset_normalizer") is not None:
        from charset_normalizer import from_bytes

        best = from_bytes(head[:GUESS_BYTES]).best()
        name = name if best is None else best.encoding
    return Encoding(name, 0, Conclusion("file.encoding", "code_page", name, Basis.GUESS))
