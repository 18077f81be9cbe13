"""Six unnamed columns of counts with an offset, as from an analogue sensor's converter: found by physics alone.

The accelerometer's counts lie on a sphere whose middle is the offset and whose radius is 1 g. The gyroscope's offset is
its median at rest; its order, signs and scale are those of the 48 under which gravity turns as it measures.
"""

from collections.abc import Sequence
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from levelhead.recording import Array, median
from levelhead.signals.gravity_turn import turn_of_gravity
from levelhead.sources.conclusions import Basis, Conclusion
from levelhead.sources.table import ArrayTable, stack
from levelhead.units import GRAVITY

ROUND = 0.3  # median deviation from the sphere, as a share of its radius, at most
MIN_CORRELATION = 0.8  # correlation of gravity's turn with the gyroscope's
STILL = 0.05  # share of the radius by which the acceleration varies in half a second of rest
CLEAN = 0.15  # median deviation from a sphere that noise about one point does not reach
MIN_OFFSET = 1.5  # radii from which a middle is not 0
WINDOW = 50  # rows


class Sphere(NamedTuple):
    """Middle and radius in counts, and the median deviation as a share of the radius."""

    middle: Array
    radius: float
    off: float


def with_sensors(table: ArrayTable, positions: Sequence[int], time: int) -> ArrayTable | None:
    """The table with its six columns at ``positions`` as gyr [rad/s] and acc [g]; None if they show no such sensors."""
    columns = table.read([*positions, time], frozenset([time]))
    values = stack(columns, positions)
    stamps = columns[time].astype(np.float64)
    t = stamps - stamps[0]
    if len(t) < 200 or not np.isfinite(values).all() or not (np.diff(t) > 0).all():
        return None
    parts = [values[:, :3], values[:, 3:]]
    spheres = [_sphere(part) for part in parts]
    known = [i for i in (0, 1) if spheres[i] is not None]
    if not known:
        return None
    which = min(known, key=lambda i: spheres[i].off)  # type: ignore[union-attr]
    sphere = spheres[which]
    assert sphere is not None
    acc, gyr = (parts[which] - sphere.middle) / sphere.radius, parts[1 - which]
    gyr = gyr - _at_rest(acc, gyr)
    best: tuple[float, tuple[int, ...], tuple[float, ...], float] = (MIN_CORRELATION, (), (), 0.0)
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turn = turn_of_gravity(t, gyr[:, order] * np.array(signs), acc * GRAVITY)
            if turn is not None and turn.correlation > best[0]:
                best = turn.correlation, order, signs, turn.scale
    correlation, order, signs, scale = best
    if not order:
        return None
    gyr_names = [table.names[positions[3 * (1 - which) + i]] for i in order]
    facts = {
        "accelerometer": table.names[positions[3 * which]],
        "per_g": sphere.radius,
        "middle": ", ".join(f"{one:.0f}" for one in sphere.middle),
        "gyroscope": ", ".join(("−" if s < 0 else "") + name for s, name in zip(signs, gyr_names, strict=True)),
        "order": list(order), "signs": list(signs), "scale": scale, "correlation": correlation,
    }  # fmt: skip
    conclusion = Conclusion("columns", "by_physics", gyr_names, Basis.GUESS, facts)
    rates = gyr[:, order] * np.array(signs) * scale
    arrays = {table.names[time]: columns[time]}
    arrays |= {f"gyr_{axis} [rad/s]": rates[:, i] for i, axis in enumerate("xyz")}
    arrays |= {f"acc_{axis} [g]": acc[:, i] for i, axis in enumerate("xyz")}
    return ArrayTable(table.source, arrays, rate=table.rate, conclusions=[*table.conclusions, conclusion])


def offset_of(values: Array) -> Array | None:
    """The middle of the sphere on which (n, 3) whole numbers lie, if that is far from 0; else None."""
    rows = _whole_rows(values)
    if len(rows) < 200:
        return None
    sphere = _sphere(rows)
    if sphere is None or sphere.off > CLEAN or float(np.linalg.norm(sphere.middle)) < MIN_OFFSET * sphere.radius:
        return None
    length = np.linalg.norm(rows, axis=1)
    about_zero = median(np.abs(length / median(length) - 1.0)) * median(length)
    return sphere.middle if sphere.off * sphere.radius < 0.7 * about_zero else None


def rates_about(values: Array) -> float | None:
    """The middle of a converter about which (n, 3) rates lie: whole numbers above 0, alike on all axes; else None.

    A gyroscope's bias is not the same on its three axes, and its numbers have both signs once it turns.
    """
    rows = _whole_rows(values)
    if len(rows) < 200 or rows.min() <= 0.0:
        return None
    middles = np.median(rows, axis=0)
    spread = np.abs(rows - middles).mean(axis=0)
    alike = middles.max() < 1.5 * middles.min() and middles.min() > 100.0
    return float(middles.mean()) if alike and (middles > 2.0 * spread).all() else None


def _whole_rows(values: Array) -> Array:
    """The complete rows of (n, 3) values if all of them are whole numbers; else none.

    The beginning distinguishes most logs, without a copy of all rows.
    """
    for part in (values[:1000], values):
        rows: Array = part[np.isfinite(part).all(axis=1)]
        if not (rows == np.rint(rows)).all():
            return rows[:0]
    return rows


def _sphere(values: Array) -> Sphere | None:
    """The sphere through (n, 3) counts by least squares; None if they lie on none, or do not cover enough of it."""
    start = values.mean(axis=0)
    rows = np.column_stack([2.0 * (values - start), np.ones(len(values))])
    found, _, rank, _ = np.linalg.lstsq(rows, ((values - start) ** 2).sum(axis=1), rcond=None)
    square = float(found[3] + found[:3] @ found[:3])
    if rank < 4 or square <= 0.0:
        return None
    radius = float(np.sqrt(square))
    off = median(np.abs(np.linalg.norm(values - start - found[:3], axis=1) / radius - 1.0))
    covered = float(np.sqrt(max(np.linalg.eigvalsh(np.cov(values.T))[0], 0.0))) > 0.05 * radius
    return Sphere(start + found[:3], radius, off) if off < ROUND and covered else None


def _at_rest(acc: Array, gyr: Array) -> Array:
    """The median of the gyroscope where the accelerometer holds still, or of all."""
    count = len(acc) // WINDOW
    spread = acc[: count * WINDOW].reshape(count, WINDOW, 3).std(axis=1).max(axis=1)
    still = np.repeat(spread < STILL, WINDOW)
    rows = gyr[: count * WINDOW][still] if still.any() else gyr
    middle: Array = np.median(rows, axis=0)
    return middle
