"""What an exported filter takes on a board: code, RAM, stack and instructions of an update, on a Cortex-M4F and an AVR.

Needs gcc-arm-none-eabi with newlib and qemu-system-arm, and avr-gcc with avr-libc and simavr; what is missing is said
and left out. Instructions and cycles are counted in QEMU and simavr, not timed. Code on the Cortex-M4F is that of a
program which calls init, update, quaternion, bias, sigma and health, as far as the filter has them.
"""

from collections.abc import Iterator
from typing import Any

from benchmarks.measure import options, show
from tests.reference.boards import M0, M4F, TOOLS, missing, on_avr, on_cortex, self_test

from levelhead import filters
from levelhead.bench.timing import Table
from levelhead.engine.binding import is_guarded
from levelhead.export import ExportConfig
from levelhead.export.config import LEAN

CPUS = {"float": (M4F,), "double": (M4F, M0)}
NOTES = {
    "float": "The processor computes float.",
    "double": "Double is done in software. libgcc's sum for ARMv7-M rounds some differences wrongly "
    "(docs/reference/exported-c.md).",
}
COLUMNS = {
    "case": "filter",
    "code": "code, -O2 [bytes]",
    "small": "code, -Os [bytes]",
    "ram": "RAM [bytes]",
    "stack": "stack of an update [bytes]",
    "instructions": "instructions of an update",
}
AVR_COLUMNS = {
    "case": "filter",
    "code": "flash [bytes]",
    "ram": "RAM [bytes]",
    "stack": "stack of an update [bytes]",
    "cycles": "cycles of an update",
    "fits": "fits an Uno",
}


def choices(real: Any) -> Iterator[ExportConfig]:
    """Every filter with the guard; lean, where that leaves something out; those of one axis."""
    for flt in filters.ALL:
        yield ExportConfig(flt.params(), real=real)
    for flt in filters.ALL:
        if is_guarded(flt):
            yield ExportConfig(flt.params(), None, real, without=LEAN)
    for flt in filters.ALL:
        if flt.axis:
            yield ExportConfig(flt.params(), real=real, axis=True)


def shown(config: ExportConfig) -> str:
    """A filter's name in a table."""
    alone = config.guard is None and is_guarded(config.flt)
    words = " --lean" if config.without >= LEAN else " --guard off" if alone else ""
    mag = " --without mag" if "mag" in config.without else ""
    return config.flt.name + (" --axis" if config.axis else words + mag)


def tables() -> Iterator[Table]:
    """Every filter on every board for which there are tools."""
    if not missing("Cortex-M4F"):
        for real in ("float", "double"):
            rows = [{"case": shown(config)} | on_cortex(config) for config in choices(real)]
            said = [self_test(config, cpu) for config in choices(real) for cpu in CPUS[real]]
            right, last = (sum(words in one for one in said) for words in ("samples are right", "last digits"))
            yield Table(
                f"Cortex-M4F, {real}, gcc -O2, guard and sigma included",
                COLUMNS,
                rows,
                f"{NOTES[real]} {len(said)} self-tests in QEMU: {right} right, {last} but for the last digits.",
            )
    if not missing("AVR"):
        every = [
            *choices("float"),
            *(
                ExportConfig(flt.params(), None, "float", without=LEAN | {"mag"})
                for flt in filters.ALL
                if is_guarded(flt)
            ),
        ]
        yield Table(
            "AVR (ATmega2560), float, avr-gcc -Os, a program that does nothing else",
            AVR_COLUMNS,
            [{"case": shown(config)} | on_avr(config) for config in every],
            "Arithmetic in float and constants are counted. An Uno has 32,256 bytes of flash and 2,048 of RAM; 160,000 "
            "cycles are 10 ms at 16 MHz.",
        )


def main() -> None:
    """Run all of it."""
    given = options(__doc__).parse_args()
    for board in TOOLS:
        if missing(board):
            print(f"{board}: left out, because these are not on the PATH: {missing(board)}")
    show(list(tables()), given.json)


if __name__ == "__main__":
    main()
