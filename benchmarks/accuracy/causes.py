"""Causes of the default's and the smoother's large errors, shown on the recordings with a reference in DIR.

    python -m benchmarks.accuracy.causes DIR --only beyond

- bias: where the default is worse than 1.2 times VQF, its error with the gyroscope's constant bias given, and whether σ
  covers the error.
- beyond: where tilt is beyond 4σ, its error with that bias given, and whether the reference came back at another place
  after it was lost.
- heading: where heading is beyond 4σ without a magnetometer, the same with that bias given.
- scale: the smoother on the sets where it has more than 0.8 of the error of VQF's offline variant in the mean, and what
  it does with the gyroscope's constant bias and matrix given.
- lag: BROAD without the time by which its reference is late.
- field: phones with a raw magnetometer, and the same in an even field with the same offset.
"""

import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.accuracy.late_reference import lag_tables
from benchmarks.accuracy.uneven_field import field_tables
from benchmarks.measure import options, part_of, run_script, run_tasks, show
from tests.reference.against_reference import (
    APART,
    JUMP,
    Jump,
    after_jumps,
    constant_bias,
    constant_errors,
    jumps,
    tilt_errors,
    true_quat,
    vertical_error,
)

import levelhead as lh
from levelhead import filters
from levelhead.bench.accuracy import accuracy
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import MAX_SIGMAS, ErrorFigures, measure_errors
from levelhead.bench.methods import DEFAULT, SMOOTHER, find_method
from levelhead.bench.ratios import WORSE, Ratio, geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.survey import Entry, survey
from levelhead.bench.timing import Progress, Table
from levelhead.evaluate.score import rms, scored_rows
from levelhead.evaluate.text_table import Cell
from levelhead.publish.progress import progress
from levelhead.recording import Array, Recording

KNOWN = lh.ESKF(bias_uncalibrated=0.0, bias_start=0.01)  # for a gyroscope without a constant bias
USUAL = lh.ESKF(bias_uncalibrated=0.0)  # for a calibrated one
KNOWN_SCALE = 1e-4  # 1σ of a matrix that is given
COVERED = 1.5  # RMS of error/σ
POOR = 0.8  # of offlineVQF's error in the mean of a set: little better
SHARE = 0.01  # of the samples beyond 4σ: as many as are wanted at most


class Worse(NamedTuple):
    """A recording on which the default is worse than VQF, and whether its magnetometer is used."""

    path: Path
    ratio: Ratio
    with_mag: bool


class Bias(NamedTuple):
    """Of such a recording: the default's error in ° with the bias given, and the error of its own bias in °/s.

    ``vertical`` is the part of the bias error about the vertical, in the mean over the recording.
    """

    known: float
    vertical: float


def with_bias_given(recording: Recording, bias: Array) -> ErrorFigures:
    """Errors of the default on readings without this constant bias."""
    track = lh.fuse(replace(recording, gyr=recording.gyr - bias), KNOWN)
    return measure_errors(recording, track.quat, False, frame=align_sensor(recording))


def bias_of(task: Worse) -> Bias:
    """The default with the gyroscope's bias given, and its own estimate of that bias."""
    recording = load_recording(task.path, task.with_mag)
    quat = true_quat(recording)
    bias = constant_bias(recording, quat)
    figures = with_bias_given(recording, bias)
    error = figures.rotated if recording.mag is not None or figures.drift is None else figures.drift
    estimates = lh.fuse(recording).bias
    assert estimates is not None
    return Bias(error, abs(vertical_error(estimates, bias, quat)))


BIAS_COLUMNS = {
    "case": "recording",
    "set": "set",
    "ratio": "times VQF's",
    "peer": "VQF's °",
    "ours": "ours °",
    "known": "bias given °",
    "vertical": "bias off by °/s",
    "sigma": "heading error/σ",
}


def bias_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """Where the default is worse than 1.2 times VQF: is it the gyroscope's bias, and does σ say so?"""
    chosen = [find_method(DEFAULT), find_method("vqf.VQF")]
    for half, with_mag in enumerate((False, True)):
        result = accuracy(places, chosen, with_mag=with_mag, jobs=jobs, progress=part_of(report, 0.5 * half, 0.3))
        paths = {entry.name: entry.path for entry in result.entries}
        tasks = [Worse(paths[one.recording], one, with_mag) for one in result.ratios[0].worse]
        found = run_tasks(bias_of, tasks, jobs, part_of(report, 0.5 * half + 0.3, 0.2))
        yield bias_table(with_mag, [one.ratio for one in tasks], [found[one] for one in tasks])


