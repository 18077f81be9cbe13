"""Header and source of a filter: the translated kernels, and the few functions around them that a program calls."""

import re
import zlib
from collections.abc import Iterable

from levelhead import filters
from levelhead.engine.stepper import MOST_DT
from levelhead.errors import LevelheadError
from levelhead.export.config import ExportConfig, remarks
from levelhead.export.flat_program import FlatProgram
from levelhead.export.helpers import helper_functions
from levelhead.export.kinds import FLOAT, Kind, Machine, Struct, variable, within
from levelhead.export.layout import (
    STEP,
    add_comment,
    comment,
    docstring,
    escape,
    join_lines,
    module_words,
    template,
    wrap_text,
)
from levelhead.filters import health
from levelhead.filters.parameters import Params, description
from levelhead.guard import Guard
from levelhead.version import VERSION

MACHINES = (
    Machine("64 bit (Cortex-A, x86-64)", 8, 8),
    Machine("32 bit (Cortex-M, ESP32, RP2040)", 8, 8),
    Machine("AVR (Uno, Mega)", 4, 1),
)

ROOTS: dict[str, dict[str, object]] = {  # of a number: its layout, and the parts of a root in whole numbers
    "double": {"f": "", "has_root": 8, "bits": "uint64_t", "whole": "int64_t", "width": 64, "fraction": 52,
               "infinite": 2047, "middle": 1023, "lift": 10, "vsqrt": '"vsqrt.f64 %P0, %P1" : "=w"(root) : "w"(x)'},
    "float": {"f": "f", "has_root": 4, "bits": "uint32_t", "whole": "int32_t", "width": 32, "fraction": 23,
              "infinite": 255, "middle": 127, "lift": 7, "vsqrt": '"vsqrt.f32 %0, %1" : "=t"(root) : "t"(x)'},
}  # fmt: skip
ANY_FILTER = "lh_filter"  # the name of every filter, where a program asks for it


