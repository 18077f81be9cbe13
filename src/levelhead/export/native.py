"""The native engine's C: every filter of the house with the driver around it, as one file each."""

import ast
import functools
from collections.abc import Iterable, Iterator
from typing import Protocol

from levelhead import filters
from levelhead.compiler.mark import KernelFunction
from levelhead.engine import driver, smoother_kernels
from levelhead.engine.binding import bind, is_guarded
from levelhead.engine.native import PACKAGE, digest, native_name, smoother_name
from levelhead.engine.smoothing import BoundSmoother, bind_aided_smoother, bind_smoother
from levelhead.engine.stepper import MOST_DT
from levelhead.export.helpers import helper_functions
from levelhead.export.kinds import BOOL, FLOAT, INT, Array, Kind, Struct, variable
from levelhead.export.layout import STEP, join_lines, template
from levelhead.export.program import Kernel, Program
from levelhead.export.type_table import decimal
from levelhead.filters.contract import Filter
from levelhead.kernels.vec3 import Vec3
from levelhead.version import VERSION

GENERATOR = (  # what makes C of kernels, beside the kernels themselves
    "compiler/hooks.py",
    "compiler/mark.py",
    "engine/binding.py",
    "engine/smoother_kernels.py",
    "engine/smoothing.py",
    *(
        f"export/{name}.py"
        for name in (
            "native",
            "program",
            "statements",
            "pointers",
            "expressions",
            "inference",
            "constants",
            "type_table",
            "kinds",
            "scopes",
        )
    ),
    *(
        f"export/templates/native.{name}"
        for name in (
            "h",
            "filter.c",
            "imu.c",
            "axis.c",
            "run.c",
            "aid.c",
            "aided.c",
            "place.c",
            "forward.c",
            "smoother.c",
            "module.c",
            "subtract_each_row.c",
        )
    ),
)


class Unit(Protocol):
    """What one file of C is made of: a program in double, and functions around it.

    Attributes:
        program: the kernels.
        functions: the template of the functions around them.
    """

    program: Program
    functions: str

    def gaps(self) -> dict[str, object]:
        """What that template leaves open; asked for when the kernels are written, which finds their arrays."""


def text(unit: Unit, name: str, symbol: str) -> str:
    """The file."""
    program = unit.program
    files = tuple(sorted({*GENERATOR, *reached_files(program.modules())}))
    about = {"name": name, "symbol": symbol, "files": ",".join(files), "digest": digest(files)}
    kernels = join_lines(line for _, lines in program.sections() for line in lines)
    constants = join_lines(program.constants.lines())
    types = [line for struct in program.private_types() for line in program.types.definition(struct, {})]
    return template("native.filter.c").substitute(
        title=f"The native engine's {name}",
        version=VERSION,
        types=join_lines([*types, *program.arrays_definition()]),
        constants=constants,
        helpers="\n".join(helper_functions(kernels, "double")),
        kernels=kernels,
        functions=template(unit.functions).substitute(unit.gaps() | about),
    )


def reached_files(modules: Iterable[str]) -> set[str]:
    """The files of these modules and of all that they import of the house, as paths inside the package."""
    found: set[str] = set()
    waiting = {name for name in modules if name.startswith("levelhead.")}
    while waiting:
        path = _path(waiting.pop())
        if path is None or path in found:
            continue
        found.add(path)
        waiting |= _imports(path)
    return found


@functools.cache
def _imports(path: str) -> set[str]:
    """Names of the house that a file imports from, and which of them may be modules."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((PACKAGE / path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("levelhead."):
            found |= {str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def _path(module: str) -> str | None:
    """A module's file inside the package; None for a name that is no module, or a package that only lists others."""
    stem = module.removeprefix("levelhead.").replace(".", "/")
    if stem in ("filters", "engine", "errors"):  # lists of others; sentences
        return None
    return next((path for path in (f"{stem}.py", f"{stem}/__init__.py") if (PACKAGE / path).is_file()), None)


def kind_leaves(kind: Kind | None, path: str) -> Iterator[tuple[str, Kind]]:
    """The numbers and arrays inside a value, in order, each with its place in C."""
    if isinstance(kind, Struct):
        for name, part in kind.fields.items():
            yield from kind_leaves(part, f"{path}.{variable(name)}")
    else:
        assert kind is not None
        yield path, kind


