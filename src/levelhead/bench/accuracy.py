"""Errors of every method on every recording, and their means by group."""

import statistics
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from levelhead import filters
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import ErrorFigures, measure_errors
from levelhead.bench.groups import Group
from levelhead.bench.methods import DEFAULT, OURS, SMOOTHER, Method
from levelhead.bench.processes import run_parallel
from levelhead.bench.ratios import PAIRS, Ratios, compare_figures
from levelhead.bench.reference import SensorFrame, align_sensor
from levelhead.bench.survey import Entry, survey
from levelhead.bench.timing import Progress, machine
from levelhead.evaluate.text_table import Cell, Column, plain_table
from levelhead.recording import Array, Recording

# Overall columns right of the groups: key, title, error, and its statistic over the recordings.
OVERALL = {
    True: (
        ("total", "total", "mean"),
        ("heading", "heading", "mean"),
        ("tilt", "tilt", "mean"),
        ("aligned", "aligned", "mean"),
        ("median total", "total", "median"),
        ("worst total", "total", "worst"),
    ),
    False: (
        ("tilt", "tilt", "mean"),
        ("median tilt", "tilt", "median"),
        ("worst tilt", "tilt", "worst"),
        ("drift in 60 s", "drift", "mean"),
    ),
}
STATISTICS: dict[str, Callable[[Sequence[float]], float]] = {
    "mean": statistics.fmean,
    "median": statistics.median,
    "worst": max,
}


class Task(NamedTuple):
    """One method on one recording."""

    entry: Entry
    method: Method
    with_mag: bool


