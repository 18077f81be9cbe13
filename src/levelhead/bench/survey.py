"""The recordings in some folders, and the errors that can be compared on each."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from levelhead.bench.contradiction import MIN_ANGLE, REFERENCE_ENDS
from levelhead.bench.datasets import list_logs, load_recording
from levelhead.bench.groups import Group, group_of
from levelhead.errors import LevelheadError
from levelhead.evaluate.score import scored_rows
from levelhead.recording import Recording

MIN_AGREED = 0.2  # of a recording: a shorter agreement was at rest, or by chance


@dataclass(frozen=True)
class Entry:
    """A recording that can be compared.

    Attributes:
        path: its file.
        group: data set and group.
        samples: how many.
        rate: samples a second, Hz.
        duration: s.
        north: whether heading is compared as it is: the reference has north and there is a magnetometer. If not, each
            method's best constant heading offset is removed first.
        magnetometer: whether there is one that is used.
        missing: the readings that are missing, for which contenders are not run on it; "" if none is.
    """

    path: Path
    group: Group
    samples: int
    rate: float
    duration: float
    north: bool
    magnetometer: bool
    missing: str

    @property
    def name(self) -> str:
        """Name of the recording: that of its file."""
        return self.path.stem

    def to_dict(self) -> dict[str, object]:
        """Ready for JSON; without the folder, which is the machine's own."""
        facts = asdict(self) | {"dataset": self.group.dataset, "group": self.group.name}
        return {"recording": self.name} | {key: facts[key] for key in facts if key != "path"}


def survey(places: Sequence[Path], with_mag: bool) -> tuple[list[Entry], list[str]]:
    """The comparable recordings, by group, and a sentence for each file that is left out.

    Raises:
        LevelheadError: nothing is left; with the first of these sentences.
    """
    entries, left_out = [], []
    for path in list_logs(places):
        try:
            recording = load_recording(path, with_mag)
            entries.append(_entry(path, recording))
            left_out += _untrusted(path, recording)
        except LevelheadError as error:
            words = str(error).replace(str(path), path.name)  # folders are the machine's own and not the result's
            left_out.append(words if path.name in words else f"{path.name}: {words}")
    if not entries:
        raise LevelheadError(f"no recording can be compared: {left_out[0]}")
    return sorted(entries, key=lambda entry: (entry.group.place, entry.name)), left_out


def _untrusted(path: Path, recording: Recording) -> list[str]:
    """A sentence where the truth was left out from some time on."""
    start = recording.meta.get(REFERENCE_ENDS)
    if start is None:
        return []
    return [
        f"{path.name} from {start:.1f} to {recording.t[-1]:.1f} s: its reference turns there by "
        f"{np.degrees(MIN_ANGLE):.0f}° and more in a quarter of a second that the gyroscope did not measure"
    ]


def _entry(path: Path, recording: Recording) -> Entry:
    if recording.truth is None:
        raise LevelheadError("it holds no true orientation; expected a reference to compare with")
    agreed = recording.meta.get(REFERENCE_ENDS, recording.t[-1]) - recording.t[0]
    if agreed < MIN_AGREED * recording.duration:
        raise LevelheadError(
            f"its reference contradicts the gyroscope after {agreed:.1f} s; expected orientations of the sensor's body "
            "in the earth frame, scalar first, on the recording's clock"
        )
    scored_rows(recording.truth)
    return Entry(
        path=path,
        group=group_of(path),
        samples=len(recording),
        rate=recording.rate,
        duration=recording.duration,
        north=recording.truth.north and recording.mag is not None,
        magnetometer=recording.mag is not None,
        missing=_missing_sensors(recording),
    )


def _missing_sensors(recording: Recording) -> str:
    incomplete = int((~recording.valid).sum())
    if recording.mag is not None:
        blind = int(np.isnan(recording.mag).any(axis=1).sum())
        if blind:
            return f"{blind:,} magnetometer readings are missing"
    return f"{incomplete:,} readings are missing" if incomplete else ""