def word_count(kind: Kind | None) -> int:
    """How many words a value takes."""
    return sum(_length(leaf) for _, leaf in kind_leaves(kind, ""))


def word_format(kind: Kind | None) -> str:
    """The same as Python's ``struct`` names them."""
    return "=" + "".join(
        f"{_length(leaf)}d" if isinstance(leaf, Array) else "d" if leaf is FLOAT else "q"
        for _, leaf in kind_leaves(kind, "")
    )


def _length(kind: Kind) -> int:
    length = 1
    for size in kind.shape if isinstance(kind, Array) else ():
        length *= size
    return length


def get_words(kind: Kind | None, path: str) -> str:
    """C that puts a value into the words ``to``."""
    lines, at = [], 0
    for place, leaf in kind_leaves(kind, path):
        if isinstance(leaf, Array):
            lines.append(f"memcpy(to + {at}, {place}, {_length(leaf)} * sizeof(lh_word));")
        else:
            lines.append(f"to[{at}].{'number' if leaf is FLOAT else 'whole'} = {place};")
        at += _length(leaf)
    return "\n".join(STEP + line for line in lines or ["(void)filter, (void)to;"])


TAKEN: dict[Kind, str] = {FLOAT: "number", INT: "whole", BOOL: "whole != 0"}


def set_words(kind: Kind | None, path: str) -> str:
    """C that takes a value from the words ``from``."""
    lines, at = [], 0
    for place, leaf in kind_leaves(kind, path):
        if isinstance(leaf, Array):
            lines.append(f"memcpy({place}, from + {at}, {_length(leaf)} * sizeof(lh_word));")
        else:
            lines.append(f"{place} = from[{at}].{TAKEN[leaf]};")
        at += _length(leaf)
    return "\n".join(STEP + line for line in lines or ["(void)filter, (void)from;"])


def _program() -> Program:
    return Program("lh", "double", inline=True)


class ImuUnit:
    """A filter on an IMU."""

    functions = "native.imu.c"

    def __init__(self, flt: Filter, guarded: bool) -> None:
        self.program = program = _program()
        self.flt, self.bound = flt, bind(flt, guarded)
        self.settings = program.types.struct(driver.Settings)
        self.settings.fields["filter"] = program.types.struct(flt.params)
        vector = program.types.struct(Vec3)
        self.begin = program.kernel(self.bound.begin, [self.settings])
        self.carry = self.begin.returns
        self.advance = program.kernel(self.bound.advance, [self.settings, self.carry, vector, vector, vector, FLOAT])
        assert isinstance(self.carry, Struct)
        run = self.carry.fields["run"]
        assert isinstance(run, Struct) and run.fields["state"] is not None
        self.result = program.kernel(self.bound.result, [self.settings, run])
        self.aid = self.place = None
        if self.bound.update_aiding is not None and flt.aiding is not None:
            numbers = [INT, FLOAT, FLOAT, FLOAT]
            self.aid = program.kernel(self.bound.update_aiding, [self.settings, self.carry, *numbers])
            self.place = program.kernel(flt.aiding.nav_state, [program.types.struct(flt.params), run.fields["state"]])

    def gaps(self) -> dict[str, object]:
        """What the template of its functions leaves open."""
        whole, loop = ["filter->settings", "filter->carry"], ["settings", "carry"]
        readings = ["three(gyr)", "three(acc)", "three(mag)", "dt"]
        kinds = {"Settings": self.settings, "Carry": self.carry, "Output": self.result.returns}
        gaps = {
            **{name: self.program.types.name(kind) for name, kind in kinds.items()},
            "arrays": f"{self.program.arrays_type} arrays;" if self.program.arrays else "",
            "begin": self.program.call(self.begin, whole[:1]),
            "report": self.program.call(self.result, [whole[0], "filter->carry.run"]),
            "advance": self.program.call(self.advance, [*loop, *readings]),
            "result": self.program.call(self.result, ["settings", "carry.run"]),
            "set_settings": set_words(self.settings, "filter->settings"),
            "set_carry": set_words(self.carry, "filter->carry"),
            "get_carry": get_words(self.carry, "filter->carry"),
            "settings_words": word_count(self.settings),
            "settings_format": word_format(self.settings),
            "carry_words": word_count(self.carry),
            "carry_format": word_format(self.carry),
            **dict.fromkeys(("aid", "aided", "place", "run", "forward"), ""),
            **dict.fromkeys(("aid_or_null", "run_or_null", "forward_or_null"), "NULL"),
            "width": 0,
        }
        if self.aid is not None and self.place is not None:
            one = ["row", "value", "deviation", "age"]
            rows = ["(int32_t)rows->row[k]", *(f"rows->{name}[k]" for name in one[1:])]
            parts = {
                "aid": self.program.call(self.aid, [*whole, *one]),
                "aided": self.program.call(self.aid, [*loop, *rows]),
                "place": self.program.call(self.place, ["settings.filter", "carry.run.state"]),
                "NavState": self.program.types.name(self.place.returns),
            }
            gaps |= {name: template(f"native.{name}.c").substitute(parts) for name in ("aid", "aided", "place")}
            gaps["aid_or_null"] = "aid"
        return gaps | self._loop(gaps)

    def _loop(self, parts: dict[str, object]) -> dict[str, object]:
        """The function that goes through samples; a second one would take as long again to compile."""
        return {"run": template("native.run.c").substitute(parts), "run_or_null": "run"}


