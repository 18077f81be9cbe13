"""The doctor measured as one measures a test: faults of known kind and size, put into real recordings.

    python -m benchmarks.reader.faults [DIR] [--share N] [--half 0|1] [--every N] [--only WORD] [--seconds 120]

DIR holds recordings that levelhead reads, with a reference where tilt is to be compared; without DIR those of
clean_logs.py are taken. Each recording meets every fault once (one of N faults with --share N), in one of its sizes. A
fault is named rightly if a finding has its name and its number: the value within 5 %, its interval, or 6 ms; the axes
that would mend it. It is named wrongly if a warning that the clean recording has not says something else. "Not told":
there is no finding, and the report notes that this motion does not allow the comparison, or it prints an interval in
which both the faulty number and that of a good sensor lie. Beside it, the tilt that the verdict expects and the rms of
the true one. --half takes every other data set, --every one of so many recordings. The
thresholds were chosen on the sets of --half 0.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmarks.measure import run_script
from benchmarks.reader.clean_logs import Known, recordings

import levelhead as lh
from levelhead.engine import fuse, native
from levelhead.errors import LevelheadError
from levelhead.inspection import examine
from levelhead.inspection.agreement import Seen, agree
from levelhead.inspection.findings import Finding, Measurement, Report
from levelhead.inspection.turns import change_of
from levelhead.inspection.values import NAMES
from levelhead.recording import Array, Recording
from levelhead.rotations import conjugate, rotate

UP = np.array([0.0, 0.0, 1.0])
PARTS = ("t", "gyr", "acc", "mag")
UNTOLD = {"acc_gyr_test_invalid", "always_still"}


class Clean(NamedTuple):
    """A clean recording: its report, what its sensors have of their own, and the usual length of its field.

    Attributes:
        report: of the doctor.
        seen: the comparisons of turns, by role.
        field: length of the magnetometer's readings; 0 without one.
    """

    report: Report
    seen: dict[str, Seen]
    field: float

    def delay(self, role: str) -> float:
        """In s."""
        return self.seen[role].fit.delay if role in self.seen else 0.0

    def own(self, name: str) -> float:
        """The scale that it shows by itself; 1 where the interval holds 1."""
        found = next((one for one in self.report.measured if one.name == name), None)
        return 1.0 if found is None or found.interval[0] <= 1.0 <= found.interval[1] else found.value


class Fault(NamedTuple):
    """A fault.

    Attributes:
        name: for the table.
        sizes: one of them is put in.
        put: (recording, size, which axis) → recording; None where it cannot be put in.
        named: the findings that name it.
        check: (finding or measurement, size, axis, clean report) → whether its number is right.
        measured: the measurement that would show it, where it has another name.
    """

    name: str
    sizes: Sequence[float]
    put: Callable[[Recording, float, int], Recording | None]
    named: Sequence[str]
    check: Callable[[Any, float, int, Clean], bool]
    measured: str = ""

    def is_hidden(self, one: Measurement, size: float, axis: int, clean: Clean) -> bool:
        """Whether an interval holds both this fault and a good sensor."""
        low, high = one.interval
        if one.name not in (self.measured, *self.named) or not low <= one.usual <= high:
            return False
        return self.check(one, size, axis, clean)


def changed(recording: Recording, **parts: Any) -> Recording:
    """With other readings."""
    kept = {name: getattr(recording, name) for name in PARTS} | parts
    return Recording(**kept)


def whatever(*_: object) -> bool:
    """The name suffices."""
    return True


def near(value: float, finding: Finding | Measurement, share: float = 0.05, least: float = 0.0) -> bool:
    """Whether a finding's number is the true one."""
    if finding.value is None:
        return False
    low, high = finding.interval or (finding.value, finding.value)
    return low <= value <= high or abs(finding.value - value) <= max(share * abs(value), least)


