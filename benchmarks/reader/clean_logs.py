"""False alarms: what the doctor says of recordings with a reference, each warning judged by that reference.

    python -m benchmarks.reader.clean_logs

BROAD without disturbance, and shared/data/truth. A warning is true where the reference, which the doctor does not see,
shows the same: see ``JUDGES``. A warning without a judge is a false alarm.
"""

import json
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from benchmarks.measure import DATA
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.inspection import examine
from levelhead.inspection.physics import MAX_FIELD, MIN_FIELD
from levelhead.recording import Recording
from levelhead.signals.gravity_turn import median_norm
from levelhead.signals.turn_matrix import SHAPES
from levelhead.sources.interpret.magnetometer import mag_unit
from levelhead.units import GRAVITY, factor

IRON = 0.08  # of the field, as the finding's own bound
MOST_ROWS = 20_000


class Known(NamedTuple):
    """A recording, its reference (n, 4) wxyz where ``ok`` (n,), and whether somebody disturbed the field."""

    recording: Recording
    quat: np.ndarray
    ok: np.ndarray
    disturbed: bool


def field_residual(known: Known) -> str:
    """The field in the reference's world, which would be constant; or somebody wrote that it was disturbed."""
    mag = known.recording.mag
    rows = known.ok & np.isfinite(mag).all(axis=1)
    world = Rotation.from_quat(known.quat[rows], scalar_first=True).apply(mag[rows])
    mean = np.median(world, axis=0)
    off = float(np.sqrt(((world - mean) ** 2).sum(axis=1).mean()) / np.linalg.norm(mean))
    if known.disturbed:
        return f"the set says that the field was disturbed; in the reference's world it varies by {100 * off:.0f} %"
    return f"in the reference's world the field varies by {100 * off:.0f} % rms" if off > 0.15 else ""