class AxisUnit:
    """A filter on one level and its rate."""

    functions = "native.axis.c"

    def __init__(self, flt: Filter) -> None:
        self.program = program = _program()
        axis = flt.axis
        assert axis is not None
        self.params = program.types.struct(flt.params)
        self.state = program.kernel(axis.init, [self.params, FLOAT]).returns
        self.step = program.kernel(axis.step, [self.params, self.state, FLOAT, FLOAT, FLOAT, FLOAT])
        self.read = program.kernel(axis.read, [self.state])

    def gaps(self) -> dict[str, object]:
        """What the template of its functions leaves open."""
        readings, program = ["level", "rate", "dt", "period"], self.program
        said = self.read.returns
        assert isinstance(said, Struct)
        return {
            "Params": program.types.name(self.params),
            "State": program.types.name(self.state),
            "Report": program.types.name(said),
            "step": self.program.call(self.step, ["filter->params", "filter->state", *readings]),
            "step_row": self.program.call(self.step, ["params", "state", *readings]),
            "read": self.program.call(self.read, ["filter->state"]),
            "read_row": self.program.call(self.read, ["state"]),
            "set_params": set_words(self.params, "filter->params"),
            "set_state": set_words(self.state, "filter->state"),
            "get_state": get_words(self.state, "filter->state"),
            "report": join_lines(
                f"{STEP * 2}to[{k}] = now.{variable(name)};" for k, name in enumerate(said.fields)
            ).rstrip(),
            "params_words": word_count(self.params),
            "params_format": word_format(self.params),
            "state_words": word_count(self.state),
            "state_format": word_format(self.state),
            "report_words": word_count(said),
        }


ROW = Array((1,))  # an array whose length the kernel does not know


class ForwardUnit(ImuUnit):
    """A filter's run forward for its smoother, which keeps its blocks."""

    def __init__(self, bound: BoundSmoother, guarded: bool) -> None:
        super().__init__(bound.flt, guarded)
        parts = bound.parts
        self._width = parts.width
        assert isinstance(self.carry, Struct)
        run = self.carry.fields["run"]
        assert isinstance(run, Struct)
        state = run.fields["state"]
        assert state is not None
        self._is_block_end = self.program.kernel(parts.is_block_end, [state])
        self._keep_start = self.program.kernel(parts.keep_start, [state, ROW])
        self._keep = self.program.kernel(parts.keep, [state, ROW, INT])

    def _loop(self, parts: dict[str, object]) -> dict[str, object]:
        """The run that keeps blocks, in place of the plain one."""
        calls = {
            "is_block_end": self.program.call(self._is_block_end, ["carry.run.state"]),
            "keep_start": self.program.call(self._keep_start, ["carry.run.state", "blocks->numbers"]),
            "keep": self.program.call(self._keep, ["carry.run.state", "blocks->numbers", f"{self._width} * kept"]),
        }
        return {
            "forward": template("native.forward.c").substitute(parts | calls),
            "forward_or_null": "forward",
            "width": self._width,
        }


