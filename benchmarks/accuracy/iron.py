"""A magnetometer as it comes: what hard iron costs heading, and how well north is known in spite of it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.measure import options, read_reference, run_script, show

import levelhead as lh
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.methods import Method, find_method
from levelhead.bench.reference import align_sensor
from levelhead.bench.timing import Table
from levelhead.errors import LevelheadError
from levelhead.evaluate.attitude_error import error_quaternion, split_error
from levelhead.recording import Array, Recording
from levelhead.rotations import to_scipy

SHARES = (0.0, 0.3, 3.0)
METHODS = (find_method("vqf.VQF"), Method("default"))


def columns(shares: tuple[float, ...]) -> dict[str, str]:
    """Three of each share of iron."""
    titles = {"case": "recording"}
    for share in shares:
        titles |= {
            f"vqf {share}": f"{share:.0%}: vqf.VQF [°]",
            f"ours {share}": "ESKF [°]",
            f"north {share}": "north at the end, 1σ [°]",
        }
    return titles


def mean_field(recording: Recording) -> Array:
    """(3,) mean of the readings in the reference's frame."""
    assert recording.truth is not None and recording.mag is not None
    quat = recording.truth.quat
    known = np.isfinite(quat).all(axis=1) & np.isfinite(recording.mag).all(axis=1)
    field: Array = to_scipy(quat[known]).apply(recording.mag[known]).mean(axis=0)
    return field


def north_error(recording: Recording, track: lh.Track, field: Array) -> tuple[float, float]:
    """Degrees by which ``Track.north`` is off a field in the reference's frame at the end, and its 1σ."""
    assert recording.truth is not None and track.north is not None
    heading = split_error(error_quaternion(track.quat, recording.truth.quat)).heading
    off = track.north.azimuth + heading[np.isfinite(heading)][-1] - math.atan2(field[0], field[1])
    return math.degrees((off + math.pi) % (2.0 * math.pi) - math.pi), math.degrees(track.north.sigma)


def bend(recording: Recording, share: float, way: Array) -> Recording:
    """The recording with an offset of this share of the field in this direction."""
    assert recording.mag is not None
    field = float(np.nanmedian(np.linalg.norm(recording.mag, axis=1)))
    return replace(recording, mag=recording.mag + share * field * way)


def row(path: Path, shares: tuple[float, ...], way: Array) -> dict[str, object]:
    """One recording with offsets in one direction."""
    recording = read_reference(path)
    if recording.mag is None:
        raise LevelheadError(f"{path} has no magnetometer that could be off; expected a calibrated one")
    frame, found = align_sensor(recording), dict[str, object](case=path.stem[:40])
    for share in shares:
        bent = bend(recording, share, way)
        errors = [measure_errors(bent, one.orientation(bent), False, None, frame).rotated for one in METHODS]
        off, sigma = north_error(bent, lh.fuse(bent), mean_field(recording))
        found |= {f"vqf {share}": round(errors[0], 2), f"ours {share}": round(errors[1], 2)}
        found[f"north {share}"] = f"{abs(off):.1f} ± {sigma:.1f}"
    return found


def directions(count: int) -> Array:
    """(count, 3) random unit vectors, always the same."""
    ways = np.random.default_rng(1).normal(size=(count, 3))
    unit: Array = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    return unit


def main() -> None:
    """Every recording given."""
    parser = options(__doc__)
    parser.add_argument("recordings", nargs="+", type=Path, help="files with a reference and a calibrated magnetometer")
    parser.add_argument("--share", type=float, action="append", help="of the field; may be repeated (0, 0.3 and 3)")
    given = parser.parse_args()
    shares = tuple(given.share or SHARES)
    ways = directions(len(given.recordings))
    rows = [row(path, shares, way) for path, way in zip(given.recordings, ways, strict=True)]
    note = "RMS total error after the best constant rotation. North is measured in the mean of the clean field."
    show([Table("Hard iron of a share of the field", columns(shares), rows, note)], given.json)


if __name__ == "__main__":
    run_script(main)