class CApi:
    """The part that header and source of every export share.

    Attributes:
        program: the kernels.
        whole: the struct that a program holds.
    """

    program: FlatProgram

    def __init__(self, config: ExportConfig) -> None:
        self.config = config
        self.whole = Struct(config.name, {})

    @property
    def name(self) -> str:
        """In front of all names."""
        return self.config.name

    def number(self, value: float) -> str:
        """A literal."""
        return self.program.types.number(value)

    def size(self, machine: Machine) -> int:
        """Bytes of a filter with its parameters."""
        return machine.size(self.whole)[0]

    def common_gaps(self) -> dict[str, object]:
        """The text for the gaps of these names in every template."""
        return {
            "name": self.name,
            "guard": self.name.upper(),
            "real": self.config.real,
            "title": f"{self.name}: {module_title(self.config)}",
            "version": VERSION,
            "command": escape(" ".join(self.config.command.split())),
            "zero": self.number(0.0),
            "longest": self.number(MOST_DT),
        }

    def sizes(self) -> str:
        """The table of sizes."""
        rows = []
        for machine in MACHINES:
            real = machine.real if self.config.real == "double" else 4
            one = Machine(machine.name, real, machine.alignment)
            note = "; double is float there" if machine.real == 4 and self.config.real == "double" else ""
            rows.append(f" *     {machine.name + note:<58}{self.size(one):>6} bytes")
        return "\n".join(rows)

    def assignments(self, params: Params, struct: Kind | None, path: str) -> list[str]:
        """Statements that set the numbers of a parameter object, each with its name."""
        assert isinstance(struct, Struct)
        lines: list[str] = []
        for name, kind in struct.fields.items():
            value = getattr(params, name)
            found = self.assign(value, kind or FLOAT, f"{path}.{variable(name)}", name)
            lines += found if value == params._field_defaults[name] else [f"{line} /* set */" for line in found]
        return lines

    def assign(self, value: object, kind: Kind, path: str, what: str) -> list[str]:
        """Statements that set a value, number by number, as both C and C++ take it."""
        if isinstance(kind, Struct):
            assert isinstance(value, tuple)
            parts = [(name, inner, getattr(value, name)) for name, inner in kind.fields.items()]
            return [
                line
                for name, inner, part in parts
                for line in self.assign(part, inner or FLOAT, f"{path}.{variable(name)}", what)
            ]
        try:
            return [f"{STEP}{path} = {self.program.types.literal(value, kind)};"]
        except OverflowError as error:
            raise LevelheadError(f"{what}: {error}; export --double") from None

    def types(self, aliases: bool = False) -> list[str]:
        """The types that other files see; or their names in this one."""
        lines: list[str] = []
        for struct in self.program.types.public:
            if aliases:
                lines.append(
                    f"typedef {self.program.types.public_name(struct)} {self.program.types.struct_name(struct)};"
                )
            else:
                lines += self.program.types.definition(struct, self.remarks(struct))
        if aliases:
            lines.append("")
            for struct in self.program.private_types():
                lines += self.program.types.definition(struct)
        return lines

    def remarks(self, struct: Struct) -> dict[str, str] | None:
        """Comments on the fields of parameters."""
        if struct.origin in (self.config.flt.params, Guard):
            return remarks(struct.origin)
        return None

    def body(self) -> tuple[list[str], list[str]]:
        """All kernels, and the constants that they use."""
        lines: list[str] = []
        for module, kernels in self.program.sections():
            lines += [*section(module), "", *kernels]
        return lines, self.program.constants.lines()

    def carry_gaps(self) -> dict[str, object]:
        """The text of the functions that save and restore a filter."""
        carry = self.whole.fields["carry"]
        definitions = [line for struct in within(carry) for line in self.program.types.definition(struct, {})]
        words = "\n".join([self.name, VERSION, *definitions])
        return {"mark": f"0x{zlib.crc32(words.encode()):08X}"}

    def source(self, functions: str, **gaps: object) -> str:
        """The C file."""
        kernels, constants = self.body()
        text = join_lines([*kernels])
        written = wrap_text(template(functions).substitute(self.common_gaps() | gaps))
        return template("filter.c").substitute(
            self.common_gaps()
            | {
                "library": template("freestanding.c").substitute(self.common_gaps() | ROOTS[self.config.real]).rstrip(),
                "types": join_lines(self.types(aliases=True)),
                "constants": join_lines(constants).rstrip() + "\n",
                "helpers": "\n".join(helper_functions(text, self.config.real)),
                "kernels": text.rstrip() + "\n",
                "functions": written.rstrip(),
            }
        )

    def header(self, functions: str, whole: Iterable[str], **gaps: object) -> str:
        """The header."""
        flt = self.config.flt
        lines = [*self.types(), *whole]
        written = wrap_text(template(functions).substitute(self.common_gaps() | gaps))
        values = self.common_gaps() | {
            "about": "\n".join(f" * {line}".rstrip() for line in docstring(description(flt.params)).split("\n")),
            "citation": "\n * ".join(line.strip(" /*") for line in comment(flt.citation) if line.strip(" /*")),
            "rounding": template(f"rounding.{self.config.real}.h").template.rstrip(),
            "sizes": self.sizes(),
            "types": join_lines(lines),
            "functions": written.rstrip() + "\n",
            "health": "",
            "sensor": "",
            "aliases": aliases(self.name, written),
        }
        return template("filter.h").substitute(values | gaps)


def aliases(name: str, code: str) -> str:
    """Definitions that give the functions of a filter, and the types in them, the one name of every filter."""
    found = sorted(set(re.findall(rf"\b{name}(?:_\w+)?\b", re.sub(r"/\*.*?\*/", "", code, flags=re.DOTALL))))
    return "\n".join(f"#define {ANY_FILTER}{one.removeprefix(name)} {one}" for one in found)


def module_title(config: ExportConfig) -> str:
    """The first line of a filter module's docstring."""
    title = module_words(filters.module_of(config.flt)).split("\n")[0].rstrip(".")
    return title.removeprefix(f"{config.flt.name}: ")


def section(module: str) -> list[str]:
    """A module's docstring above its kernels: this is where the equations stand that comments refer to."""
    words = module_words(module)
    return comment(f"---- {module.rpartition('.')[2]}\n\n{words}")


def health_bits() -> str:
    """The bits of ``health``, the same in all filters; no enumerators, which on an AVR have 16 bits with a sign."""
    named = {value: name for name, value in vars(health).items() if isinstance(value, int) and name.isupper()}
    lines = ["#ifndef LH_HEALTH_BITS", "#define LH_HEALTH_BITS", "/* Bits of health. */"]
    for bit, words in sorted(health.NAMES.items()):
        lines += add_comment([f"#define LH_{named[bit]} INT32_C({bit})"], words)
    return join_lines([*lines, "#endif", ""])
