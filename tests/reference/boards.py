"""Exported C built for a Cortex-M and an AVR, and run in QEMU and simavr."""

import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from levelhead.export import ExportConfig, write

SOURCES = Path(__file__).parents[2] / "benchmarks" / "c" / "boards"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-pedantic", "-Werror")
AVR_STRICT = tuple(flag for flag in STRICT if "promotion" not in flag)  # there double is float, and fabsf is fabs
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-ffp-contract=off")
M0 = ("-mcpu=cortex-m0plus", "-mthumb", "-ffp-contract=off")  # its code runs on an M4 as well
QEMU = ("qemu-system-arm", "-machine", "mps2-an386", "-nographic", "-semihosting", "-icount", "shift=0", "-kernel")
TOOLS = {"Cortex-M4F": ("arm-none-eabi-gcc", "qemu-system-arm"), "AVR": ("avr-gcc", "simavr")}
CORE = Path("/usr/share/arduino/hardware/arduino/avr")  # of Debian's arduino-core-avr
UNO = {"flash": 32_256, "ram": 2_048}  # ATmega328P less the boot loader
MEGA = {"ram": 8_192}
LINKED = ("init", "update", "quaternion", "bias", "sigma", "health", "angle", "rate")  # of these, those that it has
LEAST_STACK = 3_072  # that a filter of an IMU takes on an AVR


def missing(board: str) -> str:
    """The tools for a board that are not there, in words; nothing if all are."""
    return ", ".join(tool for tool in TOOLS[board] if shutil.which(tool) is None)


def run(*command: Any, cwd: Path) -> str:
    """What a command says.

    Raises:
        SystemExit: it failed; with what it said.
    """
    done = subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def image(folder: Path, config: ExportConfig, main: str, cpu: Sequence[str], *defines: str) -> Path:
    """The program ``main`` with an exported filter, for a Cortex-M in QEMU."""
    common = ("arm-none-eabi-gcc", *cpu, "-O2")
    run(*common, *STRICT, "-c", f"{config.name}.c", "-o", "filter.o", cwd=folder)
    program = folder / f"{Path(main).stem}.elf"
    run(*common, "-std=gnu99", "-I.", *defines, main, "filter.o", SOURCES / "cortex-m.c", "-T",
        SOURCES / "cortex-m.ld", "-nostartfiles", "--specs=rdimon.specs", "-lm", "-o", program, cwd=folder)  # fmt: skip
    return program


def section_sizes(tool: str, path: Path) -> dict[str, int]:
    """text, data and bss of an object."""
    names, values = run(tool, path, cwd=path.parent).splitlines()[:2]
    return dict(zip(names.split()[:3], map(int, values.split()[:3]), strict=True))


def self_test(config: ExportConfig, cpu: Sequence[str] = M4F) -> str:
    """What the generated self-test says on a Cortex-M in QEMU."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(config, folder)
        command = (*QEMU, str(image(folder, config, f"{config.name}_selftest.c", cpu)))
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120).stdout.strip()


def on_cortex(config: ExportConfig) -> dict[str, Any]:
    """Code, RAM, stack and instructions of an update on a Cortex-M4F."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(config, folder)
        defines = [f"-DFILTER={config.name}", f'-DFILTER_H="{config.name}.h"', f"-DREAL={config.real}"]
        defines += ["-DAXIS"] if config.axis else []
        said = run(*QEMU, image(folder, config, str(SOURCES / "count.c"), M4F, *defines), cwd=folder)
        return read_counts(said) | linked_code(folder, folder / f"{config.name}.c", *STRICT)


def linked_code(folder: Path, source: Path, *flags: str) -> dict[str, int]:
    """Bytes of a filter's code on a Cortex-M4F in a program that calls ``LINKED``, linked as the Arduino IDE does."""
    return {column: _linked(folder, source, level, *flags) for column, level in (("code", "-O2"), ("small", "-Os"))}


def _linked(folder: Path, source: Path, *flags: str) -> int:
    common, name = ("arm-none-eabi-gcc", *M4F, "-ffunction-sections"), source.stem
    run(*common, *flags, "-c", source, "-o", "parts.o", cwd=folder)
    wanted = [f"-Wl,-u,{name}_{call}" for call in LINKED]
    run(*common, "-r", "-nostdlib", "-Wl,--gc-sections", f"-Wl,-e,{name}_update", *wanted, "parts.o", "-o", "linked.o",
        cwd=folder)  # fmt: skip
    return section_sizes("arm-none-eabi-size", folder / "linked.o")["text"]


def read_counts(said: str) -> dict[str, Any]:
    """The figures that ``count.c`` says."""
    found: dict[str, Any] = json.loads(said)
    return found


