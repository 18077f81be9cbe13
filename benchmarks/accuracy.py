"""Errors of every filter, with its defaults, on real recordings with an optical reference; vqf for comparison.

For each BROAD .mat and RepoIMU .csv in the folders given: RMS of total, heading and tilt error in degrees over the
movement phases, as ``levelhead.evaluate`` defines them. Where the reference or the filter knows heading only
relatively, the best constant offset is removed first, for all alike.
"""

import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import levelhead as lh
from levelhead import filters
from levelhead.evaluate import evaluate
from measure import Table, options, show

ERRORS = ("total", "heading", "tilt")


def versatile(recording: lh.Recording) -> lh.Track:
    """The orientation by vqf.VQF with its defaults, in a batch."""
    import vqf

    one = vqf.VQF(1.0 / recording.rate)
    if recording.mag is None:
        quat = one.updateBatch(recording.gyr, recording.acc)["quat6D"]
    else:
        quat = one.updateBatch(recording.gyr, recording.acc, recording.mag)["quat9D"]
    return lh.Track(recording.t, quat)


def methods(recording: lh.Recording) -> dict[str, Callable[[], lh.Track]]:
    """Name -> what makes a track of the recording."""
    found: dict[str, Callable[[], lh.Track]] = {
        flt.name: lambda name=flt.name: lh.fuse(recording, name) for flt in filters.ALL
    }
    return found | {"best": lambda: lh.fuse(recording), "vqf.VQF": lambda: versatile(recording)}


def scores(recording: lh.Recording) -> dict[str, dict[str, float]]:
    """Method -> its errors; a recording with missing readings is none for vqf."""
    whole = recording.valid.all() and (recording.mag is None or not np.isnan(recording.mag).any())
    found = {}
    for name, run in methods(recording).items():
        if name == "vqf.VQF" and not whole:
            continue
        score = evaluate(recording, run())
        found[name] = {error: getattr(score, error) for error in ERRORS}
    return found


def logs(folders: list[Path]) -> list[Path]:
    """The .mat and .csv files in the folders, and files given as such."""
    found: list[Path] = []
    for folder in folders:
        found += sorted(p for p in folder.iterdir() if p.suffix in (".mat", ".csv")) if folder.is_dir() else [folder]
    if not found:
        raise SystemExit("there is no .mat and no .csv in " + ", ".join(map(str, folders)))
    return found


def table(error: str, found: dict[str, dict[str, dict[str, float]]], names: list[str]) -> Table:
    """One kind of error: recordings downwards, methods across, mean and median below."""
    rows: list[dict[str, Any]] = [
        {"recording": recording} | {name: errors[name][error] for name in names if name in errors}
        for recording, errors in found.items()
    ]
    below: list[dict[str, Any]] = []
    for label, middle in (("mean", statistics.fmean), ("median", statistics.median)):
        values = {name: [row[name] for row in rows if name in row] for name in names}
        below.append({"recording": label} | {name: middle(v) for name, v in values.items() if v})
    return Table(f"RMS {error} error, °", {"recording": "recording"} | {name: name for name in names}, rows + below)


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("folders", nargs="+", type=Path, help="folders (or files) with BROAD .mat and RepoIMU .csv")
    given = parser.parse_args()
    found, failed = {}, []
    for path in logs(given.folders):
        try:
            recording = lh.read(path)
            found[path.stem] = scores(recording)
        except lh.LevelheadError as error:
            failed.append(f"{path.name}: {error}")
    if not found:
        raise SystemExit("\n".join(failed))
    names = list(next(iter(found.values())))
    tables = [table(error, found, names) for error in ERRORS]
    tables[-1].note = f"best: {filters.best()}." + "".join(f"\n{x}" for x in failed)
    show(tables, given.json)


if __name__ == "__main__":
    main()
