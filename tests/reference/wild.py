"""The verdict on a real log, number by number against an independent decoder."""

import re
import shlex
from pathlib import Path

import numpy as np
from tests.reference.wild_decoders import DECODERS, Expected, Stream

import levelhead as lh
from levelhead.recording import Recording
from levelhead.sources import parse_counts, parse_map, parse_units

PACE = 0.03  # by which the length of a step may differ: clocks are smoothed
AHEAD = 400  # rows of the decoder among which the reader's next row is looked for
COMMAND = re.compile(r"levelhead fuse (.+?)$", re.DOTALL)


def judge(path: Path, entry: dict) -> tuple[str, str]:
    """(verdict, why)."""
    fusable = entry["fusable"] is True or entry["fusable"] == "only after reassembly"
    try:
        recording = lh.read(path)
    except lh.LevelheadError as error:
        if not fusable:
            return "refused", str(error)
        return _by_command(path, entry, str(error))
    except Exception as error:  # a traceback is what a user would see
        return "dead end", f"{type(error).__name__}: {error}"
    if not fusable:
        return "WRONG", f"read, but it cannot be fused: {entry['must_do']}"
    wrong = compare(recording, DECODERS[entry["file"]](path))
    guesses = [note for note in recording.meta["notes"] if "guess" in note]
    if wrong:
        return ("guess" if guesses else "WRONG"), f"{wrong} {' | '.join(guesses)}"
    return ("guess" if guesses else "right"), " | ".join(guesses) or f"{recording!r}"


def _by_command(path: Path, entry: dict, message: str) -> tuple[str, str]:
    found = COMMAND.search(message)
    if found is None:
        return "dead end", message
    try:
        recording = run(found.group(1))
    except lh.LevelheadError as error:
        return "dead end", f"{message} -> {error}"
    wrong = compare(recording, DECODERS[entry["file"]](path), pace="--rate" not in found.group(1))
    return ("dead end" if wrong else "command"), f"{message} {wrong}"


def run(command: str) -> Recording:
    """What the command line of a message reads."""
    words = shlex.split(command)
    given: dict[str, list[str]] = {}
    i = 1
    while i < len(words):
        if i + 1 >= len(words):
            raise lh.LevelheadError(f"the command ends with {words[i]}")
        given.setdefault(words[i].removeprefix("--"), []).append(words[i + 1])
        i += 2
    options: dict = {}
    for name, parse in (("map", parse_map), ("units", parse_units), ("counts", parse_counts)):
        if name in given:
            options[name] = parse(given[name])
    for name in ("sensor", "session"):
        if name in given:
            options[name] = given[name][0] if name == "sensor" else int(given[name][0])
    if "rate" in given:
        options["rate"] = float(given["rate"][0])
    return lh.read(words[0], **options)


def compare(recording: Recording, expected: Expected, pace: bool = True) -> str:
    """What is not as it should be; "" if all is."""
    rows = matches(recording.gyr, expected.gyr.values)
    found = rows >= 0
    if found.mean() < 0.95:
        share = 100 * found.mean()
        return f"gyroscope: {share:.0f} % of the rows are the decoder's ({scales(recording.gyr, expected.gyr)})"
    if found.sum() < 0.6 * len(expected.gyr.values) and "session" not in " ".join(recording.meta["notes"]):
        return f"gyroscope: {found.sum()} of {len(expected.gyr.values)} rows"
    stamps = expected.gyr.t[rows[found]]
    said, real = np.diff(recording.t[found]), np.diff(stamps)
    forward = (real > 0) & (real < 10 * np.median(real))
    if pace and abs(said[forward].sum() / real[forward].sum() - 1.0) > PACE:
        return f"time: runs {said[forward].sum() / real[forward].sum():.4g} times as fast"
    return _acc(recording.acc[found], stamps, expected.acc)


def _acc(acc: np.ndarray, stamps: np.ndarray, expected: Stream) -> str:
    same = len(stamps) and len(np.intersect1d(stamps, expected.t)) > 0.9 * len(np.unique(stamps))
    order = np.argsort(expected.t, kind="stable")
    if same:
        real = (
            expected.values[np.searchsorted(expected.t[order], stamps).clip(0, len(order) - 1)]
            if (np.diff(expected.t) > 0).all()
            else None
        )
        if real is None:
            return (
                ""
                if np.isfinite(acc).mean() > 0.5 and _typical(acc, expected.values)
                else "accelerometer: other numbers"
            )
    else:
        real = np.column_stack([np.interp(stamps, expected.t[order], expected.values[order, i]) for i in range(3)])
    off = np.linalg.norm(acc - real, axis=1)
    off = off[np.isfinite(off)]
    if len(off) < 0.5 * len(acc):
        return f"accelerometer: {len(acc) - len(off)} of {len(acc)} rows are missing"
    limit = 0.003 * np.nanmedian(np.linalg.norm(real, axis=1)) + (0.0 if same else 0.1)
    if np.median(off) > limit or np.quantile(off, 0.9) > 10 * limit + (0.0 if same else 3.0):
        return f"accelerometer: off by {np.median(off):.3g} m/s² in the median ({_ratio(acc, real)})"
    return ""


def _typical(acc: np.ndarray, values: np.ndarray) -> bool:
    mine, theirs = np.nanmedian(acc, axis=0), np.nanmedian(values, axis=0)
    return bool(np.allclose(mine, theirs, atol=0.5))


def _ratio(acc: np.ndarray, real: np.ndarray) -> str:
    return "ratio " + ", ".join(
        f"{np.nansum(acc[:, i] * real[:, i]) / np.nansum(real[:, i] ** 2):.4g}" for i in range(3)
    )


def scales(values: np.ndarray, expected: Stream) -> str:
    """The median lengths of both."""
    mine, theirs = (np.nanmedian(np.linalg.norm(one, axis=1)) for one in (values, expected.values))
    return f"median {mine:.4g}, expected {theirs:.4g}"


def matches(values: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """For each row the next row of the decoder with the same numbers, -1 if there is none."""
    size = np.nanmedian(np.abs(expected)) + 1e-12
    rows, at = np.full(len(values), -1), 0
    for i, row in enumerate(values):
        near = np.abs(expected[at : at + AHEAD] - row).max(axis=1) < 1e-4 * size + 2e-5 * np.abs(row).max()
        if near.any():
            rows[i] = at + int(near.argmax())
            at = rows[i] + 1
        elif i == 0 or (rows[:i] < 0).all():  # another session: look everywhere
            near = np.abs(expected - row).max(axis=1) < 1e-4 * size
            if near.any():
                rows[i] = int(near.argmax())
                at = rows[i] + 1
    return rows
