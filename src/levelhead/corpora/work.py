"""One recording of a corpus: read, run, and written as rows; a failure becomes a row too."""

import hashlib
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from levelhead.bench.accuracy import outcome_of
from levelhead.bench.datasets import load_recording
from levelhead.bench.groups import group_of
from levelhead.bench.methods import OURS, SMOOTHER, Method
from levelhead.bench.reference import align_sensor
from levelhead.calibration import Calibration
from levelhead.corpora.job import DOCTOR, NOISE, SMOOTH, Batch, Job
from levelhead.corpora.places import Source, file_digest, local_copy
from levelhead.corpora.row_layout import COEFFICIENTS, HEALTH, UNITLESS, coefficient, element
from levelhead.engine import fuse, smooth
from levelhead.errors import LevelheadError
from levelhead.filters import health
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.recording import Recording
from levelhead.track import Track
from levelhead.version import VERSION


class ResultsError(LevelheadError):
    """Results cannot be written: the end of a run, not a fault of a recording."""


def run_batch(job: Job, batch: Batch, storage: ReadOnlyJson, tracks: str) -> list[JsonObject]:
    """The rows of some recordings, one after the other.

    Args:
        job: the request.
        batch: the recordings.
        storage: options of fsspec.
        tracks: folder for tracks; "": none are written.

    Raises:
        LevelheadError: another version of levelhead is asked for than this one, or a track cannot be written.
    """
    if job.version != VERSION:
        raise ResultsError(f"a worker has levelhead {VERSION}, and the run is one of {job.version}; install the same")
    rows: list[JsonObject] = []
    prior = batch.prior
    for position, source in enumerate(batch.sources, batch.first):
        made = _rows(job, source, batch.sensor, prior, storage, tracks)
        rows += [row | {"position": position} for row in made] if batch.sensor else made
        prior = next_prior(made, prior) if batch.sensor else ""
    return rows


def next_prior(rows: list[JsonObject], prior: str) -> str:
    """The prior of a sensor's next recording: the calibration of this one, or of the one before a failure."""
    return next((str(row["calibration"]) for row in rows if row.get("calibration")), prior)


def text_digest(text: str) -> str:
    """Sixteen hexadecimal digits of a text; "" of none."""
    return hashlib.sha256(text.encode()).hexdigest()[:16] if text else ""


def failed_row(job: Job, source: Source, sensor: str, prior: str, sentence: str, transient: bool) -> JsonObject:
    """The row of a recording that gave no result."""
    return _base(job, source, sensor, prior) | {
        "method": job.verb,
        "error": " ".join(sentence.split()),
        "transient": transient,
    }


def _base(job: Job, source: Source, sensor: str, prior: str) -> JsonObject:
    return {
        "recording": source.name,
        "url": source.url,
        "sensor": sensor or None,
        "version": job.version,
        "parameters": job.digest,
        "prior": text_digest(prior),
        "stamp": source.stamp,
        "bytes": source.size,
        "transient": False,
        "gone": False,
    }


def _rows(job: Job, source: Source, sensor: str, prior: str, storage: ReadOnlyJson, tracks: str) -> list[JsonObject]:
    attempt = Attempt(job, source, sensor, prior, storage)
    with attempt, attempt.open() as path:
        if job.verb == DOCTOR:
            attempt.rows = [attempt.base | _examine(path, job)]
            return attempt.rows
        recording = attempt.read(path)
        if job.verb == NOISE:
            attempt.rows = [attempt.base | {"method": NOISE} | _noise(recording)]
        else:
            attempt.rows = attempt.rows_of_tracks(recording, tracks)
    return attempt.rows


