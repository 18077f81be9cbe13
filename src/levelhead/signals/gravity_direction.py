"""Whether three columns that are called rates are the direction of gravity: GX, GY, GZ beside AccX, AccY, AccZ."""

import numpy as np

from levelhead.recording import Array, median
from levelhead.units import GRAVITY

_MIN_ROWS = 30  # rows
_ROWS = 20_000  # enough for a mean
_CONSTANT = 0.02  # relative spread of the length; rates of a body that turns vary by far more
_ALONG = 0.95  # median cosine between the columns and the accelerometer
_MIN_VECTORS, _MAX_VARIATION = 10, 2e-3  # samples of a vector whose length software keeps constant to a share
_TURNED = np.cos(np.radians(15.0))  # the direction must move: at rest a bias has a constant direction too


def excerpt_step(n: int) -> int:
    """The step between the rows of n that are enough for a mean."""
    return max(1, n // _ROWS)


def is_gravity(gyr: Array, acc: Array) -> bool:
    """Whether (n, 3) ``gyr`` keeps its length while it turns and stays along (n, 3) ``acc``; both in any unit."""
    step = excerpt_step(len(gyr))
    gyr, acc = gyr[::step], acc[::step]
    rows = np.isfinite(gyr).all(axis=1) & np.isfinite(acc).all(axis=1)
    gyr, acc = gyr[rows], acc[rows]
    lengths, forces = np.linalg.norm(gyr, axis=1), np.linalg.norm(acc, axis=1)
    if len(gyr) < _MIN_ROWS or not (lengths.min() > 0.0 and np.std(lengths) < _CONSTANT * np.mean(lengths)):
        return False
    ways = gyr / lengths[:, None]
    mean = ways.mean(axis=0)
    turned = bool(np.quantile(ways @ mean, 0.05) < _TURNED * np.linalg.norm(mean))
    along = np.einsum("ij,ij->i", ways, acc) / np.where(forces > 0.0, forces, np.inf)
    return turned and abs(float(np.median(along))) > _ALONG


def keeps_length_of_gravity(values: Array) -> bool:
    """Whether (n, 3) values have the length of gravity, in g or m/s², at each sample: software worked them out."""
    values = values[:: excerpt_step(len(values))]
    length = np.sqrt((values**2).sum(axis=1))
    length = length[np.isfinite(length)]
    if len(length) < _MIN_VECTORS or not np.ptp(values[np.isfinite(values).all(axis=1)], axis=0).any():
        return False
    usual = median(length)
    constant = float(np.quantile(np.abs(length / usual - 1.0), 0.9)) < _MAX_VARIATION if usual > 0.0 else False
    return constant and min(abs(usual - 1.0), abs(usual / GRAVITY - 1.0)) < 0.01
