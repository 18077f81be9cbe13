"""Compiles the native engine: C from the kernels into one extension module, when the package is built.

``python -m levelhead.export.extension`` does it in a checkout, beside the sources: after a change of a kernel.
"""

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from levelhead.engine.native import PACKAGE, up_to_date
from levelhead.export.native import sources

FILE = "_native.abi3.so"
PLACE = PACKAGE / "engine" / FILE
FLAGS = (
    *("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden"),
    "-ffp-contract=off",  # no fused multiply-add: each operation rounds once, as in Python
    *("-fno-math-errno", "-fno-trapping-math"),  # errno and floating-point signals are unused; values stay
)
WISHES = (  # of gcc, where it has them
    # The part of -O3 that makes the ESKF a third faster than -O2 does; all of -O3 takes half as long again to compile.
    *("-fpeel-loops", "-fvect-cost-model=dynamic"),
    # Ranges of values gain nothing here, and half of the time to compile goes into them once loops are peeled.
    "-fno-tree-vrp",
)
VECTORS = "-mavx2"  # and no -mfma
MORE_VECTORS = "-mavx512f"  # for products of matrices; a compiler with the flag above has this one
PROBE = 'int lh_probe(void);\nint lh_probe(void) { return __builtin_cpu_supports("avx2"); }\n'


class NoCompilerError(Exception):
    """There is nothing that compiles C."""


def compiler() -> list[str]:
    """The command of the C compiler: that of ``CC``, or the one that Python was built with.

    Raises:
        NoCompilerError: it is not there.
    """
    for command in (os.environ.get("CC"), sysconfig.get_config_var("CC"), "cc"):
        words = shlex.split(command or "")
        if words and shutil.which(words[0]):
            return words
    raise NoCompilerError("no C compiler (gcc or clang) is on the PATH")


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise NoCompilerError(f"{' '.join(command)}: {done.stderr.strip() or done.stdout.strip()}")


def _takes(command: list[str], flag: str, text: str) -> bool:
    """Whether the compiler accepts a flag, with which it is to compile a text."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text(text, encoding="utf-8")
        try:
            _run([*command, "-Werror", flag, "-c", str(source), "-o", str(source.with_suffix(".o"))])
        except NoCompilerError:
            return False
    return True


def _object(command: list[str], folder: Path, name: str, key: str) -> Path:
    """A file compiled, unless it has been already with the same text and command."""
    made = hashlib.sha256("\n".join([*command, key]).encode()).hexdigest()[:16]
    path = folder / f"{Path(name).stem}-{made}.o"
    if not path.exists():
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            fresh = Path(scratch, path.name)
            _run([*command, "-c", str(folder / name), "-o", str(fresh)])
            fresh.replace(path)
    return path


def build(folder: Path, target: Path) -> None:
    """Generates and compiles everything; objects stay in ``folder`` for the next time, the module becomes ``target``.

    Raises:
        NoCompilerError: there is none, or it fails.
    """
    command = [*compiler(), *FLAGS, *shlex.split(os.environ.get("CFLAGS", ""))]
    command += [flag for flag in WISHES if _takes(command, flag, "int lh_probe;\n")]
    wide = _takes(command, VECTORS, PROBE)
    folder.mkdir(parents=True, exist_ok=True)
    texts = sources()
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    headers = "".join(text for name, text in texts.items() if name == "native.h")
    include = f"-I{sysconfig.get_path('include')}"
    module = [*command, include, *(["-DLH_WITH_WIDE"] if wide else [])]
    jobs = [(module, "native.module.c", texts["native.table.h"] + headers)]
    for name in texts:
        if name.startswith("lh_"):
            jobs.append((command, name, headers))
            smoother = name.startswith("lh_smoother_")
            if wide and ("double memory[" in texts[name] or smoother):
                jobs.append(([*command, VECTORS, "-DLH_WIDE"], name, headers))
            if wide and smoother:
                jobs.append(([*command, MORE_VECTORS, "-DLH_WIDEST"], name, headers))
    jobs.sort(key=lambda job: len(texts[job[1]]), reverse=True)  # so that no core waits for the longest at the end
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(lambda job: _object(job[0], folder, job[1], texts[job[1]] + job[2]), jobs))
    shared = shlex.split(sysconfig.get_config_var("LDSHARED") or "")[1:] or ["-shared"]
    made = folder / FILE
    _run([*compiler(), *shared, *map(str, objects), "-lm", "-o", str(made)])
    for old in set(folder.glob("*.o")) - set(objects):
        old.unlink()
    target.parent.mkdir(parents=True, exist_ok=True)
    if target != made:
        with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
            Path(shutil.copy(made, scratch)).replace(target)


def main() -> int:
    """Builds it beside the sources, unless nothing has changed."""
    if up_to_date():
        return 0
    try:
        build(PACKAGE.parent.parent / "build" / "native", PLACE)
    except NoCompilerError as error:
        sys.stderr.write(f"the native engine was not built: {error}\n")
        return 2
    sys.stdout.write(f"built {PLACE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
