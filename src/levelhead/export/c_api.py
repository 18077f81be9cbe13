"""Header and source of a filter: the translated kernels, and the few functions around them that a program calls."""

from collections.abc import Iterable
from typing import Any

from levelhead import filters
from levelhead.engine import driver
from levelhead.engine.binding import bind, estimates_bias
from levelhead.engine.stepper import MOST_DT
from levelhead.errors import LevelheadError
from levelhead.export import sensor
from levelhead.export.config import ExportConfig, remarks
from levelhead.export.expressions import variable
from levelhead.export.kinds import FLOAT, Array, Kind, Machine, Struct, is_empty, keep_what_is_read
from levelhead.export.layout import LONGEST, STEP, beside, comment, docstring, safe, template, wrapped
from levelhead.export.program import Kernel, Program, module_words
from levelhead.export.statements import joined
from levelhead.filters import health
from levelhead.filters.parameters import description
from levelhead.guard import Guard
from levelhead.kernels import quat
from levelhead.kernels.vec3 import Vec3
from levelhead.units import DEGREE, GRAVITY
from levelhead.version import VERSION

MACHINES = (
    Machine("64 bit (Cortex-A, x86-64)", 8, 8, 8),
    Machine("32 bit (Cortex-M, ESP32, RP2040)", 8, 4, 8),
    Machine("AVR (Uno, Mega)", 4, 2, 1),
)
CONSTANTS = {"one": 1.0, "two": 2.0, "quarter": 90.0, "turn": 360.0, "degrees": 1.0 / DEGREE, "gravity": GRAVITY}
HELPERS = {
    "lh_min(": """static {real} lh_min({real} a, {real} b)
{{
    return b < a ? b : a;
}}
""",
    "lh_max(": """static {real} lh_max({real} a, {real} b)
{{
    return b > a ? b : a;
}}
""",
    "lh_min_int(": """static int32_t lh_min_int(int32_t a, int32_t b)
{{
    return b < a ? b : a;
}}
""",
    "lh_max_int(": """static int32_t lh_max_int(int32_t a, int32_t b)
{{
    return b > a ? b : a;
}}
""",
}


