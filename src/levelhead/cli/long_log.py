"""``levelhead fuse`` and ``smooth`` of a log larger than memory: without pictures and errors against truth."""

import base64
import hashlib
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead import filters
from levelhead.cli.fuse_options import FuseOptions, require_north
from levelhead.cli.options import folder, print_json, print_line
from levelhead.filters import health
from levelhead.open_types import JsonObject

if TYPE_CHECKING:
    from levelhead.calibration import Calibration
    from levelhead.cli.resume import UnfinishedRun
    from levelhead.publish.progress import ProgressReport
    from levelhead.recording import Recording
    from levelhead.sources.chunked import Chunks
    from levelhead.track import Track

READING = 0.2  # of the time of smoothing
WRITING = 0.2  # of the time of fusing
WIDTHS = {"t": 1, "quat": 4, "bias": 3, "sigma": 3, "health": 1}  # of a track's columns


@dataclass
class Sums:
    """The figures of all samples so far, written or not.

    Attributes:
        samples: how many.
        start: s, of the first.
        end: name of a column to the last sample's values.
        counts: bit of health to how many samples have it.
        rows: how many were written.
        calibration: at the end.
    """

    samples: int = 0
    start: float = 0.0
    end: JsonObject = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    rows: int = 0
    calibration: "Calibration | None" = None

    def add(self, track: "Track") -> None:
        """Some samples more."""
        if not self.samples:
            self.start = float(track.t[0])
        for bit in health.NAMES:
            self.counts[bit] = self.counts.get(bit, 0) + int(np.count_nonzero(track.health & np.uint32(bit)))
        self.samples += len(track)
        self.end = {name: a[-1].tolist() for name in WIDTHS if (a := getattr(track, name)) is not None}

    def save(self) -> JsonObject:
        """For a state; ``restore`` takes it."""
        return {"samples": self.samples, "start": self.start, "end": self.end, "counts": self.counts}

    def restore(self, saved: JsonObject) -> None:
        """Continues from the state that an earlier process saved."""
        self.samples, self.start, self.end = saved["samples"], saved["start"], saved["end"]
        self.counts = {int(bit): count for bit, count in saved["counts"].items()}

    def last(self, options: FuseOptions, relative: bool) -> "Track":
        """The last sample alone, relative to the north that was asked for."""
        from levelhead.track import Track

        columns: JsonObject = {name: np.array([values]) for name, values in self.end.items() if name != "health"}
        track = Track(**columns, params=options.params, calibration=self.calibration, relative=relative)
        return options.to_north(track)


def fuse_long_log(log: Path, options: FuseOptions) -> None:
    """Reads, fuses and writes in chunks, and prints a summary; the work of an ended run is not repeated.

    Raises:
        NeedsWholeLog: the log must be seen whole; nothing was written.
        LevelheadError: as ``fuse``.
    """
    from levelhead.cli.resume import open_unfinished
    from levelhead.publish.progress import progress
    from levelhead.publish.writers import write_tracks
    from levelhead.sources.chunked import NeedsWholeLog, read_chunks

    if options.needs_start or options.motion or options.heave:
        raise NeedsWholeLog(f"{log} is turned by its start, so it is read whole")
    chunks = read_chunks(log, **options.reading.hints())
    options = options.at_place(chunks.head)
    if options.declination is not None:
        require_north(chunks.head, options.params)
    sums = Sums()
    target = folder(options.out) / f"{log.stem}-track.{options.format}"
    make = smooth_tracks if options.smooth else fuse_tracks
    with (
        open_unfinished(target, log, _options_of_result(options)) as unfinished,
        progress(f"{'smoothing' if options.smooth else 'fusing'} {log.name}") as report,
    ):

        def tracks() -> Iterator["Track"]:
            for track in make(chunks, options, unfinished, report, sums):
                sums.calibration, sums.rows = track.calibration, sums.rows + len(track)
                report(1.0, f"{sums.rows:,} rows written")
                yield options.to_north(track).to_frame(options.frame)

        write_tracks(tracks(), target)
    written = [target]
    known = _last(chunks.head, sums, options).calibration
    if options.save_calibration is not None and known is not None:
        known.save(options.save_calibration)
        written.append(options.save_calibration)
    if options.as_json:
        print_json(_facts(chunks.head, sums, options) | {"written": [str(path) for path in written]})
        return
    for line in _lines(chunks.head, sums, options):
        print_line(line)
    print_line("written: " + ", ".join(str(path) for path in written))


