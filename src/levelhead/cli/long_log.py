"""``levelhead fuse`` and ``smooth`` of a log larger than memory: without pictures and errors against truth."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from levelhead import filters
from levelhead.cli.options import folder, print_json, print_line
from levelhead.filters import health
from levelhead.open_types import Fields

if TYPE_CHECKING:
    from levelhead.cli.fuse import Wish
    from levelhead.recording import Recording
    from levelhead.track import Track

READING = 0.2  # of the time of smoothing


@dataclass
class Sums:
    """What is kept of the tracks that have gone by."""

    samples: int = 0
    start: float = 0.0
    last: "Track | None" = None
    counts: dict[int, int] = field(default_factory=dict)

    def add(self, track: "Track") -> None:
        """One more."""
        if self.last is None:
            self.start = float(track.t[0])
        for bit in health.NAMES:
            self.counts[bit] = self.counts.get(bit, 0) + int(np.count_nonzero(track.health & np.uint32(bit)))
        self.samples, self.last = self.samples + len(track), track


def fuse_long_log(log: Path, out: Path, wish: "Wish") -> None:
    """Reads, fuses and writes in chunks, and prints a summary.

    Raises:
        NeedsWholeLog: the log must be seen whole; nothing was written.
        LevelheadError: as ``fuse``.
    """
    from levelhead.cli.fuse import require_north
    from levelhead.engine import fuse_chunks
    from levelhead.engine.smooth_chunks import smooth_chunks
    from levelhead.publish.progress import progress
    from levelhead.publish.writers import write_tracks
    from levelhead.sources.chunked import read_chunks

    chunks = read_chunks(log, **wish.reading.hints())
    if wish.declination is not None:
        require_north(chunks.head, wish.params)
    sums = Sums()
    target = folder(out) / f"{log.stem}-track.{wish.format}"
    with progress(f"{'smoothing' if wish.offline else 'fusing'} {log.name}") as report:

        def smoothed() -> Iterator["Track"]:
            def follow(share: float) -> None:
                report(READING + (1.0 - READING) * share)

            return smooth_chunks(
                chunks, wish.params, guard=wish.guard, prior=wish.known, folder=target.parent, progress=follow
            )

        def tracks() -> Iterator["Track"]:
            made = fuse_chunks(chunks, wish.params, guard=wish.guard, prior=wish.known)
            for track in smoothed() if wish.offline else made:
                sums.add(track)
                report(1.0 if wish.offline else chunks.fraction, f"{sums.samples:,} samples")
                yield track if wish.declination is None else track.to_true_north(wish.declination)

        write_tracks(tracks(), target)
    assert sums.last is not None
    written = [target]
    if wish.save_calibration is not None and sums.last.calibration is not None:
        sums.last.calibration.save(wish.save_calibration)
        written.append(wish.save_calibration)
    if wish.quiet:
        print_json(_facts(chunks.head, sums) | {"written": [str(path) for path in written]})
        return
    for line in _lines(chunks.head, sums):
        print_line(line)
    print_line("written: " + ", ".join(str(path) for path in written))


def _facts(head: "Recording", sums: Sums) -> Fields:
    """For programs: the names are those of the summary of a shorter log."""
    track = sums.last
    assert track is not None
    counts = {health.NAMES[bit]: count for bit, count in sums.counts.items() if count and bit & health.FAULTS}
    return {
        "samples": sums.samples,
        "duration_s": float(track.t[-1]) - sums.start,
        "rate_hz": head.rate,
        "magnetometer": head.mag is not None,
        "notes": list(head.meta.get("notes", ())),
        "filter": filters.of(track.params).name,
        "end": {"quat_wxyz": track.quat[-1].tolist()},
        "bias_rad_s": None if track.bias is None else track.bias[-1].tolist(),
        "sigma_east_north_up_rad": None if track.sigma is None else track.sigma[-1].tolist(),
        "calibration": None if track.calibration is None else track.calibration.to_dict(),
        "at_rest": sums.counts[health.AT_REST] / sums.samples,
        "health": counts,
    }


def _lines(head: "Recording", sums: Sums) -> Iterator[str]:
    facts, track = _facts(head, sums), sums.last
    assert track is not None
    sensors = "gyroscope + accelerometer" + (" + magnetometer" if head.mag is not None else "")
    yield f"recording  {sums.samples:,} samples, {facts['duration_s']:.6g} s, {head.rate:.5g} Hz, {sensors}, in chunks"
    yield f"filter     {track.name}"
    roll, pitch, yaw = track.euler()[-1]
    yield f"end        roll {roll:.2f}°, pitch {pitch:.2f}°, yaw {yaw:.2f}°".replace("-", "−")
    if track.sigma_tilt is not None and track.sigma_heading is not None:
        tilt, heading = math.degrees(track.sigma_tilt[-1]), math.degrees(track.sigma_heading[-1])
        yield f"1σ at end  tilt {tilt:.3g}°, heading {heading:.3g}°"
    if facts["at_rest"]:
        yield f"at rest    {100 * facts['at_rest']:.2g} % of the time, where the bias was measured"
    for name, count in sorted(facts["health"].items(), key=lambda item: -item[1]):
        yield f"health     {count:,} samples ({100 * count / sums.samples:.2g} %): {name}"
    for note in facts["notes"]:
        yield f"note       {note}"
