"""A raw magnetometer beside a reference: how uneven its field is, and the filter in an even field with its offset."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.measure import run_tasks
from tests.reference.against_reference import true_quat

import levelhead as lh
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.ratios import geometric_mean
from levelhead.bench.reference import align_sensor
from levelhead.bench.timing import Progress, Table
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, rotate, to_scipy
from levelhead.sources.formats.npz import load_arrays

FAR = 10.0  # µT by which a reading is off the mean field, beyond which it counts less
STRIDE = 10  # samples, of those that are fitted
ROUNDS = 10  # of weighting
COLUMNS = {
    "case": "recording",
    "azimuth": "field's azimuth, RMS °",
    "plain": "without magnetometer °",
    "raw": "with it °",
    "even": "in an even field °",
    "ratio": "with by without",
    "even_ratio": "in an even field",
}


class Field(NamedTuple):
    """The offset (3,) and the field (3,) in the reference's frame, µT, that explain raw readings best."""

    offset: Array
    field: Array


def list_raw(places: Sequence[Path]) -> list[Path]:
    """Array files in which a raw magnetometer stands beside a reference."""
    return [path for path in list_logs(places) if path.suffix == ".npz" and "mag_raw" in load_arrays(path)]


def load_raw(path: Path) -> Recording:
    """A recording with the raw magnetometer in place of its own."""
    return replace(load_recording(path, False), mag=np.asarray(load_arrays(path)["mag_raw"], dtype=float))


def fit_field(recording: Recording, quat: Array) -> Field:
    """By least squares with the orientation ``quat`` (n, 4); readings that are far off count less."""
    assert recording.mag is not None
    known = np.isfinite(quat).all(axis=1) & np.isfinite(recording.mag).all(axis=1)
    turns, readings = to_scipy(quat[known]).as_matrix()[::STRIDE], recording.mag[known][::STRIDE]
    columns = np.concatenate([turns, np.broadcast_to(np.eye(3), turns.shape)], axis=2).reshape(-1, 6)
    target = np.einsum("nij,nj->ni", turns, readings).reshape(-1)
    weight = np.ones(len(readings))
    for _ in range(ROUNDS):
        each = np.repeat(np.sqrt(weight), 3)
        fit, *_ = np.linalg.lstsq(columns * each[:, None], target * each, rcond=None)
        left = np.linalg.norm((target - columns @ fit).reshape(-1, 3), axis=1)
        weight = 1.0 / np.maximum(1.0, left / FAR)
    return Field(fit[:3], fit[3:])


def uneven_of(path: Path) -> dict[str, float]:
    """Of one recording."""
    raw = load_raw(path)
    assert raw.mag is not None
    quat, frame = true_quat(raw), align_sensor(raw)
    offset, field = fit_field(raw, quat)
    known = np.isfinite(quat).all(axis=1) & np.isfinite(raw.mag).all(axis=1)
    east, north, _ = rotate(quat[known], raw.mag[known] - offset).T
    azimuth = np.exp(1j * np.arctan2(east, north))
    apart = np.degrees(np.angle(azimuth / azimuth.sum()))
    even = np.full_like(raw.mag, np.nan)
    even[known] = rotate(conjugate(quat[known]), np.broadcast_to(field, (int(known.sum()), 3))) + offset
    errors = [
        measure_errors(one, lh.fuse(one).quat, False, frame=frame).rotated
        for one in (replace(raw, mag=None), raw, replace(raw, mag=even))
    ]
    return {"azimuth": float(np.sqrt(np.mean(apart**2)))} | dict(zip(("plain", "raw", "even"), errors, strict=True))


def field_tables(places: Sequence[Path], jobs: int, report: Progress) -> Iterator[Table]:
    """Where a raw magnetometer makes a phone worse: is it the field of the building?"""
    found = run_tasks(uneven_of, list_raw(places), jobs, report)
    rows: list[dict[str, float | str]] = [
        {"case": path.stem, **one, "ratio": one["raw"] / one["plain"], "even_ratio": one["even"] / one["plain"]}
        for path, one in found.items()
    ]
    if rows:
        means = {key: geometric_mean([float(row[key]) for row in rows]) for key in list(COLUMNS)[1:]}
        rows.append({"case": "geometric mean", **means})
    yield Table(
        "Raw magnetometers of phones",
        COLUMNS,
        rows,
        "An even field has the offset of the raw readings and their mean field, at the reference's orientation. Errors "
        "are without the best constant rotation.",
    )