class Attempt:
    """One recording on its way to rows; an error in a block ``with`` it becomes its one row.

    Attributes:
        base: the columns that all of its rows have.
        rows: its rows.
    """

    def __init__(self, job: Job, source: Source, sensor: str, prior: str, storage: ReadOnlyJson) -> None:
        self._job, self._source, self._sensor, self._prior, self._storage = job, source, sensor, prior, storage
        self._copied = ""
        self.base = _base(job, source, sensor, prior)
        self.rows: list[JsonObject] = []

    def __enter__(self) -> None:
        """Begins."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        """Makes an error a row, unless it is the end of the run."""
        if error is None or isinstance(error, ResultsError) or not isinstance(error, Exception):
            return False
        sentence, transient = self._words(error)
        if self._copied:
            sentence = sentence.replace(self._copied, self._source.url)
        failed = failed_row(self._job, self._source, self._sensor, self._prior, sentence, transient)
        self.rows = [failed | self.base | {"transient": transient}]
        return True

    def _words(self, error: Exception) -> tuple[str, bool]:
        """The error, and whether another try may succeed."""
        url = self._source.url
        if isinstance(error, LevelheadError):
            return str(error), False
        if isinstance(error, OSError):
            return f"{url} cannot be read: {error.strerror or error}", True
        if isinstance(error, MemoryError):
            return f"{url} needs more memory than the worker has", True
        return f"{url} failed: {type(error).__name__}: {error}", True  # of a store, or a fault of a reader

    @contextmanager
    def open(self) -> Iterator[Path]:
        """The recording's path on this machine."""
        with local_copy(self._source, self._storage) as path:
            self._copied = str(path)
            group = group_of(path)
            self.base |= {"dataset": group.dataset, "group": group.name, "sha256": file_digest(path)}
            yield path

    def read(self, path: Path) -> Recording:
        """The recording."""
        began = time.perf_counter()
        recording = read_recording(path, self._job)
        self.base |= {"read_s": time.perf_counter() - began} | _facts(recording)
        return recording

    def rows_of_tracks(self, recording: Recording, tracks: str) -> list[JsonObject]:
        """A row for each method."""
        target = f"{tracks}/{self._source.name}" if tracks else ""
        return [self.base | row for row in _tracks(self._job, recording, self._prior, target)]


def read_recording(path: Path, job: Job) -> Recording:
    """The recording at a path of this machine, as a job asks for it; a truth whose third axis is not up is left out."""
    from levelhead.sources.interpret.reference_columns import points_up

    recording = _read(path, job)
    if recording.truth is None or points_up(recording.truth.quat, recording.acc):
        return recording
    return replace(recording, truth=None)


def _read(path: Path, job: Job) -> Recording:
    if any(job.hints.values()):
        from levelhead.sources import read

        recording = read(path, **job.hints)
        if not job.magnetometer and recording.mag is not None:
            return Recording(recording.t, recording.gyr, recording.acc, None, recording.truth, recording.meta)
        return recording
    return load_recording(path, job.magnetometer)


def _facts(recording: Recording) -> JsonObject:
    return {
        "samples": len(recording),
        "duration_s": recording.duration,
        "rate_hz": recording.rate,
        "start_s": recording.meta.get("t0"),
        "magnetometer": recording.mag is not None,
    }


def _tracks(job: Job, recording: Recording, prior: str, target: str) -> Iterator[JsonObject]:
    """A row for each method."""
    known = Calibration.from_dict(json.loads(prior), "the prior") if prior else None
    truth = recording.truth
    frame = None if truth is None else align_sensor(recording)
    for method in job.methods:
        row: JsonObject = {"method": method.name}
        began = time.perf_counter()
        try:
            with np.errstate(all="ignore"):
                track = find_orientation(job, method, recording, known)
        except Exception as error:
            if isinstance(error, LevelheadError) and len(job.methods) == 1:
                raise
            yield row | {"error": f"failed: {type(error).__name__}: {' '.join(str(error).split())}"}
            continue
        row |= {"run_s": time.perf_counter() - began} | _doubt(track) | _calibration_fields(track)
        if truth is not None:
            absolute = truth.north and recording.mag is not None
            outcome = outcome_of(recording, track.quat, track.sigma, absolute, frame)
            row |= {"error": outcome.failure or None}
            if outcome.figures is not None:
                figures = outcome.figures._asdict()
                row |= {name if name in UNITLESS else f"{name}_deg": value for name, value in figures.items()}
        if target:
            _write(_of_body(job, track), target if len(job.methods) == 1 else f"{target}.{_file_name(method)}")
        yield row