def scaled(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """A factor of the gyroscope; or this times that which the clean recording showed."""
    return near(size, finding) or near(size * clean.own("gyro_scale"), finding)


def multiply(role: str, matrix: Array) -> Callable[[Recording, float, int], Recording | None]:
    """A sensor times a matrix, its axes turned on by ``axis``."""

    def put(recording: Recording, size: float, axis: int) -> Recording | None:
        values = getattr(recording, role)
        return None if values is None else changed(recording, **{role: values @ _rolled(matrix, axis).T})

    return put


def _rolled(matrix: Array, axis: int) -> Array:
    return np.roll(np.roll(matrix, axis, axis=0), axis, axis=1)


def mends(role: str, matrix: Array) -> Callable[[Finding, float, int, Clean], bool]:
    """Whether the finding's mend is the inverse; or it names this way among several, where the motion leaves them."""

    def check(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
        true = _rolled(matrix, axis)
        if finding.mend is not None and finding.mend.sole:
            return finding.mend.role == role and bool(np.allclose(finding.mend.matrix, true.T))
        return f"{NAMES[role]} {change_of(true.T)}" in finding.what or "one of them is inverted" in finding.what

    return check


def turned(role: str) -> Callable[[Recording, float, int], Recording | None]:
    """A sensor that is mounted askew by ``size`` deg."""

    def put(recording: Recording, size: float, axis: int) -> Recording | None:
        values = getattr(recording, role)
        if values is None:
            return None
        c, s = np.cos(np.radians(size)), np.sin(np.radians(size))
        matrix = _rolled(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), axis)
        return changed(recording, **{role: values @ matrix.T})

    return put


def angle(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """Of a mounting, to 2° or the interval; the sensors have some of their own."""
    return near(size, finding, 0.1, 3.0)


def late(role: str, sign: float = 1.0) -> Callable[[Recording, float, int], Recording | None]:
    """A sensor whose readings come ``size`` ms late."""

    def put(recording: Recording, size: float, axis: int) -> Recording | None:
        values = getattr(recording, role)
        if values is None:
            return None
        known = np.isfinite(values).all(axis=1)
        t = recording.t
        moved = np.stack([np.interp(t - 1e-3 * size, t[known], one) for one in values[known].T], axis=1)
        moved[~known] = np.nan
        return changed(recording, **{role: moved})

    return put


def delayed(role: str, sign: float) -> Callable[[Finding, float, int, Clean], bool]:
    """The delay, beside that which the clean recording had."""

    def check(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
        own = 1e3 * clean.delay(role)
        return near(sign * size, finding, 0.15, 6.0) or near(own + sign * size, finding, 0.15, 6.0)

    return check


def clock(recording: Recording, size: float, axis: int) -> Recording:
    """A rate that is ``size`` times too high."""
    return changed(recording, t=recording.t / size)


def clock_checked(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """The turn in the time that the stamps say."""
    return scaled(finding, 1.0 / size, axis, clean) and (isinstance(finding, Measurement) or "clock" in finding.what)


def low_passed(recording: Recording, size: float, axis: int) -> Recording:
    """The accelerometer through a first-order filter of ``size`` Hz."""
    share = 1.0 - np.exp(-2.0 * np.pi * size / recording.rate)
    acc = np.array(recording.acc)
    for i in range(1, len(acc)):
        acc[i] = acc[i - 1] + share * (acc[i] - acc[i - 1])
    return changed(recording, acc=acc)


def frequency(finding: Finding | Measurement, size: float, axis: int, clean: Clean) -> bool:
    """Of a filter, within a factor of 1.5 or its interval; or a delay, whose interval holds the filter's."""
    if isinstance(finding, Measurement):
        return near(1e3 / (2.0 * np.pi * size), finding)
    return finding.value is not None and (near(size, finding) or 1 / 1.5 < finding.value / size < 1.5)


def stuck(role: str) -> Callable[[Recording, float, int], Recording | None]:
    """An axis that stands still from a share of the recording on."""

    def put(recording: Recording, size: float, axis: int) -> Recording | None:
        values = np.array(getattr(recording, role))
        first = int(size * len(values))
        values[first:, axis] = values[first, axis]
        return changed(recording, **{role: values})

    return put


def sensor_axis(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """The right axis."""
    return f"'s {'xyz'[axis]}" in finding.what


def jumped(recording: Recording, size: float, axis: int) -> Recording:
    """A bias that jumps by ``size`` deg/s halfway."""
    gyr = np.array(recording.gyr)
    gyr[len(gyr) // 2 :, axis] += np.radians(size)
    return changed(recording, gyr=gyr)


def biased(recording: Recording, size: float, axis: int) -> Recording:
    """A constant bias in deg/s."""
    return changed(recording, gyr=recording.gyr + np.radians(size) * np.eye(3)[axis])


def bias_checked(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """The largest bias, to a quarter or 1 deg/s, with what was there before."""
    return near(size, finding, 0.25, 1.0)


def iron(recording: Recording, size: float, axis: int) -> Recording | None:
    """Iron of ``size`` % of the field that turns with the sensor."""
    if recording.mag is None:
        return None
    usual = float(np.nanmedian(np.linalg.norm(recording.mag, axis=1)))
    return changed(recording, mag=recording.mag + 0.01 * size * usual * np.eye(3)[axis])


def iron_checked(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """Percent of the field, to a quarter, with the iron that was there before."""
    if "mag" not in clean.seen:
        return near(size, finding, 0.25, 6.0)
    fitted, segments = clean.seen["mag"].fit, clean.seen["mag"].segments
    strength = float(np.sqrt(((segments.vector - fitted.iron) ** 2).sum(axis=-1).mean()))
    both = fitted.iron + 0.01 * size * clean.field * np.eye(3)[axis]
    return near(100.0 * float(np.linalg.norm(both)) / strength, finding, 0.25, 6.0)


def shape_checked(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """Percent by which an axis is longer, to a quarter, with the shape that was there before."""
    own = np.eye(3) + (clean.seen["mag"].fit.shape if "mag" in clean.seen else 0.0)
    values = np.linalg.svd(own @ np.diag(1.0 / (1.0 + 0.01 * size * np.eye(3)[axis])), compute_uv=False)
    return near(size, finding, 0.25, 6.0) or near(100.0 * (values[0] / values[-1] - 1.0), finding, 0.25, 6.0)


def soft_iron(recording: Recording, size: float, axis: int) -> Recording | None:
    """One axis is ``size`` % longer."""
    if recording.mag is None:
        return None
    return changed(recording, mag=recording.mag * (1.0 + 0.01 * size * np.eye(3)[axis]))


def clipped(role: str) -> Callable[[Recording, float, int], Recording | None]:
    """A range that ends at a share of the largest reading (of an accelerometer, between that and 1 g)."""

    def put(recording: Recording, size: float, axis: int) -> Recording | None:
        values = getattr(recording, role)
        top = float(np.nanquantile(np.abs(values), 1.0 - 0.2 * (1.0 - size)))
        if role == "acc":
            top = max(top, 18.0)
            if (np.abs(values) > top).sum() < 40:
                return None
        return changed(recording, **{role: values.clip(-top, top)})

    return put


def gravity_removed(recording: Recording, size: float, axis: int) -> Recording | None:
    """What a phone calls linear acceleration: gravity of the default filter's own attitude taken off."""
    quat = fuse(recording).quat
    return changed(recording, acc=recording.acc - 9.80665 * rotate(conjugate(quat), np.tile(UP, (len(quat), 1))))


def dropped(recording: Recording, size: float, axis: int) -> Recording:
    """Ten gaps of ``size`` s."""
    keep = np.ones(len(recording), dtype=bool)
    for start in np.linspace(0.05, 0.9, 10):
        first = int(start * len(recording))
        keep[first : first + round(size * recording.rate)] = False
    return changed(recording, **{name: None if (v := getattr(recording, name)) is None else v[keep] for name in PARTS})


def acc_scaled(recording: Recording, size: float, axis: int) -> Recording:
    """An accelerometer that reads ``size`` times the force."""
    return changed(recording, acc=size * recording.acc)


def gyr_scaled(recording: Recording, size: float, axis: int) -> Recording:
    """A gyroscope that reads ``size`` times the rate."""
    return changed(recording, gyr=size * recording.gyr)


def acc_scale_checked(finding: Finding, size: float, axis: int, clean: Clean) -> bool:
    """The scale, times that which the clean recording had."""
    return near(size * clean.own("acc_scale"), finding, 0.03)


def held(recording: Recording, size: float, axis: int) -> Recording:
    """Every reading is written ``size`` times."""
    rows = (np.arange(len(recording)) // int(size)) * int(size)
    return changed(recording, gyr=recording.gyr[rows], acc=recording.acc[rows])


ONE, SWAP, CYCLE = np.diag([-1.0, 1.0, 1.0]), np.eye(3)[[1, 0, 2]], np.eye(3)[[1, 2, 0]]
SCALE = ("gyro_scale", "unit_header_wrong")
WIRING = ("axes_order", "gyro_inverted")
FAULTS = (
    Fault("gyroscope × 2", (2.0,), gyr_scaled, SCALE, scaled),
    Fault("gyroscope × 0.5", (0.5,), gyr_scaled, SCALE, scaled),
    Fault("gyroscope, neighbour's sensitivity", (1.147, 0.872), gyr_scaled, SCALE, scaled),
    Fault("gyroscope × 1.1", (1.1, 0.9), gyr_scaled, SCALE, scaled),
    Fault("gyroscope deg/s for rad/s", (57.2958,), gyr_scaled, SCALE, scaled),
    Fault("clock × 2", (2.0,), clock, SCALE, clock_checked),
    Fault("clock × 0.5", (0.5,), clock, SCALE, clock_checked),
    Fault("gyroscope axis reversed", (1.0,), multiply("gyr", ONE), WIRING, mends("gyr", ONE)),
    Fault("gyroscope inverted", (1.0,), multiply("gyr", -np.eye(3)), WIRING, mends("gyr", -np.eye(3))),
    Fault("gyroscope axes swapped", (1.0,), multiply("gyr", SWAP), WIRING, mends("gyr", SWAP)),
    Fault("gyroscope axes in a cycle", (1.0,), multiply("gyr", CYCLE), WIRING, mends("gyr", CYCLE)),
    Fault("accelerometer axis reversed", (1.0,), multiply("acc", ONE), WIRING, mends("acc", ONE)),
    Fault("accelerometer axes swapped", (1.0,), multiply("acc", SWAP), WIRING, mends("acc", SWAP)),
    Fault("accelerometer axes in a cycle", (1.0,), multiply("acc", CYCLE), WIRING, mends("acc", CYCLE)),
    Fault("accelerometer askew", (5.0, 15.0, 30.0), turned("acc"), ("mounting",), angle),
    Fault("gyroscope askew", (5.0, 15.0, 30.0), turned("gyr"), ("mounting",), angle),
    Fault("accelerometer low-passed", (0.5, 0.3, 1.0), low_passed, ("acc_low_passed",), frequency, "sensor_delay"),
    Fault("accelerometer without gravity", (1.0,), gravity_removed, ("gravity_removed",), whatever),
    Fault("accelerometer scale", (1.05, 0.93, 1.1), acc_scaled, ("acc_scale",), acc_scale_checked),
    Fault("accelerometer axis stuck", (0.0, 0.5), stuck("acc"), ("stuck_acc",), sensor_axis),
    Fault("gyroscope axis stuck", (0.0, 0.5), stuck("gyr"), ("stuck_gyr",), sensor_axis),
    Fault("gyroscope bias", (5.0, 10.0), biased, ("gyro_bias",), bias_checked),
    Fault("gyroscope bias jumps", (5.0, 3.0), jumped, ("bias_jumps",), lambda f, s, a, c: near(s, f, 0.3)),
    Fault("gyroscope late", (40.0, 80.0), late("gyr"), ("sensor_delay",), delayed("acc", -1.0)),
    Fault("magnetometer late", (40.0, 100.0, 20.0, 10.0), late("mag"), ("mag_delay",), delayed("mag", 1.0)),
    Fault("hard iron", (100.0, 30.0, 300.0, 10.0), iron, ("mag_offset",), iron_checked),
    Fault("soft iron", (50.0, 25.0), soft_iron, ("mag_shape",), shape_checked),
    Fault("magnetometer axis reversed", (1.0,), multiply("mag", ONE), ("mag_axes",), mends("mag", ONE)),
    Fault("magnetometer axes swapped", (1.0,), multiply("mag", SWAP), ("mag_axes",), mends("mag", SWAP)),
    Fault("gyroscope clipped", (0.5, 0.9), clipped("gyr"), ("clipping_gyr",), whatever),
    Fault("accelerometer clipped", (0.5,), clipped("acc"), ("clipping_acc",), whatever),
    Fault("rows dropped", (0.3, 1.0), dropped, ("gaps",), whatever),
    Fault("rows held", (2.0, 4.0), held, ("held_samples",), whatever),
)  # fmt: skip


def tilt_error(recording: Recording, quat: Array, ok: Array) -> float:
    """The rms tilt in deg of the default filter against the reference, after 5 s."""
    track = fuse(recording)
    rows = ok & np.isfinite(track.quat).all(axis=1) & (track.t > track.t[0] + 5.0)
    up = [rotate(conjugate(one[rows]), np.tile(UP, (int(rows.sum()), 1))) for one in (track.quat, quat)]
    off = np.arccos(np.clip((up[0] * up[1]).sum(axis=1), -1.0, 1.0))
    return float(np.degrees(np.sqrt((off**2).mean())))


def judge(fault: Fault, size: float, axis: int, report: Report, clean: Clean) -> tuple[str, str]:
    """("right", "wrong", "not told" or "missed", and what was said)."""
    usual = {one.name for one in clean.report.findings}
    fresh = [one for one in report.findings if one.name not in usual or one.name in fault.named]
    named = [one for one in fresh if one.name in fault.named]
    if any(fault.check(one, size, axis, clean) for one in named):
        return "right", ""
    loud = [one for one in fresh if one.severity != "note"]
    if loud:
        return "wrong", "; ".join(f"{one.name}: {one.what}" for one in loud[:2])
    hidden = any(fault.is_hidden(one, size, axis, clean) for one in report.measured)
    said = "; ".join(one.what for one in named[:1])
    return ("not told" if hidden or report.names() & UNTOLD else "missed"), said


def folder(path: Path) -> list[tuple[str, Known]]:
    """The recordings of a folder; those without a reference count for the names only."""
    if not path.is_dir():
        raise LevelheadError(f"{path} is no folder; expected one with recordings")
    found = []
    for file in sorted(one for one in path.rglob("*") if one.is_file()):
        try:
            recording = lh.read(file)
        except LevelheadError:
            continue
        quat = np.zeros((len(recording), 4)) if recording.truth is None else np.nan_to_num(recording.truth.quat)
        found.append((file.stem, Known(recording, quat, np.abs(quat).sum(axis=1) > 0.5, False)))
    return found


def cropped(known: Known, seconds: float) -> Known:
    """Its middle."""
    count = min(len(known.recording), int(seconds * known.recording.rate))
    first = (len(known.recording) - count) // 2
    rows = slice(first, first + count)
    return Known(known.recording[rows], known.quat[rows], known.ok[rows], known.disturbed)


def main() -> None:
    """Prints each fault that is not named rightly, and the tables."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("dir", type=Path, nargs="?")
    parser.add_argument("--share", type=int, default=1)
    parser.add_argument("--half", type=int)
    parser.add_argument("--only", default="")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--every", type=int, default=1)
    options = parser.parse_args()
    if not native.up_to_date():
        raise LevelheadError(
            "without a native engine of these sources the doctor judges by fewer rows; run make native"
        )
    every = folder(options.dir) if options.dir else recordings()
    if options.half is not None:
        sets = sorted({name.partition("/")[0] for name, _ in every})
        every = [one for one in every if sets.index(one[0].partition("/")[0]) % 2 == options.half]
    table: dict[str, Counter[str]] = defaultdict(Counter)
    ratios: dict[str, list[float]] = defaultdict(list)
    alarms: Counter[str] = Counter()
    for i, (name, whole) in list(enumerate(every))[:: options.every]:
        known = cropped(whole, options.seconds)
        report = examine(changed(known.recording), name)
        seen = {one.role: one for one in agree(known.recording).seen}
        mag = known.recording.mag
        field = 0.0 if mag is None else float(np.nanmedian(np.linalg.norm(mag, axis=1)))
        clean = Clean(report, seen, field)
        alarms.update(f"{one.name} ({one.severity})" for one in clean.report.findings if one.severity != "note")
        print(f"{name}: {[one.name for one in clean.report.findings if one.severity != 'note']}", flush=True)
        for j, fault in enumerate(FAULTS):
            if (i + j) % options.share or options.only not in fault.name:
                continue
            size, axis = fault.sizes[(i // options.share) % len(fault.sizes)], (i + j) % 3
            faulty = fault.put(known.recording, size, axis)
            if faulty is None:
                continue
            report = examine(faulty, name)
            verdict, said = judge(fault, size, axis, report, clean)
            table[fault.name][verdict] += 1
            words = ""
            if len(faulty) == len(known.ok) and known.ok.sum() > 100:
                true, expected = tilt_error(faulty, known.quat, known.ok), report.sigma_tilt
                if expected:
                    ratios[fault.name].append(true / expected)
                words = f"tilt {true:.1f}°, expected {expected or np.nan:.1f}°"
            if verdict != "right" or ("tilt" in words and not 0.5 <= ratios[fault.name][-1] <= 2.0):
                print(f"  {fault.name} {size:g} {'xyz'[axis]}: {verdict} {words} {said}", flush=True)
    _print(table, ratios, alarms, len(every[:: options.every]))


def _print(table: dict[str, Counter[str]], ratios: dict[str, list[float]], alarms: Counter[str], count: int) -> None:
    kinds = ("right", "wrong", "missed", "not told")
    header = " ".join(f"{kind:>8}" for kind in kinds)
    print(f"\n{'fault':36} {header}  true tilt over expected: least … most")
    total: Counter[str] = Counter()
    for fault in FAULTS:
        row = table.get(fault.name)
        if row is None:
            continue
        total.update(row)
        some = ratios[fault.name]
        ends = f"{min(some):6.2f} … {max(some):5.2f}" if some else ""
        print(f"{fault.name:36} " + " ".join(f"{row[kind]:8}" for kind in kinds) + f"    {ends}")
    every = sum(total.values())
    shares = ", ".join(f"{kind} {100 * total[kind] / max(1, every):.0f} %" for kind in kinds)
    told = 100 * total["right"] / max(1, every - total["not told"])
    print(f"{every} faults: {shares}; of those that the motion tells, right {told:.0f} %")
    values = np.array([one for some in ratios.values() for one in some])
    if len(values):
        within = 100 * ((values >= 0.5) & (values <= 2.0)).mean()
        print(f"verdict within a factor of two of the true tilt: {within:.0f} %; beyond twice: {(values > 2.0).sum()}")
    print(f"clean recordings: {count}, warnings {dict(alarms)}")


if __name__ == "__main__":
    run_script(main)
