"""Standard output, whose errors carry its name: other errors without a file, of the network, are not its own."""

from collections.abc import Iterator
from contextlib import contextmanager

NAME = "standard output"


@contextmanager
def standard_output() -> Iterator[None]:
    """Names standard output in the ``OSError`` of a block that writes to it."""
    try:
        yield
    except OSError as error:
        error.filename = NAME
        raise
