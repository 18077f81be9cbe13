"""The default beside VQF on recordings that were changed: what holds where nobody has looked?

Every recording with a reference below the folders, with and without its magnetometer: begun at 30 and at 60 % of its
length, so in the middle of its motion; at 50 and at 20 samples a second; with samples that were lost; with the bias,
scale and noise of a toy's sensor; with a gyroscope that ends at 250 deg/s; and with a magnet beside the start. Both
filters get the same readings.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.measure import options, run_script, show
from scipy.spatial.transform import Rotation

from levelhead.bench import ratios
from levelhead.bench.accuracy import outcome_of
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import ErrorFigures
from levelhead.bench.methods import Method, find_method
from levelhead.bench.processes import run_parallel
from levelhead.bench.reference import align_sensor
from levelhead.bench.survey import Entry, survey
from levelhead.bench.timing import Table
from levelhead.recording import Recording

SHORTEST = 20.0  # s of a recording that is begun later
FULL_SCALE = np.radians(250.0)
LEAST_ROWS = 50  # with a reference
METHODS = (find_method("default"), find_method("vqf.VQF"))
Pair = tuple[ErrorFigures | None, ErrorFigures | None]


def begun(share: float) -> Callable[[Recording, int], Recording | None]:
    """From this share of its length on."""

    def cut(recording: Recording, seed: int) -> Recording | None:
        rest = recording[round(share * len(recording)) :]
        return rest if rest.t[-1] - rest.t[0] > SHORTEST else None

    return cut


def sampled(rate: float) -> Callable[[Recording, int], Recording | None]:
    """Means of so many readings that about this many Hz are left; the last reading of a magnetometer."""

    def thin(recording: Recording, seed: int) -> Recording | None:
        k = round(recording.rate / rate)
        if k < 2:
            return None
        n = len(recording) // k * k
        last = slice(k - 1, n, k)
        gyr, acc = (values[:n].reshape(-1, k, 3).mean(axis=1) for values in (recording.gyr, recording.acc))
        mag = None if recording.mag is None else recording.mag[last]
        assert recording.truth is not None
        return Recording(recording.t[last], gyr, acc, mag, recording.truth[last], recording.meta)

    return thin


def with_losses(recording: Recording, seed: int) -> Recording:
    """After 8 s, 0.04 to 0.45 s of samples are lost again and again, after 2.5 s in the mean."""
    random = np.random.default_rng(seed)
    keep = np.ones(len(recording), dtype=bool)
    first = recording.t[0] + 8.0
    while first < recording.t[-1]:
        last = first + random.uniform(0.04, 0.45)
        keep &= (recording.t < first) | (recording.t > last)
        first = last + random.exponential(2.5)
    assert recording.truth is not None
    mag = None if recording.mag is None else recording.mag[keep]
    truth = recording.truth[keep]
    return Recording(recording.t[keep], recording.gyr[keep], recording.acc[keep], mag, truth, recording.meta)


def of_a_toy(recording: Recording, seed: int) -> Recording:
    """1σ of 2 deg/s and 0.2 m/s² of bias, 1.5 and 1 % of scale, 0.05 deg/s and 0.03 m/s² of noise."""
    random = np.random.default_rng(seed)
    n = len(recording)
    gyr = recording.gyr * (1.0 + random.normal(0.0, 0.015, 3)) + np.radians(random.normal(0.0, 2.0, 3))
    acc = recording.acc * (1.0 + random.normal(0.0, 0.01, 3)) + random.normal(0.0, 0.2, 3)
    return replace(
        recording,
        gyr=gyr + np.radians(random.normal(0.0, 0.05, (n, 3))),
        acc=acc + random.normal(0.0, 0.03, (n, 3)),
    )


def clipped(recording: Recording, seed: int) -> Recording | None:
    """The gyroscope's full scale is 250 deg/s."""
    if not (np.abs(recording.gyr) > FULL_SCALE).any():
        return None
    return replace(recording, gyr=np.clip(recording.gyr, -FULL_SCALE, FULL_SCALE))


