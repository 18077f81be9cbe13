"""Mutated logs of all formats, and the outcome of reading one."""

import os
import random
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import levelhead as lh
from levelhead.publish.progress import progress
from levelhead.recording import Recording
from levelhead.sources.formats import npz
from levelhead.sources.formats.csv_writer import write_csv

LONGEST = 20.0  # s
LARGEST = 250_000  # bytes of a seed
FACTORS = (180.0 / np.pi, np.pi / 180.0, 1e3, 1e-3, 9.80665, 1.0 / 9.80665)
UNITS = (b"rad/s", b"deg/s", b"m/s", b"[g]", b"(g)", b"ms", b"us", b"uT", b"dps")
WORDS = (
    (b"time", b"Zeit"),
    (b"gyr", b"Drehrate"),
    (b"acc", b"Beschleunigung"),
    (b"x", b"\xd7"),
    (b"t", b"\xe6\x97\xb6"),
)


def flip(raw: bytes, rng: random.Random) -> bytes:
    """Some bytes changed."""
    found = bytearray(raw)
    for _ in range(rng.choice((1, 3, 20))):
        found[rng.randrange(len(found))] = rng.randrange(256)
    return bytes(found)


def tear(raw: bytes, rng: random.Random) -> bytes:
    """Parts of lines missing."""
    found = raw
    for _ in range(rng.choice((1, 2, 8))):
        at = rng.randrange(len(found))
        found = found[:at] + found[min(len(found), at + rng.randrange(1, 60)) :]
    return found


def cut(raw: bytes, rng: random.Random) -> bytes:
    """The end or the start missing."""
    at = rng.randrange(1, len(raw))
    return raw[:at] if rng.random() < 0.7 else raw[at:]


def repeat(raw: bytes, rng: random.Random) -> bytes:
    """A part twice."""
    a = rng.randrange(len(raw))
    b = min(len(raw), a + rng.randrange(1, 4000))
    return raw[:b] + raw[a:]


def swap(raw: bytes, rng: random.Random) -> bytes:
    """Two columns exchanged, of a text with commas."""
    rows = [line.split(b",") for line in raw.split(b"\n")]
    width = max(map(len, rows))
    if width < 3:
        return raw[::-1]
    i, j = rng.sample(range(width), 2)
    for row in rows:
        if len(row) == width:
            row[i], row[j] = row[j], row[i]
    return b"\n".join(b",".join(row) for row in rows)


def rename(raw: bytes, rng: random.Random) -> bytes:
    """Another unit in the header."""
    head, rest = raw[:400], raw[400:]
    return head.replace(rng.choice(UNITS), rng.choice(UNITS)) + rest


def translate(raw: bytes, rng: random.Random) -> bytes:
    """Other words in the header."""
    head, rest = raw[:400], raw[400:]
    old, new = rng.choice(WORDS)
    return head.replace(old, new) + rest


HARMLESS = {"tear", "cut", "repeat", "rename", "translate"}  # numbers stay what they were


MUTATIONS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "flip": flip, "tear": tear, "cut": cut, "repeat": repeat, "swap": swap, "rename": rename, "translate": translate,
}  # fmt: skip


def seeds(folder: Path) -> list[Path]:
    """Small logs of every format that can be written here, and of wild/."""
    made = lh.simulate.recording("MPU-6050", "hand", duration=4.0, seed=1)
    write_csv(made, folder / "plain.csv")
    npz.write_npz(made, folder / "own.npz")
    text = (folder / "plain.csv").read_text()
    (folder / "semicolon.csv").write_text(text.replace(",", ";").replace(".", ","))
    (folder / "tabs.txt").write_text("// Update Rate: 100.0Hz\n" + text.replace(",", "\t"))
    table = np.column_stack([made.t, made.gyr, made.acc])
    words = [
        f"t={a:.3f} gx={b:.4f} gy={c:.4f} gz={d:.4f} ax={e:.3f} ay={f:.3f} az={g:.3f}" for a, b, c, d, e, f, g in table
    ]
    (folder / "words.log").write_text("\n".join(words))
    np.savetxt(folder / "bare.csv", table, "%.5f", ",")
    lines = [f'{{"t": {row[0]}, "gyr": {row[1:4].tolist()}, "acc": {row[4:].tolist()}}}' for row in table]
    (folder / "lines.jsonl").write_text("\n".join(lines))
    import scipy.io

    scipy.io.savemat(folder / "arrays.mat", {"gyr": made.gyr, "acc": made.acc, "t": made.t})
    found = sorted(path for path in folder.iterdir() if path.is_file())
    wild = Path(os.environ.get("LEVELHEAD_DATA", "")) / "wild"
    if wild.is_dir():
        found += [path for path in sorted(wild.iterdir()) if path.is_file() and path.stat().st_size < LARGEST
                  and path.suffix not in {".json", ".bag"}]  # fmt: skip
    return found