def bias_table(with_mag: bool, ratios: Sequence[Ratio], found: Sequence[Bias]) -> Table:
    """A row of each, and their medians."""
    rows = [
        {"case": one.recording, "set": one.dataset, "ratio": one.value, "ours": one.ours, "peer": one.peer}
        | {"sigma": one.figures.heading_ratio, **bias._asdict()}
        for one, bias in zip(ratios, found, strict=True)
    ]
    if rows:
        keys = list(BIAS_COLUMNS)[2:]
        rows.append({"case": "median"} | {key: statistics.median(row[key] for row in rows) for key in keys})
    covered = sum(one.figures.heading_ratio < COVERED for one in ratios)
    explained = sum(bias.known <= WORSE * one.peer for one, bias in zip(ratios, found, strict=True))
    return Table(
        f"Worse than {WORSE} times VQF, {'with' if with_mag else 'without'} magnetometer",
        BIAS_COLUMNS,
        rows,
        f"{'Total error' if with_mag else 'Drift of heading'}. With the gyroscope's constant bias given {explained} of "
        f"{len(ratios)} are no worse. On {covered} σ of heading covers the error (RMS of error/σ below {COVERED}). "
        "Bias off by: the mean error of our estimate about the vertical.",
    )


class Beyond(NamedTuple):
    """Errors of tilt beyond 4σ on a recording, as shares of its samples; and where these are many, what is behind them.

    Attributes:
        share: of the samples.
        error, known: °, RMS error of tilt, and the same with the gyroscope's constant bias given.
        bias: °/s, that bias.
        after, sound: shares of samples beyond 4σ after a jump of the reference, and after one without lost samples.
        jumps: of the reference, each with the times of its gap.
    """

    share: float
    error: float | None = None
    known: float | None = None
    bias: float | None = None
    after: float = 0.0
    sound: float = 0.0
    jumps: tuple[tuple[float, float, Jump], ...] = ()


def far_entries(shares: dict[Entry, float]) -> list[Entry]:
    """Recordings with more than ``SHARE`` of their samples beyond 4σ, the most first."""
    return sorted((entry for entry, share in shares.items() if share > SHARE), key=lambda one: -shares[one])


def beyond_of(entry: Entry) -> Beyond:
    """Of one recording without magnetometer."""
    recording = load_recording(entry.path, False)
    assert recording.truth is not None
    quat, track, rows = true_quat(recording), lh.fuse(recording), scored_rows(recording.truth)
    assert track.sigma is not None
    tilt = tilt_errors(track.quat, quat, rows)
    beyond = rows & (np.radians(tilt) > MAX_SIGMAS * np.hypot(track.sigma[:, 0], track.sigma[:, 1]))
    share = float(beyond[rows].mean())
    if share <= SHARE:
        return Beyond(share)
    bias = constant_bias(recording, quat)
    found = jumps(recording, quat, tilt)
    sound = [one._replace(after=0.0) if one.lost else one for one in found]
    after = [float((beyond & after_jumps(len(rows), some))[rows].mean()) for some in (found, sound)]
    return Beyond(
        share,
        rms(tilt[rows]),
        with_bias_given(recording, bias).rotated_tilt,
        float(np.degrees(np.linalg.norm(bias))),
        *after,
        tuple((float(recording.t[one.last]), float(recording.t[one.first]), one) for one in found),
    )


BEYOND_COLUMNS = {
    "case": "recording",
    "set": "set",
    "share": "beyond 4σ %",
    "part": "of the mean %",
    "error": "tilt error °",
    "known": "bias given °",
    "bias": "bias °/s",
    "jumps": "jumps",
    "after": "after a jump %",
    "sound": "no sample lost %",
}
JUMP_COLUMNS = {
    "case": "recording",
    "from": "lost from s",
    "to": "to s",
    "longest": "longest interval s",
    "reference": "turn by the reference °",
    "gyroscope": "by the gyroscope °",
    "apart": "between the two °",
    "before": "tilt error before °",
    "after": "after °",
}