class Outcome(NamedTuple):
    """The result of a task: errors, or the reason why there are none."""

    figures: ErrorFigures | None
    failure: str = ""

    @property
    def blank(self) -> str:
        """The cell of a table where there is no figure."""
        return "NaN" if self.failure.startswith("NaN") else "–"


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Methods on recordings; printed, it is the table by group.

    Attributes:
        entries: the recordings, by group.
        methods: in the order of the table.
        outcomes: by recording's and method's position.
        with_mag: whether the magnetometers were used.
        remarks: sentences about methods and files that are left out.
    """

    entries: tuple[Entry, ...]
    methods: tuple[Method, ...]
    outcomes: dict[tuple[int, int], Outcome]
    with_mag: bool
    remarks: tuple[str, ...] = ()

    @property
    def groups(self) -> list[Group]:
        """Those that occur, in the order of the table."""
        return list(dict.fromkeys(entry.group for entry in self.entries))

    @property
    def main(self) -> list[int]:
        """Positions of the recordings over which overall figures are taken: those with the best known heading.

        A total error without its heading offset is another thing than one with it; their mean would be neither.
        """
        north = [i for i, entry in enumerate(self.entries) if entry.north]
        return north if self.with_mag and north else list(range(len(self.entries)))

    @property
    def figure(self) -> str:
        """Name of the error in the columns of the groups."""
        return "total" if self.with_mag else "tilt"

    @property
    def columns(self) -> list[Column]:
        """Method, groups, overall."""
        shown = [Column(group.name, group.name, "", 2, "low") for group in self.groups]
        overall = [Column(f"all: {key}", key, "", 2, "low") for key, _, _ in OVERALL[self.with_mag]]
        return [Column("method", "method"), *shown, *overall]

    @property
    def table(self) -> list[dict[str, Cell]]:
        """One mapping per method from column key to degrees; None where there is no figure at all."""
        return [self._row(j) for j in range(len(self.methods))]

    def _row(self, method: int) -> dict[str, Cell]:
        row: dict[str, Cell] = {"method": self.methods[method].name}
        for group in self.groups:
            row[group.name] = self._over(self._of(group), method, self.figure, "mean")
        for key, figure, how in OVERALL[self.with_mag]:
            row[f"all: {key}"] = self._over(self.main, method, figure, how)
        return row

    def _of(self, group: Group) -> list[int]:
        return [i for i, entry in enumerate(self.entries) if entry.group == group]

    def _over(self, rows: Sequence[int], method: int, figure: str, how: str) -> float | None:
        found = [self.outcomes[i, method].figures for i in rows]
        values = [getattr(one, figure) for one in found if one is not None]
        known = [value for value in values if value is not None]
        return float(STATISTICS[how](known)) if known else None

    def cell(self, method: int, column: Column) -> str:
        """A cell as text; a star marks figures from which some recordings are missing."""
        rows = {group.name: self._of(group) for group in self.groups}.get(column.key, self.main)
        failed = [self.outcomes[i, method] for i in rows if self.outcomes[i, method].figures is None]
        value = self._row(method)[column.key]
        if value is None:
            return failed[0].blank if failed else "–"
        return column.cell(value) + ("*" if failed and column.key != "method" else "")

    @property
    def notes(self) -> list[str]:
        """Sentences that explain the table."""
        return [*_about(self), *self._failures(), *self.remarks]

    def _failures(self) -> list[str]:
        """A line for every method and reason."""
        found: dict[tuple[str, str], list[str]] = {}
        for (i, j), outcome in sorted(self.outcomes.items()):
            if outcome.failure:
                found.setdefault((self.methods[j].name, outcome.failure), []).append(self.entries[i].name)
        return [f"* {name} {why} on {_name_some(where)}." for (name, why), where in found.items()]

    @property
    def long(self) -> list[dict[str, Cell]]:
        """One mapping per recording and method: names, figures in degrees, note; None for an absent one."""
        nothing = dict.fromkeys(ErrorFigures._fields)
        return [
            {"dataset": entry.group.dataset, "group": entry.group.name, "recording": entry.name}
            | {"method": self.methods[j].name, "package": self.methods[j].package}
            | (nothing if (one := self.outcomes[i, j]).figures is None else one.figures._asdict())
            | {"note": one.failure}
            for i, entry in enumerate(self.entries)
            for j in range(len(self.methods))
        ]

    @property
    def ratios(self) -> list[Ratios]:
        """Ours beside VQF, online and smoothed, where both of a pair took part."""
        order = {method.name: j for j, method in enumerate(self.methods)}
        return [
            compare_figures(name, peer, self._pairs(order[name], order[peer]), self.with_mag)
            for name, peer in PAIRS
            if name in order and peer in order
        ]

    def _pairs(self, ours: int, peer: int) -> list[tuple[Entry, ErrorFigures, ErrorFigures]]:
        found = [(entry, self.outcomes[i, ours].figures, self.outcomes[i, peer].figures)
                 for i, entry in enumerate(self.entries)]  # fmt: skip
        return [(entry, one, other) for entry, one, other in found if one is not None and other is not None]

    def to_dict(self) -> dict[str, object]:
        """Everything, ready for JSON: numbers, texts, None; never NaN."""
        return {
            "machine": machine(),
            "magnetometer": self.with_mag,
            "unit": "deg",
            "figure_of_groups": self.figure,
            "notes": self.notes,
            "methods": [
                {"method": one.name, "package": one.package, "params": _plain(one)} | {"errors": row}
                for one, row in zip(self.methods, self.table, strict=True)
            ],
            "ratios": [one.to_dict() for one in self.ratios],
            "recordings": [entry.to_dict() for entry in self.entries],
            "runs": self.long,
        }

    def __str__(self) -> str:
        return "\n".join([plain_table(self.columns, self.table), *self.notes])


def _about(result: Accuracy) -> list[str]:
    """The meaning of the figures, in sentences."""
    main = [result.entries[i] for i in result.main]
    sets = " and ".join(dict.fromkeys(entry.group.dataset for entry in main))
    lines = [f"RMS {result.figure} error in °, mean over each group; right of that over all {len(main)} of {sets}."]
    if result.with_mag:
        lines.append("Aligned: the total error without each recording's best constant heading offset.")
        relative = dict.fromkeys(entry.group.dataset for entry in result.entries if not entry.north)
        if relative:
            lines.append(
                f"{' and '.join(relative)}: no north in the reference, so that offset is removed for all alike."
            )
    else:
        lines.append("Without magnetometer. Drift: RMS change of the heading error in 60 s, mean over the recordings.")
    names = {method.name for method in result.methods}
    return lines + [words for name, words in _remarks(result).items() if name in names]


def _remarks(result: Accuracy) -> dict[str, str]:
    """Remarks on methods, by name."""
    known = {
        DEFAULT: f"default: {filters.default()}, which fuse uses where no filter is named.",
        SMOOTHER: f"smoother: {filters.offline()} with its backward pass: every instant uses the whole recording.",
        "imufusion.Ahrs+": "imufusion.Ahrs+: with its bias estimate and the rejections of its advanced example.",
        "riann.RIANN": "riann.RIANN gives tilt alone: its heading has no meaning.",
        "vqf.offlineVQF": "vqf.offlineVQF uses the whole recording for every instant.",
    }
    if result.with_mag:
        known["ahrs.EKF"] = "ahrs.EKF gets the measured dip of the field; its default is Munich's."
        for method in result.methods:
            if method.params is not None and "heading" not in filters.of(method.params).estimates:
                known[method.name] = f"{method.name} keeps the heading of its start: see its tilt and aligned error."
    return known


def _plain(method: Method) -> dict[str, object] | None:
    params = {DEFAULT: filters.default(), SMOOTHER: filters.offline()}.get(method.name, method.params)
    return None if params is None else {"filter": filters.of(params).name, **params._asdict()}


def _name_some(names: Sequence[str], most: int = 3) -> str:
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")


@lru_cache(maxsize=1)
def _recording(path: Path, with_mag: bool) -> tuple[Recording, SensorFrame | None]:
    """The recording, and the rotation from its reference's body to the sensor."""
    recording = load_recording(path, with_mag)
    return recording, align_sensor(recording)


