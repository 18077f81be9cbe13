"""What an exported filter takes on a board: code, RAM, stack and instructions of an update, on a Cortex-M4F and an AVR.

Needs gcc-arm-none-eabi with newlib, qemu-system-arm, and avr-gcc with avr-libc; what is missing is said and left out.
Instructions are counted in QEMU, not timed.
"""

import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from levelhead import filters
from levelhead.bench.timing import Table
from levelhead.export import Choice, write
from measure import options, show

SOURCES = Path(__file__).parent / "c" / "boards"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-pedantic", "-Werror")
AVR_STRICT = tuple(flag for flag in STRICT if "promotion" not in flag)  # there double is float, and fabsf is fabs
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-ffp-contract=off")
M0 = ("-mcpu=cortex-m0plus", "-mthumb", "-ffp-contract=off")  # its code runs on an M4 as well
QEMU = ("qemu-system-arm", "-machine", "mps2-an386", "-nographic", "-semihosting", "-icount", "shift=0", "-kernel")
TOOLS = {"Cortex-M4F": ("arm-none-eabi-gcc", "qemu-system-arm"), "AVR": ("avr-gcc",)}
UNO = {"flash": 32_256, "ram": 2_048}  # ATmega328P less the boot loader
CPUS = {"float": (M4F,), "double": (M4F, M0)}
NOTES = {
    "float": "The processor computes float.",
    "double": "Double is done in software. libgcc's sum for ARMv7-M rounds some differences wrongly (docs/export.md).",
}
COLUMNS = {
    "case": "filter",
    "code": "code [bytes]",
    "ram": "RAM [bytes]",
    "stack": "stack of an update [bytes]",
    "instructions": "instructions of an update",
}
AVR_COLUMNS = {
    "case": "filter",
    "code": "flash with float arithmetic [bytes]",
    "ram": "RAM with constants [bytes]",
    "fits": "on an Uno",
}


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


def image(folder: Path, choice: Choice, main: str, cpu: Sequence[str], *defines: str) -> Path:
    """The program ``main`` with an exported filter, for a Cortex-M in QEMU."""
    common = ("arm-none-eabi-gcc", *cpu, "-O2")
    run(*common, *STRICT, "-c", f"{choice.name}.c", "-o", "filter.o", cwd=folder)
    program = folder / f"{Path(main).stem}.elf"
    run(*common, "-std=gnu99", "-I.", *defines, main, "filter.o", SOURCES / "cortex-m.c", "-T",
        SOURCES / "cortex-m.ld", "-nostartfiles", "--specs=rdimon.specs", "-lm", "-o", program, cwd=folder)  # fmt: skip
    return program


def section_sizes(tool: str, path: Path) -> dict[str, int]:
    """text, data and bss of an object."""
    names, values = run(tool, path, cwd=path.parent).splitlines()[:2]
    return dict(zip(names.split()[:3], map(int, values.split()[:3]), strict=True))


def self_test(choice: Choice, cpu: Sequence[str] = M4F) -> str:
    """What the generated self-test says on a Cortex-M in QEMU."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(choice, folder)
        command = (*QEMU, str(image(folder, choice, f"{choice.name}_selftest.c", cpu)))
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120).stdout.strip()


def on_cortex(choice: Choice) -> dict[str, Any]:
    """Code, RAM, stack and instructions of an update on a Cortex-M4F."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(choice, folder)
        defines = [f"-DFILTER={choice.name}", f'-DFILTER_H="{choice.name}.h"', f"-DREAL={choice.real}"]
        defines += ["-DAXIS"] if choice.axis else []
        said = run(*QEMU, image(folder, choice, str(SOURCES / "count.c"), M4F, *defines), cwd=folder)
        found: dict[str, Any] = json.loads(said)
        return found | {"code": section_sizes("arm-none-eabi-size", folder / "filter.o")["text"]}


def on_avr(choice: Choice) -> dict[str, Any]:
    """Flash and RAM of a whole program that calls the filter on an ATmega328P, and whether an Uno holds it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(choice, folder)
        program = f'#include "{choice.name}.h"\nstatic {choice.name} filter;\nvolatile float in[10], out[4];\n'
        if choice.axis:
            program += (
                f"int main(void) {{ {choice.name}_report now; {choice.name}_init(&filter, in[0]);\n"
                f"for (;;) {{ {choice.name}_update(&filter, in[1], in[2], in[3], 360, &now);\n"
                "out[0] = now.level; } }\n"
            )
        else:
            program += (
                f"int main(void) {{ {choice.name}_init(&filter); for (;;) {{ float v[10];\n"
                f"for (int i = 0; i < 10; i++) v[i] = in[i];\n"
                f"{choice.name}_update(&filter, v, v + 3, v + 6, v[9]);\n"
                f"const {choice.name}_quat q = {choice.name}_quaternion(&filter);\n"
                "out[0] = q.w; out[1] = q.x; out[2] = q.y; out[3] = q.z; } }\n"
            )
        (folder / "main.c").write_text(program, encoding="utf-8")
        common = ("avr-gcc", "-mmcu=atmega328p", "-Os")
        run(*common, *AVR_STRICT, "-c", f"{choice.name}.c", cwd=folder)
        command = (*common, "-std=gnu99", "-Wl,--gc-sections", "main.c", f"{choice.name}.o", "-lm", "-o", "main.elf")
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return {"fits": "no: " + done.stderr.strip().splitlines()[-1]}
        sizes = section_sizes("avr-size", folder / "main.elf")
        code, ram = sizes["text"] + sizes["data"], sizes["data"] + sizes["bss"]
        return {"code": code, "ram": ram, "fits": "yes" if code <= UNO["flash"] and ram <= 0.75 * UNO["ram"] else "no"}


def choices(real: Any) -> Iterator[Choice]:
    """Every filter with the guard, and those of one axis."""
    for flt in filters.ALL:
        yield Choice(flt.params(), real=real)
    for flt in filters.ALL:
        if flt.axis:
            yield Choice(flt.params(), real=real, axis=True)


def shown(choice: Choice) -> str:
    """A filter's name in a table."""
    return f"{choice.flt.name}, one axis" if choice.axis else choice.flt.name


def tables() -> Iterator[Table]:
    """Every filter on every board for which there are tools."""
    if not missing("Cortex-M4F"):
        for real in ("float", "double"):
            rows = [{"case": shown(choice)} | on_cortex(choice) for choice in choices(real)]
            said = [self_test(choice, cpu) for choice in choices(real) for cpu in CPUS[real]]
            right, last = (sum(words in one for one in said) for words in ("samples are right", "last digits"))
            yield Table(
                f"Cortex-M4F, {real}, gcc -O2, guard and sigma included",
                COLUMNS,
                rows,
                f"{NOTES[real]} {len(said)} self-tests in QEMU: {right} right, {last} but for the last digits.",
            )
    if not missing("AVR"):
        rows = [{"case": shown(choice)} | on_avr(choice) for choice in choices("float")]
        yield Table(
            "AVR (ATmega328P), float, avr-gcc -Os, a whole program", AVR_COLUMNS, rows,
            "It fits if flash is enough and a quarter of the RAM is left for the stack.",
        )  # fmt: skip


def main() -> None:
    """Run all of it."""
    given = options(__doc__).parse_args()
    for board in TOOLS:
        if missing(board):
            print(f"{board}: left out, because these are not on the PATH: {missing(board)}")
    show(list(tables()), given.json)


if __name__ == "__main__":
    main()
