"""What an update takes on a Cortex-M4F and an AVR: exported filters beside the published equations alone, by hand.

``python -m benchmarks.speed.peers``. The twins are Mahony's, Madgwick's and the lesson's Kalman filter as published, in
C by hand (``benchmarks/c/twins``): the equations of the paper, without missing readings, gaps or σ. ``lean_mahony`` and
``lean_ekf`` are lean exports by hand, to the bit (``benchmarks/c/lean``): what C itself takes for these outputs.
``--source FILE.c --name NAME`` measures the C of another library too, which has ``NAME_init`` and ``NAME_update`` with
the arguments of a twin. Code on the Cortex-M4F is that of a program which calls init, update and what it reads, on the
AVR that of the whole object.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.measure import options, run_script, show
from benchmarks.speed.boards import shown
from tests.reference import boards
from tests.reference.twins import LEAN as BY_HAND
from tests.reference.twins import LEAN_NAMES, NAMES, TWINS

from levelhead import filters
from levelhead.bench.timing import Table
from levelhead.export import ExportConfig
from levelhead.export.config import LEAN

COLUMNS = {
    "case": "filter",
    "code": "code, -O2 [bytes]",
    "small": "code, -Os [bytes]",
    "ram": "RAM [bytes]",
    "stack": "stack [bytes]",
    "instructions": "instructions",
    "flash": "AVR: code [bytes]",
}


def by_hand(source: Path, name: str) -> dict[str, Any]:
    """A filter in C that is not exported; without a header of its own it has that of the twins."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        defines = [f"-DFILTER={name}", f'-DFILTER_H="{name}.h"', "-DREAL=float"]
        defines += ["-DAXIS"] if name.endswith("_axis") else []
        own = source.with_suffix(".h")
        header = own if own.is_file() else TWINS / "twin.h"
        (folder / f"{name}.h").write_text(f'#include <stdint.h>\n#include "{header}"\n', encoding="utf-8")
        common = ("arm-none-eabi-gcc", *boards.M4F, "-O2", "-std=gnu99", f"-I{source.parent}", "-I.")
        boards.run(*common, "-c", source, "-o", "filter.o", cwd=folder)
        boards.run(*common, *defines, boards.SOURCES / "count.c", "filter.o", boards.SOURCES / "cortex-m.c", "-T",
                   boards.SOURCES / "cortex-m.ld", "-nostartfiles", "--specs=rdimon.specs", "-lm", "-o", "count.elf",
                   cwd=folder)  # fmt: skip
        found = boards.read_counts(boards.run(*boards.QEMU, "count.elf", cwd=folder))
        found |= boards.linked_code(folder, source, "-std=gnu99", f"-I{source.parent}")
        boards.run("avr-gcc", "-mmcu=atmega2560", "-Os", "-std=gnu99", f"-I{source.parent}", "-c", source, "-o",
                   "avr.o", cwd=folder)  # fmt: skip
        return found | {"case": name, "flash": boards.section_sizes("avr-size", folder / "avr.o")["text"]}


def exported(config: ExportConfig) -> dict[str, Any]:
    """The same of an export."""
    return {"case": shown(config), **boards.on_cortex(config), "flash": boards.object_on_avr(config)}


def rows(source: Path | None, name: str) -> Iterator[dict[str, Any]]:
    """Each twin beside the exported filter."""
    for params in (filters.Mahony(), filters.Madgwick(), filters.EKF()):
        yield exported(ExportConfig(params, None, "float", without=LEAN))
    yield exported(ExportConfig(filters.EKF(), real="float"))
    yield exported(ExportConfig(filters.Kalman(), real="float", axis=True))
    for lean in LEAN_NAMES:
        yield by_hand(BY_HAND / f"{lean}.c", lean)
    for twin in NAMES:
        yield by_hand(TWINS / f"{twin}.c", twin)
    if source is not None:
        yield by_hand(source.resolve(), name)


def main() -> None:
    """The table."""
    parser = options(__doc__)
    parser.add_argument("--source", type=Path, help="another filter in C")
    parser.add_argument("--name", default="", help="in front of its functions")
    given = parser.parse_args()
    for board in boards.TOOLS:
        if boards.missing(board):
            raise SystemExit(f"needs {boards.missing(board)}")
    note = "Float; gcc -O2 on the Cortex-M4F, -Os on the AVR. Instructions and stack are of one update."
    show([Table("Beside the published equations", COLUMNS, list(rows(given.source, given.name)), note)], given.json)


if __name__ == "__main__":
    run_script(main)
