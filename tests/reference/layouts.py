"""Layouts of public code that nobody has tried with the reader when they were written, in rounds; see dialects.py."""

from collections.abc import Callable

from tests.reference.dialects import Dialect

ROUNDS: dict[str, dict[str, Dialect]] = {}
UNFUSABLE: set[str] = set()  # names of layouts that hold no gyroscope, no gravity or no numbers: refused is right


def layout(kind: str, fusable: bool = True) -> Callable[[Dialect], Dialect]:
    """Registers a layout in the round ``kind`` by its name."""

    def register(function: Dialect) -> Dialect:
        ROUNDS.setdefault(kind, {})[function.__name__] = function
        if not fusable:
            UNFUSABLE.add(function.__name__)
        return function

    return register
