"""The C without a C library: its own root to the bit, and a module for WebAssembly that gives the bits of Python."""

import shutil
import subprocess

import numpy as np
import pytest
from tests.reference.c_engine import WARNINGS, run_selftest
from tests.reference.hard import hard_recording

import levelhead as lh
from levelhead.export import ExportConfig, write

GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on the PATH")
pytestmark = pytest.mark.compiled
ROOTS = """#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#undef __SSE2__
#define LH_FREESTANDING
#include "lh_mahony.c"
#undef sqrt
#undef sqrtf
int main(void)
{
    uint64_t state = 88172645463325252u;
    long wrong = 0;
    for (long i = 0; i < 400000; i++) {
        state ^= state << 13, state ^= state >> 7, state ^= state << 17;
        const uint64_t bits = i % 50 ? state : state & (sizeof(REAL) == 8 ? 0x000FFFFFFFFFFFFFu : 0x007FFFFFu);
        const uint32_t half = (uint32_t)bits;
        REAL x;
        memcpy(&x, sizeof x == 8 ? (const void *)&bits : (const void *)&half, sizeof x);
        const REAL found = lh_root(x), right = (REAL)(sizeof x == 8 ? sqrt((double)x) : (double)sqrtf((float)x));
        wrong += !(found == right || (found != found && right != right));
    }
    printf("%ld\\n", wrong);
    return 0;
}
"""
NODE = """
const fs = require('fs');
const { exports: e } = new WebAssembly.Instance(new WebAssembly.Module(fs.readFileSync('filter.wasm')), {});
const input = new Float64Array(new Uint8Array(fs.readFileSync('rows')).buffer), n = input.length / 10;
const first = (e.__heap_base.value + 15) & ~15, rows = first + 8192;
e.memory.grow(Math.ceil((8192 + 8 * 14 * n) / 65536) + 1);
new Float64Array(e.memory.buffer, rows, 10 * n).set(input);
const at = [0, 3, 6, 9, 10].map((column) => rows + 8 * column * n);
e.lh_ekf_init(first);
const taken = e.lh_ekf_update_rows(first, n, ...at);
fs.writeFileSync('quat', new Uint8Array(e.memory.buffer, at[4], 32 * n));
console.log(taken, WebAssembly.Module.imports(new WebAssembly.Module(fs.readFileSync('filter.wasm'))).length);
"""


@GCC
@pytest.mark.parametrize("real", ["double", "float"])
def test_its_root_is_that_of_the_library_to_the_bit(tmp_path, real):
    write(ExportConfig(lh.Mahony(), real=real), tmp_path)
    (tmp_path / "root.c").write_text(ROOTS.replace("REAL", real), encoding="utf-8")
    subprocess.run(["gcc", "-std=c99", "-O2", "-w", "root.c", "-lm", "-o", "root"], cwd=tmp_path, check=True)
    assert subprocess.run(["./root"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout == "0\n"


@GCC
def test_it_compiles_without_a_library_and_gives_the_same(tmp_path):
    write(ExportConfig(lh.EKF()), tmp_path)
    command = ["gcc", *WARNINGS, "-Werror", "-ffreestanding", "-DLH_FREESTANDING", "-O2", "-E", "lh_ekf.c"]
    text = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "math.h" not in text and "string.h" not in text
    code, said = run_selftest(tmp_path, "lh_ekf", "-O2", "-DLH_FREESTANDING")
    assert code == 0 and "all 96 samples are right" in said


@pytest.mark.skipif(not all(map(shutil.which, ("clang", "wasm-ld", "node"))), reason="needs clang, wasm-ld and node")
def test_webassembly_gives_the_bits_of_python(tmp_path):
    """One module without imports; all rows in one call."""
    write(ExportConfig(lh.EKF()), tmp_path)
    command = ["clang", "--target=wasm32", "-O2", "-ffreestanding", "-nostdlib", "-DLH_FREESTANDING"]
    command += ["-mbulk-memory", "-Wl,--no-entry"]
    subprocess.run([*command, "-Wl,--export-all", "lh_ekf.c", "-o", "filter.wasm"], cwd=tmp_path, check=True)
    recording = hard_recording(True)
    steps = np.diff(recording.t, prepend=recording.t[0] - 1.0)
    columns = [recording.gyr.ravel(), recording.acc.ravel(), recording.mag.ravel(), steps]
    np.concatenate(columns).astype("<f8").tofile(tmp_path / "rows")
    (tmp_path / "run.js").write_text(NODE, encoding="utf-8")
    done = subprocess.run(["node", "run.js"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(len(recording)), "0"]
    found = np.fromfile(tmp_path / "quat", "<f8").reshape(-1, 4)
    np.testing.assert_array_equal(found, lh.fuse(recording, lh.EKF(), engine="python").quat)
