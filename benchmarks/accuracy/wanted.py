"""The figures that are wanted of the default and its smoother beside those that are measured, as one table.

    python -m benchmarks.accuracy.wanted DIR

DIR holds the recordings with a reference. The last column names what misses a figure. A raw magnetometer that stands
beside a reference (``mag_raw`` of an array file) counts by itself: north after a minute, and the error with it by the
error without. Costs are those of ``levelhead bench speed``; the figures of sets that are left out are those of
``leave_one_out.py``.
"""

import statistics
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.accuracy import iron
from benchmarks.accuracy.uneven_field import fit_field, list_raw, load_raw
from benchmarks.measure import options, run_script, show

import levelhead as lh
from levelhead.bench.accuracy import Accuracy, accuracy
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.groups import BROAD
from levelhead.bench.methods import DEFAULT, SMOOTHER, find_method
from levelhead.bench.ratios import PAIRS, Ratios, geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.timing import Table

MINUTE = 60.0  # s
SETS = {"diodem": 2.0, "expsimon": 1.3, "x3mate": 2.5}  # °, mean error with magnetometers
IRON = {0.3: (1.15, 1.5), 3.0: (1.6, 2.0)}  # share of the field -> °, mean error and median of north
COLUMNS = {"case": "", "measured": "measured", "wanted": "wanted", "missed": "missed by"}
Row = dict[str, object]


def row(what: str, value: float, most: float, unit: str = "", named: str = "") -> Row:
    """A figure, what it may be at most, and what misses it; the figure itself if nothing else is named."""
    missed = (named or "the figure") if value > most else ""
    return {"case": what, "measured": f"{value:.3g}{unit}", "wanted": f"≤ {most:g}{unit}", "missed": missed}


def ratio_rows(ratios: Ratios, suffix: str, most: tuple[float, int, float]) -> Iterator[Row]:
    """The default beside VQF: mean, recordings that are worse, the worst, and errors beyond 4σ."""
    *sets, whole = ratios.table
    names = ", ".join(f"{one.recording} {one.value:.2f}" for one in ratios.worse)
    yield row(f"error/VQF's, geometric mean, {suffix}", whole["ratio"], most[0])
    yield row(f"recordings worse than 1.2 times, {suffix}", whole["worse"], most[1], named=names)
    yield row(f"the worst, {suffix}", whole["worst"], most[2], named=whole["worst recording"])
    for part in ("tilt", "heading"):
        shares = {one["data"]: 100.0 * (one[f"beyond_{part}"] or 0.0) for one in sets}
        worst = max(shares, key=lambda name: shares[name])
        yield row(f"{part} beyond 4σ, {suffix}", 100.0 * (whole[f"beyond_{part}"] or 0.0), 1.0, " %", worst)
        yield row(f"the same of the worst set, {suffix}", shares[worst], 3.0, " %", worst)


def mean_of_broad(result: Accuracy, method: str, key: str) -> float:
    """° over BROAD's recordings."""
    column = [one.name for one in result.methods].index(method)
    rows = [i for i, entry in enumerate(result.entries) if entry.group.dataset == BROAD]
    figures = [result.outcomes[i, column].figures for i in rows]
    return statistics.fmean(getattr(one, key) for one in figures if one is not None)


def known_rows(known: Accuracy) -> Iterator[Row]:
    """What is wanted of single sets with magnetometers, and of the smoother."""
    online, smoothed = known.ratios
    means = {one["data"]: one["ours"] for one in online.table}
    for name, most in SETS.items():
        if name in means:
            yield row(f"mean error of {name}", means[name], most, "°")
    yield row("mean error of BROAD", mean_of_broad(known, DEFAULT, "aligned"), 1.0, "°")
    yield row("BROAD smoothed, total", mean_of_broad(known, SMOOTHER, "aligned"), 0.65, "°")
    yield row("BROAD smoothed, tilt", mean_of_broad(known, SMOOTHER, "tilt"), 0.52, "°")
    yield smoother_row(smoothed, "with magnetometers")