def reading(path: Path) -> Recording | str:
    """What the reader makes of a file: a recording, or the sentence of its error."""
    try:
        return lh.read(path)
    except lh.LevelheadError as error:
        return str(error)


def silently_wrong(recording: Recording, seed: Recording | str) -> bool:
    """Whether rates, accelerations or steps of time differ by a factor from the seed's, and no note says "a guess"."""
    if isinstance(seed, str) or any("guess" in note for note in recording.meta.get("notes", ())):
        return False
    if any(_by_factor(getattr(recording, role), getattr(seed, role)) for role in ("gyr", "acc")):
        return True
    if min(len(recording), len(seed)) < 20:
        return False
    pace = float(np.median(np.diff(recording.t)) / np.median(np.diff(seed.t)))
    return not 1.0 / 30.0 < pace < 30.0


def _by_factor(values: np.ndarray, original: np.ndarray) -> bool:
    """Whether rows of (n, 3) values are rows of the original times a factor between units."""
    rows = values[np.isfinite(values).all(axis=1) & (values != 0.0).any(axis=1)]
    rows = rows[:: max(1, len(rows) // 40)][:40]
    theirs = original[np.isfinite(original).all(axis=1)]
    if len(rows) == 0 or len(theirs) == 0:
        return False
    size = np.abs(rows).max(axis=1, keepdims=True)
    same = [float((np.abs(theirs[None] - rows[:, None] * factor).max(axis=2) < 1e-5 * size * factor).any(axis=1).mean())
            for factor in (1.0, *FACTORS)]  # fmt: skip
    return max(same[1:]) > 0.5 > same[0]


def mutate(originals: list[Path], seed: int, number: int) -> tuple[Path, str, bytes]:
    """The file, the mutation and the bytes of one number; the same whenever it is called, whatever came before."""
    rng = random.Random(f"{seed}:{number}")
    path = rng.choice(originals)
    kind = rng.choice(list(MUTATIONS))
    return path, kind, MUTATIONS[kind](path.read_bytes(), rng)


class Hang(BaseException):
    """A reading took too long. No ``Exception``: readers try format after format and would take it for a refusal."""


def outcome(target: Path, kind: str, original: Recording | str) -> str:
    """What became of a mutated file; in capitals what must not be."""
    signal.alarm(int(LONGEST))
    try:
        found = reading(target)
    except Hang:
        return "HANG"
    except Exception as error:
        return f"TRACEBACK {type(error).__name__}: {str(error)[:80]}"
    finally:
        signal.alarm(0)
    if isinstance(found, str):
        return "NO SENTENCE" if "\n" in found or len(found) > 2000 else "refused"
    if not np.isfinite(found.t).all():
        return "NAN"
    return "WRONG UNIT" if kind in HARMLESS and silently_wrong(found, original) else "read"


def run(seed: int, numbers: Sequence[int], keep: Path | None = None) -> Counter[str]:
    """Outcomes by name; what must not be is printed with the command that does it again."""
    outcomes: Counter[str] = Counter()
    signal.signal(signal.SIGALRM, _hang)
    with tempfile.TemporaryDirectory() as name, progress("reading") as report:
        folder = Path(name)
        originals = seeds(folder)
        read: dict[Path, Recording | str] = {}
        for done, number in enumerate(numbers):
            report(done / len(numbers))
            path, kind, mutated = mutate(originals, seed, number)
            target = (keep or folder) / f"mutated{path.suffix}"
            target.write_bytes(mutated)
            if path not in read:
                read[path] = reading(path)
            began = time.monotonic()
            found = outcome(target, kind, read[path])
            if found.split()[0].isupper() or keep is not None:
                print(
                    f"{path.name} {kind}: {found} ({time.monotonic() - began:.1f} s): "
                    f"python -m benchmarks.reader.fuzz --replay {seed}:{number} --keep .",
                    flush=True,
                )
            outcomes[found] += 1
    return outcomes


def _hang(*_: object) -> None:
    raise Hang
