"""The exported filters on boards that are not there: built for them, and their self-tests run in QEMU."""

import shutil
import subprocess
from pathlib import Path

import pytest
from tests.reference import boards

from levelhead import filters
from levelhead.export import ExportConfig, project, write
from levelhead.export.board import BOARDS, SKETCH_STACK, memory
from levelhead.export.config import LEAN

pytestmark = pytest.mark.full


def cortex():
    """Skips where there is no compiler for a Cortex-M, or no QEMU."""
    if boards.missing("Cortex-M4F"):
        pytest.skip(f"not on the PATH: {boards.missing('Cortex-M4F')}")


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_cortex_m4f_in_float(flt):
    cortex()
    assert "all 96 samples are right" in boards.self_test(ExportConfig(flt.params(), real="float"))


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_cortex_m0_in_double_to_the_bit(flt):
    """No FPU at all, and a compiler's C for every sum: the same bits as Python on x86."""
    cortex()
    assert "all 96 samples are right" in boards.self_test(ExportConfig(flt.params()), boards.M0)


def test_cortex_m4f_in_double_but_for_a_defect_of_libgcc():
    """1 − y is rounded wrongly by its sum for ARMv7-M where y lies about 2⁻³³; the self-test says so, and no more."""
    cortex()
    said = boards.self_test(ExportConfig(filters.Complementary()))
    assert "samples are right" in said or "differ in their last digits" in said


@pytest.mark.parametrize("real", ["double", "float"])
def test_one_axis(real):
    cortex()
    assert "all 40 samples are right" in boards.self_test(
        ExportConfig(filters.Kalman(), real=real, axis=True), boards.M0
    )


def test_what_an_update_costs_on_a_cortex_m4f():
    cortex()
    one, imu = (boards.on_cortex(ExportConfig(filters.Kalman(), real="float", axis=axis)) for axis in (True, False))
    assert one["ram"] == 44 and imu["ram"] < 1024
    assert 20 < one["instructions"] < imu["instructions"] < 20_000
    assert one["code"] < imu["code"] < 40_000 and one["stack"] <= imu["stack"] < 8_000


def test_an_uno_holds_the_lesson():
    if boards.missing("AVR"):
        pytest.skip(f"not on the PATH: {boards.missing('AVR')}")
    found = boards.on_avr(ExportConfig(filters.Kalman(), real="float", axis=True))
    assert found["fits"] == "yes" and found["ram"] < 256 and found["code"] < 8_192
    assert 20 < found["stack"] < 512 and 1_000 < found["cycles"] < 40_000
    assert boards.on_avr(ExportConfig(filters.EKF(), real="float"))["fits"] == "no"


@pytest.mark.parametrize("without", [None, LEAN, LEAN | {"mag"}], ids=["whole", "lean", "lean without mag"])
@pytest.mark.parametrize("name", ["Triad", "BiasRateKalman", "EKF"])
def test_the_stack_on_an_avr_is_never_more_than_reckoned(name, without):
    """The filters that come nearest; the rest of a sketch takes its own share besides."""
    if boards.missing("AVR"):
        pytest.skip(f"not on the PATH: {boards.missing('AVR')}")
    params = filters.find(name).params()
    if without is None or name == "Triad":
        config = ExportConfig(params, real="float")
    else:
        config = ExportConfig(params, None, "float", without=without)
    api = project.build_c_api(config)
    api.write()
    assert boards.on_avr(config)["stack"] <= memory(api, BOARDS["mega"]).stack - SKETCH_STACK


@pytest.mark.parametrize(
    "command",
    [("avr-gcc", "-mmcu=avrxmega3", "-Os"), ("arm-none-eabi-gcc", "-mcpu=cortex-m0plus", "-mthumb", "-O2"),
     ("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-O2")],
    ids=["nano-every", "m0", "m4"],
)  # fmt: skip
def test_it_compiles_for_boards_that_no_emulator_runs(command, tmp_path):
    """avrxmega3 is the architecture of the ATmega4809, m0 that of SAMD21 and RP2040, m4 that of SAMD51."""
    if shutil.which(command[0]) is None:
        pytest.skip(f"no {command[0]} here")
    config = ExportConfig(filters.EKF(), real="float")
    write(config, tmp_path)
    strict = boards.AVR_STRICT if "avr" in command[0] else boards.STRICT
    subprocess.run([*command, *strict, "-c", f"{config.name}.c", "-o", "filter.o"], cwd=tmp_path, check=True)
    api = project.build_c_api(config)
    api.write()
    size = boards.section_sizes(f"{command[0].removesuffix('gcc')}size", tmp_path / "filter.o")["text"]
    assert size < memory(api, BOARDS["nano-every" if "avr" in command[0] else "m0"]).flash


SKETCHES = {
    "uno": ExportConfig(filters.Mahony(), None, "float", without=LEAN | {"mag"}, board="uno"),
    "mega": ExportConfig(filters.EKF(), real="float", board="mega"),
}


@pytest.mark.parametrize("name", SKETCHES)
def test_the_sketch_runs_with_the_real_core(name):
    """Beside Wire and Serial, in no more memory than the export has reckoned with.

    Mahony on an Uno at 100 Hz; the whole EKF on a Mega, which cannot keep that up in software.
    """
    if boards.missing("AVR") or not boards.CORE.exists() or not Path("/usr/include/simavr").exists():
        pytest.skip("needs gcc-avr, arduino-core-avr, simavr and libsimavr-dev")
    config, board = SKETCHES[name], BOARDS[name]
    found = boards.run_sketch(config, name)
    api = project.build_c_api(config)
    api.write()
    reckoned = memory(api, board)
    assert {"uno": 99.0, "mega": 60.0}[name] < found["rate"] < 101.0
    assert found["flash"] <= reckoned.flash <= board.flash and found["flash"] > 0.6 * reckoned.flash
    assert found["static"] <= reckoned.static and found["stack"] <= reckoned.stack
    assert found["static"] + found["stack"] < board.ram