def run(task: Task) -> Outcome:
    """One method on one recording. Whatever goes wrong in it becomes part of the result: users would meet it too."""
    recording, frame = _recording(task.entry.path, task.with_mag)
    if task.entry.missing and task.method.package != OURS:
        return Outcome(None, f"left out, knowing no missing reading ({task.entry.missing}),")
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            quat, sigma = task.method.run(recording)
    except Exception as error:
        why = (str(error).splitlines() or [""])[0][:100]
        return Outcome(None, f"failed: {type(error).__name__}{f' ({why})' if why else ''}")
    return outcome_of(recording, np.asarray(quat, dtype=float), sigma, task.entry.north, frame)


def outcome_of(
    recording: Recording, quat: Array, sigma: Array | None, absolute: bool, frame: SensorFrame | None
) -> Outcome:
    """The figures, if there is a unit quaternion for every sample."""
    if quat.shape != (len(recording), 4):
        return Outcome(None, f"failed: gave an array of shape {quat.shape}")
    lost = ~np.isfinite(quat).all(axis=1)
    if lost.any():
        return Outcome(
            None, f"NaN at {int(lost.sum()):,} samples, the first at {recording.t[int(lost.argmax())]:.3g} s,"
        )
    length = np.linalg.norm(quat, axis=1)
    if (np.abs(length - 1.0) > 0.01).any():
        return Outcome(None, f"failed: gave quaternions of length {length.min():.3g} to {length.max():.3g}")
    return Outcome(measure_errors(recording, quat / length[:, None], absolute, sigma, frame))


def accuracy(
    places: Sequence[Path],
    methods: Sequence[Method],
    *,
    with_mag: bool = True,
    jobs: int = 1,
    remarks: Sequence[str] = (),
    progress: Progress | None = None,
) -> Accuracy:
    """Run every method over every recording in the folders that has a truth.

    Args:
        places: folders with recordings, or files.
        methods: the methods to compare.
        with_mag: whether magnetometers are used; without them heading is relative for all.
        jobs: processes.
        remarks: sentences for the notes.
        progress: called with the fraction done, 0 to 1.

    Raises:
        LevelheadError: no such folder, nothing to compare in it, or a process that died.
    """
    _recording.cache_clear()  # a file may have changed since the last run in this process
    entries, left_out = survey(places, with_mag)
    tasks = [Task(entry, method, with_mag) for entry in entries for method in methods]
    if jobs > 1:
        _compile_once(methods, entries[0], with_mag)
    position = {entry.path: i for i, entry in enumerate(entries)}
    order = {method.name: j for j, method in enumerate(methods)}
    outcomes: dict[tuple[int, int], Outcome] = {}
    for task, outcome in run_parallel(run, tasks, min(jobs, len(tasks))):
        outcomes[position[task.entry.path], order[task.method.name]] = outcome
        if progress is not None:
            progress(len(outcomes) / len(tasks))
    notes = [*remarks, *(f"Left out: {words.removesuffix('.')}." for words in left_out)]
    return Accuracy(tuple(entries), tuple(methods), outcomes, with_mag, tuple(notes))


def _compile_once(methods: Sequence[Method], entry: Entry, with_mag: bool) -> None:
    """Numba's machine code into the cache, so that the processes need not each make it; native filters need none."""
    from levelhead.engine import fuse
    from levelhead.engine.binding import choose_engine
    from levelhead.engine.native import has_imu

    recording = _recording(entry.path, with_mag)[0]
    for method in methods:
        if method.package == OURS:
            params = filters.default() if method.params is None else method.params
            native = has_imu(filters.of(params), guarded=True)
            fuse(recording[:2], params, engine=choose_engine("auto", len(recording), native))