def beside_a_magnet(seconds: float) -> Callable[[Recording, int], Recording | None]:
    """A field of half the first one's norm, any direction, fixed to the room, on top of it for the first seconds."""

    def start(recording: Recording, seed: int) -> Recording | None:
        assert recording.truth is not None
        beside = recording.t - recording.t[0] < seconds
        quat = recording.truth.quat[beside]
        if recording.mag is None or not np.isfinite(quat).all() or not np.isfinite(recording.mag[beside]).all():
            return None
        way = np.random.default_rng(seed).normal(0.0, 1.0, 3)
        magnet = 0.5 * np.linalg.norm(recording.mag[0]) * way / np.linalg.norm(way)
        mag = np.array(recording.mag)
        mag[beside] += Rotation.from_quat(quat, scalar_first=True).inv().apply(magnet)
        return replace(recording, mag=mag)

    return start


COLUMNS = {
    "case": "change",
    "recordings": "recordings",
    "ratio": "error/VQF's, geometric mean",
    "tilt": "the same of tilt",
    "worse": "worse than 1.2",
    "worst": "worst",
    "beyond_tilt": "tilt beyond 4σ",
    "beyond_heading": "heading beyond 4σ",
}
CHANGES: dict[str, Callable[[Recording, int], Recording | None]] = {
    "begun at 30 %": begun(0.3),
    "begun at 60 %": begun(0.6),
    "50 Hz": sampled(50.0),
    "20 Hz": sampled(20.0),
    "samples lost": with_losses,
    "sensor of a toy": of_a_toy,
    "full scale 250 deg/s": clipped,
    "a magnet for 3 s": beside_a_magnet(3.0),
    "a magnet for 10 s": beside_a_magnet(10.0),
}


def figures(method: Method, recording: Recording, entry: Entry) -> ErrorFigures | None:
    """None where there is no orientation or too little of a reference."""
    quat, sigma = method.run(recording)
    return outcome_of(recording, np.asarray(quat, dtype=float), sigma, entry.north, align_sensor(recording)).figures


def compare(task: tuple[int, Entry, bool, list[str]]) -> dict[str, Pair]:
    """Of each change that this recording can have: figures of the default and of VQF."""
    seed, entry, with_mag, names = task
    whole, found = load_recording(entry.path, with_mag), {}
    for name in names:
        recording = CHANGES[name](whole, seed)
        if recording is None or recording.truth is None:
            continue
        if np.isfinite(recording.truth.quat[:, 0]).sum() < LEAST_ROWS:
            continue
        found[name] = (figures(METHODS[0], recording, entry), figures(METHODS[1], recording, entry))
    return found


def rows(places: list[Path], with_mag: bool, jobs: int, names: list[str]) -> Iterator[dict[str, object]]:
    """A row of each change."""
    entries, _ = survey(places, with_mag)
    entries = [entry for entry in entries if entry.magnetometer or not with_mag]
    tasks = [(seed, entry, with_mag, names) for seed, entry in enumerate(entries) if not entry.missing]
    results = list(run_parallel(compare, tasks, jobs))
    for name in names:
        pairs = [(task[1], *found[name]) for task, found in results if name in found]
        whole = [(entry, ours, peer) for entry, ours, peer in pairs if ours is not None and peer is not None]
        if not whole:
            continue
        one = ratios.compare_figures("default", "vqf.VQF", whole, with_mag).table[-1]
        yield {"case": f"{name}, {'with' if with_mag else 'without'} magnetometer", **one}


def main() -> None:
    """A table of all changes."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("places", nargs="+", type=Path, help="folders with recordings that have a reference")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--change", action="append", choices=CHANGES, help="this one only; may be repeated")
    given = parser.parse_args()
    names = given.change or list(CHANGES)
    found = [row for with_mag in (True, False) for row in rows(given.places, with_mag, given.jobs, names)]
    show([Table("The default beside VQF on changed recordings", COLUMNS, found, "")], given.json)


if __name__ == "__main__":
    run_script(main)