def iron(known: Known) -> str:
    """The iron c that stands still in the sensor while the reference rotates: least squares of R (m − c) = h."""
    mag = known.recording.mag
    rows = np.flatnonzero(known.ok & np.isfinite(mag).all(axis=1))
    rows = rows[:: max(1, len(rows) // MOST_ROWS)]
    rotation = Rotation.from_quat(known.quat[rows], scalar_first=True).as_matrix()
    design = np.concatenate([rotation, np.broadcast_to(np.eye(3), rotation.shape)], axis=2).reshape(-1, 6)
    found = np.linalg.lstsq(design, (rotation @ mag[rows, :, None]).ravel(), rcond=None)[0]
    share = float(np.linalg.norm(found[:3]) / np.linalg.norm(found[3:]))
    return f"by the reference, iron of {100 * share:.0f} % of the field turns with it" if share > IRON else ""


def shape(known: Known) -> str:
    """The symmetric matrix S by which R (m + S m − c) is constant, by the reference: least squares."""
    mag = known.recording.mag
    rows = np.flatnonzero(known.ok & np.isfinite(mag).all(axis=1))
    rows = rows[:: max(1, len(rows) // MOST_ROWS)]
    rotation = Rotation.from_quat(known.quat[rows], scalar_first=True).as_matrix()
    shaped = np.einsum("nij,sjk,nk->nis", rotation, SHAPES, mag[rows])
    fixed = np.broadcast_to(np.eye(3), rotation.shape)
    design = np.concatenate([-shaped, rotation, fixed], axis=2).reshape(-1, len(SHAPES) + 6)
    found = np.linalg.lstsq(design, (rotation @ mag[rows, :, None]).ravel(), rcond=None)[0]
    values = np.linalg.eigvalsh(np.eye(3) + np.tensordot(found[: len(SHAPES)], SHAPES, 1))
    longer = float(values[-1] / values[0] - 1.0)
    return f"by the reference, {100 * longer:.0f} % more along one direction" if longer > IRON else ""


def strength(known: Known) -> str:
    """The mean field in the reference's world, which is that of no place on earth."""
    mag = known.recording.mag
    rows = known.ok & np.isfinite(mag).all(axis=1)
    world = Rotation.from_quat(known.quat[rows], scalar_first=True).apply(mag[rows])
    size = float(np.linalg.norm(np.median(world, axis=0)))
    return f"in the reference's world it is {size:.0f} µT" if not MIN_FIELD < size < MAX_FIELD else ""


def scale(known: Known) -> str:
    """The mean specific force in the reference's world, or its length where the reference stands still."""
    rec, rows = known.recording, np.flatnonzero(known.ok)
    rotation = Rotation.from_quat(known.quat[rows], scalar_first=True)
    mean = float(np.linalg.norm(np.nanmean(rotation.apply(rec.acc[rows]), axis=0)))
    step = max(1, round(0.2 / max(1e-4, float(np.median(np.diff(rec.t[rows]))))))
    turn = (rotation[:-step].inv() * rotation[step:]).magnitude()
    still = rec.acc[rows[:-step][turn < np.radians(0.1)]]
    rest = float(np.median(np.linalg.norm(still, axis=1))) if len(still) > 50 else GRAVITY
    worst = max((mean, rest), key=lambda one: abs(one - GRAVITY))
    return f"{worst:.2f} m/s² by the reference" if abs(worst / GRAVITY - 1.0) > 0.025 else ""


def gaps(known: Known) -> str:
    """Intervals of the stamps themselves."""
    steps = np.diff(known.recording.t)
    longest = float(steps.max() / np.median(steps))
    return f"the longest interval is {longest:.0f} usual ones" if longest > 5.0 else ""


def clipping(known: Known) -> str:
    """A full scale that chips have, reached to 1 % and never passed."""
    top = np.nanmax(np.abs(known.recording.acc)) / GRAVITY
    near = min((2.0, 4.0, 8.0, 16.0), key=lambda one: abs(one - top))
    return f"no value beyond {top:.3f} g" if abs(top / near - 1.0) < 0.02 else ""


def held(known: Known) -> str:
    """All six numbers repeat at once, while the reference turns."""
    rec = known.recording
    six = np.hstack([rec.gyr, rec.acc])
    share = float((six[1:] == six[:-1]).all(axis=1)[np.linalg.norm(rec.gyr[1:], axis=1) > 0.2].mean())
    return f"in motion {100 * share:.0f} % of the rows repeat all six numbers" if share > 0.15 else ""


JUDGES: dict[str, Callable[[Known], str]] = {
    "mag_disturbed": field_residual, "mag_offset": iron, "mag_strength": strength,
    "mag_shape": shape,
    "acc_scale": scale, "gaps": gaps, "clipping_acc": clipping, "held_samples": held,
}  # fmt: skip


def recordings() -> list[tuple[str, Known]]:
    """All of them, by name."""
    found = []
    for path in sorted((DATA / "broad").glob("*_undisturbed_*.mat")):
        rec = lh.read(path)
        quat = np.nan_to_num(rec.truth.quat)
        found.append((f"broad/{path.stem}", Known(rec, quat, np.abs(quat).sum(axis=1) > 0.5, False)))
    index = {(one["dataset"], one["trial"]): one for one in json.loads((DATA / "truth/INDEX.json").read_text())}
    for path in sorted((DATA / "truth").glob("*/*.npz")):
        with np.load(path) as data:
            mag = data.get("mag")
            unit = None if mag is None else mag_unit(median_norm(mag))
            if mag is not None and unit is not None:
                mag = mag * factor("mag", unit)
            quat, ok = np.nan_to_num(data["q_ref_sensor"]), data["ref_ok"].astype(bool)
            if path.parent.name == "fiumarg":  # its y is up
                quat = _turned_up(quat)
            meta = {"mag_unit": "relative"} if mag is not None and unit is None else {}  # as the reader has it
            rec = Recording(data["t"], data["gyr"], data["acc"], mag, meta=meta)
        ok &= np.abs(quat).sum(axis=1) > 0.5
        said = index[path.parent.name, path.stem]["magnetic_disturbance"]
        found.append((f"{path.parent.name}/{path.stem}", Known(rec, quat, ok, bool(said))))
    return found


def _turned_up(quat: np.ndarray) -> np.ndarray:
    """A reference whose y axis is up as one whose z axis is."""
    there = np.abs(quat).sum(axis=1) > 0.5
    turned = quat.copy()
    up = Rotation.from_euler("x", 90, degrees=True)
    turned[there] = (up * Rotation.from_quat(quat[there], scalar_first=True)).as_quat(scalar_first=True)
    return turned


def main() -> None:
    """Prints each warning with its judgement, the faults that are only likely, and the sums."""
    counts: Counter[str] = Counter()
    likely: Counter[str] = Counter()
    every = recordings()
    for name, known in every:
        findings = examine(known.recording, name).findings
        warnings = [one for one in findings if one.severity != "note"]
        for one in findings:
            if not one.sure:
                likely[one.name] += 1
                print(f"{name:44} {one.name:14} likely: {one.what}")
        false = 0
        for one in warnings:
            why = JUDGES[one.name](known) if one.name in JUDGES else ""
            false += not why
            print(f"{name:44} {one.name:14} {'true: ' + why if why else 'FALSE: ' + str(one)}")
        counts["silent"] += not warnings
        counts["only true warnings"] += bool(warnings) and not false
        counts["a false alarm"] += bool(false)
    print(f"{len(every)} recordings: {', '.join(f'{name} {count}' for name, count in counts.items())}")
    print(f"likely faults, as notes: {dict(likely)}")


if __name__ == "__main__":
    main()
