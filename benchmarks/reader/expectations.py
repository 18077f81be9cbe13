"""What the doctor's verdict expects of a log, against what a track fused from it is worth by the reference.

    python -m benchmarks.reader.expectations

Recordings with a reference: BROAD, and shared/data/truth. For each the expected 1σ of tilt and of heading (or its
drift, without a magnetometer) beside the measured rms, and the ratio measured over expected: 1 is honest, above 1
promises too much. The table that follows has the geometric mean and the rms of the ratios by set: of a drift, which is
one number of either sign, an honest σ has rms 1 and mean 0.53. Below it the part of the field's wandering that is in
heading, of largest likelihood on the other sets, for each set (tyrex by phone), and what it is worth on the set.
"""

from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from benchmarks.measure import DATA
from benchmarks.reader.clean_logs import Known, recordings
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.inspection import examine
from levelhead.inspection.field_azimuth import FOLLOWS

LEAST = 60.0  # s of a recording from which a drift is measured
Ratios = dict[str, dict[str, list[float]]]


class Measured(NamedTuple):
    """By the reference: rms of inclination and of heading after its mean is taken out, deg; |drift|, deg/min, or None.

    ``sigma``: the filter's own σ of heading, rms in deg.
    """

    tilt: float
    heading: float
    drift: float | None
    sigma: float


def measured(known: Known) -> Measured:
    """What a track of the default filter is worth."""
    recording = known.recording
    track = lh.fuse(recording)
    rows = known.ok & np.isfinite(track.quat).all(axis=1) & (recording.t > recording.t[0] + 5.0)
    estimate = Rotation.from_quat(track.quat[rows], scalar_first=True)
    error = (
        estimate * Rotation.from_quat(known.quat[rows], scalar_first=True).inv()
    )  # earth of one to earth of the other
    x, y, z, w = error.as_quat().T
    tilt = 2.0 * np.degrees(np.arcsin(np.clip(np.hypot(x, y), 0.0, 1.0)))
    heading = np.unwrap(2.0 * np.arctan2(z, w))
    t = recording.t[rows]
    off = np.degrees(heading - np.angle(np.exp(1j * heading).mean()))
    off = (off + 180.0) % 360.0 - 180.0
    drift = None
    if t[-1] - t[0] > LEAST:
        slope = np.polyfit(t, heading, 1)[0]
        drift = float(abs(np.degrees(slope)) * 60.0)
    sigma = np.degrees(track.sigma[rows, 2])
    return Measured(*(float(np.sqrt((one**2).mean())) for one in (tilt, off)), drift, float(np.sqrt((sigma**2).mean())))


def main() -> None:
    """Prints both tables."""
    ratios: Ratios = defaultdict(lambda: defaultdict(list))
    parts: dict[str, list[float]] = defaultdict(list)
    every = recordings()
    for path in sorted((DATA / "broad").glob("*.mat")):
        if "_undisturbed_" not in path.name:
            rec = lh.read(path)
            quat = np.nan_to_num(rec.truth.quat)
            every.append((f"broad disturbed/{path.stem}", Known(rec, quat, np.abs(quat).sum(axis=1) > 0.5, True)))
    for name, known in every:
        report = examine(known.recording, name)
        tilt, heading, drift, own = measured(known)
        words = f"{name:46}"
        if report.sigma_tilt is not None:
            ratios[Path(name).parent.name]["tilt"].append(tilt / report.sigma_tilt)
            words += f" tilt {report.sigma_tilt:5.2f} {tilt:5.2f} {tilt / report.sigma_tilt:5.2f}"
        if report.sigma_heading is not None:
            ratios[Path(name).parent.name]["heading"].append(heading / report.sigma_heading)
            words += f"  heading {report.sigma_heading:5.1f} {heading:5.1f} {heading / report.sigma_heading:5.2f}"
            ratios[Path(name).parent.name]["filter σ"].append(heading / own)
            parts[_left_out(name)].append(FOLLOWS * heading / report.sigma_heading)
        if report.heading_drift and drift is not None:
            ratios[Path(name).parent.name]["drift"].append(drift / report.heading_drift)
            words += f"  drift {report.heading_drift:5.2f} {drift:5.2f} {drift / report.heading_drift:5.2f}"
        print(words, flush=True)
    print(f"\n{'set':18} {'of':8} {'n':>3} {'mean':>6} {'rms':>6} {'least':>6} {'most':>6} {'within 2x':>9}")
    for where, kinds in ratios.items():
        for kind, found in kinds.items():
            _row(where, kind, found)
    for kind in ("tilt", "heading", "filter σ", "drift"):
        _row("all", kind, [one for kinds in ratios.values() for one in kinds[kind]])
    print(f"\n{'left out':18} {'part':>5} {'n':>3} {'mean':>6} {'rms':>6} {'within 2x':>9}")
    together: list[float] = []
    for left, found in parts.items():
        part = np.sqrt(np.mean([np.mean(np.square(values)) for name, values in parts.items() if name != left]))
        together += [one / part for one in found]
        _part(left, part, [one / part for one in found])
    _part("each in turn", np.nan, together)


def _left_out(name: str) -> str:
    """The set that a recording belongs to: BROAD with and without magnets is one, each phone of tyrex is."""
    where, _, trial = name.partition("/")
    return f"{where} {trial.split('_')[1]}" if where == "tyrex" else where.split()[0]


def _part(left: str, part: float, found: list[float]) -> None:
    values = np.array(found)
    near = ((values > 0.5) & (values < 2.0)).mean()
    mean, rms = np.exp(np.log(values).mean()), np.sqrt((values**2).mean())
    print(f"{left:18} {part:5.2f} {len(values):3} {mean:6.2f} {rms:6.2f} {100 * near:7.0f} %")


def _row(where: str, kind: str, found: list[float]) -> None:
    values = np.array(found)
    if len(values):
        mean = np.exp(np.log(np.maximum(values, 1e-3)).mean())
        near = ((values > 0.5) & (values < 2.0)).mean()
        ends = f"{np.sqrt((values**2).mean()):6.2f} {values.min():6.2f} {values.max():6.2f}"
        print(f"{where:18} {kind:8} {len(values):3} {mean:6.2f} {ends} {100 * near:7.0f} %")


if __name__ == "__main__":
    main()
