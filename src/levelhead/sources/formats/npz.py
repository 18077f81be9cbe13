"""NumPy archives, never with pickles: those of others, and levelhead's own, which hold a Recording exactly."""

import json
import os
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.recording import Gnss, Pressure, Recording, Truth
from levelhead.sources.conclusions import Conclusion
from levelhead.sources.formats.named_arrays import tabulate
from levelhead.sources.hints import Hints
from levelhead.sources.table import ArrayTable

_MARK = "levelhead_format"
_VERSION = 1
_TRUTH = ("bias", "moving", "position", "velocity")
NOTHING_MORE: Mapping[str, NDArray[np.float64]] = {}
_BESIDE: dict[str, type[Pressure | Gnss]] = {"pressure": Pressure, "gnss": Gnss}


def write_npz(
    recording: Recording, path: str | os.PathLike[str], more: Mapping[str, NDArray[np.float64]] = NOTHING_MORE
) -> None:
    """A Recording as .npz in SI units, which ``read`` gives back exactly.

    It holds t, gyr, acc and, where there are any, mag, temperature, truth_quat, truth_bias, truth_moving,
    truth_position, truth_velocity, truth_north, the fields of pressure and gnss as pressure_t, gnss_position …, and
    meta as JSON; ``more`` has further arrays, which ``read`` leaves out. The file appears whole or not at all.

    Raises:
        LevelheadError: the path cannot be written.
    """
    arrays: JsonObject = {"t": recording.t, "gyr": recording.gyr, "acc": recording.acc}
    if recording.mag is not None:
        arrays["mag"] = recording.mag
    if recording.temperature is not None:
        arrays["temperature"] = recording.temperature
    if (truth := recording.truth) is not None:
        arrays |= {"truth_quat": truth.quat, "truth_north": np.array(truth.north)}
        for name in _TRUTH:
            if (values := getattr(truth, name)) is not None:
                arrays[f"truth_{name}"] = values
    for name in _BESIDE:
        if (sensor := getattr(recording, name)) is not None:
            arrays |= {f"{name}_{key}": values for key, values in vars(sensor).items() if values is not None}
    stored = {**recording.meta}
    if "conclusions" in stored:
        stored["conclusions"] = [one.to_dict() for one in stored["conclusions"]]
    meta = json.dumps(stored, default=str, ensure_ascii=False)
    arrays |= more
    arrays |= {"meta": np.array(meta), _MARK: np.array(_VERSION)}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def read_own(path: Path, hints: Hints) -> Recording | None:
    """The Recording in a .npz that levelhead wrote; None for the archives of others.

    Raises:
        LevelheadError: damaged, a pickle inside, hints for a file that needs none.
    """
    arrays = load_arrays(path)
    if _MARK not in arrays:
        return None
    if hints.given:
        raise LevelheadError(f"{path} was written by levelhead, in SI units; hints do not apply")
    return _own(path, arrays)


def _archive(path: Path, display_path: str) -> ArrayTable:
    """The arrays of any .npz as columns; in levelhead's own, time is in seconds."""
    arrays = load_arrays(path)
    if _MARK in arrays and "t" in arrays:
        arrays["t [s]"] = arrays.pop("t")
    info = "\n".join(str(value) for value in arrays.values() if value.dtype.kind == "U" and value.size == 1)
    return tabulate(display_path, arrays, info)


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of a .npz by name.

    Raises:
        LevelheadError: it is not an archive, damaged, or holds a pickle.
    """
    try:
        with open(path, "rb") as stream:
            file = np.load(stream, allow_pickle=False)
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise LevelheadError(f"{path} is a single array (.npy); expected an archive with gyr, acc and t")
            return {name: file[name] for name in file.files}
    except LevelheadError:
        raise
    except (
        ValueError,
        OSError,
        EOFError,
        KeyError,
        RuntimeError,
        NotImplementedError,
        zipfile.BadZipFile,
        zlib.error,
        SyntaxError,
        tokenize.TokenError,
        MemoryError,
    ) as error:  # NumPy parses the header of an array as Python
        if "pickle" in str(error).lower():
            raise LevelheadError(
                f"{path} holds a pickle, which can run code when it is read; expected arrays of numbers only"
            ) from None
        raise LevelheadError(f"{path} is not a .npz archive, or it is truncated or damaged") from None


def _read_aiding_sensor(kind: type[Pressure | Gnss], name: str, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """The sensor beside the IMU whose fields are there; None without stamps."""
    keys = [key.name for key in fields(kind)]
    found = {key: arrays[f"{name}_{key}"] for key in keys if f"{name}_{key}" in arrays}
    if not found:
        return None
    if missing := [key for key in ("t", "values") if key in keys and key not in found]:
        raise LevelheadError(f"{name} lacks {', '.join(missing)}; expected a file by levelhead")
    return kind(**found)


def _own(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Recording:
    if arrays[_MARK].shape != () or arrays[_MARK] != _VERSION:
        raise LevelheadError(f"{path} was written by a newer levelhead; expected format {_VERSION}")
    missing = [name for name in ("t", "gyr", "acc", "meta") if name not in arrays]
    if missing:
        raise LevelheadError(f"{path} lacks {', '.join(missing)}; expected a file by levelhead")
    try:
        meta = json.loads(str(arrays["meta"]))
        if not isinstance(meta, dict):
            raise ValueError
        meta["conclusions"] = [Conclusion.from_dict(one) for one in meta.get("conclusions", ())]
    except (ValueError, TypeError, KeyError):
        raise LevelheadError(f"{path}: meta is not JSON by levelhead") from None
    truth = None
    if "truth_quat" in arrays:
        north = bool(np.all(arrays.get("truth_north", np.array(True))))
        known = {name: arrays[f"truth_{name}"] for name in _TRUTH if f"truth_{name}" in arrays}
        truth = Truth(arrays["truth_quat"], north=north, **known)
    try:
        beside = {name: _read_aiding_sensor(kind, name, arrays) for name, kind in _BESIDE.items()}
        return Recording(
            arrays["t"], arrays["gyr"], arrays["acc"], arrays.get("mag"), truth, {**meta, "source": str(path)},
            **beside, temperature=arrays.get("temperature"),
        )  # fmt: skip
    except LevelheadError as error:
        raise LevelheadError(f"{path}: {error}") from None


def tables(path: Path, display_path: str, hints: Hints) -> list[ArrayTable]:
    """The one table of an .npz, or of a single array (.npy)."""
    return [_single(path, display_path) if path.suffix.lower() == ".npy" else _archive(path, display_path)]


def _single(path: Path, display_path: str) -> ArrayTable:
    """The columns of numpy.save's array: those of its fields, or by number."""
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, OSError, EOFError, tokenize.TokenError, SyntaxError) as error:
        raise LevelheadError(f"{display_path} is not an array of numbers, or it is damaged") from error
    if not isinstance(array, np.ndarray):
        raise LevelheadError(f"{display_path} is named .npy but is an archive; expected the suffix .npz")
    if array.dtype.names:
        return tabulate(display_path, {name: array[name] for name in array.dtype.names})
    return tabulate(display_path, {"column": array})
