"""Runs any filter: over a whole recording (``batch``) or sample by sample (``stream``), by one driver."""

from levelhead.engine.batch import fuse, fuse_axis
from levelhead.engine.many import fuse_all, fuse_many
from levelhead.engine.stream import AxisStream, Stream

__all__ = ["AxisStream", "Stream", "fuse", "fuse_all", "fuse_axis", "fuse_many"]
