"""Results for people and other programs: terminal tables, a progress bar, pictures, files and a summary.

Everything heavy (matplotlib, rich, pyarrow) is imported when it is needed, not before.
"""

from levelhead.publish.progress import progress
from levelhead.publish.summary import summary
from levelhead.publish.table import print_table, rich_table
from levelhead.publish.writers import write_track

__all__ = ["print_table", "progress", "rich_table", "summary", "write_track"]