def object_on_avr(config: ExportConfig) -> int:
    """Bytes of code of the filter's object for an AVR, alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(config, folder)
        run("avr-gcc", "-mmcu=atmega2560", "-Os", *AVR_STRICT, "-c", f"{config.name}.c", "-o", "one.o", cwd=folder)
        return section_sizes("avr-size", folder / "one.o")["text"]


def on_avr(config: ExportConfig) -> dict[str, Any]:
    """Flash, RAM, stack and cycles of a program that does nothing but update, on an ATmega2560 in simavr."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(config, folder)
        defines = [f"-DFILTER={config.name}", f'-DFILTER_H="{config.name}.h"', *(["-DAXIS"] if config.axis else [])]
        common = ("avr-gcc", "-mmcu=atmega2560", "-Os", "-ffunction-sections")
        run(*common, *AVR_STRICT, "-c", f"{config.name}.c", cwd=folder)
        run(*common, "-std=gnu99", "-I.", *defines, SOURCES / "avr.c", f"{config.name}.o", "-Wl,--gc-sections", "-lm",
            "-Wl,--defsym,__DATA_REGION_LENGTH__=64K",  # so that what has no room is measured too
            "-o", "main.elf", cwd=folder)  # fmt: skip
        sizes = section_sizes("avr-size", folder / "main.elf")
        code, ram = sizes["text"] + sizes["data"], sizes["data"] + sizes["bss"]
        if ram + LEAST_STACK > MEGA["ram"]:
            return {"code": code, "ram": ram, "fits": "no, nor a Mega"}
        command = ("simavr", "-m", "atmega2560", "-f", "16000000", "main.elf")
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
        said = done.stdout + done.stderr  # what the program says goes to one, what simavr says to the other
        stack, cycles = map(int, re.findall(r"(\d+) (\d+) ", said)[0])
        fits = code <= UNO["flash"] and ram + stack <= UNO["ram"]
        return {"code": code, "ram": ram, "stack": stack, "cycles": cycles, "fits": "yes" if fits else "no"}


def core_library(folder: Path, mcu: str, variant: str) -> Path:
    """The Arduino core and Wire, compiled for a processor.

    An archive, as the IDE links the core: a Mega's other serial ports stay out of a sketch that has no use for them.
    """
    parts = ("cores/arduino", "libraries/Wire/src", "libraries/Wire/src/utility")
    sources = [source for part in parts for source in (CORE / part).glob("*")]
    made = []
    for source in sources:
        compiler = {".c": ("avr-gcc", "-std=gnu11"), ".cpp": ("avr-g++", "-std=gnu++11"), ".S": ("avr-gcc",)}
        if source.suffix in compiler:
            made.append(folder / f"{source.name}.o")
            flags = [*core_flags(mcu, variant), "-w", *(["-fpermissive"] if source.suffix == ".cpp" else [])]
            run(*compiler[source.suffix], *flags, "-c", source, "-o", made[-1], cwd=folder)
    run("avr-ar", "rcs", "core.a", *made, cwd=folder)
    return folder / "core.a"


def core_flags(mcu: str, variant: str) -> list[str]:
    """As the IDE compiles; DECIMAL_DIG is missing in this core's libc for C++."""
    includes = [f"-I{CORE / part}" for part in ("cores/arduino", f"variants/{variant}", "libraries/Wire/src")]
    return [f"-mmcu={mcu}", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_ARCH_AVR", "-DDECIMAL_DIG=9", "-Os",
            "-ffunction-sections", "-fdata-sections", *includes]  # fmt: skip


def run_sketch(config: ExportConfig, name: str, seconds: float = 5.0) -> dict[str, Any]:
    """The sketch of an export on an AVR in simavr, with the real core: flash, static memory, stack, samples a second.

    The MPU-6050 on its bus lies still. ``name``: "uno" or "mega".
    """
    mcu, variant = {"uno": ("atmega328p", "standard"), "mega": ("atmega2560", "mega")}[name]
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write(config, folder)
        flags, sketch = core_flags(mcu, variant), f"{config.name}_mpu6050"
        run("avr-gcc", *flags, "-std=gnu99", "-c", f"{config.name}.c", "-o", "filter.o", cwd=folder)
        run("avr-g++", *flags, "-std=gnu++11", "-I.", "-include", "Arduino.h", "-x", "c++", "-c",
            f"{sketch}/{sketch}.ino", "-o", "sketch.o", cwd=folder)  # fmt: skip
        core = core_library(folder, mcu, variant)
        run("avr-gcc", f"-mmcu={mcu}", "-Os", "-Wl,--gc-sections", "filter.o", "sketch.o", core, "-lm", "-o",
            "sketch.elf", cwd=folder)  # fmt: skip
        run("gcc", "-O2", SOURCES / "uno.c", "-I/usr/include/simavr", "-lsimavr", "-lelf", "-o", "board", cwd=folder)
        said = run("./board", "sketch.elf", mcu, seconds, cwd=folder)
        sizes = section_sizes("avr-size", folder / "sketch.elf")
        rows = [line for line in said.splitlines() if re.match(r"[0-9.]+,", line)]
        times = [float(row.partition(",")[0]) for row in rows[:-1]]
        return {
            "flash": sizes["text"] + sizes["data"],
            "static": sizes["data"] + sizes["bss"],
            "stack": int(re.findall(r"# stack (\d+)", said)[0]),
            "rate": (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0,
        }