def beyond_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """Where more than 1 % of the errors of tilt are beyond 4σ: is it the gyroscope's bias, or the reference?"""
    entries = survey(places, False)[0]
    found = run_tasks(beyond_of, entries, jobs, report)
    far = far_entries({entry: found[entry].share for entry in entries})
    groups = [(entry.name, entry.group.dataset, [found[entry]]) for entry in far]
    for name in dict.fromkeys(entry.group.dataset for entry in entries):
        some = [found[entry] for entry in entries if entry.group.dataset == name]
        groups.append((f"mean of {len(some)}", name, some))
    groups.append((f"mean of {len(entries)}", "all", list(found.values())))
    rows = [_beyond_row(*group, len(entries)) for group in groups]
    yield Table(
        "Tilt beyond 4σ without magnetometer",
        BEYOND_COLUMNS,
        rows,
        f"Recordings with more than {100 * SHARE:.0f} % of the samples, and the sets. A jump: while the reference was "
        f"lost its turn and the gyroscope's came {APART:.0f}° apart, and the error of tilt changed by {JUMP}°. After a "
        "jump: to a larger error, until the next one.",
    )
    yield Table(
        "Jumps of the reference",
        JUMP_COLUMNS,
        [
            {"case": entry.name, "from": f"{start:.2f}", "to": f"{end:.2f}"} | jump._asdict()
            for entry in far
            for start, end, jump in found[entry].jumps
        ],
        "Turns over the time without the reference, in the sensor's frame, the gyroscope's by integration alone.",
    )


def _beyond_row(name: str, dataset: str, some: Sequence[Beyond], count: int) -> dict[str, Cell]:
    row: dict[str, Cell] = {"case": name, "set": dataset}
    for key in ("share", "after", "sound"):
        row[key] = round(100.0 * statistics.fmean(getattr(one, key) for one in some), 2)
    row["part"] = round(100.0 * sum(one.share for one in some) / count, 2)
    row["jumps"] = sum(len(one.jumps) for one in some)
    if len(some) == 1:
        row |= {key: getattr(some[0], key) for key in ("error", "known", "bias")}
    return row


class Heading(NamedTuple):
    """Errors of heading on a recording: the share of samples beyond 4σ, and the drift in °; both with the bias given.

    ``vertical`` is the bias about the vertical in °/s, ``off`` the error of the default's estimate of it.
    """

    share: float
    drift: float | None
    known_share: float = 0.0
    known_drift: float | None = None
    vertical: float = 0.0
    off: float = 0.0


def heading_of(entry: Entry) -> Heading:
    """Of one recording without magnetometer."""
    recording = load_recording(entry.path, False)
    track, frame = lh.fuse(recording), align_sensor(recording)
    figures = measure_errors(recording, track.quat, False, track.sigma, frame)
    share = figures.beyond_heading or 0.0
    if share <= SHARE:
        return Heading(share, figures.drift)
    quat = true_quat(recording)
    bias = constant_bias(recording, quat)
    given = lh.fuse(replace(recording, gyr=recording.gyr - bias), USUAL)
    known = measure_errors(recording, given.quat, False, given.sigma, frame)
    assert track.bias is not None
    off, vertical = (abs(vertical_error(one, bias, quat)) for one in (track.bias, np.zeros_like(track.bias)))
    return Heading(share, figures.drift, known.beyond_heading or 0.0, known.drift, vertical, off)


HEADING_COLUMNS = {
    "case": "recording",
    "set": "set",
    "share": "beyond 4σ %",
    "known_share": "bias given %",
    "drift": "drift °",
    "known_drift": "bias given °",
    "vertical": "bias about the vertical °/s",
    "off": "off by °/s",
    "sigmas": "in σ of a calibrated gyroscope",
}