class CApi:
    """What header and source of every export share.

    Attributes:
        program: the kernels.
        whole: the struct that a program holds.
    """

    def __init__(self, config: ExportConfig) -> None:
        self.config = config
        self.program = Program(config.name, config.real)
        self.whole = Struct(config.name, {})

    @property
    def name(self) -> str:
        """In front of all names."""
        return self.config.name

    def number(self, value: float) -> str:
        """A literal."""
        return self.program.number(value)

    def size(self, machine: Machine) -> int:
        """Bytes of a filter with its parameters, once it is written: that finds the arrays."""
        parts: dict[str, Kind | None] = dict(self.whole.fields)
        for name, array in self.program.arrays.items():
            for i in range(_count(array)):
                parts[f"{name}_{i}"] = FLOAT
        return machine.size(Struct(self.name, parts))[0]

    def common(self) -> dict[str, Any]:
        """What every gap of that name is filled with."""
        return {
            "name": self.name,
            "guard": self.name.upper(),
            "real": self.config.real,
            "title": f"{self.name}: {module_title(self.config)}",
            "version": VERSION,
            "command": safe(" ".join(self.config.command.split())),
            "zero": self.number(0.0),
            "longest": self.number(MOST_DT),
        }

    def sizes(self) -> str:
        """The table of sizes."""
        rows = []
        for machine in MACHINES:
            real = machine.real if self.config.real == "double" else 4
            one = Machine(machine.name, real, machine.address, machine.alignment)
            note = "; double is float there" if machine.real == 4 and self.config.real == "double" else ""
            rows.append(f" *     {machine.name + note:<58}{self.size(one):>6} bytes")
        return "\n".join(rows)

    def values(self, params: Any, struct: Kind | None, indent: str) -> list[str]:
        """The numbers of a parameter object, each with its name, as an initialiser."""
        assert isinstance(struct, Struct)
        lines = []
        for name, kind in struct.fields.items():
            value = getattr(params, name)
            try:
                text = self.program.literal(value, kind or FLOAT)
            except OverflowError as error:
                raise LevelheadError(f"{name}: {error}; export --double") from None
            default = type(params)._field_defaults.get(name)
            lines.append(f"{indent}.{variable(name)} = {text},{'' if value == default else ' /* set */'}")
        return lines

    def types(self, aliases: bool = False) -> list[str]:
        """The types that other files see; or their names in this one."""
        lines: list[str] = []
        for struct in self.program.public:
            if aliases:
                lines.append(f"typedef {self.program.public_name(struct)} {self.program.struct_name(struct)};")
            else:
                lines += self.program.definition(struct, self.remarks(struct))
        if aliases:
            lines.append("")
            for struct in self.program.private():
                lines += self.program.definition(struct)
        return lines

    def remarks(self, struct: Struct) -> dict[str, str] | None:
        """Comments on the fields of parameters."""
        if struct.origin in (self.config.flt.params, Guard):
            return remarks(struct.origin)
        return None

    def call(self, kernel: Kernel, values: list[str], to: str = "") -> str:
        """A call of a kernel from outside of the language; ``to``: where one that writes in place does so."""
        function = kernel.source.function
        given = [to] if to else []
        given += ["&filter->arrays"] if self.program.makes(function) else []
        for value, (kind, addressed) in zip(values, self.program.passing(function), strict=True):
            if not is_empty(kind):
                given.append(f"&{value}" if addressed else value)
        star = "*" if self.program.handed_back(function) is not None else ""
        return f"{star}{kernel.name}({', '.join(given)})"

    def body(self) -> tuple[list[str], list[str]]:
        """All kernels, and the constants that they use."""
        lines: list[str] = []
        for module, kernels in self.program.sections():
            lines += [*section(module), "", *kernels]
        return lines, self.program.constants()

    def source(self, functions: str, **gaps: Any) -> str:
        """The C file."""
        kernels, constants = self.body()
        text = joined([*kernels])
        used = [code.format(real=self.config.real) for call, code in HELPERS.items() if f"{call}" in text]
        written = fitted(template(functions).substitute(self.common() | gaps))
        return template("filter.c").substitute(
            self.common()
            | {
                "types": joined(self.types(aliases=True)),
                "constants": joined(constants).rstrip() + "\n",
                "helpers": "\n".join(used),
                "kernels": text.rstrip() + "\n",
                "includes": "#include <string.h>\n" if "memset(" in text else "",
                "functions": written.rstrip(),
            }
        )

    def header(self, functions: str, whole: Iterable[str], **gaps: Any) -> str:
        """The header."""
        flt = self.config.flt
        lines = [*self.types(), *self.program.arrays_definition(), *whole]
        written = fitted(template(functions).substitute(self.common() | gaps))
        values = self.common() | {
            "about": "\n".join(f" * {line}".rstrip() for line in docstring(description(flt.params)).split("\n")),
            "citation": "\n * ".join(line.strip(" /*") for line in comment(flt.citation) if line.strip(" /*")),
            "bits": ", to the bit" if self.config.real == "double" else " but for the rounding of float",
            "sizes": self.sizes(),
            "types": joined(lines),
            "functions": written.rstrip() + "\n",
            "health": "",
            "sensor": "",
        }
        return template("filter.h").substitute(values | gaps)


def fitted(text: str) -> str:
    """Code whose long lines are broken."""
    lines: list[str] = []
    for line in text.split("\n"):
        code = line.lstrip()
        fits = len(line) <= LONGEST or code.startswith(("/*", "*", "//"))
        lines += [line] if fits else wrapped(code, line[: len(line) - len(code)])
    return "\n".join(lines)


def module_title(config: ExportConfig) -> str:
    """The first line of what a filter's module says of itself."""
    title = module_words(filters.module_of(config.flt)).split("\n")[0].rstrip(".")
    return title.removeprefix(f"{config.flt.name}: ")


def section(module: str) -> list[str]:
    """A module's docstring above its kernels: this is where the equations stand that comments refer to."""
    words = module_words(module)
    return comment(f"---- {module.rpartition('.')[2]}\n\n{words}")


def health_bits() -> str:
    """The bits of ``health``, the same in all filters."""
    named = {value: name for name, value in vars(health).items() if isinstance(value, int) and name.isupper()}
    lines = ["#ifndef LH_HEALTH_BITS", "#define LH_HEALTH_BITS", "/* Bits of health. */", "enum {"]
    for bit, words in sorted(health.NAMES.items()):
        lines += beside([f"{STEP}LH_{named[bit]} = {bit},"], words)
    return joined([*lines, "};", "#endif", ""])


