"""A black box run again, as the node ran: the same numbers, to the bit, changes of parameters included."""

import os
from typing import Any

import numpy as np

from levelhead import filters
from levelhead.engine.stream import Stream
from levelhead.guard import Guard
from levelhead.sources.formats.blackbox import FUSED, MAG_NEW, read_box
from levelhead.track import Track


def rerun(path: str | os.PathLike[str], engine: str = "auto") -> tuple[Track, Track]:
    """The node's orientations, and those of a new stream for the same samples.

    Args:
        path: the black box.
        engine: as for ``Stream``.

    Returns:
        Two Tracks over the samples that were fused, with the bias of the start in ``bias``.

    Raises:
        LevelheadError: no black box, or nothing in it was fused.
    """
    box = read_box(path)
    flt = filters.find(box.config["filter"])
    guard = None if box.config["guard"] is None else Guard(**box.config["guard"])
    stream = Stream(flt.params(**box.config["params"]), guard=guard, engine=engine)
    rows = box.rows[(box.rows["flags"] & FUSED) > 0]
    changes, headings = list(box.changes), list(box.headings)
    a, b, c = box.bias
    said: list[Any] = []
    for row in rows:
        while changes and changes[0][0] <= row["seq"]:
            stream.set(**changes.pop(0)[1])
        while headings and headings[0][0] <= row["seq"]:
            stream.set_heading(headings.pop(0)[1])
        x, y, z = row["gyr"].tolist()
        mag = tuple(row["mag"].tolist()) if row["flags"] & MAG_NEW else None
        stream.update((x - a, y - b, z - c), tuple(row["acc"].tolist()), mag, t=float(row["t"]))
        said.append(stream.output)
    bias = np.array([[u + a, v + b, w + c] for u, v, w in (one.bias for one in said)])
    quat, sigma = np.array([one.quat for one in said]), np.array([one.sigma for one in said])
    health = np.array([one.health for one in said], np.uint32)
    again = Track(rows["t"], quat, bias, sigma, health, stream.params)
    return Track(rows["t"], rows["quat"], rows["bias"], rows["sigma"], rows["health"], stream.params), again
