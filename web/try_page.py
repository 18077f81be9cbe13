"""Builds the pages that run in the browser alone, as static files: the lesson, a phone, and a log that is dropped.

python web/try_page.py build/site/try [FILTER …]    after `make page`

The page for a log needs Python in the browser, so it is built where PYODIDE_DIST holds NumPy for Pyodide. Each filter,
or those that are named, becomes a module for WebAssembly (clang and lld); any other runs in plain Python. Pyodide's
runtime is that of npm. Its lock file has the hash of NumPy's wheel, which only a release of Pyodide holds.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np

from levelhead import filters
from levelhead.publish.dashboard.block import pack_block
from levelhead.simulate.lesson import GYR_NOISE, INTERVAL, lesson

WEB = Path(__file__).resolve().parent
SOURCE = WEB.parent / "src"
RUNTIME = ("pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json")


def build(target: Path, release: Path | None, names: list[str]) -> None:
    """Writes the pages; ``release``: folder with the packages of a release of Pyodide."""
    subprocess.run(["node", "build.mjs", "try", str(target.resolve())], cwd=WEB, check=True)
    export_filters(target / "lesson", ["GyroIntegration", "Complementary", "Kalman"], "--guard", "off")
    (target / "lesson.bin").write_bytes(lesson_block())
    export_filters(target / "filters", ["ESKF"] if release is None else names)
    if release is None:
        for name in ("index.html", "app.js", "worker.js"):
            (target / name).unlink()
    else:
        add_python(target, release)


def add_python(target: Path, release: Path) -> None:
    """What the page for a log needs: Python, NumPy and levelhead."""
    npm, folder = WEB / "node_modules" / "pyodide", target / "pyodide"
    folder.mkdir()
    for name in RUNTIME:
        shutil.copy(npm / name, folder)
    numpy = json.loads((npm / "pyodide-lock.json").read_text())["packages"]["numpy"]
    wheel = release / numpy["file_name"]
    if not wheel.is_file() or hashlib.sha256(wheel.read_bytes()).hexdigest() != numpy["sha256"]:
        sys.exit(f"{wheel} is missing, or its hash is not {numpy['sha256']}; see docs/howto/view.md")
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
    command = [sys.executable, "-m", "levelhead", "export", "--wasm", "-o", str(folder), *options]
    for name in names:
        subprocess.run([*command, name], check=True, stdout=subprocess.DEVNULL)
        next(path for path in folder.iterdir() if path.name.replace("-", "") == f"lh{name.lower()}").rename(
            folder / f"lh-{name.lower()}"
        )
    (folder / "index.json").write_text(json.dumps({name: f"lh-{name.lower()}" for name in names}))


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
