"""Builds the page that reads a log in the browser itself: static files, for the site.

python web/try_page.py build/site/try [FILTER …]    after `make page`; NumPy for Pyodide comes from PYODIDE_DIST

Each filter, or those that are named, becomes a module for WebAssembly (clang and lld); any other runs in plain Python.

Pyodide's runtime is that of npm. Its lock file has the hash of NumPy's wheel, which only a release of Pyodide holds.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from levelhead import filters

WEB = Path(__file__).resolve().parent
SOURCE = WEB.parent / "src"
RUNTIME = ("pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json")


def build(target: Path, release: Path, names: list[str]) -> None:
    """Writes the page; ``release``: folder with the packages of a release of Pyodide."""
    subprocess.run(["node", "build.mjs", "try", str(target.resolve())], cwd=WEB, check=True)
    npm, folder = WEB / "node_modules" / "pyodide", target / "pyodide"
    folder.mkdir()
    for name in RUNTIME:
        shutil.copy(npm / name, folder)
    numpy = json.loads((npm / "pyodide-lock.json").read_text())["packages"]["numpy"]
    wheel = release / numpy["file_name"]
    if not wheel.is_file() or hashlib.sha256(wheel.read_bytes()).hexdigest() != numpy["sha256"]:
        sys.exit(f"{wheel} is missing, or its hash is not {numpy['sha256']}; see docs/howto/view.md")
    shutil.copy(wheel, folder)
    export_filters(target / "filters", names)
    with (target / "licences.txt").open("a") as licences:
        licences.write(f"\n{'-' * 80}\n\npyodide, MPL-2.0, with CPython (PSF-2.0) and NumPy (BSD-3-Clause)\n")
    with zipfile.ZipFile(target / "levelhead.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted((SOURCE / "levelhead").rglob("*")):
            if path.is_file() and path.suffix in {".py", ".txt"}:
                archive.write(path, path.relative_to(SOURCE))


def export_filters(folder: Path, names: list[str]) -> None:
    """Writes a package for each filter, and which folder holds which."""
    folder.mkdir()
    index = {}
    for name in names:
        subprocess.run(
            [sys.executable, "-m", "levelhead", "export", name, "--wasm", "-o", str(folder)],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        index[name] = next(path.name for path in folder.iterdir() if path.name not in index.values() and path.is_dir())
    (folder / "index.json").write_text(json.dumps(index))


if __name__ == "__main__":
    release = os.environ.get("PYODIDE_DIST")
    if len(sys.argv) < 2 or not release:
        sys.exit(__doc__)
    build(Path(sys.argv[1]), Path(release), sys.argv[2:] or [flt.name for flt in filters.ALL])
