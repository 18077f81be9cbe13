"""The generated self-test passes where the filter is right, and only there."""

import re

import numpy as np
import pytest
from tests.reference import c_engine
from tests.reference.c_engine import run_selftest

import levelhead as lh
from levelhead import filters
from levelhead.export import ExportConfig, files, write
from levelhead.export.selftest import BOUND
from levelhead.export.test_vectors import vector_rows
from levelhead.filters import health

GCC = pytest.mark.skipif("gcc" not in c_engine.COMPILERS, reason="no gcc on the PATH")
EVERY = pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)


@pytest.mark.compiled
@GCC
@EVERY
@pytest.mark.parametrize("real", [pytest.param("double", marks=pytest.mark.full), "float"])
def test_it_passes(flt, real, tmp_path):
    config = ExportConfig(flt.params(), real=real)
    write(config, tmp_path)
    code, said = run_selftest(tmp_path, config.name, "-O1")
    assert code == 0 and said.startswith(f"{config.name}: all 96 samples are right"), said


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("flt", [f for f in filters.ALL if f.axis], ids=lambda f: f.name)
def test_it_passes_on_one_axis(flt, real, tmp_path):
    config = ExportConfig(flt.params(), real=real, axis=True)
    write(config, tmp_path)
    code, said = run_selftest(tmp_path, config.name, "-O3", "-ffp-contract=off")
    assert code == 0 and said.startswith(f"{config.name}: all 40 samples are right"), said


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize(
    "real, wrong, expected, words",
    [
        ("double", "0.03000000000001", 2, "samples differ in their last digits, the first is number"),
        ("double", "0.0301", 1, "samples are wrong, the first is number"),
        ("float", "0.033f", 1, "samples are wrong, the first is number"),
    ],
)
def test_it_fails_where_a_number_of_the_source_is_another(real, wrong, expected, words, tmp_path):
    config = ExportConfig(lh.Kalman(r_measure=0.03), real=real)
    write(config, tmp_path)
    source = tmp_path / "lh_kalman.c"
    text = source.read_text(encoding="utf-8")
    right = ".r_measure = 0.03f;" if real == "float" else ".r_measure = 0.03;"
    assert text.count(right) == 1
    source.write_text(text.replace(right, f".r_measure = {wrong};"), encoding="utf-8")
    code, said = run_selftest(tmp_path, "lh_kalman", "-O1")
    assert code == expected and words in said


@pytest.mark.compiled
@GCC
@EVERY
def test_the_bound_of_single_precision_has_room(flt):
    """The largest difference over all filters is below a quarter of the bound that the self-test states."""
    config = ExportConfig(flt.params(), real="float")
    found = vector_rows(config)
    assert [row.taken for row in found].count(False) == 2
    taken = [row for row in found if row.taken]
    program = c_engine.built(config)
    recording = lh.Recording(
        np.cumsum([row.sample.dt for row in taken]),
        *(np.array([[x if abs(x) < 1e9 else np.nan for x in row.sample[k]] for row in taken]) for k in (1, 2, 3)),
    )
    track = program.fuse(recording)
    for name, values in (("quat", track.quat), ("bias", track.bias), ("sigma", track.sigma)):
        if values is not None:
            wanted = np.array([getattr(row.output, name) for row in taken])
            assert (np.abs(values - wanted) / (1.0 + np.abs(wanted))).max() < 0.25 * BOUND, name


def test_everything_goes_wrong_in_the_vector():
    seen = 0
    for flt in filters.ALL:
        for row in vector_rows(ExportConfig(flt.params())):
            seen |= row.output.health
    for bit in (health.GYR_MISSING, health.ACC_MISSING, health.MAG_MISSING, health.GAP, health.AT_REST,
                health.MAG_REJECTED, health.ACC_REJECTED):  # fmt: skip
        assert seen & bit, health.NAMES[bit]


@pytest.mark.parametrize("arduino", [False, True])
@pytest.mark.parametrize("axis", [False, True])
@pytest.mark.slow
def test_a_library_in_float_does_not_promise_the_bits_of_double(axis, arduino):
    """Neither header, properties, self-test nor sketch; the library in double does."""
    promise = re.compile(r"same bits|to the bit\b(?!\.)|same, to|exactly")
    for real in ("float", "double"):
        made = files(ExportConfig(lh.Kalman(), real=real, axis=axis), arduino)
        promised = {name for name, text in made.items() if promise.search(text)}
        outside = {name for name in promised if not name.endswith(("lh_kalman.c", "lh_kalman_axis.c"))}
        assert bool(outside) == (real == "double"), outside
