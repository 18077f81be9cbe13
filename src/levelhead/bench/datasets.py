"""Public recordings with a reference, in their published formats, with the properties of each set."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from levelhead.bench.contradiction import trust_until_contradiction
from levelhead.errors import LevelheadError, require
from levelhead.recording import Array, Recording, Truth
from levelhead.rotations import product, to_scipy
from levelhead.sources import read
from levelhead.sources.formats.npz import load_arrays

SUFFIXES = (".mat", ".csv", ".npz", ".h5", ".hdf5", ".parquet")
IMU = Path("mav0") / "imu0" / "data.csv"  # EuRoC and TUM-VI
REFERENCES = (  # file, and the column of the quaternion's scalar part
    (Path("mav0") / "state_groundtruth_estimate0" / "data.csv", 4),  # EuRoC
    (Path("mav0") / "mocap0" / "data.csv", 4),  # TUM-VI
)
WITHOUT_REFERENCE = frozenset({"wild", "samples"})  # folders of logs without one
NORTH = frozenset({"tyrex"})  # sets of arrays whose reference points north,
Y_UP = frozenset({"fiumarg"})  # and whose reference has y upwards
Y_UP_TO_Z_UP = np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])  # a quarter turn about x
MAX_OFFSET = 0.05  # s from a stamp within which the reference must have one
NANO = 1e-9


def list_logs(places: Iterable[Path]) -> list[Path]:
    """The recordings in folders and in all folders inside them; files and EuRoC's folders given as such.

    Raises:
        LevelheadError: a place that is not there, or a folder without recordings.
    """
    found: list[Path] = []
    for place in places:
        if not place.exists():
            raise LevelheadError(f"there is no folder {place}; expected one with recordings ({', '.join(SUFFIXES)})")
        inside = list(_inside(place)) if place.is_dir() else [place]
        if not inside:
            raise LevelheadError(f"{place} holds no recordings; expected files that end in {', '.join(SUFFIXES)}")
        found += inside
    if not found:
        raise LevelheadError("there is no folder to look into; expected one or more with recordings")
    return list(dict.fromkeys(found))


def _inside(folder: Path) -> Iterator[Path]:
    if (folder / IMU).is_file():
        yield folder
        return
    for path in sorted(folder.iterdir()):
        if path.is_dir() and path.name not in WITHOUT_REFERENCE:
            yield from _inside(path)
        elif path.is_file() and path.suffix.lower() in SUFFIXES:
            yield path


def load_recording(path: Path, with_mag: bool) -> Recording:
    """The recording, without its magnetometer if that is not wanted, and without a truth that cannot be true.

    Raises:
        LevelheadError: by its reader.
    """
    recording = trust_until_contradiction(_read(path))
    if with_mag or recording.mag is None:
        return recording
    return Recording(recording.t, recording.gyr, recording.acc, None, recording.truth, recording.meta)


def _read(path: Path) -> Recording:
    if (path / IMU).is_file():
        return _folder(path)
    if path.suffix.lower() == ".npz":
        arrays = load_arrays(path)
        if "q_ref_sensor" in arrays:
            return _arrays(path, arrays)
    return read(path)


def _arrays(path: Path, found: dict[str, Array]) -> Recording:
    """Arrays t, gyr, acc, mag in SI units and q_ref_sensor (wxyz), which is the reference where ref_ok is true."""
    missing = [name for name in ("t", "gyr", "acc", "ref_ok") if name not in found]
    if missing:
        raise LevelheadError(f"{path} has q_ref_sensor and no {', '.join(missing)}; expected all of them")
    quat, known = np.array(found["q_ref_sensor"], dtype=float), found["ref_ok"].astype(bool)
    if quat.ndim != 2 or known.shape != quat.shape[:1]:
        raise LevelheadError(
            f"{path}: q_ref_sensor has shape {quat.shape} and ref_ok {known.shape}; expected (n, 4) and (n,)"
        )
    quat[~known] = np.nan
    if path.parent.name in Y_UP:
        quat = product(Y_UP_TO_Z_UP, quat)
    truth = Truth(quat, north=path.parent.name in NORTH)
    return Recording(found["t"], found["gyr"], found["acc"], found.get("mag"), truth, {"source": str(path)})


def _folder(folder: Path) -> Recording:
    """EuRoC's and TUM-VI's layout: stamps in ns, rad/s and m/s², the reference at stamps of its own."""
    imu = _columns(folder / IMU, 7)
    t = (imu[:, 0] - imu[0, 0]) * NANO
    for name, column in REFERENCES:
        if (folder / name).is_file():
            reference = _columns(folder / name, column + 4)
            quat = _interpolate(t, (reference[:, 0] - imu[0, 0]) * NANO, reference[:, column : column + 4])
            return Recording(t, imu[:, 1:4], imu[:, 4:7], None, Truth(quat, north=False), {"source": str(folder)})
    raise LevelheadError(f"{folder} has no {' and no '.join(str(name) for name, _ in REFERENCES)}")


def _columns(path: Path, least: int) -> Array:
    """Rows of numbers between commas, ``least`` or more on each."""
    try:
        found = np.loadtxt(path, delimiter=",", comments="#", ndmin=2)
    except ValueError:
        raise LevelheadError(
            f"{path} is damaged or something else; expected {least} or more numbers between commas on each line"
        ) from None
    if found.shape[0] < 2 or found.shape[1] < least:
        raise LevelheadError(
            f"{path} has {found.shape[0]} rows of {found.shape[1]} numbers; expected 2 or more of {least}"
        )
    return found


def _interpolate(t: Array, known: Array, quat: Array) -> Array:
    """(n, 4) the reference at the stamps ``t``, NaN where it has none within ``MAX_OFFSET``."""
    require("scipy", "the benchmark", "bench")
    from scipy.spatial.transform import Slerp

    found = np.full((len(t), 4), np.nan)
    after = np.clip(np.searchsorted(known, t), 1, len(known) - 1)
    inside = (t >= known[0]) & (t <= known[-1]) & (known[after] - known[after - 1] < MAX_OFFSET)
    turns = Slerp(known, to_scipy(quat))
    found[inside] = turns(t[inside]).as_quat(scalar_first=True)
    return found