def smoother_row(ratios: Ratios, suffix: str) -> Row:
    """The smoother beside offlineVQF, with the sets where it is worse."""
    *sets, whole = ratios.table
    above = ", ".join(f"{one['data']} {one['ratio']:.2f}" for one in sets if one["ratio"] > 0.8)
    return row(f"smoothed/offlineVQF's, {suffix}", whole["ratio"], 0.42, named=above)


def iron_rows(known: Accuracy) -> Iterator[Row]:
    """Error and north with hard iron on BROAD's magnetometers, and north by a raw chip that is simulated."""
    paths = [entry.path for entry in known.entries if entry.group.dataset == BROAD]
    rows = [iron.row(path, tuple(IRON), way) for path, way in zip(paths, iron.directions(len(paths)), strict=True)]
    for share, (most, most_north) in IRON.items():
        error = statistics.fmean(float(str(one[f"ours {share}"])) for one in rows)
        north = statistics.median(float(str(one[f"north {share}"]).split()[0]) for one in rows)
        yield row(f"BROAD + {share:.0%} of iron, mean error", error, most, "°")
        yield row(f"BROAD + {share:.0%} of iron, north at the end, median", north, most_north, "°")
    raw = statistics.median(simulated_north(seed) for seed in range(6))
    yield row("north after a minute, raw ICM-20948 (simulated), median", raw, 2.0, "°")


def simulated_north(seed: int) -> float:
    """Degrees by which north is off after a minute with a simulated raw ICM-20948 in a hand."""
    recording = lh.simulate.recording("ICM-20948", "hand", MINUTE, seed=seed)
    return abs(iron.north_error(recording, lh.fuse(recording), np.array(lh.simulate.EARTH_FIELD))[0])


def raw_rows(places: Sequence[Path]) -> Iterator[Row]:
    """Phones whose raw magnetometer stands beside a reference."""
    norths, worse = {}, {}
    for path in list_raw(places):
        raw = load_raw(path)
        plain = replace(raw, mag=None)
        assert raw.truth is not None
        frame = align_sensor(plain)
        first = int(np.searchsorted(raw.t, raw.t[0] + MINUTE))
        norths[path.stem] = iron.north_error(raw[:first], lh.fuse(raw[:first]), fit_field(raw, raw.truth.quat).field)
        errors = [measure_errors(one, lh.fuse(one).quat, False, None, frame).rotated for one in (raw, plain)]
        worse[path.stem] = errors[0] / errors[1]
    if norths:
        far = ", ".join(f"{name} {off:.0f} ± {sigma:.0f}°" for name, (off, sigma) in norths.items() if abs(off) > 8.0)
        beyond = max(abs(off) / sigma for off, sigma in norths.values())
        middle = statistics.median(abs(off) for off, _ in norths.values())
        yield row("raw phones: north after a minute, median", middle, 8.0, "°", far)
        yield row("raw phones: the same by its σ, the largest", beyond, 4.0)
        named = ", ".join(f"{name} {value:.1f}" for name, value in worse.items() if value > 1.0)
        yield row("raw phones: error with/without magnetometer", geometric_mean(list(worse.values())), 1.0, "", named)


def main() -> None:
    """One table."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    given = parser.parse_args()
    methods = [find_method(name) for pair in PAIRS for name in pair]
    known, blind = (accuracy(given.places, methods, with_mag=yes, jobs=given.jobs) for yes in (True, False))
    rows = [
        *ratio_rows(known.ratios[0], "with magnetometers", (0.42, 5, 2.0)),
        *ratio_rows(blind.ratios[0], "without", (0.48, 13, 3.0)),
        *known_rows(known),
        smoother_row(blind.ratios[1], "without"),
        *iron_rows(known),
        *raw_rows(given.places),
    ]
    missed = sum(bool(one["missed"]) for one in rows)
    show([Table("What is wanted of the default", COLUMNS, rows, f"{missed} of {len(rows)} missed.")], given.json)


if __name__ == "__main__":
    run_script(main)