class SmootherUnit:
    """The way back of a filter's smoother, with position and velocity if ``aided``."""

    functions = "native.smoother.c"

    def __init__(self, bound: BoundSmoother, aided: bool) -> None:
        self.program, self._bound, self._aided = _program(), bound, aided
        backward = smoother_kernels.backward_with_nav if aided else smoother_kernels.backward
        block: list[Kind] = [ROW, ROW, INT, INT, INT, INT]
        self._backward = self._kernel(backward, [ROW, INT, *[ROW] * (6 if aided else 4)])
        self._compose = self._kernel(smoother_kernels.compose_ends, [ROW, INT, ROW, ROW])
        self._spread = self._kernel(smoother_kernels.spread_block, [*block, *[ROW] * 7])
        self._spread_nav = self._kernel(smoother_kernels.spread_nav, [*block, *[ROW] * 3]) if aided else None

    def _kernel(self, function: KernelFunction, kinds: list[Kind]) -> Kernel:
        return self.program.kernel(self._bound.bind(function), kinds)

    def gaps(self) -> dict[str, object]:
        """What the template of its functions leaves open."""
        kept, corrections = ["s->numbers", "s->count"], ["s->turn", "s->before", "s->bias", "s->sigma"]
        block = ["s->t", "s->numbers", "k", "s->count", "first", "last"]
        turn, before, bias, sigma = corrections
        track, found = ["s->quat", "s->biases", "s->sigmas"], ["s->nav_end", "s->nav_before"]
        back = [*kept, "s->memory", turn, bias, sigma, *(found if self._aided else [])]
        spread_nav = self._spread_nav and self.program.call(self._spread_nav, [*block, *found, "s->nav"])
        return {
            "backward": self.program.call(self._backward, back),
            "compose_ends": self.program.call(self._compose, [*kept, turn, before]),
            "spread_block": self.program.call(self._spread, [*block, *corrections, *track]),
            "spread_nav": f"{spread_nav};" if spread_nav else "",
            "width": self._bound.parts.width,
            "memory": self._bound.parts.memory,
            "aided": int(self._aided),
        }


def smoothers(flt: Filter, guarded: bool) -> dict[bool, BoundSmoother]:
    """The smoothers of a filter: False: without position, velocity and height; True: with them."""
    found = {} if flt.smoothing is None else {False: bind_smoother(flt, guarded)}
    return found if flt.aided_smoothing is None else found | {True: bind_aided_smoother(flt, guarded)}


def units() -> Iterator[tuple[str, str, Unit]]:
    """Every filter of the house, ("imu" or "axis", name, unit): with the guard and without, and on one axis."""
    for flt in filters.ALL:
        for guarded in (True, False) if is_guarded(flt) else (False,):
            yield "imu", native_name(flt, guarded), ImuUnit(flt, guarded)
            for bound in smoothers(flt, guarded).values():
                yield "imu", native_name(bound.flt, guarded), ForwardUnit(bound, guarded)
        for aided, bound in smoothers(flt, True).items():
            yield "smoother", smoother_name(flt, aided), SmootherUnit(bound, aided)
        if flt.axis is not None:
            yield "axis", flt.name, AxisUnit(flt)


def sources() -> dict[str, str]:
    """File name -> text of all that the extension is compiled from."""
    names: dict[str, list[str]] = {"imu": [], "axis": [], "smoother": [], "wide": []}
    found = {}
    for kind, name, unit in units():
        found[f"lh_{kind}_{name}.c"] = text(unit, name, f"lh_{kind}_{name}")
        names[kind].append(name)
        if unit.program.arrays:
            names["wide"].append(name)
    lists = {kind: " ".join(f"X({name})" for name in listed) for kind, listed in names.items()}
    table = template("native.table.h").substitute(lists, longest=decimal(MOST_DT))
    fixed = {name: template(name).template for name in ("native.h", "native.module.c")}
    return found | fixed | {"native.table.h": table}
