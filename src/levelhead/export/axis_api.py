"""Header and source of a filter on one noisy level and its drifting rate."""

from levelhead.export.c_api import CApi
from levelhead.export.config import ExportConfig
from levelhead.export.kinds import FLOAT, Kind, Struct, is_empty, keep_what_is_read, variable
from levelhead.export.layout import STEP, join_lines


class AxisApi(CApi):
    """A filter on one noisy level and its drifting rate; it keeps no more than its step reads."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        axis, program = config.flt.axis, self.program
        assert axis is not None
        self.params = program.types.struct(config.flt.params)
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
        program.types.publish(self.params)
        assert isinstance(self.params, Struct)
        program.types.public_names |= {self.params: "params", self.report: "report"}
        for kind in (self.report, *self.kept.values()):
            assert kind is not None
            program.types.publish(kind)
        self.whole.fields.update(params=self.params, **self.kept)

    def write(self) -> dict[str, str]:
        """File name -> text."""
        program = self.program
        assert isinstance(self.state, Struct) and isinstance(self.report, Struct)
        names = [variable(name) for name in self.kept]
        source = self.source(
            "axis.functions.c",
            values=join_lines(self.assignments(self.config.params, self.params, "filter->params")).rstrip(),
            params=program.types.struct_name(self.params),
            state=program.types.struct_name(self.state),
            kept=join_lines(f"{STEP}filter->{name} = state->{name};" for name in names).rstrip(),
            restored=", ".join(
                f"filter->{variable(name)}" if name in self.kept else self._zero(kind)
                for name, kind in self.state.fields.items()
                if not is_empty(kind)
            ),
            begin=self.program.call(self.begin, ["filter->params", "level"]),
            step=self.program.call(self.step, ["filter->params", "before", "level", "rate", "dt", "period"]),
            read=self.program.call(self.read, ["state"]),
        )
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source}

    def _zero(self, kind: Kind | None) -> str:
        """A number that no step reads, or a record of them."""
        if isinstance(kind, Struct):
            return "{" + ", ".join(self._zero(part) for part in kind.fields.values()) + "}"
        return self.number(0.0) if kind is FLOAT else "0"

    def _header(self) -> str:
        assert isinstance(self.report, Struct)
        whole = ["/* A filter: what a human sets, and what goes from one sample to the next. */", "typedef struct {"]
        for name, kind in self.whole.fields.items():
            assert kind is not None
            whole.append(f"{STEP}{self.program.types.name(kind, public=True)} {variable(name)};")
        whole += [f"}} {self.name};", ""]
        return self.header(
            "axis.functions.h",
            whole,
            init_call=f"{self.name}_init(&filter, first_angle)",
            loop=f" *     {self.name}_report now;\n"
            f" *     for each sample: {self.name}_update(&filter, angle, rate, dt, 360.0, &now);",
            units="Any unit will do, as long as rate is in units of the level per unit of dt, and parameters are too.",
        )
