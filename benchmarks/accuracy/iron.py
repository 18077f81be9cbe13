"""A magnetometer that was never calibrated: what an offset costs, and what is left once it was learned."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.measure import options, read_reference, run_script, show

import levelhead as lh
from levelhead.bench import methods
from levelhead.bench.timing import Table
from levelhead.errors import LevelheadError
from levelhead.evaluate import evaluate

COLUMNS = {
    "case": "recording",
    "clean": "no offset [°]",
    "vqf": "vqf.VQF [°]",
    "default": "ESKF [°]",
    "wide": "mag_offset = 0.3 [°]",
    "prior": "the next run, with its prior [°]",
    "left": "offset not learned [% of the field]",
}


def row(path: Path, share: float, rng: np.random.Generator) -> dict[str, Any]:
    """One recording with an offset in a direction of its own."""
    recording = read_reference(path)
    if recording.mag is None:
        raise LevelheadError(f"{path} has no magnetometer that could be off; expected a calibrated one")
    field = float(np.nanmedian(np.linalg.norm(recording.mag, axis=1)))
    offset = rng.normal(size=3)
    offset *= share * field / np.linalg.norm(offset)
    bent = replace(recording, mag=recording.mag + offset)
    wide = lh.fuse(bent, lh.ESKF(mag_offset=0.3))
    assert wide.calibration is not None and wide.calibration.mag_offset is not None
    tracks = {
        "clean": lh.fuse(recording, lh.ESKF()),
        "vqf": lh.Track(bent.t, methods.find_method("vqf.VQF").orientation(bent)),
        "default": lh.fuse(bent, lh.ESKF()),
        "wide": wide,
        "prior": lh.fuse(bent, lh.ESKF(), prior=wide.calibration),
    }
    errors = {name: round(evaluate(recording, track).total, 2) for name, track in tracks.items()}
    left = np.linalg.norm(wide.calibration.mag_offset.value - offset) / field
    return {"case": path.stem[:40]} | errors | {"left": round(100.0 * float(left), 1)}


def main() -> None:
    """Every recording given."""
    parser = options(__doc__)
    parser.add_argument("recordings", nargs="+", type=Path, help="files with a reference and a calibrated magnetometer")
    parser.add_argument("--share", type=float, default=0.3, help="the offset, as a share of the field")
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    rows = [row(path, given.share, rng) for path in given.recordings]
    note = "RMS total error. Translations do not turn the sensor enough to tell an offset."
    show([Table(f"A magnetometer that is off by {given.share:.0%} of the field", COLUMNS, rows, note)], given.json)


if __name__ == "__main__":
    run_script(main)