def _options_of_result(options: FuseOptions) -> JsonObject:
    """All that the track depends on."""
    from levelhead.sources.chunked import ROWS

    hints = {key: str(value) for key, value in options.reading.hints().items() if value}
    guard = {} if options.guard is None else {f"guard {key}": value for key, value in options.guard._asdict().items()}
    prior = "" if options.prior is None else json.dumps(options.prior.to_dict(), sort_keys=True)
    asked = {
        "verb": "smooth" if options.smooth else "fuse",
        "filter": filters.of(options.params).name,
        "guard": "off" if options.guard is None else "on",
        "declination": options.declination,
        "north": options.north,
        "frame": options.frame,
        "prior": hashlib.sha256(prior.encode()).hexdigest()[:16] if prior else None,
        "rows of a chunk": ROWS,
    }
    if options.output_rate is not None:
        asked["output rate"] = options.output_rate
    return asked | options.params._asdict() | guard | hints


def _go_on(chunks: "Chunks", unfinished: "UnfinishedRun", rows: int) -> None:
    """Leaves out the rows that an earlier run has done, and reports it."""
    if unfinished.state is not None:
        chunks.begin_at(rows)
        sys.stderr.write(f"levelhead: continues after {rows:,} samples of an interrupted run\n")


def fuse_tracks(
    chunks: "Chunks", options: FuseOptions, unfinished: "UnfinishedRun", report: "ProgressReport", sums: Sums
) -> Iterator["Track"]:
    """The filter's track of each chunk, when all are in files."""
    from levelhead.engine.chunks import ChunkRun
    from levelhead.engine.column_files import ColumnFiles
    from levelhead.publish.output_rate import OutputRate
    from levelhead.sources.chunked import ROWS
    from levelhead.track import Track, is_relative

    before = unfinished.state or {}
    saved = base64.b64decode(before["filter"]) if before else None
    run = ChunkRun(options.params, options.guard, "auto", options.prior, saved)
    files = ColumnFiles(unfinished.folder, before["columns"], before["rows"]) if before else None
    if before:
        sums.restore(before["sums"])
    output = None if options.output_rate is None else OutputRate(options.output_rate, before.get("output"))
    _go_on(chunks, unfinished, sums.samples)

    def state() -> JsonObject:
        assert files is not None
        files.flush()
        word = base64.b64encode(run.save()).decode()
        columns = {name: WIDTHS[name] for name in files.names}
        kept = {"rows": files.rows, "columns": columns, "filter": word, "sums": sums.save()}
        return kept if output is None else kept | {"output": output.state}

    for chunk in chunks:
        track = run.track(chunk)
        sums.add(track)
        rows = slice(None) if output is None else output.rows(track.t)
        columns = {name: values[rows] for name in WIDTHS if (values := getattr(track, name)) is not None}
        if files is None:
            files = ColumnFiles(unfinished.folder, {name: WIDTHS[name] for name in columns})
        files.append(columns)
        report((1.0 - WRITING) * chunks.fraction, f"{sums.samples:,} samples")
        unfinished.save(state)
    assert files is not None
    if unfinished.state is not None:  # long work is worth keeping
        unfinished.save(state, now=True)
        unfinished.complete = True
    calibration, relative = run.calibration, is_relative(options.params, chunks.head.mag is not None)
    for start in range(0, files.rows, ROWS):
        stop = min(start + ROWS, files.rows)
        parts: JsonObject = {name: files.read(name, start, stop) for name in files.names}
        parts["health"] = parts["health"].view(np.uint64).astype(np.uint32)
        yield Track(**parts, params=options.params, calibration=calibration, relative=relative)


