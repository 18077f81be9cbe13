"""Columns and their ranges, for a person who can name them."""

from collections.abc import Sequence

import numpy as np

from levelhead.recording import Array

_SHOWN = 14  # columns in a message


def list_ranges(names: Sequence[str], values: Array) -> str:
    """The columns of (n, k) ``values`` with their ranges, for a person who can name them."""
    shown = []
    for name, column in zip(names[:_SHOWN], values.T, strict=False):
        finite = column[np.isfinite(column)]
        shown.append(f"{name} {finite.min():.4g} to {finite.max():.4g}" if len(finite) else f"{name} empty")
    more = f", and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f"the columns reach: {', '.join(shown)}{more}"