def _of_body(job: Job, track: Track) -> Track:
    """The track as it is written: of the body, in the frame of the job."""
    return (track.mount(job.axes) if job.axes else track).to_frame(job.frame)


def find_orientation(job: Job, method: Method, recording: Recording, prior: Calibration | None) -> Track:
    """The track that a method makes of a recording."""
    if method.package != OURS:
        quat, sigma = method.run(recording)
        return Track(recording.t, quat, sigma=sigma)
    run = smooth if job.verb == SMOOTH or method.name == SMOOTHER else fuse
    return run(recording, method.params, guard=job.guard, engine=job.engine, prior=prior)


def _doubt(track: Track) -> JsonObject:
    """σ and health of a track."""
    found: JsonObject = {}
    if track.sigma is not None:
        tilt, heading = np.degrees(np.hypot(track.sigma[:, 0], track.sigma[:, 1])), np.degrees(track.sigma[:, 2])
        found |= {"sigma_tilt_deg": float(np.median(tilt)), "sigma_heading_deg": float(np.median(heading))}
        found |= {"sigma_tilt_end_deg": float(tilt[-1]), "sigma_heading_end_deg": float(heading[-1])}
    if track.params is None:  # of another package, which has no health
        return found
    found["share_faulty"] = float(np.mean(track.health & np.uint32(health.FAULTS) != 0))
    return found | {name: float(np.mean(track.health & np.uint32(bit) != 0)) for bit, name in HEALTH.items()}


def _calibration_fields(track: Track) -> JsonObject:
    """The calibration, number by number where it is known, and whole as JSON."""
    if track.calibration is None:
        return {}
    whole = track.calibration.to_dict()
    found: JsonObject = {"calibration": json.dumps(whole, sort_keys=True)}
    for name in whole:
        part = getattr(track.calibration, name)
        if part is not None:
            known, values, sigmas = part.known.ravel(), part.value.ravel(), part.sigma.ravel()
            for i in np.flatnonzero(known).tolist():
                found |= {element(name, i): float(values[i]), f"{element(name, i)}_sigma": float(sigmas[i])}
    return found


def _file_name(method: Method) -> str:
    return "".join(letter if letter.isalnum() or letter in "=._-" else "-" for letter in method.name)


def _write(track: Track, target: str) -> None:
    from levelhead.publish.writers import write_track

    path = Path(f"{target}.parquet")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_track(track, path)
    except (LevelheadError, OSError) as error:
        raise ResultsError(str(error)) from None


def _noise(recording: Recording) -> JsonObject:
    from levelhead.noise import measure_noise

    began = time.perf_counter()
    model = measure_noise(recording)
    found: JsonObject = {"still_s": model.duration, "run_s": time.perf_counter() - began}
    for sensor, triad in model.triads.items():
        for name in COEFFICIENTS:
            part = getattr(triad, name)
            for i, axis in enumerate("xyz"):
                column = coefficient(sensor, name, axis)
                found |= {column: float(part.value[i]), f"{column}_sigma": float(part.sigma[i])}
    return found


def _examine(path: Path, job: Job) -> JsonObject:
    from levelhead.inspection import inspect

    began = time.perf_counter()
    report = inspect(path, **job.hints)
    return {
        "method": DOCTOR,
        "error": None if report.recording is not None else report.verdict.replace(str(path), path.name),
        "run_s": time.perf_counter() - began,
        "verdict": report.verdict,
        "exit_code": report.exit_code,
        "sigma_tilt_deg": report.sigma_tilt,
        "sigma_heading_deg": report.sigma_heading,
        "heading_drift_deg_min": report.heading_drift,
        "findings": [one.name for one in report.findings],
        "sentences": [one.what for one in report.findings],
        "cures": [one.cure for one in report.findings],
    } | ({} if report.recording is None else _facts(report.recording))
