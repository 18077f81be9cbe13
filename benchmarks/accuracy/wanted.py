"""What was wanted of the default filter and its smoother beside what is measured, as one table in Markdown.

    python -m benchmarks.accuracy.wanted DIR

The figures are those of ``levelhead bench accuracy`` with and without magnetometers, of ``leave_one_out.py`` and
of ``levelhead bench speed``; DIR holds the recordings with a reference. The last column names a command that shows
more: of what is as wanted the one behind the figures, of what is missed the one that shows the cause. The search of
``leave_one_out.py`` takes most of the 15 minutes on two cores; ``--no-search`` leaves it out.
"""

import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.accuracy import iron
from benchmarks.accuracy.leave_one_out import Found, leave_out
from benchmarks.measure import options, run_script, show, show_markdown

from levelhead.bench.accuracy import Accuracy, accuracy
from levelhead.bench.groups import BROAD, REPOIMU
from levelhead.bench.methods import DEFAULT, SMOOTHER, find_method
from levelhead.bench.ratios import PAIRS, WORSE, Ratios, geometric_mean
from levelhead.bench.speed import batch, live
from levelhead.bench.survey import survey
from levelhead.bench.timing import Table, machine
from levelhead.evaluate.text_table import Cell
from levelhead.open_types import JsonObject
from levelhead.publish.bench_tables import format_cell
from levelhead.publish.progress import progress

METHODS = tuple(name for pair in PAIRS for name in pair)
ONLINE, OFFLINE = "vqf.VQF", "vqf.offlineVQF"
ACCURACY = f"levelhead bench accuracy DIR -f {DEFAULT} -f {ONLINE}"
SMOOTHED = f"levelhead bench accuracy DIR -f {SMOOTHER} -f {OFFLINE}"
SEARCH = "python -m benchmarks.accuracy.leave_one_out DIR"
SPEED = "levelhead bench speed"
IRON = "python -m benchmarks.accuracy.iron DIR/broad/*.mat"
SIGMAS = "python -m benchmarks.accuracy.error_over_sigma FILE …"
CAUSE = "python -m benchmarks.accuracy.causes DIR --only "
PHONES = "tyrex"
MEANS = "error/VQF's, geometric mean with magnetometers; without; together"
SMOOTHER_MEANS = "smoother's error/offlineVQF's, with; without; together"
LEFT_OUT = "the same, each set left out of the choice of the numbers"
STREAM = f"Stream({DEFAULT}), tuples"
SAMPLES = 200_000  # of a batch
SIGMA = (0.5, 1.5)  # RMS of error/σ
COLUMNS = {"case": "", "measured": "measured", "wanted": "wanted", "met": "met", "shown": "shown by"}


class Figure(NamedTuple):
    """A figure as text, what was wanted, and whether it is so; None: it was not measured."""

    text: str
    wanted: str
    met: bool | None


class Row(NamedTuple):
    """Figures of one kind, the command behind them, and the one that shows why they are missed."""

    what: str
    figures: tuple[Figure, ...]
    command: str
    cause: str = ""

    @property
    def cells(self) -> dict[str, Cell]:
        """By the keys of ``COLUMNS``; what holds of all figures is said once."""
        missed = any(one.met is False for one in self.figures)
        return {
            "case": self.what,
            "measured": "; ".join(one.text for one in self.figures),
            "wanted": _once([one.wanted for one in self.figures]),
            "met": _once(["–" if one.met is None else format_cell(one.met) for one in self.figures]),
            "shown": f"`{self.cause if missed and self.cause else self.command}`",
        }


def _once(words: Sequence[str]) -> str:
    return words[0] if len(set(words)) == 1 else "; ".join(words)


def at_most(value: float, most: float, unit: str = "") -> Figure:
    """A figure that is to be no more than ``most``."""
    return Figure(f"{format_cell(value)}{unit}", f"{format_cell(most)}{unit}", value <= most)


def share(value: float) -> Figure:
    """A share of samples that is to be no more than 1 %."""
    return Figure(f"{100.0 * value:.1f} %", "1 %", value <= 0.01)


def means_row(what: str, known: Ratios, blind: Ratios, command: str, wanted: tuple[float, float, float]) -> Row:
    """Geometric means of the ratios with magnetometers, without, and over both."""
    values = [[one.value for one in ratios.recordings] for ratios in (known, blind)]
    means = [geometric_mean(some) for some in (*values, values[0] + values[1])]
    return Row(what, tuple(at_most(mean, most) for mean, most in zip(means, wanted, strict=True)), command)


