"""Header and source of a filter on an IMU whose state has arrays, with the driver around it."""

from collections.abc import Iterable

from levelhead.engine import driver
from levelhead.engine.binding import bind, estimates_bias
from levelhead.export import sensor
from levelhead.export.c_api import CApi, health_bits
from levelhead.export.config import ExportConfig
from levelhead.export.kinds import FLOAT, Array, Struct, is_empty, keep_what_is_read, variable
from levelhead.export.layout import STEP, join_lines, template, wrap_line
from levelhead.guard import Guard
from levelhead.kernels import quat
from levelhead.kernels.vec3 import Vec3
from levelhead.units import DEGREE, GRAVITY

CONSTANTS = {"one": 1.0, "two": 2.0, "quarter": 90.0, "turn": 360.0, "degrees": 1.0 / DEGREE, "gravity": GRAVITY}


class ArrayApi(CApi):
    """A filter with arrays, with the driver around it: NaN, gaps, the guard, sigma and health are those of Python."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        bound, program = bind(config.flt, config.guard is not None), self.program
        settings = program.types.struct(driver.Settings)
        settings.fields["filter"] = program.types.struct(config.flt.params)
        vector = program.types.struct(Vec3)
        self.correction = sensor.ReadingCorrection(config, program)
        self.begin = program.kernel(bound.begin, [settings])
        carry = self.begin.returns
        program.in_place.add(bound.advance)
        self.advance = program.kernel(bound.advance, [settings, carry, vector, vector, vector, FLOAT])
        assert isinstance(carry, Struct) and carry.fields["run"] is not None
        self.result = program.kernel(bound.result, [settings, carry.fields["run"]])
        self.euler = program.kernel(quat.to_euler, [program.types.struct(quat.Quat)])
        for part in (settings.fields["filter"], settings.fields["guard"]):
            assert isinstance(part, Struct)
            keep_what_is_read(part)
        program.types.public_names[program.types.struct(config.flt.params)] = "params"
        for kind in (settings, carry, self.result.returns, self.euler.returns):
            program.types.publish(kind)
        self.settings = settings
        self.whole.fields.update(settings=settings, carry=carry)
        if self.correction.errors is not None:
            self.whole.fields["errors"] = self.correction.errors

    def arrays_definition(self) -> list[str]:
        """The storage of arrays."""
        return self.program.arrays_definition()

    def write(self) -> dict[str, str]:
        """File name -> text."""
        source = self.source(
            "array.functions.c",
            values=self._values(),
            components=sensor.components(self.config),
            mounted=sensor.axes_comment(self.config),
            table=sensor.prior_table(self.config, self.program),
            told=sensor.prior_start(self.config),
            begin=self.program.call(self.begin, ["filter->settings"]),
            advance=self.program.call(
                self.advance, ["filter->settings", "filter->carry", *self.correction.arguments, "dt"], "&filter->carry"
            ),
            result=self.program.call(self.result, ["filter->settings", "filter->carry.run"]),
            **{name: self.number(value) for name, value in CONSTANTS.items()},
            **self._correction_function(),
        )
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source + self._copy()}

    def _values(self) -> str:
        return (join_lines(self._settings()) + self.correction.start()).rstrip()

    def _correction_function(self) -> dict[str, str]:
        """The function that corrects readings, and its use in an update; empty where nothing is corrected."""
        if not self.config.corrects:
            return {"corrected": "", "now": ""}
        kernel = self.correction.kernel
        value = "(Readings){three(gyr), three(acc), three(mag)}"
        body = [f"return {self.program.call(kernel, ['filter->errors', *sensor.GIVEN])};"] if kernel else []
        body = body or ["(void)filter;", f"return {value};"]
        return {
            "corrected": template("array.corrected.c").substitute(self.common_gaps(), body=f"\n{STEP}".join(body)),
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
            whole += [] if is_empty(kind) else [f"{STEP}{self.program.types.name(kind, public=True)} {name};"]
        whole += [f"{STEP}{self.program.arrays_type} arrays;"] if self.program.arrays else []
        whole += [f"}} {self.name};", ""]
        flt = self.config.flt
        bias = estimates_bias(flt, self.config.guarded)
        field, frame = sensor.field_unit(self.config), sensor.frame(self.config)
        return self.header(
            "array.functions.h",
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
            lines += wrap_line(f"to->{path} = (void *)((char *)to + ({shift}));", STEP)
        return join_lines([*lines, "}"])


def _pointers(struct: Struct) -> Iterable[str]:
    """The members of a struct, and of structs inside, that are addresses of arrays."""
    for name, kind in struct.fields.items():
        if isinstance(kind, Array):
            yield variable(name)
        elif isinstance(kind, Struct):
            yield from (f"{variable(name)}.{inner}" for inner in _pointers(kind))
