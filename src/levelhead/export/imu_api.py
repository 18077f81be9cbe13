"""Header and source of a filter on an IMU, with the driver around it: no more of both than a program asks for."""

from collections.abc import Iterator, Mapping

from levelhead.engine.binding import bind, estimates_bias
from levelhead.engine.driver import Carry, FilterRun
from levelhead.export import frame, sensor, temperature
from levelhead.export.c_api import CApi, health_bits
from levelhead.export.config import ExportConfig
from levelhead.export.flat_program import FlatProgram, Root
from levelhead.export.graph import Operand, Place, Record, RecordField
from levelhead.export.kinds import FLOAT, Struct, is_empty
from levelhead.export.layout import STEP, join_lines, template
from levelhead.export.procedures import like
from levelhead.filters.contract import HEIGHT, POSITION, VELOCITY, ZERO_VELOCITY, NavState
from levelhead.guard import Guard
from levelhead.guard.stance import StanceState, begin_stance, step_stance
from levelhead.kernels import correction, quat
from levelhead.kernels.vec3 import ZERO
from levelhead.units import DEGREE, GRAVITY

CONSTANTS = {"one": 1.0, "two": 2.0, "turn": 360.0, "degrees": 1.0 / DEGREE, "gravity": GRAVITY}
PLACES = {"settings": "filter->settings", "carry": "filter->carry", "run": "filter->carry.run"}
STANCE = "stance[0]"  # at the pointer that a program gives
UNUSED = f"{STEP}(void)filter; /* zero at any time */\n{STEP}"
TYPES = {"quaternion": "quat", "bias": "vec3", "sigma": "vec3"}