def _count(array: Array) -> int:
    count = 1
    for size in array.shape:
        count *= size
    return count


class ImuApi(CApi):
    """A filter on an IMU, with the driver around it: NaN, gaps, the guard, sigma and health are those of Python."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        bound, program = bind(config.flt, config.guard is not None), self.program
        settings = program.struct(driver.Settings)
        settings.fields["filter"] = program.struct(config.flt.params)
        vector = program.struct(Vec3)
        self.correction = sensor.Correction(config, program)
        self.begin = program.kernel(bound.begin, [settings])
        carry = self.begin.returns
        program.written.add(bound.advance)
        self.advance = program.kernel(bound.advance, [settings, carry, vector, vector, vector, FLOAT])
        assert isinstance(carry, Struct) and carry.fields["run"] is not None
        self.result = program.kernel(bound.result, [settings, carry.fields["run"]])
        self.euler = program.kernel(quat.to_euler, [program.struct(quat.Quat)])
        for part in (settings.fields["filter"], settings.fields["guard"]):
            assert isinstance(part, Struct)
            keep_what_is_read(part)
        program.called[program.struct(config.flt.params)] = "params"
        for kind in (settings, carry, self.result.returns, self.euler.returns):
            program.publish(kind)
        self.settings = settings
        self.whole.fields.update(settings=settings, carry=carry)
        if self.correction.errors is not None:
            self.whole.fields["errors"] = self.correction.errors

    def write(self) -> dict[str, str]:
        """File name -> text."""
        source = self.source(
            "imu.functions.c",
            values=self._values(),
            components=sensor.components(self.config),
            mounted=sensor.mounted(self.config),
            table=sensor.prior_table(self.config, self.program),
            told=sensor.prior_start(self.config),
            begin=self.call(self.begin, ["filter->settings"]),
            advance=self.call(
                self.advance, ["filter->settings", "filter->carry", *self.correction.arguments, "dt"], "&filter->carry"
            ),
            result=self.call(self.result, ["filter->settings", "filter->carry.run"]),
            **{name: self.number(value) for name, value in CONSTANTS.items()},
            **self._corrected(),
        )
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source + self._copy()}

    def _values(self) -> str:
        return (joined(self._settings()) + self.correction.start()).rstrip()

    def _corrected(self) -> dict[str, str]:
        """The function that corrects readings, and its use in an update; empty where nothing is corrected."""
        if not self.config.corrects:
            return {"corrected": "", "now": ""}
        kernel = self.correction.kernel
        value = "(Readings){three(gyr), three(acc), three(mag)}"
        body = [f"return {self.call(kernel, ['filter->errors', *sensor.GIVEN])};"] if kernel else []
        body = body or ["(void)filter;", f"return {value};"]
        return {
            "corrected": template("corrected.c").substitute(self.common(), body=f"\n{STEP}".join(body)),
            "now": f"{STEP}const Readings now = {self.name}_corrected(filter, gyr, acc, mag);\n",
        }

    def _settings(self) -> list[str]:
        if is_empty(self.settings):
            return []
        lines = [f"{STEP}filter->settings = (Settings){{"]
        given = {"filter": self.config.params, "guard": self.config.guard or Guard()}
        for name, kind in self.settings.fields.items():
            if not is_empty(kind):
                lines += [f"{STEP * 2}.{name} = {{", *self.values(given[name], kind, STEP * 3), f"{STEP * 2}}},"]
        return [*lines, f"{STEP}}};"]

    def _header(self) -> str:
        whole = ["/* A filter: what a human sets, and what goes from one sample to the next. */", "typedef struct {"]
        for name, kind in self.whole.fields.items():
            assert kind is not None
            whole += [] if is_empty(kind) else [f"{STEP}{self.program.kind(kind, public=True)} {name};"]
        whole += [f"{STEP}{self.program.arrays_type} arrays;"] if self.program.arrays else []
        whole += [f"}} {self.name};", ""]
        flt = self.config.flt
        bias = estimates_bias(flt, self.config.guarded)
        field, frame = sensor.field_unit(self.config), sensor.frame(self.config)
        return self.header(
            "imu.functions.h",
            whole,
            copy=template("copy.h").substitute(name=self.name) if self.program.arrays else "",
            no_bias="" if bias else "; zero, as this filter estimates none",
            health=health_bits() + "\n",
            init_call=f"{self.name}_init(&filter)",
            loop=f" *     for each sample: {self.name}_update(&filter, gyr, acc, mag, dt);\n"
            f" *     {self.name}_quat q = {self.name}_quaternion(&filter);",
            sensor=sensor.about(self.config),
            field=field,
            frame=frame,
            corrected=template("corrected.h").substitute(name=self.name, real=self.config.real)
            if self.config.corrects
            else "",
            units=f"gyr rad/s, acc m/s² (a level sensor at rest reads 0, 0, +9.81), mag {field}, dt s;\n"
            f" * q turns {frame} into earth (x east, y magnetic north, z up). A sensor that is not there is NULL.",
        )

    def _copy(self) -> str:
        """Nothing, unless arrays lie inside the struct and are pointed to."""
        paths = list(_pointers(self.whole))
        if not paths:
            return ""
        lines = [
            "",
            "/* The addresses of the arrays inside a filter are its own; a copy needs those of the copy. */",
            f"void {self.name}_copy({self.name} *to, const {self.name} *from)",
            "{",
            f"{STEP}*to = *from;",
        ]
        for path in paths:
            shift = f"(const char *)from->{path} - (const char *)from"
            lines += wrapped(f"to->{path} = (void *)((char *)to + ({shift}));", STEP)
        return joined([*lines, "}"])


def _pointers(struct: Struct) -> Iterable[str]:
    """The members of a struct, and of structs inside, that are addresses of arrays."""
    for name, kind in struct.fields.items():
        if isinstance(kind, Array):
            yield variable(name)
        elif isinstance(kind, Struct):
            yield from (f"{variable(name)}.{inner}" for inner in _pointers(kind))


class AxisApi(CApi):
    """A filter on one noisy level and its drifting rate; it keeps no more than its step reads."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        axis, program = config.flt.axis, self.program
        assert axis is not None
        self.params = program.struct(config.flt.params)
        self.begin = program.kernel(axis.init, [self.params, FLOAT])
        self.state = self.begin.returns
        assert isinstance(self.state, Struct)
        self.state.known.clear()
        self.step = program.kernel(axis.step, [self.params, self.state, FLOAT, FLOAT, FLOAT, FLOAT])
        self.kept = {name: kind for name, kind in self.state.fields.items() if name in self.state.known}
        self.read = program.kernel(axis.read, [self.state])
        self.report = self.read.returns
        assert isinstance(self.report, Struct)
        keep_what_is_read(self.params)
        program.publish(self.params)
        assert isinstance(self.params, Struct)
        program.called |= {self.params: "params", self.report: "report"}
        for kind in (self.report, *self.kept.values()):
            assert kind is not None
            program.publish(kind)
        self.whole.fields.update(params=self.params, **self.kept)

    def write(self) -> dict[str, str]:
        """File name -> text."""
        program = self.program
        assert isinstance(self.state, Struct) and isinstance(self.report, Struct)
        names = [variable(name) for name in self.kept]
        source = self.source(
            "axis.functions.c",
            values=joined(self.values(self.config.params, self.params, STEP * 2)).rstrip(),
            params=program.struct_name(self.params),
            state=program.struct_name(self.state),
            kept=joined(f"{STEP}filter->{name} = state->{name};" for name in names).rstrip(),
            restored=", ".join(f".{name} = filter->{name}" for name in names),
            begin=self.call(self.begin, ["filter->params", "level"]),
            step=self.call(self.step, ["filter->params", "before", "level", "rate", "dt", "period"]),
            read=self.call(self.read, ["state"]),
        )
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source}

    def _header(self) -> str:
        assert isinstance(self.report, Struct)
        whole = ["/* A filter: what a human sets, and what goes from one sample to the next. */", "typedef struct {"]
        for name, kind in self.whole.fields.items():
            assert kind is not None
            whole.append(f"{STEP}{self.program.kind(kind, public=True)} {variable(name)};")
        whole += [f"}} {self.name};", ""]
        return self.header(
            "axis.functions.h",
            whole,
            init_call=f"{self.name}_init(&filter, first_angle)",
            loop=f" *     {self.name}_report now;\n"
            f" *     for each sample: {self.name}_update(&filter, angle, rate, dt, 360.0, &now);",
            units="Any unit will do, as long as rate is in units of the level per unit of dt, and parameters are too.",
        )


def build_c_api(config: ExportConfig) -> CApi:
    """Header and source of what was chosen."""
    return AxisApi(config) if config.axis else ImuApi(config)
