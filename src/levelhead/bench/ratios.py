"""Our errors as ratios to VQF's, recording by recording: the expectation of a user of any sensor in any motion.

The error of a recording is the total error after one constant rotation where there is a magnetometer, and the change of
the heading error in a minute where there is none (``ErrorFigures.rotated``, ``.drift``). Means over recordings are
geometric: twice as good on one makes up for half as good on another.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from levelhead.bench.error_figures import ErrorFigures
from levelhead.bench.methods import DEFAULT, SMOOTHER
from levelhead.bench.survey import Entry
from levelhead.open_types import JsonObject

PAIRS = ((DEFAULT, "vqf.VQF"), (SMOOTHER, "vqf.offlineVQF"))
MIN_ERROR = 0.02  # °: below, a reference is not more accurate
WORSE = 1.2  # a ratio that counts as worse


@dataclass(frozen=True)
class Ratio:
    """One recording: our error and the peer's in degrees, and ours/peer's of tilt."""

    recording: str
    dataset: str
    group: str
    ours: float
    peer: float
    tilt: float
    figures: ErrorFigures

    @property
    def value(self) -> float:
        """Ours by the peer's."""
        return max(self.ours, MIN_ERROR) / max(self.peer, MIN_ERROR)


@dataclass(frozen=True)
class Ratios:
    """A method of ours beside its peer on all recordings."""

    method: str
    peer: str
    recordings: tuple[Ratio, ...]

    def to_dict(self) -> JsonObject:
        """Ready for JSON."""
        rows = [asdict(one) | {"ratio": one.value} for one in self.recordings]
        for row in rows:
            row.pop("figures")
        return {"method": self.method, "peer": self.peer, "table": self.table, "recordings": rows}

    @property
    def table(self) -> list[JsonObject]:
        """A row per data set, and one over all."""
        sets = list(dict.fromkeys(one.dataset for one in self.recordings))
        rows = [_row(name, [one for one in self.recordings if one.dataset == name]) for name in sets]
        return rows + ([_row("all", self.recordings)] if len(sets) > 1 else [])

    @property
    def worse(self) -> list[Ratio]:
        """Recordings whose ratio is above ``WORSE``, the worst first."""
        return sorted((one for one in self.recordings if one.value > WORSE), key=lambda one: -one.value)


def compare_figures(
    method: str, peer: str, pairs: Sequence[tuple[Entry, ErrorFigures, ErrorFigures]], with_mag: bool
) -> Ratios:
    """The ratios of all recordings that both have figures of."""
    found = []
    for entry, ours, other in pairs:
        a, b = compared_error(entry, ours, with_mag), compared_error(entry, other, with_mag)
        if a is not None and b is not None:
            tilt = max(ours.rotated_tilt, MIN_ERROR) / max(other.rotated_tilt, MIN_ERROR)
            found.append(Ratio(entry.name, entry.group.dataset, entry.group.name, a, b, tilt, ours))
    return Ratios(method, peer, tuple(found))


def compared_error(entry: Entry, figures: ErrorFigures, with_mag: bool) -> float | None:
    """Degrees: the total error after one constant rotation with a magnetometer, without the drift of heading."""
    return figures.rotated if with_mag and entry.magnetometer else figures.drift


def geometric_mean(values: Sequence[float]) -> float:
    """exp of the mean logarithm."""
    return math.exp(statistics.fmean(math.log(value) for value in values))


def _row(name: str, ratios: Sequence[Ratio]) -> JsonObject:
    worst = max(ratios, key=lambda one: one.value)
    figures = [one.figures for one in ratios]
    return {
        "data": name,
        "recordings": len(ratios),
        "ratio": geometric_mean([one.value for one in ratios]),
        "tilt": geometric_mean([one.tilt for one in ratios]),
        "ours": statistics.fmean(one.ours for one in ratios),
        "peer": statistics.fmean(one.peer for one in ratios),
        "worse": sum(one.value > WORSE for one in ratios),
        "worst": worst.value,
        "worst recording": worst.recording,
        "beyond_tilt": _mean([one.beyond_tilt for one in figures]),
        "beyond_heading": _mean([one.beyond_heading for one in figures]),
        "tilt_ratio": _root([one.tilt_ratio for one in figures]),
        "heading_ratio": _root([one.heading_ratio for one in figures]),
    }


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.fmean(known) if known else None


def _root(values: Sequence[float | None]) -> float | None:
    """RMS."""
    known = [value for value in values if value is not None]
    return math.sqrt(statistics.fmean(value * value for value in known)) if known else None