def heading_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """Where more than 1 % of the errors of heading are beyond 4σ: is it the gyroscope's bias?"""
    entries = survey(places, False)[0]
    found = run_tasks(heading_of, entries, jobs, report)
    far = far_entries({entry: found[entry].share for entry in entries})
    rows = [
        {"case": entry.name, "set": entry.group.dataset, "sigmas": found[entry].off / USUAL.bias_start}
        | found[entry]._asdict()
        | {key: 100.0 * getattr(found[entry], key) for key in ("share", "known_share")}
        for entry in far
    ]
    yield Table(
        "Heading beyond 4σ without magnetometer",
        HEADING_COLUMNS,
        rows,
        f"Recordings with more than {100 * SHARE:.0f} % of the samples. With the bias given, σ is that of a calibrated "
        f"gyroscope, {USUAL.bias_start:g} °/s.",
    )


class Scale(NamedTuple):
    """The smoother's drift of heading in ° with the gyroscope's bias given, with its matrix too, and that matrix.

    Attributes:
        bias, both: °.
        largest: the largest of the matrix's elements in size, %.
    """

    bias: float
    both: float
    largest: float


def scale_of(path: Path) -> Scale:
    """Of one recording without magnetometer."""
    recording = load_recording(path, False)
    quat, frame = true_quat(recording), align_sensor(recording)
    given = [recording.gyr - constant_bias(recording, quat)]
    errors, bias = constant_errors(recording, quat)
    given.append(recording.gyr @ (np.eye(3) - errors).T - bias)
    drifts = []
    for gyr, width in zip(given, (filters.offline().scale_start, KNOWN_SCALE), strict=True):
        params = filters.offline()._replace(bias_uncalibrated=0.0, bias_start=0.01, scale_start=width)
        track = lh.smooth(replace(recording, gyr=gyr), params)
        drifts.append(measure_errors(recording, track.quat, False, frame=frame).drift or 0.0)
    return Scale(*drifts, 100.0 * float(errors.flat[np.abs(errors).argmax()]))


SCALE_COLUMNS = {
    "case": "recording",
    "set": "set",
    "ratio": "times offlineVQF's",
    "peer": "offlineVQF's °",
    "ours": "ours °",
    "bias": "bias given °",
    "both": "matrix too °",
    "largest": "its largest element %",
}


def scale_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """Where the smoother is little better in the mean of a set without magnetometer: is it the gyroscope's scale?"""
    chosen = [find_method(SMOOTHER), find_method("vqf.offlineVQF")]
    result = accuracy(places, chosen, with_mag=False, jobs=jobs, progress=part_of(report, 0.0, 0.5))
    ratios = result.ratios[0]
    paths = {entry.name: entry.path for entry in result.entries}
    sets = [row["data"] for row in ratios.table if row["ratio"] > POOR and row["data"] != "all"]
    worse = [one for one in ratios.recordings if one.dataset in sets]
    tasks = [paths[one.recording] for one in worse]
    found = run_tasks(scale_of, tasks, jobs, part_of(report, 0.5, 0.5))
    rows = [
        {"case": one.recording, "set": one.dataset, "ratio": one.value, "ours": one.ours, "peer": one.peer}
        | found[paths[one.recording]]._asdict()
        for one in worse
    ]
    before = geometric_mean([one.value for one in ratios.recordings])
    then = geometric_mean(
        [
            replace(one, ours=found[paths[one.recording]].both).value if one in worse else one.value
            for one in ratios.recordings
        ]
    )
    yield Table(
        f"The smoother where it has more than {POOR} of offlineVQF's error in the mean of a set",
        SCALE_COLUMNS,
        rows,
        "Drift of heading without magnetometer. Given: the constants by which the gyroscope's rotations over each "
        f"second fit the reference's. Over all recordings {before:.3f} of offlineVQF's error, with both given on these "
        f"{then:.3f}.",
    )


CAUSES: dict[str, Callable[[Sequence[Path], int, Progress], Iterator[Table]]] = {
    "bias": bias_tables,
    "beyond": beyond_tables,
    "heading": heading_tables,
    "scale": scale_tables,
    "lag": lag_tables,
    "field": field_tables,
}


def main() -> None:
    """The tables of all causes, or of one."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--only", choices=CAUSES, help="this cause alone")
    given = parser.parse_args()
    tables: list[Table] = []
    for name in [given.only] if given.only else CAUSES:
        with progress(name) as report:
            tables += CAUSES[name](given.places, given.jobs, report)
    show(tables, given.json)


if __name__ == "__main__":
    run_script(main)
