"""Runs any filter: over a whole recording (``batch``), sample by sample (``stream``), or there and back
(``smoothing``), by one driver."""

import importlib
from typing import TYPE_CHECKING, Any

from levelhead.engine.batch import fuse, fuse_axis

if TYPE_CHECKING:
    from levelhead.engine.chunks import fuse_chunks
    from levelhead.engine.parallel import fuse_parameter_sets, fuse_recordings
    from levelhead.engine.smoothing import smooth
    from levelhead.engine.stream import AxisStream, Stream

__all__ = [
    "AxisStream",
    "Stream",
    "fuse",
    "fuse_axis",
    "fuse_chunks",
    "fuse_parameter_sets",
    "fuse_recordings",
    "smooth",
]

# Imported at first use: who fuses one recording waits for neither threads nor streams.
_HOMES = {
    "AxisStream": "stream",
    "Stream": "stream",
    "fuse_chunks": "chunks",
    "fuse_recordings": "parallel",
    "fuse_parameter_sets": "parallel",
    "smooth": "smoothing",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
