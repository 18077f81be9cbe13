"""Results for people and other programs: terminal tables, a progress bar, pictures, files and a summary.

Everything heavy (matplotlib, rich, pyarrow) is imported when it is needed, not before.
"""

from typing import TYPE_CHECKING, Any

from levelhead.publish.progress import progress
from levelhead.publish.summary import summary
from levelhead.publish.writers import write_track

if TYPE_CHECKING:
    from levelhead.publish.terminal_table import print_table, rich_table

__all__ = ["print_table", "progress", "rich_table", "summary", "write_track"]


def __getattr__(name: str) -> Any:
    if name not in ("print_table", "rich_table"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from levelhead.publish import terminal_table  # with all of `evaluate` and `tune`

    return getattr(terminal_table, name)