def ratio_rows(known: Ratios, blind: Ratios) -> list[Row]:
    """The default beside VQF with magnetometers and without: where it is worse, and where σ is too small."""
    one, other = (ratios.table[-1] for ratios in (known, blind))
    return [
        Row(
            f"recordings worse than {WORSE} times, with magnetometers; without",
            (at_most(one["worse"], 5), at_most(other["worse"], 13)),
            ACCURACY,
            CAUSE + "bias",
        ),
        Row(
            "the worst, with; without",
            (at_most(one["worst"], 2), at_most(other["worst"], 3)),
            ACCURACY,
            CAUSE + "bias",
        ),
        Row("beyond 4σ with magnetometers: tilt; heading", _beyond(one), ACCURACY, CAUSE + "beyond"),
        Row("the same without: tilt; heading", _beyond(other), f"{ACCURACY} --no-mag", CAUSE + "beyond"),
    ]


def _beyond(row: JsonObject) -> tuple[Figure, Figure]:
    return share(row["beyond_tilt"]), share(row["beyond_heading"])


def sigma_rows(known: Ratios, blind: Ratios) -> list[Row]:
    """RMS of error/σ of each set with magnetometers and without: the sets that are outside of what was wanted."""
    causes = {"tilt": CAUSE + "beyond", "heading": SIGMAS}
    return [
        Row(
            f"error/σ of {part}, RMS, with magnetometers; without",
            tuple(
                _outside({str(row["data"]): row[f"{part}_ratio"] for row in ratios.table}) for ratios in (known, blind)
            ),
            ACCURACY,
            cause,
        )
        for part, cause in causes.items()
    ]


def _outside(values: Mapping[str, float | None]) -> Figure:
    low, high = SIGMA
    sets = {name: value for name, value in values.items() if value is not None and name != "all"}
    found = [f"{name} {value:.2f}" for name, value in sets.items() if not low <= value <= high]
    words = f"{len(found)} of {len(sets)} sets outside" + (f" ({', '.join(found)})" if found else "")
    return Figure(words, f"{low} to {high}", not found)


def broad_row(result: Accuracy, method: str, most: tuple[float, float]) -> Row:
    """Mean errors over BROAD's recordings."""
    chosen = [entry.group.dataset == BROAD for entry in result.entries]
    column = [one.name for one in result.methods].index(method)
    figures = [result.outcomes[i, column].figures for i, yes in enumerate(chosen) if yes]
    found = [
        at_most(statistics.fmean(getattr(one, key) for one in figures if one is not None), limit, "°")
        for key, limit in zip(("aligned", "tilt"), most, strict=True)
    ]
    what = f"BROAD, mean of {len(figures)}, {method}: total with the best heading removed; tilt"
    return Row(what, tuple(found), ACCURACY if method == DEFAULT else SMOOTHED, CAUSE + "rotation")


def repoimu_row(known: Ratios) -> Row:
    """The mean error on RepoIMU by VQF's, and three of its recordings."""
    mean = next(row for row in known.table if row["data"] == REPOIMU)
    ours = {one.recording.removeprefix("TStick_"): one.ours for one in known.recordings}
    single = [("Test07_Trial2", 2.0), ("Test05_Trial1", 15.0), ("Test05_Trial2", 15.0)]
    figures = [at_most(mean["ours"] / mean["peer"], 0.35), *(at_most(ours[name], most, "°") for name, most in single)]
    return Row("RepoIMU: mean by VQF's; Test07 trial 2; Test05 trials 1 and 2", tuple(figures), ACCURACY)


def sets_row(known: Ratios) -> Row:
    """The mean errors with magnetometers on a limb, on a rig and in a hand."""
    wanted = {"diodem": 2.0, "expsimon": 1.3, "x3mate": 2.5}
    ours = {row["data"]: float(row["ours"]) for row in known.table}
    figures = [at_most(ours[name], most, "°") for name, most in wanted.items() if name in ours]
    return Row(f"mean error with magnetometers, {', '.join(wanted)}", tuple(figures), ACCURACY)


def iron_rows(known: Accuracy) -> list[Row]:
    """Error and north with hard iron on BROAD's magnetometers, and north by a raw chip that is simulated."""
    paths = [entry.path for entry in known.entries if entry.group.dataset == BROAD]
    ways = iron.directions(len(paths))
    shares = {0.3: (1.15, 1.5), 3.0: (1.6, 2.0)}
    rows = [iron.row(path, tuple(shares), way) for path, way in zip(paths, ways, strict=True)]
    errors, norths = [], []
    for share, (most, most_north) in shares.items():
        errors.append(at_most(statistics.fmean(float(str(row[f"ours {share}"])) for row in rows), most, "°"))
        north = [float(str(row[f"north {share}"]).split()[0]) for row in rows]
        norths.append(at_most(statistics.median(north), most_north, "°"))
    raw = [abs(iron.simulated_north(seed)) for seed in range(6)]
    return [
        Row("BROAD with 30 and 300 % of hard iron: mean error", tuple(errors), IRON),
        Row("north at the end there, median; a raw ICM-20948 (simulated) after a minute",
            (*norths, at_most(statistics.median(raw), 2.0, "°")), IRON),
    ]  # fmt: skip