class ImuApi(CApi):
    """A filter on an IMU, with the driver around it: NaN, gaps, the guard, sigma and health are those of Python."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        frozen = (type(config.settings), type(config.params), Guard) if "parameters" in config.without else ()
        self.fields, self._learned = sensor.learned_errors(config)
        self._carry = config.begin()
        self.program = FlatProgram(
            config.name, config.real, list(self._roots()), self._carry, self._kept(), frozen, prefixes()
        )
        types = self.program.types
        settings, carry = types.struct(type(config.settings)), types.struct(Carry)
        types.public_names[types.struct(config.flt.params)] = "params"
        self.whole.fields.update({"carry": carry} if frozen else {"settings": settings, "carry": carry})
        for kind in (*self.whole.fields.values(), types.struct(quat.Quat), types.struct(quat.Euler)):
            types.publish(kind or FLOAT)
        if "place" in self.program.procedures:
            types.publish(types.struct(NavState))
            types.public_names[types.struct(StanceState)] = "stance"
            types.publish(types.struct(StanceState))
        if config.corrects:
            types.publish(types.struct(correction.Readings))
        if config.corrections is not None:
            errors = types.struct(correction.SensorErrors)
            types.publish(errors)
            self.whole.fields["errors"] = errors
        if config.curves:
            change = types.struct(temperature.BiasChange)
            types.publish(change)
            self.whole.fields["bias_change"] = change

    def _kept(self) -> list[type]:
        kept: list[type] = [type(self.config.settings), Carry]
        if self.fields:
            kept.append(type(self._carry.run.state))
        if self.config.corrections is not None:
            kept.append(correction.SensorErrors)
        if self.config.flt.aiding is not None:
            kept.append(StanceState)
        return [*kept, correction.Readings] if self.config.corrects else kept

    def _roots(self) -> Iterator[Root]:
        config, bound = self.config, bind(self.config.flt, self.config.guard is not None)
        settings, carry, vector = like(config.settings), like(self._carry), like(ZERO)
        assert isinstance(settings, Record) and isinstance(carry, Record)
        run, number = carry.get("run"), Operand("const", (), "float", 0.0)
        state = Place("carry", prefixes()["state"])
        homes = {type(self._carry.run.state): state}
        yield Root("begin", bound.begin, [settings], alone=True, fixed=self._fixed(), homes=homes)
        yield Root("advance", bound.advance, [settings, carry, vector, vector, vector, number], fixed=self._fixed())
        for name, field in config.answers.items():
            yield Root(name, bound.result, [settings, run], field, fixed=self._fixed())
        if bound.update_aiding is not None and config.flt.aiding is not None:
            assert isinstance(run, Record)
            row = Operand("const", (), "int", 0)
            yield Root("aid", bound.update_aiding, [settings, carry, row, *[number] * 3], fixed=self._fixed())
            yield Root("place", config.flt.aiding.nav_state, [settings.get("filter"), run.get("state")])
            homes = {StanceState: Place("stance", ())}
            yield Root("stand", step_stance, [like(begin_stance()), vector, vector, number], homes=homes)
        yield Root("euler", quat.to_euler, [like(quat.IDENTITY)])
        if config.corrections is not None:
            yield Root("corrected", correction.correct_readings, [like(config.corrections.errors), *[vector] * 3])

    def _fixed(self) -> dict[str, object]:
        """Arguments that are known when the program is made."""
        settings = {"settings": self.config.settings} if "parameters" in self.config.without else {}
        return settings | ({"mag": ZERO} if "mag" in self.config.without else {})

    # Files

    def write(self) -> dict[str, str]:
        """File name -> text."""
        self.kernels = self.body()  # first: it finds the constants
        source = self.source("imu.functions.c", **self._gaps())
        if self.fields:
            source += template("errors.c").substitute(self.common_gaps() | self._learned, one=self.number(1.0))
        if "place" in self.program.procedures:
            source += "\n" + template("aiding.c").substitute(self.common_gaps(), **self._aiding())
        source += template("carry.c").substitute(self.common_gaps() | self.carry_gaps())
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source}

    def _aiding(self) -> dict[str, object]:
        """The text of the calls for position, velocity and height."""
        row = {"row": "row", "value": "value", "deviation": "sigma", "age": "age"}
        places = {"params": "filter->settings.filter", "state": "filter->carry.run.state", "nav_state": "found"}
        vectors = {f"{name}_{axis}": f"{name}[{i}]" for name in ("gyr", "acc") for i, axis in enumerate("xyz")}
        turns = frame.aiding_lines(self.config.frame, f"{self.name}_nav_state", self.config.real, self.number)
        return turns | {
            "aid": self.program.call("aid", PLACES, row),
            "place": self.program.call("place", places),
            "begin_stance": self._begin_stance(),
            "stand": self.program.call("stand", {"stance": STANCE}, vectors | {"dt": "dt"}),
            "position": POSITION,
            "velocity": VELOCITY,
            "zero_velocity": ZERO_VELOCITY,
            "height": HEIGHT,
        }

    def _begin_stance(self) -> str:
        kind = self.program.types.struct(StanceState)
        return join_lines(self.assign(begin_stance(), kind, STANCE, "stance")).rstrip()

    def _gaps(self) -> dict[str, object]:
        readings = {f"{name}_{axis}": f"{name}[{i}]" for name in sensor.READINGS for i, axis in enumerate("xyz")}
        call = self.program.call
        answers = {
            name: frame.answer_lines(
                self.config.frame, field, f"{self.name}_{TYPES.get(name, 'int32_t')}", call(name, PLACES), self.number
            )
            for name, field in self.config.answers.items()
        }
        parts = [
            template(f"imu.{name}.c").substitute(self.common_gaps(), answer=answer)
            if "filter->" in answer
            else template(f"imu.{name}.c").substitute(self.common_gaps(), answer=answer).replace(STEP, UNUSED, 1)
            for name, answer in answers.items()
        ]
        return {
            "values": self._values(),
            "mounted": sensor.axes_comment(self.config),
            "components": self._components(),
            "table": sensor.prior_table(self.config, self.program.types),
            "told": sensor.prior_start(self.config),
            "begin": call("begin", PLACES),
            "advance": call("advance", PLACES, readings | {"dt": "dt"}),
            "take": self._take(),
            "corrected": temperature.update_temperature(self.config, self.number) + self._corrected(readings),
            "euler": call("euler", {}, {f"q_{axis}": f"q.{axis}" for axis in "wxyz"}),
            "answers": "\n".join(parts),
            "read": "\n".join(
                f"{STEP}found.{name} = {self.name}_{full}(filter);" for full, name in self.config.answers.items()
            ),
            **{name: self.number(value) for name, value in CONSTANTS.items()},
            **self._body_gaps(),
        }

    def _body_gaps(self) -> Mapping[str, object]:
        """The text of bearing, up and linear acceleration."""
        down = "-" if self.config.frame == "NED" else ""
        if self.config.corrects:
            force = f"const {self.name}_readings now = {self.name}_corrected(filter, 0, acc_read, 0);"
            names = [f"now.acc.{axis}" for axis in "xyz"]
        else:
            force = f"{self.config.real} acc[3];\n{STEP}three(acc_read, acc);"
            names = [f"acc[{i}]" for i in range(3)]
        terms = frame.frame_terms(self.config.frame).bias
        forces = [frame.sum_in_c(row, names, self.number) for row in terms]
        return {
            "bearing_of": frame.BEARING[self.config.frame].format(quarter=self.number(90.0)),
            "down": down,
            "force": force,
        } | {f"force_{axis}": one for axis, one in zip("xyz", forces, strict=True)}

    def _components(self) -> str:
        """The lines that turn a reading into the body's axes; zero if there is none."""
        zero = self.number(0.0)
        absent = f"{STEP}if (!v) {{\n{STEP * 2}to[0] = to[1] = to[2] = {zero};\n{STEP * 2}return;\n{STEP}}}"
        rows = [frame.sum_in_c(row, ["v[0]", "v[1]", "v[2]"], self.number) for row in self.config.axes.terms]
        return join_lines([absent, *(f"{STEP}to[{i}] = {row};" for i, row in enumerate(rows))]).rstrip()

    def _take(self) -> str:
        """The lines that turn an update's readings into the filter's input."""
        taken = {str(node.content) for node in self.program.arguments("advance")}
        names = [name for name in sensor.READINGS if f"{name}_x" in taken]
        lines = [f"{STEP}{self.config.real} {', '.join(f'{name}[3]' for name in names)};"]
        if self.config.corrections is None and not self.config.curves:
            lines += [f"{STEP}three({name}_read, {name});" for name in names]
        else:
            lines.append(
                f"{STEP}const {self.name}_readings now = {self.name}_corrected(filter, gyr_read, acc_read, mag_read);"
            )
            for name in names:
                lines += [f"{STEP}{name}[{i}] = now.{name}.{axis};" for i, axis in enumerate("xyz")]
        lines += [f"{STEP}(void){name}_read;" for name in sensor.READINGS if name not in names and len(lines) < 5]
        return join_lines(lines).rstrip()

    def _corrected(self, readings: dict[str, str]) -> str:
        """The function that corrects readings; empty where nothing is corrected."""
        if not self.config.corrects:
            return ""
        lines = [f"{STEP}{self.config.real} gyr[3], acc[3], mag[3];", f"{STEP}{self.name}_readings now;"]
        lines += [f"{STEP}three({name}_read, {name});" for name in sensor.READINGS]
        lines += temperature.subtract_change(self.config, self.number)
        if self.config.corrections is None:
            lines += [] if self.config.curves else [f"{STEP}(void)filter;"]
            for name in sensor.READINGS:
                lines += [f"{STEP}now.{name}.{axis} = {name}[{i}];" for i, axis in enumerate("xyz")]
        else:
            places = {"errors": "filter->errors", "readings": "now"}
            lines.append(f"{STEP}{self.program.call('corrected', places, readings)};")
        return template("corrected.c").substitute(self.common_gaps(), body=join_lines(lines).rstrip()) + "\n"

    def _values(self) -> str:
        """The lines that set parameters and the errors of the sensor."""
        given = {"filter": self.config.params, "guard": self.config.guard or Guard()}
        lines = []
        for name, kind in self._struct("settings").fields.items() if "settings" in self.whole.fields else ():
            if not is_empty(kind):
                lines += self.assignments(given[name], kind, f"filter->settings.{name}")
        if self.config.corrections is not None:
            for name, kind in self._struct("errors").fields.items():
                value = getattr(self.config.corrections.errors, name)
                lines += self.assign(value, kind or FLOAT, f"filter->errors.{name}", f"calibration, {name}")
        if self.config.curves:
            lines += self.assign(temperature.NOTHING, self._struct("bias_change"), "filter->bias_change", "temperature")
        return join_lines(lines).rstrip()

    def _struct(self, name: str) -> Struct:
        kind = self.whole.fields[name]
        assert isinstance(kind, Struct)
        return kind

    def _extras(self) -> str:
        """The calls that only some filters have."""
        aiding = ""
        if "place" in self.program.procedures:
            aiding = template("aiding.h").substitute(self.common_gaps(), axes=frame.axes_list(self.config.frame))
        if not self.fields:
            return aiding
        return aiding + template("errors.h").substitute(self.common_gaps(), fields=self.fields)

    def _header(self) -> str:
        whole = ["/* A filter: its parameters, and its state from one sample to the next. */", "typedef struct {"]
        for name, kind in self.whole.fields.items():
            assert kind is not None
            whole += [] if is_empty(kind) else [f"{STEP}{self.program.types.name(kind, public=True)} {name};"]
        whole += [f"}} {self.name};", "", "/* The outputs of the filter after a sample. */", "typedef struct {"]
        for full, name in self.config.answers.items():
            kind_name = f"{self.name}_{TYPES[full]}" if full in TYPES else "int32_t"
            whole.append(f"{STEP}{kind_name} {name};")
        whole += [f"}} {self.name}_output;", ""]
        bias = estimates_bias(self.config.flt, self.config.guarded)
        field, body = sensor.field_unit(self.config), sensor.frame(self.config)
        earth = frame.axes_words(self.config.frame)
        magnetic = earth.replace("north", "magnetic north")
        gaps = {
            "field": field, "frame": body, "earth": earth, "yaw": frame.YAW[self.config.frame],
            "axes": frame.axes_list(self.config.frame),
            "no_bias": "" if bias else "; zero, as this filter estimates none",
        }  # fmt: skip
        parts = [template(f"imu.{name}.h").substitute(self.common_gaps(), **gaps) for name in self.config.answers]
        corrected = template("corrected.h").substitute(name=self.name, real=self.config.real)
        return self.header(
            "imu.functions.h",
            whole,
            answers="\n".join(parts),
            health=health_bits() + "\n" if "health" in self.config.answers else "",
            init_call=f"{self.name}_init(&filter)",
            loop=f" *     for each sample: {self.name}_update(&filter, gyr, acc, mag, dt);\n"
            f" *     {self.name}_quat q = {self.name}_quaternion(&filter);",
            sensor=sensor.about(self.config),
            corrected=temperature.declaration(self.config) + (corrected if self.config.corrects else ""),
            saving=self._extras() + template("carry.h").substitute(self.common_gaps() | self.carry_gaps()),
            reset="Forgets everything but the parameters, which may be changed at any time: filter.settings.…"
            if "settings" in self.whole.fields
            else "Forgets everything.",
            without_mag="\n * Exported without the magnetometer: mag is not read."
            if "mag" in self.config.without
            else "",
            units=f"gyr rad/s, acc m/s² (a level sensor at rest reads 0, 0, +9.81), mag {field}, dt s;\n"
            f" * q turns {body} into earth ({magnetic}). A sensor that is not there is NULL.",
            **gaps,
        )


def prefixes() -> dict[str, tuple[RecordField, ...]]:
    """Where in the carry the arguments of the driver's kernels lie."""
    run = RecordField(Carry, "run")
    return {"carry": (), "run": (run,), "state": (run, RecordField(FilterRun, "state"))}
