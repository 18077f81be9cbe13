"""The native engine's C: every filter of the house with the driver around it, as one file each."""

import ast
import functools
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from levelhead import filters
from levelhead.compiler.mark import KernelFunction
from levelhead.engine import smoother_kernels
from levelhead.engine.binding import bind, is_guarded
from levelhead.engine.driver import Carry, FilterRun, Settings
from levelhead.engine.native import PACKAGE, digest, native_name, smoother_name
from levelhead.engine.smoothing import BoundSmoother, bind_aided_smoother, bind_smoother
from levelhead.engine.stepper import MOST_DT
from levelhead.export.flat_program import FlatProgram, Root, classes, number_paths
from levelhead.export.graph import ARRAY, Operand, Place, Record, RecordField, Value, leaves
from levelhead.export.helpers import helper_functions
from levelhead.export.kinds import BOOL, FLOAT, INT, Array, Kind, Struct, variable, within
from levelhead.export.layout import STEP, join_lines, template
from levelhead.export.procedures import like
from levelhead.export.type_table import annotations, decimal
from levelhead.filters.contract import Filter
from levelhead.guard import Guard
from levelhead.kernels.arrays import subtract_each_row
from levelhead.kernels.vec3 import ZERO
from levelhead.version import VERSION

GENERATOR = (  # the translator of kernels to C, beside the kernels themselves
    "compiler/hooks.py",
    "compiler/mark.py",
    "engine/binding.py",
    "engine/smoother_kernels.py",
    "engine/smoothing.py",
    *(
        f"export/{name}.py"
        for name in (
            "calling",
            "constants",
            "flat_c",
            "flat_program",
            "folding",
            "fusing",
            "graph",
            "graph_builder",
            "homing",
            "kinds",
            "liveness",
            "merging",
            "names",
            "native",
            "plan",
            "procedures",
            "tracing",
            "type_table",
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
BY_HAND = {subtract_each_row: "native.subtract_each_row.c"}
PLACES = {"settings": "filter->settings", "carry": "filter->carry", "run": "filter->carry.run"}
CARRIED_STATE = {"state": "filter->carry.run.state"}
READINGS = {f"{name}_{axis}": f"{name}[{i}]" for name in ("gyr", "acc", "mag") for i, axis in enumerate("xyz")}


class Unit(Protocol):
    """One file of C: a program in double, and functions around it.

    Attributes:
        program: the kernels.
        functions: the template of the functions around them.
        has_arrays: whether a state has arrays.
        kinds: the types of those functions.
    """

    program: FlatProgram
    kinds: tuple[Struct, ...]
    functions: str
    has_arrays: bool

    def gaps(self) -> dict[str, object]:
        """The gaps of that template; asked for when the kernels are written, which finds their arrays."""


def text(unit: Unit, name: str, symbol: str) -> str:
    """The file."""
    program = unit.program
    files = tuple(sorted({*GENERATOR, *reached_files(program.modules())}))
    about = {"name": name, "symbol": symbol, "files": ",".join(files), "digest": digest(files)}
    kernels = join_lines(line for _, lines in program.sections() for line in lines)
    constants = join_lines(program.constants.lines())
    known = dict.fromkeys([*(inner for kind in unit.kinds for inner in within(kind)), *program.private_types()])
    types = [line for struct in known for line in program.types.definition(struct, {})]
    return template("native.filter.c").substitute(
        title=f"The native engine's {name}",
        version=VERSION,
        types=join_lines(types),
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
    """A module's file inside the package; None for a name that is not a module, or a package that only lists others."""
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


def _program(roots: Iterable[Root], values: Iterable[Value] = ()) -> FlatProgram:
    kept = [cls for value in values for cls in classes(value)]
    return FlatProgram("lh", "double", list(roots), kept=kept, by_hand=BY_HAND)


NUMBER, WHOLE = Operand("const", (), "float", 0.0), Operand("const", (), "int", 0)
ROW = Operand("const", (), ARRAY, shape=(1,))  # an array of a length unknown to the kernel


class ImuUnit:
    """A filter on an IMU."""

    functions = "native.imu.c"

    def __init__(self, flt: Filter, guarded: bool) -> None:
        self.flt, self.bound = flt, bind(flt, guarded)
        given = Settings(flt.params(), Guard())
        first = self.bound.begin(given)
        self._settings, self._carry = like(given), like(first)
        assert isinstance(self._settings, Record) and isinstance(self._carry, Record)
        self._run = self._carry.get("run")
        assert isinstance(self._run, Record)
        self._state = self._run.get("state")
        self.program = _program(self._roots(type(first.run.state)), [self._settings, self._carry])
        types = self.program.types
        self.settings, self.carry = types.struct(Settings), types.struct(Carry)
        self.kinds: tuple[Struct, ...] = self.settings, self.carry
        self.has_arrays = any(leaf.kind == ARRAY for leaf in leaves(self._carry))

    def _roots(self, state: type) -> Iterator[Root]:
        bound, settings, carry = self.bound, self._settings, self._carry
        assert isinstance(settings, Record)
        place = Place("carry", (RecordField(Carry, "run"), RecordField(FilterRun, "state")))
        yield Root("begin", bound.begin, [settings], homes={state: place})
        yield Root("advance", bound.advance, [settings, carry, *[like(ZERO)] * 3, NUMBER])
        yield Root("result", bound.result, [settings, self._run])
        yield Root("orientation", bound.result, [settings, self._run], pick="quat")
        if bound.update_aiding is not None and self.flt.aiding is not None:
            yield Root("aid", bound.update_aiding, [settings, carry, WHOLE, *[NUMBER] * 3])
            yield Root("place", self.flt.aiding.nav_state, [settings.get("filter"), self._state])

    def gaps(self) -> dict[str, object]:
        """The gaps of its functions' template."""
        call = self.program.call
        gaps = {
            "Settings": "Settings",
            "Carry": "Carry",
            "begin": call("begin", PLACES),
            "advance": call("advance", PLACES, READINGS | {"dt": "dt"}),
            "result": call("result", PLACES | {"output": "out"}),
            "orientation": call("orientation", PLACES),
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
        if "aid" in self.program.procedures:
            names = ("row", "value", "deviation", "age")
            rows = ["(int32_t)rows->row[k]", *(f"rows->{name}[k]" for name in names[1:])]
            place = {"params": "filter->settings.filter", "nav_state": "now"} | CARRIED_STATE
            parts = {
                "aid": call("aid", PLACES, {name: name for name in names}),
                "aided": call("aid", PLACES, dict(zip(names, rows, strict=True))),
                "place": call("place", place),
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
    has_arrays = False

    def __init__(self, flt: Filter) -> None:
        axis = flt.axis
        assert axis is not None
        params = flt.params()
        self._params, self._state = like(params), like(axis.init(params, 0.0))
        self._kernels = {"step": axis.step, "read": axis.read}
        given = {"step": [self._params, self._state, *[NUMBER] * 4], "read": [self._state]}
        roots = [Root(name, kernel, given[name], least=sys.maxsize) for name, kernel in self._kernels.items()]
        self.program = _program(roots, [self._params, self._state])
        types = self.program.types
        assert isinstance(self._state, Record)
        self.params, self.state = types.struct(flt.params), types.struct(self._state.cls)
        self.kinds: tuple[Struct, ...] = self.params, self.state
        self.said: Sequence[str] = axis.report._fields  # type: ignore[attr-defined]

    def _call(self, name: str, params: str, state: str) -> str:
        """A call of a root with the numbers of parameters and of a state."""
        words = self._kernels[name].__code__.co_varnames
        paths: dict[str, str] = {}
        records = ((self._params, params), (self._state, state)) if name == "step" else ((self._state, state),)
        for word, (value, path) in zip(words, records, strict=False):
            paths |= {content: f"{path}{inner}" for content, inner in number_paths(value, word)}
        readings = {name: name for name in ("level", "rate", "dt", "period")}
        return self.program.call(name, {}, paths | readings)

    def gaps(self) -> dict[str, object]:
        """The gaps of its functions' template."""
        writer, step, read = self.program.writer, self.program.procedures["step"], self.program.procedures["read"]
        members = writer.result_members(step).values()
        inner = [path for _, path in number_paths(self._state, "")]
        keep = "\n".join(f"{STEP}{STEP}$to{path} = next.{member};" for path, member in zip(inner, members, strict=True))
        said = zip(self.said, writer.result_members(read).values(), strict=True)
        return {
            "Params": self.program.types.name(self.params),
            "State": self.program.types.name(self.state),
            "Next": writer.result_type(step),
            "Report": writer.result_type(read),
            "step": self._call("step", "filter->params.", "filter->state."),
            "step_row": self._call("step", "params.", "state."),
            "keep": keep.replace("$to", "filter->state."),
            "keep_row": keep.replace("$to", "state."),
            "read": self._call("read", "", "filter->state."),
            "read_row": self._call("read", "", "state."),
            "set_params": set_words(self.params, "filter->params"),
            "set_state": set_words(self.state, "filter->state"),
            "get_state": get_words(self.state, "filter->state"),
            "report": join_lines(f"{STEP * 2}to[{k}] = now.{member};" for k, (_, member) in enumerate(said)).rstrip(),
            "params_words": word_count(self.params),
            "params_format": word_format(self.params),
            "state_words": word_count(self.state),
            "state_format": word_format(self.state),
            "report_words": len(self.said),
        }


class ForwardUnit(ImuUnit):
    """A filter's run forward for its smoother, which keeps its blocks."""

    def __init__(self, bound: BoundSmoother, guarded: bool) -> None:
        self._parts = bound.parts
        super().__init__(bound.flt, guarded)

    def _roots(self, state: type) -> Iterator[Root]:
        yield from super()._roots(state)
        yield Root("is_block_end", self._parts.is_block_end, [self._state])
        yield Root("keep_start", self._parts.keep_start, [self._state, ROW])
        yield Root("keep", self._parts.keep, [self._state, ROW, WHOLE])

    def _loop(self, parts: dict[str, object]) -> dict[str, object]:
        """The run that keeps blocks, in place of the plain one."""
        first = ("blocks->numbers", f"{self._parts.width} * kept")
        calls = {
            name: self.program.call(name, CARRIED_STATE, dict(zip(_arguments(kernel)[1:], first, strict=False)))
            for name, kernel in (
                ("is_block_end", self._parts.is_block_end),
                ("keep_start", self._parts.keep_start),
                ("keep", self._parts.keep),
            )
        }
        return {
            "forward": template("native.forward.c").substitute(parts | calls),
            "forward_or_null": "forward",
            "width": self._parts.width,
        }


def _arguments(function: KernelFunction) -> tuple[str, ...]:
    """The names of a kernel's arguments."""
    return function.__code__.co_varnames[: function.__code__.co_argcount]


class SmootherUnit:
    """The way back of a filter's smoother, with position and velocity if ``aided``."""

    functions = "native.smoother.c"
    has_arrays = False
    kinds: tuple[Struct, ...] = ()

    def __init__(self, bound: BoundSmoother, aided: bool) -> None:
        self._bound, self._aided = bound, aided
        kernels = {
            "backward": smoother_kernels.backward_with_nav if aided else smoother_kernels.backward,
            "compose_ends": smoother_kernels.compose_ends,
            "spread_block": smoother_kernels.spread_block,
            **({"spread_nav": smoother_kernels.spread_nav} if aided else {}),
        }
        self._kernels = {name: bound.bind(kernel) for name, kernel in kernels.items()}
        self.program = _program(
            Root(name, kernel, [WHOLE if hint is int else ROW for hint in self._hints(kernel)])
            for name, kernel in self._kernels.items()
        )

    @staticmethod
    def _hints(kernel: KernelFunction) -> list[object]:
        hints = annotations(kernel)
        return [hints[name] for name in _arguments(kernel)]

    def gaps(self) -> dict[str, object]:
        """The gaps of its functions' template."""
        kept, corrections = ["s->numbers", "s->count"], ["s->turn", "s->before", "s->bias", "s->sigma"]
        block = ["s->t", "s->numbers", "k", "s->count", "first", "last"]
        turn, before, bias, sigma = corrections
        track, found = ["s->quat", "s->biases", "s->sigmas"], ["s->nav_end", "s->nav_before"]
        given = {
            "backward": [*kept, "s->memory", turn, bias, sigma, *(found if self._aided else [])],
            "compose_ends": [*kept, turn, before],
            "spread_block": [*block, *corrections, *track],
            "spread_nav": [*block, *found, "s->nav"],
        }
        calls = {
            name: self.program.call(name, {}, dict(zip(_arguments(kernel), given[name], strict=True))) + ";"
            for name, kernel in self._kernels.items()
        }
        return (
            {"spread_nav": ""}
            | calls
            | {
                "width": self._bound.parts.width,
                "memory": self._bound.parts.memory,
                "aided": int(self._aided),
            }
        )


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
        if unit.has_arrays:
            names["wide"].append(name)
    lists = {kind: " ".join(f"X({name})" for name in listed) for kind, listed in names.items()}
    table = template("native.table.h").substitute(lists, longest=decimal(MOST_DT))
    fixed = {name: template(name).template for name in ("native.h", "native.module.c")}
    return found | fixed | {"native.table.h": table}
