"""A Recording as CSV that reads back to the bit."""

import os
from collections.abc import Iterator

import numpy as np

from levelhead.atomic import atomic_path
from levelhead.recording import Array, Recording

_ROWS = 10_000  # written at a time


def write_csv(recording: Recording, path: str | os.PathLike[str]) -> None:
    """A Recording as CSV: ``t [s],gyr_x [rad/s],…``, numbers in their shortest exact form, missing values blank.

    The reference is in truth_qw … truth_qz (truth_relative_qw … where it does not point north), truth_bias_x …, and
    truth_moving (0 or 1). The file appears whole or not at all.

    Raises:
        LevelheadError: the path cannot be written.
    """
    names, columns = zip(*_columns(recording), strict=True)
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(names) + "\n")
        for start in range(0, len(recording), _ROWS):
            texts = [_texts(column[start : start + _ROWS]) for column in columns]
            file.write("\n".join(map(",".join, zip(*texts, strict=True))) + "\n")


def _columns(recording: Recording) -> Iterator[tuple[str, Array]]:
    yield "t [s]", recording.t
    for name, values, unit in (
        ("gyr", recording.gyr, "rad/s"),
        ("acc", recording.acc, "m/s²"),
        ("mag", recording.mag, _mag(recording)),
    ):
        if values is not None:
            for axis, column in zip("xyz", values.T, strict=True):
                yield f"{name}_{axis} [{unit}]", column
    if recording.temperature is not None:
        yield "temperature [°C]", recording.temperature
    truth = recording.truth
    if truth is None:
        return
    for axis, column in zip("wxyz", truth.quat.T, strict=True):
        yield f"truth_{'' if truth.north else 'relative_'}q{axis}", column
    if truth.bias is not None:
        for axis, column in zip("xyz", truth.bias.T, strict=True):
            yield f"truth_bias_{axis} [rad/s]", column
    if truth.moving is not None:
        yield "truth_moving", truth.moving.astype(np.float64)


def _mag(recording: Recording) -> str:
    return str(recording.meta.get("mag_unit", "µT"))


def _texts(column: Array) -> list[str]:
    return ["" if value != value else repr(value) for value in column.tolist()]
