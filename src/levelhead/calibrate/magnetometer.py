"""A magnetometer in any motion: the field is constant while gyroscope and accelerometer measure the sensor's turn.

    Rz(ψ) R (h − d ω × h) = H + noise,   h = (1 − M)(μ − c)                                                      (2)

R is the attitude without a magnetometer, whose heading drifts by ψ, a random walk with the filter's own σ. c is the
field of a magnet on the board (hard iron), M = Σ xᵢ Bᵢ soft iron, scale factors and the rotation to the gyroscope, tr M
= 0 since no strength of the field is known, d the delay. Gauss and Newton with Huber's weights find c, x, d, H and ψ.

An ellipsoid (|h| constant) uses of each reading one number; (2) uses three, and needs no sphere: c is known in all
directions as soon as the sensor has turned about two axes. Each residual shares its disturbance with those of the next
seconds, so that its information is divided by that time. σ is at least the one of scores of independent stretches (H.
White, Maximum likelihood estimation of misspecified models, Econometrica 50, 1982, eq. 3.2).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.calibrate.field_blocks import FieldBlocks
from levelhead.recording import Array

SYMMETRIC, TURNED = 0.1, 0.05  # 1σ of the numbers of M before any measurement
DELAY = 0.015  # s, likewise of d
LATENCY = 0.0005  # s, 1σ of d by the gyroscope's filter
OFFSET = 10.0  # times the field, likewise of c
MIN_SPREAD = 0.001  # share of the field, 1σ of a block's reading at least
ROBUST = 2.5  # σ from which a residual counts by its size and no more by its square (Huber)
SHARED = 0.2, 10.0  # s for which a disturbance lasts: at least, at most
STRETCH = 4.0  # s of a stretch that is independent of the next
ROUNDS = 15
BASIS = np.array([
    [[1, 0, 0], [0, 0, 0], [0, 0, -1]], [[0, 0, 0], [0, 1, 0], [0, 0, -1]],
    [[0, 1, 0], [1, 0, 0], [0, 0, 0]], [[0, 0, 1], [0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
    [[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
], dtype=float)  # fmt: skip
CENTRE, SHAPE, LATE, FIELD, DRIFT = slice(0, 3), slice(3, 11), 11, slice(12, 15), 15  # of the parameters


class FieldFit(NamedTuple):
    """The result.

    Attributes:
        value: (p,) c, x, d, H and the values of ψ at the knots.
        covariance: (p, p).
        spread: µT, 1σ of a component of a block.
    """

    value: Array
    covariance: Array
    spread: float

    @property
    def centre(self) -> Array:
        """(3,) c, µT."""
        return self.value[CENTRE]

    @property
    def matrix(self) -> Array:
        """(3, 3) M."""
        made: Array = np.tensordot(self.value[SHAPE], BASIS, 1)
        return made

    @property
    def field(self) -> Array:
        """(3,) H, µT, east, north and up of a frame that is level."""
        return self.value[FIELD]

    @property
    def strength(self) -> float:
        """|H|, µT."""
        return float(np.linalg.norm(self.field))

    @property
    def linear(self) -> Array:
        """(3, 4) N of eq. 1."""
        return _linear(self.value)

    def offset(self) -> tuple[Array, Array]:
        """(3,) o = (1 − M) c of a Calibration and its (3, 3) covariance."""
        change = np.hstack([np.eye(3) - self.matrix, -(BASIS @ self.centre).T])
        return self.centre - self.matrix @ self.centre, change @ self.covariance[:11, :11] @ change.T

    def matrix_sigma(self) -> Array:
        """(3, 3) 1σ of M."""
        flat = BASIS.reshape(8, 9)
        made: Array = np.sqrt(np.einsum("ij,ik,kj->j", flat, self.covariance[SHAPE, SHAPE], flat)).reshape(3, 3)
        return made

    def residuals(self, blocks: FieldBlocks) -> Array:
        """(n, 3) left side of eq. 2 minus H."""
        psi = _drift_at(blocks, self.value[DRIFT:])
        made: Array = _about_up(psi, blocks.fields(self.linear, float(self.value[LATE]))) - self.field
        return made


def fit_field(blocks: FieldBlocks, keep: NDArray[np.bool_] | None = None, begin: FieldFit | None = None) -> FieldFit:
    """The calibration of eq. 2 from the blocks, or from those in ``keep`` (n,); faster where it begins near."""
    keep = np.ones(len(blocks), dtype=bool) if keep is None else keep
    value = _start(blocks, keep) if begin is None else begin.value
    shared = SHARED[0]
    prior, mean = _prior(blocks, value), np.zeros(len(value))
    mean[CENTRE] = value[CENTRE]
    spread = 0.0
    covariance: Array = np.zeros_like(prior)
    for step in range(ROUNDS):
        residual, jacobian = _residual(blocks, value), _jacobian(blocks, value)
        spread, weight = _weights(residual, keep, float(np.linalg.norm(value[FIELD])))
        weight = weight * min(1.0, blocks.step / shared)
        flat = jacobian.reshape(-1, len(value))
        hessian = flat.T @ (flat * np.repeat(weight, 3)[:, None])
        scores = np.einsum("nip,ni,n->np", jacobian, residual, weight)
        covariance = np.asarray(np.linalg.inv(hessian + prior), np.float64)
        change = -covariance @ (scores.sum(axis=0) + prior @ (value - mean))
        value = value + change
        if (np.abs(change) < 0.05 * np.sqrt(np.diag(covariance))).all() or step == ROUNDS - 1:
            last, shared = shared, _shared_time(residual, keep, blocks)
            if abs(last - shared) < 0.1 * shared or step == ROUNDS - 1:
                return FieldFit(value, _widen(covariance, scores, prior, blocks, keep), spread)
    return FieldFit(value, covariance, spread)


def level_sigma(fit: FieldFit) -> float:
    """rad, 1σ of the azimuth of the corrected field, of a level sensor that looks to all sides in turn."""
    variance = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
        seen = _about_up(np.array([-angle]), fit.field[None])[0]
        reading = np.linalg.solve(np.eye(3) - fit.matrix, seen)  # about the centre
        change = np.hstack([np.eye(3) - fit.matrix, (BASIS @ reading).T])
        across = np.array([-seen[1], seen[0], 0.0]) / (seen[0] ** 2 + seen[1] ** 2)
        row = across @ change
        variance.append(float(row @ fit.covariance[:11, :11] @ row))
    return float(np.sqrt(np.mean(variance)))


def _linear(value: Array) -> Array:
    """(3, 4) N of eq. 1."""
    shape = np.eye(3) - np.tensordot(value[SHAPE], BASIS, 1)
    return np.hstack([shape, -(shape @ value[CENTRE])[:, None]])


def _about_up(psi: Array, vectors: Array) -> Array:
    """(n, 3) vectors turned by (n,) ψ about the vertical."""
    x, y, z = vectors.T
    return np.stack([np.cos(psi) * x - np.sin(psi) * y, np.sin(psi) * x + np.cos(psi) * y, z], axis=1)


def _drift_at(blocks: FieldBlocks, values: Array) -> Array:
    """(n,) ψ of each block."""
    drift: Array = np.interp(blocks.knots, np.arange(len(values)), values)
    return drift


def _start(blocks: FieldBlocks, keep: NDArray[np.bool_]) -> Array:
    """c and one H of each recording by linear least squares, M = 0; ψ from the azimuths of H."""
    number = np.searchsorted(np.flatnonzero(blocks.drift == np.pi) + 1, blocks.knots, side="right")
    several = int(number.max()) + 1
    left = np.zeros((len(blocks), 3, 3 + 3 * several))
    left[:, :, :3] = blocks.features[:, :, :, 3]
    for i in range(3):
        left[np.arange(len(blocks)), i, 3 + 3 * number + i] = 1.0
    right = np.einsum("nijj->ni", blocks.features[:, :, :, :3])
    found = np.linalg.lstsq(left[keep].reshape(-1, left.shape[2]), right[keep].reshape(-1), rcond=1e-6)[0]
    fields = found[3:].reshape(-1, 3)
    azimuth = np.arctan2(fields[:, 1], fields[:, 0])
    value = np.zeros(DRIFT + len(blocks.drift) + 1)
    value[CENTRE], value[FIELD] = found[:3], fields[0]
    borders = np.flatnonzero(blocks.drift == np.pi) + 1
    value[DRIFT:] = (azimuth[0] - azimuth)[np.searchsorted(borders, np.arange(len(blocks.drift) + 1), side="right")]
    return value


def _prior(blocks: FieldBlocks, start: Array) -> Array:
    """(p, p) information before any measurement; ψ is 0 at first."""
    strength = float(np.linalg.norm(start[FIELD]))
    sigma = np.concatenate([np.full(3, OFFSET * strength), np.full(5, SYMMETRIC), np.full(3, TURNED), [DELAY]])
    information = np.zeros((len(start), len(start)))
    information[:12, :12] = np.diag(sigma**-2.0)
    information[DRIFT, DRIFT] = 1e8
    for i, one in enumerate(blocks.drift, DRIFT):
        information[i : i + 2, i : i + 2] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / one**2
    return information


def _residual(blocks: FieldBlocks, value: Array) -> Array:
    return FieldFit(value, np.zeros((0, 0)), 0.0).residuals(blocks)


def _jacobian(blocks: FieldBlocks, value: Array) -> Array:
    """(n, 3, p) of the residuals."""
    psi, linear = _drift_at(blocks, value[DRIFT:]), _linear(value)
    features = blocks.features - value[LATE] * blocks.late
    centred = np.hstack([np.eye(3), -value[CENTRE, None]])
    columns = np.zeros((len(blocks), 3, len(value)))
    shape = np.eye(3) - np.tensordot(value[SHAPE], BASIS, 1)
    columns[:, :, CENTRE] = -features[:, :, :, 3] @ shape
    columns[:, :, SHAPE] = -np.einsum("nijl,kjl->nik", features, BASIS @ centred)
    columns[:, :, LATE] = -np.einsum("nijl,jl->ni", blocks.late, linear)
    turned = np.stack([_about_up(psi, columns[:, :, i]) for i in range(12)], axis=2)
    columns[:, :, :12] = turned
    columns[:, :, FIELD] = -np.eye(3)
    x, y, _ = _about_up(psi, np.einsum("nijl,jl->ni", features, linear)).T
    low = blocks.knots.astype(int).clip(0, len(blocks.drift) - 1)
    share, rows = blocks.knots - low, np.arange(len(blocks))
    for place, part in ((low, 1.0 - share), (low + 1, share)):
        columns[rows, 0, DRIFT + place] += -y * part
        columns[rows, 1, DRIFT + place] += x * part
    return columns


def _weights(residual: Array, keep: NDArray[np.bool_], strength: float) -> tuple[float, Array]:
    """1σ of a component, and (n,) information of each block by Huber's influence."""
    length = np.linalg.norm(residual, axis=1)
    spread = max(float(np.median(length[keep])) / 1.538, MIN_SPREAD * strength)  # median of χ with 3 degrees
    weight = np.minimum(1.0, ROBUST * spread / np.maximum(length, 1e-12)) / spread**2
    return spread, np.where(keep, weight, 0.0)


