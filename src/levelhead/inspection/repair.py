"""The repaired recording as Parquet, with its changes in its metadata."""

import json
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.inspection.findings import Finding, Report
from levelhead.inspection.mend import Mend
from levelhead.inspection.turns import examine_turns
from levelhead.inspection.verdict import expectation
from levelhead.open_types import JsonObject
from levelhead.recording import Recording
from levelhead.signals.turn_matrix import NONE, cut, fit, left_as_read

BETTER = 1.15  # times less that must be left, or tilt that must be expected, for a change
SAME = 0.15  # by which the mends of a half and of the whole may differ


def write_repaired(report: Report, path: Path) -> list[str]:
    """Writes a report's recording with its repairable faults mended, and returns the sentences of ``repair``.

    The reader's repairs (stamps, units, signs, columns) are in the recording already. Columns are t [s],
    gyr [rad/s], acc [m/s²], mag [µT]; the metadata "levelhead" holds the findings, the reader's notes and the changes
    as JSON.

    Raises:
        LevelheadError: pyarrow is not installed, or the path cannot be written.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise LevelheadError("--fix writes Parquet, which needs pyarrow: pip install 'levelhead[formats]'") from None
    if report.recording is None:
        raise LevelheadError(f"{report.source} could not be read; there is nothing to repair")
    recording, changes = repair(report)
    columns: JsonObject = {"t [s]": recording.t}
    sensors = [("gyr", "rad/s", recording.gyr), ("acc", "m/s²", recording.acc)]
    if recording.mag is not None:
        relative = "mag_unit" in recording.meta
        sensors.append(("mag", "relative" if relative else "µT", recording.mag))
    for name, unit, values in sensors:
        columns |= {f"{name}_{axis} [{unit}]": np.asarray(values[:, i]) for i, axis in enumerate("xyz")}
    notes = [str(note) for note in report.recording.meta.get("notes", ())]
    facts = {key: value for key, value in report.to_dict().items() if key != "samples"}
    facts = {"changes": [*notes, *changes], **facts}
    table = pa.table(columns).replace_schema_metadata({"levelhead": json.dumps(facts, ensure_ascii=False, default=str)})
    with atomic_path(path) as temporary:
        pq.write_table(table, temporary)
    return changes


def repair(report: Report) -> tuple[Recording, list[str]]:
    """The recording, mended, and the changes made or refused, in sentences.

    Signs, axes, scales, delays and iron are mended where it is proved: each half of the recording shows the fault, and
    its mend leaves less in the other half, on which nothing was fitted.
    """
    recording = report.recording
    assert recording is not None
    changes = []
    for one in report.findings:
        mend = one.mend
        if mend is None or not mend.sole:
            continue
        better = _gain(recording, mend)
        if better is None or better < BETTER:
            proof = "the recording is too short to prove it"
            if better is not None:
                proof = f"found in one half, it leaves {better:.2f} times less in the other; expected {BETTER}"
            changes.append(f"not mended: {one.what} ({proof})")
            continue
        mended = mend.apply(recording)
        if mend.lag and not _levels(recording, mended):
            changes.append(f"not mended: {one.what} (the expected tilt would hardly be less: noise grows)")
            continue
        recording = mended
        changes.append(
            f"mended: {one.what}; on the half that did not show it the residual between gyroscope and "
            f"{'field' if mend.role == 'mag' else 'gravity'} is {better:.1f} times smaller"
        )
    return recording, changes


def _levels(before: Recording, after: Recording) -> bool:
    """Whether a track of the mended readings is expected to have clearly less tilt."""
    tilts = [expectation(one, ()).tilt for one in (before, after)]
    return tilts[0] is not None and tilts[1] is not None and tilts[0] > BETTER * tilts[1]


def _gain(recording: Recording, mend: Mend) -> float | None:
    """How many times less a mend leaves in the half of a recording that it was not found from; None: too short.

    The mend is found again, by its kind, in the other half. The gain is that of the worse of both halves.
    """
    half = len(recording) // 2
    parts = (recording[:half], recording[half:])
    gains = []
    for found, kept in (parts, parts[::-1]):
        again = [one.mend for one in examine_turns(found) if isinstance(one, Finding)]
        same = next((one for one in again if one is not None and one.role == mend.role and _is_like(one, mend)), None)
        before, after = (_left(one, mend.role) for one in (kept, kept if same is None else same.apply(kept)))
        if before is None or after is None:
            return None
        gains.append(before / max(after, 1e-12))
    return float(min(gains))


def _is_like(found: Mend, mend: Mend) -> bool:
    """Whether two mends change the same about as much."""
    kinds = [(bool(one.delay), bool(one.lag), bool(np.any(one.offset))) for one in (found, mend)]
    return kinds[0] == kinds[1] and float(np.abs(found.matrix - mend.matrix).max()) < SAME


def _left(recording: Recording, role: str) -> float | None:
    """The residual of force and field when the gyroscope turns them back, as it is; bias and arm are fitted."""
    left = []
    for one in ("acc", "mag"):
        values = getattr(recording, one)
        if values is None or role not in ("gyr", one):
            continue
        seg = cut(recording.t, recording.gyr, values, one == "acc")
        if seg is not None:
            left.append(left_as_read(seg, fit(seg, np.eye(3), NONE)))
    return float(np.prod(left) ** (1.0 / len(left))) if left else None
