"""How the figures of a corpus are distributed: quantiles and a histogram for each folder or sensor."""

import math
from collections.abc import Callable, Sequence
from pathlib import PurePosixPath

import numpy as np

from levelhead.evaluate.text_table import Column, Row
from levelhead.open_types import JsonObject

BINS = 12
BARS = "▁▂▃▄▅▆▇█"
QUANTILES = (0.1, 0.5, 0.9)
Figures = dict[str, tuple[str, str, int, float]]  # column of the rows -> title, unit, digits, factor
COLUMNS = (
    Column("place", "of"), Column("method", "method"), Column("figure", "figure"),
    Column("recordings", "recordings", "", 0), Column("low", "10 %", "", 3), Column("middle", "median", "", 3),
    Column("high", "90 %", "", 3), Column("most", "largest", "", 3), Column("histogram", "histogram"),
)  # fmt: skip


def folder_of(row: JsonObject) -> str:
    """The folder of a recording, by its name."""
    return str(PurePosixPath(row["recording"]).parent)


def sensor_of(row: JsonObject) -> str:
    """The sensor of a recording; "": unknown."""
    return str(row["sensor"] or "")


def distributions(rows: Sequence[JsonObject], figures: Figures, place: Callable[[JsonObject], str]) -> list[Row]:
    """A row for each place, method and figure; histograms of one figure have one logarithmic axis."""
    made: list[Row] = []
    for key, (title, unit, _, factor) in figures.items():
        parts: dict[tuple[str, str], list[float]] = {}
        for row in rows:
            value = row.get(key)
            if value is not None and math.isfinite(value) and place(row):
                parts.setdefault((place(row), row["method"]), []).append(factor * value)
        edges = _edges([value for values in parts.values() for value in values])
        for (where, method), values in sorted(parts.items()):
            low, middle, high = np.quantile(values, QUANTILES).tolist()
            made.append(
                {
                    "place": where, "method": method, "figure": f"{title} [{unit}]", "recordings": float(len(values)),
                    "low": low, "middle": middle, "high": high, "most": max(values), "histogram": _bars(values, edges),
                }
            )  # fmt: skip
    return made


def axis_note(rows: Sequence[Row]) -> str:
    """The unit of the bars."""
    return f"Histograms: {BINS} bins on a logarithmic axis from the least to the largest of a figure." if rows else ""


def _edges(values: Sequence[float]) -> list[float]:
    positive = [value for value in values if value > 0.0]
    if not positive or min(positive) == max(positive):
        return []
    return [float(edge) for edge in np.geomspace(min(positive), max(positive), BINS + 1)]


def _bars(values: Sequence[float], edges: Sequence[float]) -> str:
    """A bar for each bin, as high as its share of the fullest; values that are not positive are in the first."""
    if not edges:
        return ""
    counts, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
    most = int(counts.max())
    return "".join(" " if count == 0 else BARS[(len(BARS) - 1) * int(count) // most] for count in counts)