def _shared_time(residual: Array, keep: NDArray[np.bool_], blocks: FieldBlocks) -> float:
    """s: the integral of the residuals' autocorrelation up to its first zero."""
    used = np.where(keep[:, None], residual, 0.0)
    total, whole = 1.0, float((used * used).sum())
    for lag in range(1, min(len(blocks) // 4, round(SHARED[1] / blocks.step))):
        one = float((used[lag:] * used[:-lag]).sum()) / max(whole, 1e-30)
        if one <= 0.05:
            break
        total += 2.0 * one
    return float(np.clip(total * blocks.step, *SHARED))


def _widen(covariance: Array, scores: Array, prior: Array, blocks: FieldBlocks, keep: NDArray[np.bool_]) -> Array:
    """The covariance with 1σ at least as large as White's from independent stretches."""
    number = (blocks.time / STRETCH).astype(int)
    sums = np.zeros((int(number.max()) + 1, scores.shape[1]))
    np.add.at(sums, number[keep], scores[keep])
    there = len(np.unique(number[keep]))
    middle = sums.T @ sums * there / max(1, there - 12) + prior
    robust = np.sqrt(np.diag(covariance @ middle @ covariance))
    more = np.maximum(1.0, robust / np.sqrt(np.diag(covariance)))
    wide: Array = covariance * np.outer(more, more)
    wide[8:11, 8:11] += np.eye(3) * blocks.frame**2
    wide[LATE, LATE] += LATENCY**2
    return wide
