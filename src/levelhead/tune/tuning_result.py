"""A Tuning: the parameters that were found for a filter, their errors, and the doubts about them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from levelhead import filters
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.open_types import JsonObject
from levelhead.parameter_file import ParameterFile
from levelhead.recording import Array
from levelhead.tune.error_bands import Advice, Bands
from levelhead.tune.innovations import HORIZON
from levelhead.tune.left_out import FLOOR, MEASURES, ErrorGain, ErrorLoss, Fold, gain, losses
from levelhead.tune.parameter_space import Space
from levelhead.tune.reference_orientation import Reference
from levelhead.tune.sweep import Metric, Sweep

WORTH = 0.03  # of the error, on the parts left out: a smaller gain does not count
AT_END = 0.01  # share of a range: so near to its end is at the end
INWARDS = 0.08  # share of a range from its end, over which the error must fall by so much for the end to matter
FALLS = 1.01  # times
MAX_LOSSES = 3  # losses that are listed


def mean_error(errors: Array) -> float:
    """Of errors in degrees, so that each recording counts alike, whatever its size."""
    return float(np.exp(np.mean(np.log(np.maximum(errors, FLOOR)))))


class TruthCheck(NamedTuple):
    """Where the smoother was the reference and there is a truth: errors against the truth, °, each (logs,)."""

    smoother: Array
    before: Array
    after: Array


@dataclass(frozen=True, eq=False)
class Tuning:
    """The result of ``tune_filter``.

    Attributes:
        space: the parameters of the search, with their values at the start.
        best: the parameters found. A parameter that does not matter (1 %) stays as it was.
        metric: the error that was minimised.
        references: the reference of the filter, log by log.
        before: (logs,) RMS error in degrees with the parameters at the start.
        after: (logs,) with those found.
        curves: the error over each parameter searched, the others at their best.
        folds: logs, or quarters of the only one, each left out once.
        bands: parts of the error of the first log, before and after.
        advice: which parameter lowers which part.
        check: against the truth, where the smoother was the reference.
        guard: in front of the filter.
        runs: of the filter over all logs, for the result itself.
    """

    space: Space
    best: Params
    metric: Metric
    references: tuple[Reference, ...]
    before: Array
    after: Array
    curves: tuple[Sweep, ...]
    folds: tuple[Fold, ...]
    bands: tuple[Bands, Bands]
    advice: tuple[Advice, ...]
    check: TruthCheck | None
    guard: Guard | None
    runs: int

    @property
    def gain(self) -> float:
        """Share of the error that is gone, on the logs that were searched."""
        return 1.0 - mean_error(self.after) / mean_error(self.before)

    @property
    def held_out(self) -> ErrorGain | None:
        """The same on the parts left out, with its interval: the expectation for another log of this kind."""
        return gain(self.folds, MEASURES.index(self.metric)) if self.folds else None

    @property
    def held_out_gain(self) -> float:
        """Its share; without parts left out the gain itself."""
        return self.gain if self.held_out is None else self.held_out.share

    @property
    def losses(self) -> list[ErrorLoss]:
        """Parts left out on which the error, tilt or heading got worse beyond its noise."""
        columns = [MEASURES.index(self.metric), MEASURES.index("tilt")]
        if "gyr" in filters.of(self.space.params).uses:
            columns.append(MEASURES.index("heading"))
        return losses(self.folds, sorted(set(columns)))

    @property
    def worth(self) -> bool:
        """Whether another log gains: by 3 %, surely more than none, and nowhere at the cost of tilt or heading."""
        held_out = self.held_out
        if min(self.gain, self.held_out_gain) < WORTH:
            return False
        return held_out is None or (held_out.low > 0.0 and not self.losses)

    @property
    def params(self) -> Params:
        """The parameters to take: those found, or those of the start where nothing is gained."""
        return self.best if self.worth else self.space.params

    @property
    def kinds(self) -> list[str]:
        """The kind of the references, in words."""
        return sorted({one.kind for one in self.references})

    def at_end(self, index: int) -> str:
        """Where a parameter is at an end of its range up to which the error falls: "lowest" or "highest"; else ""."""
        one, curve = self.space.ranges[index], self.curves[index]
        value = getattr(self.best, one.name)
        share = one.share(value)
        if value == getattr(self.space.params, one.name):
            return ""
        if AT_END <= share <= 1.0 - AT_END:
            return ""
        shares = np.array([one.share(value) for value in curve.values.tolist()])
        inside = np.flatnonzero(np.abs(shares - round(share)) >= INWARDS)
        near = inside[np.argmin(np.abs(shares[inside] - round(share)))]
        if curve.scores[near] < FALLS * curve.scores[np.searchsorted(curve.values, value)]:
            return ""
        return "lowest" if share < 0.5 else "highest"

    def to_dict(self) -> JsonObject:
        """All numbers, ready for JSON."""
        parameters = [
            {
                "name": one.name, "unit": one.param.unit, "before": getattr(self.space.params, one.name),
                "found": getattr(self.best, one.name), "searched": [one.low, one.high],
                "flat": [float(curve.values[i]) for i in curve.flat], "at_end": self.at_end(k) or None,
                "values": curve.values.tolist(), "error_deg": curve.scores.tolist(),
            }
            for k, (one, curve) in enumerate(zip(self.space.ranges, self.curves, strict=True))
        ]  # fmt: skip
        logs = [
            {"log": one.name, "reference": one.kind, "seconds": one.seconds, "before_deg": before, "after_deg": after}
            for one, before, after in zip(self.references, self.before.tolist(), self.after.tolist(), strict=True)
        ]
        check = self.check
        return {
            "filter": filters.of(self.best).name,
            "params": dict(self.params._asdict()),
            "found": dict(self.best._asdict()),
            "metric": self.metric,
            "worth": self.worth,
            "gain": self.gain,
            "held_out_gain": self.held_out_gain,
            "held_out_interval": None if self.held_out is None else [self.held_out.low, self.held_out.high],
            "losses": [one._asdict() for one in self.losses],
            "logs": logs,
            "held_out": [
                {"name": one.name, "before": one.before, "after": one.after, "scores": one.scores.tolist()}
                for one in self.folds
            ],
            "parameters": parameters,
            "error_parts": {"before": self.bands[0]._asdict(), "after": self.bands[1]._asdict()},
            "advice": [one._asdict() for one in self.advice],
            "truth": None if check is None else {name: part.tolist() for name, part in check._asdict().items()},
            "runs": self.runs,
            "verdict": self.verdict(),
        }

    def file(self) -> ParameterFile:
        """The parameters to take, as a file for ``--params``."""
        keys = ("metric", "worth", "gain", "held_out_gain", "logs", "held_out", "runs", "verdict")
        facts = self.to_dict()
        found = {"params": facts["found"], "searched": list(self.space.names)} | {key: facts[key] for key in keys}
        return ParameterFile(self.params, None if self.guard == Guard() else self.guard, found)

    def verdict(self) -> list[str]:
        """In words: the gain, whether to take it, its reference, and its weaknesses."""
        before, after = mean_error(self.before), mean_error(self.after)
        changed = _changes(self.space.params, self.best)
        name = filters.of(self.best).name
        lines = []
        if self.worth:
            lines.append(
                f"take {name} with {changed}: {self.measure} {before:.2f}° → {after:.2f}° RMS, "
                f"{_percent(self.gain)} less; {self._elsewhere()}"
            )
        else:
            lines.append(self._keep(name, before, after, changed))
            lines += [
                f"on {one.part}, left out of the search, {one.measure} got worse: {one.before:.2f}° → {one.after:.2f}°"
                for one in self.losses[:MAX_LOSSES]
                if changed
            ]
        lines.append(self._reference_words())
        if self.check is not None:
            lines.append(self._truth_words(self.check))
        lines += [
            f"{one.name} = {getattr(self.best, one.name):g} is the {end} value searched: a better one may lie outside; "
            f"widen the range with -p {one.name}=LOW:HIGH"
            for k, one in enumerate(self.space.ranges)
            if (end := self.at_end(k))
        ]
        return [*lines, *(remark for one in self.references for remark in one.remarks)]

    def _elsewhere(self) -> str:
        """The gain on the parts left out."""
        held_out = self.held_out
        if held_out is None:
            return "nothing was left out to measure the gain on another log"
        parts = "logs" if len(self.references) > 1 else "parts of the log"
        less = held_out.share >= 0.0
        words = f"{_percent(abs(held_out.share))} {'less' if less else 'more'}"
        return f"on {parts} left out of the search {words} ({100 * held_out.low:.0f} to {100 * held_out.high:.0f} %)"

    @property
    def measure(self) -> str:
        """The goal of the search, in words."""
        return f"{self.metric} {'innovation' if self.kinds == ['likelihood'] else 'error'}"

    def _keep(self, name: str, before: float, after: float, changed: str) -> str:
        start = "the defaults" if self.space.params == type(self.space.params)() else "the parameters given"
        if not changed:
            return f"keep {start} of {name}: no others have a smaller {self.measure} than {before:.2f}° RMS"
        searched = f"{self.measure} {before:.2f}° → {after:.2f}° on the logs of the search, {_percent(self.gain)} less"
        if self.gain < WORTH or self.held_out is None:
            return f"keep {start} of {name}: {searched}; {self._elsewhere()}"
        if self.held_out.share < WORTH or self.held_out.low <= 0.0:
            return f"keep {start} of {name}: the gain does not last; {self._elsewhere()}; {searched}"
        return f"keep {start} of {name}: a part got worse; {searched}; {self._elsewhere()}"

    def _reference_words(self) -> str:
        seconds = sum(one.seconds for one in self.references)
        logs = f"{len(self.references)} log{'s' if len(self.references) > 1 else ''}, {seconds:.0f} s"
        if self.kinds == ["truth"]:
            return f"held against the truth: {logs} scored"
        if self.kinds == ["truth", "smoother"]:
            return f"held against the truth where there is one, else against the smoother: {logs} scored"
        if self.kinds == ["likelihood"]:
            return (
                f"by the likelihood of the innovations over {HORIZON:g} s, motion among them, which no parameter "
                f"lowers: {logs} scored"
            )
        own = "; it is this filter's own, so errors that both share are not seen"
        shared = filters.of(self.best).smoothing is not None
        return f"held against the smoother, where it is sure of itself: {logs} scored{own if shared else ''}"

    def _truth_words(self, check: TruthCheck) -> str:
        smoother, before, after = (mean_error(one) for one in check)
        return (
            f"against the truth, which was not used: {before:.2f}° → {after:.2f}°; the smoother itself has "
            f"{smoother:.2f}°"
        )

    def __str__(self) -> str:
        return "\n".join(self.verdict())


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.005 or share <= -0.005 else "less than 1 %"


def _changes(before: Params, after: Params) -> str:
    """The parameters that differ, as one would type them."""
    own: Sequence[tuple[str, object]] = [
        (name, value) for name, value in after._asdict().items() if value != getattr(before, name)
    ]
    return ", ".join(
        f"{name}={value:g}" if isinstance(value, float) and math.isfinite(value) else f"{name}={value}"
        for name, value in own
    )
