"""Scores of parameter sets against the references of a filter: errors in degrees, or scales of innovations."""

from collections.abc import Sequence

import numpy as np

from levelhead.engine import fuse
from levelhead.engine.threads import map_in_order
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.recording import Array
from levelhead.tune.reference_orientation import Reference
from levelhead.tune.score_sets import score_sets


def score_references(
    held: Sequence[Reference], sets: Sequence[Params], guard: Guard | None, engine: str = "auto"
) -> Array:
    """(logs, k, 3) total, tilt and heading of each set, °; arguments as for ``score_sets``."""
    scores = np.empty((len(held), len(sets), 3))
    errors = [i for i, one in enumerate(held) if one.innovations is None]
    if errors:
        scores[errors] = score_sets([held[i].recording for i in errors], sets, guard, engine)

    def work(pair: tuple[Reference, Params]) -> tuple[float, float, float]:
        one, params = pair
        assert one.innovations is not None
        return one.innovations.scales(fuse(one.recording, params, guard=guard, engine=engine))

    predicted = [i for i in range(len(held)) if i not in errors]
    pairs = [(held[i], params) for i in predicted for params in sets]
    for place, score in enumerate(map_in_order(work, pairs, 1 if engine == "python" else None)):
        scores[predicted[place // len(sets)], place % len(sets)] = score
    return scores
