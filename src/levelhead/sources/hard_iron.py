"""Whether a magnetometer was ever calibrated: the middle of the sphere on which its readings lie should be zero.

Least squares over |μ|² = 2 c·μ + (R² − c²), which is linear in c and in the bracket (C. Konvalin, Compensating for
tilt, hard-iron, and soft-iron effects, Sensors, 2009).
"""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, Recording

APART = 0.5  # s between readings that count as independent: iron in a room is met for as long
LEAST = 0.08  # share of the field from which an offset is worth a word
SURE = 4.0  # and how many σ of it
ENOUGH = 60  # independent readings
COVERED = 0.1  # share of the field by which readings must spread in every direction; turns about one axis do not


class HardIron(NamedTuple):
    """The middle of the sphere in µT, its radius, and 1σ of the middle along the direction that is known worst."""

    offset: Array
    field: float
    sigma: float

    @property
    def share(self) -> float:
        """The offset as a share of the field."""
        return float(np.linalg.norm(self.offset)) / self.field

    @property
    def heading(self) -> float:
        """By how much, in °, it may turn heading where the field dips by 60°, as in most of the inhabited north."""
        return float(np.degrees(np.arcsin(min(self.share / 0.5, 1.0))))

    @property
    def clear(self) -> bool:
        """Whether there is an offset, beyond doubt."""
        return self.share > LEAST and float(np.linalg.norm(self.offset)) > SURE * self.sigma

    def explained(self, offset: Array) -> bool:
        """Whether this offset is what was found."""
        return float(np.linalg.norm(self.offset - offset)) < max(LEAST * self.field, SURE * self.sigma)


def hard_iron(recording: Recording) -> HardIron | None:
    """The sphere through a recording's field; None without a magnetometer, or if it was not turned enough to tell."""
    if recording.mag is None:
        return None
    mag = np.asarray(recording.mag)
    mag = mag[np.isfinite(mag).all(axis=1) & (mag != 0.0).any(axis=1)]
    count = min(len(mag), int((recording.t[-1] - recording.t[0]) / APART))
    if count < ENOUGH:
        return None
    middle = mag.mean(axis=0)
    if np.sqrt(max(np.linalg.eigvalsh(np.cov(mag.T))[0], 0.0)) < COVERED * np.median(np.linalg.norm(mag, axis=1)):
        return None
    rows = np.column_stack([2.0 * (mag - middle), np.ones(len(mag))])
    found, _, rank, _ = np.linalg.lstsq(rows, ((mag - middle) ** 2).sum(axis=1), rcond=None)
    square = float(found[3] + found[:3] @ found[:3])
    if rank < 4 or square <= 0.0:
        return None
    out = mag - middle - found[:3]
    norms = np.linalg.norm(out, axis=1)
    sphere = np.column_stack([out / norms[:, None], np.ones(len(mag))])
    doubt = np.linalg.eigvalsh(np.linalg.inv(sphere.T @ sphere)[:3, :3])[-1] * len(mag) / count
    return HardIron(middle + found[:3], float(np.sqrt(square)), float(norms.std() * np.sqrt(doubt)))