def smooth_tracks(
    chunks: "Chunks", options: FuseOptions, unfinished: "UnfinishedRun", report: "ProgressReport", sums: Sums
) -> Iterator["Track"]:
    """The smoother's track of each chunk."""
    from levelhead.engine.smooth_chunks import ChunkSmoother
    from levelhead.publish.output_rate import OutputRate

    run = ChunkSmoother(
        unfinished.folder, options.params, options.guard, "auto", options.prior, unfinished.save, unfinished.state
    )
    if not run.has_read_all:
        _go_on(chunks, unfinished, run.rows)
        for chunk in chunks:
            run.read(chunk)
            report(READING * chunks.fraction, f"{run.rows:,} samples read")
    else:
        _go_on(chunks, unfinished, run.rows)
    run.smooth(lambda share: report(READING + (1.0 - READING) * share, f"{run.rows:,} samples"))
    unfinished.complete = True
    output = None if options.output_rate is None else OutputRate(options.output_rate)
    for whole in run.tracks():
        sums.add(whole)
        track = whole if output is None else output.reduce(whole)
        if track is not None:
            yield track


def _last(head: "Recording", sums: Sums, options: FuseOptions) -> "Track":
    from levelhead.track import is_relative

    return sums.last(options, is_relative(options.params, head.mag is not None))


def _facts(head: "Recording", sums: Sums, options: FuseOptions) -> JsonObject:
    """For programs: the names are those of the summary of a shorter log."""
    from levelhead.publish.summary import north_facts

    track = _last(head, sums, options)
    counts = {health.NAMES[bit]: count for bit, count in sums.counts.items() if count and bit & health.FAULTS}
    return {
        "samples": sums.samples,
        "rows": sums.rows,
        "duration_s": float(track.t[-1]) - sums.start,
        "rate_hz": head.rate,
        "magnetometer": head.mag is not None,
        "notes": list(head.meta.get("notes", ())),
        "filter": filters.of(track.params).name,
        "end": {"quat_wxyz": track.quat[-1].tolist()},
        "bias_rad_s": None if track.bias is None else track.bias[-1].tolist(),
        "sigma_east_north_up_rad": None if track.sigma is None else track.sigma[-1].tolist(),
        "north": north_facts(track),
        "calibration": None if track.calibration is None else track.calibration.to_dict(),
        "at_rest": sums.counts[health.AT_REST] / sums.samples,
        "health": counts,
    }


def _lines(head: "Recording", sums: Sums, options: FuseOptions) -> Iterator[str]:
    from levelhead.publish.summary import north_sentence

    facts, track = _facts(head, sums, options), _last(head, sums, options)
    sensors = "gyroscope + accelerometer" + (" + magnetometer" if head.mag is not None else "")
    yield f"recording  {sums.samples:,} samples, {facts['duration_s']:.6g} s, {head.rate:.5g} Hz, {sensors}, in chunks"
    yield f"filter     {track.name}"
    roll, pitch, yaw = track.euler()[-1]
    yield f"end        roll {roll:.2f}°, pitch {pitch:.2f}°, yaw {yaw:.2f}°".replace("-", "−")
    if track.sigma_tilt is not None and track.sigma_heading is not None:
        tilt, heading = math.degrees(track.sigma_tilt[-1]), math.degrees(track.sigma_heading[-1])
        yield f"1σ at end  tilt {tilt:.3g}°, heading {heading:.3g}°"
    yield f"north      {north_sentence(track)}"
    if facts["at_rest"]:
        yield f"at rest    {100 * facts['at_rest']:.2g} % of the time, where the bias was measured"
    for name, count in sorted(facts["health"].items(), key=lambda item: -item[1]):
        yield f"health     {count:,} samples ({100 * count / sums.samples:.2g} %): {name}"
    if options.output_rate is not None:
        yield f"rows       {sums.rows:,} written, at {options.output_rate:g} Hz"
    for note in facts["notes"]:
        yield f"note       {note}"
