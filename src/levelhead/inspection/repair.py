"""The repaired recording as Parquet, with what was changed in its metadata."""

import json
from pathlib import Path

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.inspection.findings import Report
from levelhead.open_types import Fields
from levelhead.recording import Recording


def write_repaired(report: Report, path: Path) -> None:
    """Writes a report's recording with what can be mended mended.

    Signs of an inverted gyroscope are turned round; what the reader repaired (stamps, units, signs, columns) is in the
    recording already. Columns are t [s], gyr [rad/s], acc [m/s²], mag [µT]; the metadata "levelhead" holds the
    findings, the reader's notes and the changes as JSON.

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
    columns: Fields = {"t [s]": recording.t}
    sensors = [("gyr", "rad/s", recording.gyr), ("acc", "m/s²", recording.acc)]
    if recording.mag is not None:
        relative = "mag_unit" in recording.meta
        sensors.append(("mag", "relative" if relative else "µT", recording.mag))
    for name, unit, values in sensors:
        columns |= {f"{name}_{axis} [{unit}]": np.asarray(values[:, i]) for i, axis in enumerate("xyz")}
    facts = {"changes": changes, **{key: value for key, value in report.to_dict().items() if key != "samples"}}
    table = pa.table(columns).replace_schema_metadata({"levelhead": json.dumps(facts, ensure_ascii=False, default=str)})
    with atomic_path(path) as temporary:
        pq.write_table(table, temporary)


def repair(report: Report) -> tuple[Recording, list[str]]:
    """The recording, mended, and what was changed, in sentences."""
    recording = report.recording
    assert recording is not None
    changes = [str(note) for note in recording.meta.get("notes", ())]
    inverted = next((one for one in report.findings if one.name == "gyro_inverted"), None)
    if inverted is not None:
        changes.append(f"gyroscope: turned round, because {inverted.evidence}")
        recording = Recording(
            recording.t, -recording.gyr, recording.acc, recording.mag, recording.truth, recording.meta
        )
    return recording, changes
