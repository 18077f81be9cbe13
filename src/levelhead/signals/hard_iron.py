"""Whether a magnetometer was ever calibrated: the middle of the sphere on which its readings lie should be zero.

Least squares over |μ|² = 2 c·μ + (R² − c²), which is linear in c and in the bracket (C. Konvalin, Compensating for
tilt, hard-iron, and soft-iron effects, Sensors, 2009).
"""

from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, Recording

INTERVAL = 0.5  # s between readings that count as independent: iron in a room is met for as long
BLOCKS = 8  # parts of the recording, each of which is left out once
ROUNDER = 0.7  # share of the lengths' spread that may be left when the offset is taken out
MIN_OFFSET = 0.08  # share of the field from which an offset is worth a word
MIN_SIGMAS = 4.0  # and how many σ of it
MIN_READINGS = 60  # independent readings
COVERED = 0.1  # share of the field by which readings must spread in every direction; turns about one axis do not


class HardIron(NamedTuple):
    """The middle of the sphere.

    Attributes:
        offset: the middle in µT.
        field: the sphere's radius in µT.
        sigma: 1σ of the middle, by a jackknife that leaves out one of ``BLOCKS`` parts of the recording at a time. A
            room full of iron pulls the middle elsewhere in each of them, which residuals do not show.
        left: spread of the lengths about the middle, over that about zero.
    """

    offset: Array
    field: float
    sigma: float
    left: float

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
        return (
            self.share > MIN_OFFSET
            and float(np.linalg.norm(self.offset)) > MIN_SIGMAS * self.sigma
            and self.left < ROUNDER
        )

    def explained(self, offset: Array) -> bool:
        """Whether this offset explains the readings."""
        return float(np.linalg.norm(self.offset - offset)) < max(MIN_OFFSET * self.field, MIN_SIGMAS * self.sigma)


def hard_iron(recording: Recording) -> HardIron | None:
    """The sphere through a recording's field; None without a magnetometer, or if it was not turned enough."""
    if recording.mag is None:
        return None
    mag = np.asarray(recording.mag)
    mag = mag[np.isfinite(mag).all(axis=1) & (mag != 0.0).any(axis=1)]
    count = min(len(mag), int((recording.t[-1] - recording.t[0]) / INTERVAL))
    if count < MIN_READINGS:
        return None
    middle = mag.mean(axis=0)
    if np.sqrt(max(np.linalg.eigvalsh(np.cov(mag.T))[0], 0.0)) < COVERED * np.median(np.linalg.norm(mag, axis=1)):
        return None
    rows = np.column_stack([2.0 * (mag - middle), np.ones(len(mag))])
    squares = ((mag - middle) ** 2).sum(axis=1)
    parts = np.array_split(np.arange(len(mag)), BLOCKS)
    normal = np.array([rows[part].T @ rows[part] for part in parts])
    right = np.array([rows[part].T @ squares[part] for part in parts])
    try:
        found = np.linalg.solve(normal.sum(axis=0), right.sum(axis=0))
        without = np.array([
            np.linalg.solve(normal.sum(axis=0) - one, right.sum(axis=0) - other)
            for one, other in zip(normal, right, strict=True)
        ])[:, :3]  # fmt: skip
    except np.linalg.LinAlgError:
        return None
    square = float(found[3] + found[:3] @ found[:3])
    if not square > 0.0:
        return None
    spread = (BLOCKS - 1) / BLOCKS * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    before, after = np.linalg.norm(mag, axis=1), np.linalg.norm(mag - middle - found[:3], axis=1)
    left = float(after.std() / after.mean() * before.mean() / max(before.std(), 1e-12))
    return HardIron(middle + found[:3], float(np.sqrt(square)), float(np.sqrt(spread.sum())), left)
