"""The exported C as an engine: built, called through ctypes, with the signature of ``lh.fuse``."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

import levelhead as lh
from levelhead import filters
from levelhead.engine.binding import estimates_bias
from levelhead.export import project
from levelhead.export.config import ExportConfig

WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-pedantic")
COMPILERS = tuple(name for name in ("gcc", "clang") if shutil.which(name))
EVERY_COMPILER = pytest.mark.parametrize(
    "compiler", [pytest.param(name, marks=() if name == "gcc" else pytest.mark.full) for name in COMPILERS]
)
GUARD = lh.Guard()
REALS = {"double": np.float64, "float": np.float32}

IMU = """#include "{name}.h"
void run({name} *filter, long n, double last, const double *t, const {real} *gyr, const {real} *acc, const {real} *mag,
         {real} *quat, {real} *bias, {real} *sigma, uint32_t *health);
void run({name} *filter, long n, double last, const double *t, const {real} *gyr, const {real} *acc, const {real} *mag,
         {real} *quat, {real} *bias, {real} *sigma, uint32_t *health)
{{
    for (long i = 0; i < n; i++) {{
        const double dt = i > 0 ? t[i] - t[i - 1] : t[0] - last > 0.0 ? t[0] - last : 1.0;
        (void){name}_update(filter, gyr + 3 * i, acc + 3 * i, mag ? mag + 3 * i : 0, ({real})dt);
        const {name}_output out = {name}_read(filter);
        const {real} q[4] = {{out.quat.w, out.quat.x, out.quat.y, out.quat.z}};
        const {real} b[3] = {{out.bias.x, out.bias.y, out.bias.z}}, s[3] = {{out.sigma.x, out.sigma.y, out.sigma.z}};
        for (int k = 0; k < 4; k++) quat[4 * i + k] = q[k];
        for (int k = 0; k < 3; k++) {{ bias[3 * i + k] = b[k]; sigma[3 * i + k] = s[k]; }}
        health[i] = (uint32_t)out.health;
    }}
}}
unsigned long size(void);
unsigned long size(void) {{ return sizeof({name}); }}
"""
AXIS = """#include "{name}.h"
void run({name} *filter, long n, const double *t, const {real} *level, const {real} *rate, {real} period,
         {name}_report *out);
void run({name} *filter, long n, const double *t, const {real} *level, const {real} *rate, {real} period,
         {name}_report *out)
{{
    for (long i = 1; i < n; i++)
        (void){name}_update(filter, level[i], rate[i], ({real})(t[i] - t[i - 1]), period, out + i);
}}
unsigned long size(void);
unsigned long size(void) {{ return sizeof({name}); }}
"""


KEPT = tempfile.TemporaryDirectory()  # a library whose file is gone would be taken for the next one by the loader


class Built:
    """A filter's C in this process."""

    def __init__(self, config: ExportConfig, compiler: str = "gcc", level: str = "-O2") -> None:
        self.config, written = config, project.build_c_api(config)
        folder = Path(tempfile.mkdtemp(dir=KEPT.name))
        for name, text in written.write().items():
            (folder / name).write_text(text, encoding="utf-8")
        names = {"name": config.name, "real": config.real}
        (folder / "run.c").write_text((AXIS if config.axis else IMU).format(**names), encoding="utf-8")
        command = [compiler, *WARNINGS, "-Werror", level, "-ffp-contract=off", "-shared", "-fPIC", "-o", "filter.so"]
        done = subprocess.run(
            [*command, f"{config.name}.c", "run.c", "-lm"], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0 and not done.stderr, done.stderr
        self.library = ctypes.CDLL(str(folder / "filter.so"))
        self.library.size.restype = ctypes.c_ulong
        self.size = int(self.library.size())

    def function(self, name: str):
        """One of the exported functions."""
        return getattr(self.library, f"{self.config.name}_{name}")

    def start(self):
        """A filter's memory before its first sample."""
        memory = ctypes.create_string_buffer(self.size)
        self.function("init")(memory)
        return memory

    def fuse(self, recording: lh.Recording, memory=None) -> lh.Track:
        """The recording through the filter, as ``lh.fuse`` does it; or through one that has ``memory`` already."""
        real = REALS[self.config.real]
        n = len(recording)
        memory = self.start() if memory is None else memory
        inputs = [np.ascontiguousarray(a, real) for a in (recording.gyr, recording.acc)]
        mag = None if recording.mag is None else np.ascontiguousarray(recording.mag, real)
        t = np.ascontiguousarray(recording.t)
        quat, bias, sigma = np.empty((n, 4), real), np.empty((n, 3), real), np.empty((n, 3), real)
        health = np.empty(n, np.uint32)
        at = [
            ctypes.c_void_p(None if a is None else a.ctypes.data) for a in (t, *inputs, mag, quat, bias, sigma, health)
        ]
        self.library.run(memory, ctypes.c_long(n), ctypes.c_double(t[0]), *at)
        known = estimates_bias(self.config.flt, self.config.guarded)
        values = [np.asarray(a, np.float64) for a in (quat, bias, sigma)]
        return lh.Track(recording.t, values[0], values[1] if known else None, values[2], health, self.config.params)

    def fuse_axis(self, t, level, rate, period=0.0):
        """(n, k) reports of all samples but the first."""
        real = REALS[self.config.real]
        memory = ctypes.create_string_buffer(self.size)
        number = ctypes.c_double if real is np.float64 else ctypes.c_float
        t, level, rate = (np.ascontiguousarray(a, kind) for a, kind in ((t, np.float64), (level, real), (rate, real)))
        self.function("init")(memory, number(level[0]))
        out = np.zeros((len(t), len(self.config.flt.axis.report._fields)), real)
        at = [ctypes.c_void_p(a.ctypes.data) for a in (t, level, rate)]
        self.library.run(memory, ctypes.c_long(len(t)), *at, number(period), ctypes.c_void_p(out.ctypes.data))
        return out[1:]


BUILT: dict[object, Built] = {}


def built(config: ExportConfig, compiler: str = "gcc", level: str = "-O0") -> Built:
    """The same, built once in this process; with -O0 in a third of the time of -O2, which test_same_bits has."""
    key = (config.flt.name, config, compiler, level)  # parameters of two filters may be equal: they are tuples
    if key not in BUILT:
        BUILT[key] = Built(config, compiler, level)
    return BUILT[key]


def fuse(recording, params=None, *, guard=GUARD, engine="c", progress=None):
    """``lh.fuse`` in C, the names of other engines mean this one."""
    params = filters.default() if params is None else filters.resolve(params)
    return built(ExportConfig(params, guard)).fuse(recording)


def run_selftest(folder, name, *flags):
    """Exit code and line of the self-test of what was exported to a folder."""
    command = ["gcc", *WARNINGS, "-Werror", *flags, f"{name}.c", f"{name}_selftest.c", "-lm", "-o", "selftest"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run(["./selftest"], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout
