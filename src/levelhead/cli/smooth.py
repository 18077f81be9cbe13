"""``levelhead smooth LOG``: ``fuse --offline`` by the name that people look for."""

import functools

from levelhead.cli.fuse import fuse

smooth = functools.partial(fuse, offline=True)
