"""C sources built at run time into a temporary folder, called through ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

SOURCES = Path(__file__).parents[2] / "benchmarks" / "c"
STRICT = ("-O3", "-ffp-contract=off")  # no fused multiply-add: the same bits as Python's
NATIVE = (*STRICT, "-march=native")

Doubles = ctypes.POINTER(ctypes.c_double)


class KalmanParams(ctypes.Structure):
    """Params of c/kalman.c."""

    _fields_ = (
        *((name, ctypes.c_double) for name in ("q_angle", "q_bias", "r_measure", "p_angle", "p_bias")),
        *((name, ctypes.c_int) for name in ("q_per_sample", "joseph")),
    )


def compiler() -> str:
    """The C compiler's first line about itself.

    Raises:
        SystemExit: there is none.
    """
    if shutil.which("gcc") is None:
        raise SystemExit("gcc is not on the PATH; the C yardsticks need it")
    return subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]


def build(source: str, flags: tuple[str, ...] = STRICT, sources: Path = SOURCES) -> Any:
    """The function ``run`` of c/``source``: run(params, n, t, level, rate, period, out), all arrays of double."""
    compiler()
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "yardstick.so"
        command = ["gcc", "-std=c99", "-Wall", "-Wextra", *flags, "-shared", "-fPIC", sources / source]
        subprocess.run([*map(str, command), "-o", str(library), "-lm"], check=True)
        run = ctypes.CDLL(str(library)).run  # stays mapped when the file is gone
    run.argtypes = [ctypes.c_void_p, ctypes.c_ssize_t, Doubles, Doubles, Doubles, ctypes.c_double, Doubles]
    run.restype = None
    return run


def doubles(array: Any) -> Any:
    """A float64 array as C sees it."""
    return array.ctypes.data_as(Doubles)
