"""Header and source of a filter on an IMU whose state has arrays, with the driver around it."""

from levelhead.engine import driver
from levelhead.engine.binding import bind, estimates_bias
from levelhead.export import sensor
from levelhead.export.c_api import CApi, health_bits, pointers
from levelhead.export.config import ExportConfig
from levelhead.export.kinds import FLOAT, INT, Struct, is_empty, keep_what_is_read
from levelhead.export.layout import STEP, join_lines, template, wrap_line
from levelhead.export.type_table import declarator
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, ZERO_VELOCITY
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
        self.aid = self.place = None
        if bound.update_aiding is not None and config.flt.aiding is not None:
            state = carry.fields["run"].fields["state"]  # type: ignore[union-attr]
            assert state is not None
            program.in_place.add(bound.update_aiding)
            self.aid = program.kernel(bound.update_aiding, [settings, carry, INT, FLOAT, FLOAT, FLOAT])
            self.place = program.kernel(config.flt.aiding.nav_state, [program.types.struct(config.flt.params), state])
            program.types.publish(self.place.returns)
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
            components=sensor.components(self.config, self.number),
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
        self.fields, numbers = sensor.learned_errors(self.config)
        if self.fields:
            source += template("errors.c").substitute(self.common_gaps() | numbers, one=self.number(1.0))
        return {
            f"{self.name}.h": self._header(),
            f"{self.name}.c": source + self._aiding() + self._saving() + self._copy(),
        }

    def _saving(self) -> str:
        """The calls that save and restore a filter; several arrays might change places."""
        if len(self.program.arrays) > 1:
            return ""
        return template("carry.c").substitute(self.common_gaps() | self.carry_gaps())

    def _aiding(self) -> str:
        """The calls for position, velocity and height, of a filter that takes them."""
        if self.aid is None or self.place is None:
            return ""
        whole = ["filter->settings", "filter->carry"]
        aid = self.program.call(self.aid, [*whole, "row", "value", "sigma", "age"], "&filter->carry")
        place = self.program.call(self.place, ["filter->settings.filter", "filter->carry.run.state"])
        return "\n" + template("aiding.c").substitute(
            self.common_gaps(),
            aid=aid,
            place=place,
            position=POSITION,
            velocity=VELOCITY,
            zero_velocity=ZERO_VELOCITY,
            height=HEIGHT,
        )

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
            copy=(template("aiding.h").substitute(self.common_gaps()) if self.aid else "")
            + (template("errors.h").substitute(self.common_gaps(), fields=self.fields) if self.fields else "")
            + (template("carry.h").substitute(self.common_gaps() | self.carry_gaps()) if self._saving() else "")
            + (template("copy.h").substitute(name=self.name) if self.program.arrays else ""),
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
        paths = list(pointers(self.whole))
        if not paths:
            return ""
        lines = [
            "",
            "/* The addresses of the arrays inside a filter are its own; a copy needs those of the copy. */",
            f"void {self.name}_copy({self.name} *to, const {self.name} *from)",
            "{",
            f"{STEP}*to = *from;",
        ]
        for path, array in paths:
            kind = f"{self.config.real} {declarator(array, '')}"
            shift = f"(const char *)from->{path} - (const char *)from"
            lines += wrap_line(f"to->{path} = ({kind})(void *)((char *)to + ({shift}));", STEP)
        return join_lines([*lines, "}"])
