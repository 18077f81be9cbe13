"""Builds the pages that run in the browser alone, as static files: the lesson, a phone, and a log that is dropped.

python web/try_page.py build/site/try [FILTER …]    after `make page`

Each filter, or those that are named, becomes a module for WebAssembly (clang and lld). With them alone plain.html reads
a CSV of plain columns. index.html reads what levelhead reads: it needs Python in the browser, so it is built where
PYODIDE_DIST holds NumPy for Pyodide. The runtime is that of npm. Its lock file has the hash of NumPy's wheel, which
only a release of Pyodide holds.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np

from levelhead import filters, units
from levelhead.cli import main
from levelhead.open_types import JsonObject
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.browser import MOTION
from levelhead.publish.dashboard.description import filter_description, filter_names, health_names
from levelhead.simulate import recording as simulate
from levelhead.simulate.lesson import GYR_NOISE, INTERVAL, lesson
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.sources.hints import QUANTITY
from levelhead.sources.interpret.clock_choice import LONGEST_UPTIME
from levelhead.sources.names.column_name import understand
from levelhead.sources.names.vocabulary import LETTERS, TIMES, WORDS
from levelhead.track import is_relative

WEB = Path(__file__).resolve().parent
SOURCE = WEB.parent / "src"
RUNTIME = ("pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json")
PHONE = "ESKF"  # the filter that the phone has beside those of the lesson


def build(target: Path, release: Path | None, names: list[str]) -> None:
    """Writes the pages; ``release``: folder with the packages of a release of Pyodide."""
    subprocess.run(["node", "build.mjs", "try", str(target.resolve())], cwd=WEB, check=True)
    export_filters(target / "lesson", ["GyroIntegration", "Complementary", "Kalman"], "--guard", "off")
    (target / "lesson.bin").write_bytes(lesson_block())
    export_filters(target / "filters", list(dict.fromkeys([PHONE, *names])))
    (target / "filters" / "facts.json").write_text(json.dumps(facts(), allow_nan=False))
    sensor, motion, duration, rate = MOTION
    write_csv(replace(simulate(sensor, motion, duration=duration, rate=rate), truth=None), target / "hand.csv")
    if release is None:
        for name in ("index.html", "python.js", "worker.js"):
            (target / name).unlink()
    else:
        add_python(target, release)


def add_python(target: Path, release: Path) -> None:
    """The rest of the page that reads what levelhead reads: Python, NumPy and levelhead."""
    npm, folder = WEB / "node_modules" / "pyodide", target / "pyodide"
    folder.mkdir()
    for name in RUNTIME:
        shutil.copy(npm / name, folder)
    numpy = json.loads((npm / "pyodide-lock.json").read_text())["packages"]["numpy"]
    wheel = release / numpy["file_name"]
    if not wheel.is_file() or hashlib.sha256(wheel.read_bytes()).hexdigest() != numpy["sha256"]:
        sys.exit(f"{wheel} is missing, or its hash is not {numpy['sha256']}; see docs/howto/browser.md")
    shutil.copy(wheel, folder)
    with (target / "licences.txt").open("a") as licences:
        licences.write(f"\n{'-' * 80}\n\npyodide, MPL-2.0, with CPython (PSF-2.0) and NumPy (BSD-3-Clause)\n")
    with zipfile.ZipFile(target / "levelhead.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted((SOURCE / "levelhead").rglob("*")):
            if path.is_file() and path.suffix in {".py", ".txt"}:
                archive.write(path, path.relative_to(SOURCE))


def export_filters(folder: Path, names: list[str], *options: str) -> None:
    """Writes a package for each filter, and which folder holds which."""
    folder.mkdir()
    for name in names:
        with redirect_stdout(StringIO()):
            if main(["export", "--wasm", "-o", str(folder), *options, name]) != 0:
                sys.exit(f"{name} was not exported")
        next(path for path in folder.iterdir() if path.name.replace("-", "") == f"lh{name.lower()}").rename(
            folder / f"lh-{name.lower()}"
        )
    (folder / "index.json").write_text(json.dumps({name: f"lh-{name.lower()}" for name in names}))


def facts() -> JsonObject:
    """What a page without Python takes from it: filters with the default first, health, names of columns, units."""
    default = filters.default()
    known = sorted(filter_names(), key=lambda one: one["name"] != type(default).__name__)
    described = []
    for one in known:
        params = filters.find(one["name"]).params()
        described.append(
            one | filter_description(params) | {"relative": [is_relative(params, has_mag) for has_mag in (False, True)]}
        )
    return {
        "filters": described, "health": health_names(), "names": column_names(), "uptime": LONGEST_UPTIME,
        "units": {role: units.FACTORS[quantity] for role, quantity in QUANTITY.items()},
        "usual": {role: units.USUAL[quantity] for role, quantity in QUANTITY.items()},
    }  # fmt: skip


def column_names() -> dict[str, tuple[str, int]]:
    """Names of columns, in lower case and without signs, that the reader understands by themselves: role and axis."""
    found = {word: ("t", 0) for word in TIMES if understand(word).role == "t"}
    for role in ("gyr", "acc", "mag"):
        for word in WORDS[role] | LETTERS[role]:
            for axis, letter in enumerate("xyz"):
                name = understand(f"{word}_{letter}")
                if (name.role, name.axis) == (role, letter):
                    found[word + letter] = (role, axis)
    return found


def lesson_block() -> bytes:
    """The lesson in its parts, so that the page can give each error another size; ° and °/s."""
    plain, noisy = (lesson(accel_noise=size, bias_walk=size) for size in (0.0, 1.0))
    angle = np.degrees(2.0 * np.arctan2(plain.truth.quat[:, 1], plain.truth.quat[:, 0]))
    accel, accel_noisy = (np.degrees(np.arctan2(one.acc[:, 1], one.acc[:, 2])) for one in (plain, noisy))
    rate = np.gradient(angle, INTERVAL)
    columns = {
        "t": plain.t, "angle": angle, "accel": accel, "accel_unit": accel_noisy - accel, "rate": rate,
        "rate_unit": (np.degrees(plain.gyr[:, 0]) - rate) / GYR_NOISE, "bias_unit": np.degrees(noisy.truth.bias[:, 0]),
    }  # fmt: skip
    return pack_block({}, columns)


if __name__ == "__main__":
    release = os.environ.get("PYODIDE_DIST")
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    build(Path(sys.argv[1]), Path(release) if release else None, sys.argv[2:] or [flt.name for flt in filters.ALL])