def left_out_row(found: Mapping[str, Found] | None) -> Row:
    """Each set by numbers that were chosen on the others; None: that was not run."""
    if found is None:
        return Row(LEFT_OUT, (Figure("not run", "0.58", None),), SEARCH)
    chosen = [value for one in found.values() for value in one.chosen]
    return Row(LEFT_OUT, (at_most(geometric_mean(chosen), 0.58),), SEARCH)


def left_out_note(found: Mapping[str, Found] | None) -> str:
    """What the phones have to do with it."""
    if found is None or PHONES not in found or len(found) == 1:
        return ""
    phones = geometric_mean(found[PHONES].chosen)
    others = geometric_mean([value for name, one in found.items() if name != PHONES for value in one.chosen])
    return (
        f"Left out: {PHONES} by numbers chosen on the other sets {phones:.3f}, by the default's "
        f"{geometric_mean(found[PHONES].default):.3f}; the other sets, each left out, {others:.3f}."
    )


def time_rows(whole: Table, updates: Table) -> list[Row]:
    """Times with magnetometer, in a batch and live, by VQF's."""
    by = {str(row["case"]): float(row["vqf"] or 0.0) for row in whole.rows}
    one = {str(row["case"]): float(row[ONLINE] or 0.0) for row in updates.rows}
    return [
        Row("time in a batch with magnetometer by VQF's", (at_most(by[DEFAULT], 0.80),), SPEED, CAUSE + "time"),
        Row(
            "time of the smoother with magnetometer by offlineVQF's",
            (at_most(by[SMOOTHER] / by[OFFLINE], 0.85),),
            SPEED,
            CAUSE + "time",
        ),
        Row("time of a live update with magnetometer by VQF's", (at_most(one[STREAM], 0.70),), SPEED),
    ]


def accuracy_rows(known: Accuracy, blind: Accuracy, found: Mapping[str, Found] | None) -> list[Row]:
    """All rows of errors."""
    (online, offline), (online_blind, offline_blind) = known.ratios, blind.ratios
    return [
        means_row(
            "error/VQF's, geometric mean with magnetometers; without; together",
            online,
            online_blind,
            ACCURACY,
            (0.42, 0.48, 0.45),
        ),
        left_out_row(found),
        *ratio_rows(online, online_blind),
        *sigma_rows(online, online_blind),
        broad_row(known, DEFAULT, (1.00, 0.62)),
        sets_row(online),
        broad_row(known, SMOOTHER, (0.65, 0.52)),
        means_row(
            "smoother's error/offlineVQF's, with; without; together",
            offline,
            offline_blind,
            SMOOTHED,
            (0.42, 0.42, 0.42),
        ),
        repoimu_row(online),
        *iron_rows(known),
    ]


def main() -> None:
    """Everything, one after the other."""
    parser = options(__doc__)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--steps", type=int, default=200, help="of the search without each set (default 200)")
    parser.add_argument("--no-search", action="store_true", help="without that search, which takes half an hour")
    given = parser.parse_args()
    chosen, results, found = [find_method(name) for name in METHODS], [], None
    for with_mag in (True, False):
        with progress("with magnetometers" if with_mag else "without") as report:
            results.append(accuracy(given.places, chosen, with_mag=with_mag, jobs=given.jobs, progress=report))
    if not given.no_search:
        with progress("choosing without each set") as report:
            paths = [entry.path for entry in survey(given.places, True)[0]]
            found = leave_out(paths, given.steps, given.jobs, report)
    with progress("timing") as report:
        times = [make(True, SAMPLES, given.repeats, report) for make in (batch, live)]
    rows = [row.cells for row in [*accuracy_rows(results[0], results[1], found), *time_rows(*times)]]
    facts = ", ".join(f"{name} {value}" for name, value in machine().items())
    notes = [left_out_note(found), f"Times on {facts}."]
    table = Table("What was wanted", COLUMNS, rows, "\n".join(note for note in notes if note))
    if given.json:
        show([table], True)
    else:
        show_markdown(table)


if __name__ == "__main__":
    run_script(main)
