"""Header and source of a filter on one noisy level and its drifting rate."""

import sys

from levelhead.export.c_api import CApi
from levelhead.export.config import ExportConfig
from levelhead.export.flat_program import FlatProgram, Root, classes, number_paths
from levelhead.export.graph import FLOAT, Operand, Record, Value
from levelhead.export.kinds import variable
from levelhead.export.layout import STEP, join_lines
from levelhead.export.procedures import like

SAMPLE = {"level": "level", "rate": "rate", "dt": "dt", "period": "period"}
KERNELS = ("init", "step", "read")


class AxisApi(CApi):
    """A filter on one noisy level and its drifting rate; it keeps no more than its step reads, number by number."""

    def __init__(self, config: ExportConfig) -> None:
        super().__init__(config)
        axis = config.flt.axis
        assert axis is not None
        params, state = like(config.params), like(axis.init(config.params, 0.0))
        assert isinstance(params, Record) and isinstance(state, Record)
        number = Operand("const", (), FLOAT, 0.0)
        given: list[list[Value]] = [[params, number], [params, state, *[number] * 4], [state]]
        self._kernels = dict(zip(KERNELS, (axis.init, axis.step, axis.read), strict=True))
        roots = [
            Root(name, self._kernels[name], values, least=sys.maxsize)
            for name, values in zip(KERNELS, given, strict=True)
        ]
        kept = [params.cls, axis.report, *classes(state)]
        self.program = FlatProgram(config.name, config.real, roots, kept=kept)
        types, self._state = self.program.types, state
        self.params, self.report = types.struct(params.cls), types.struct(axis.report)
        read = {content for name in KERNELS[:2] for content in self._taken(name)}
        self._params = {f"{one}_{name}": f"filter->params.{variable(name)}" for name in self.params.fields
                        for one in {self._argument(kernel, 0) for kernel in KERNELS[:2]}}  # fmt: skip
        self.params.fields = {
            name: kind
            for name, kind in self.params.fields.items()
            if any(path == f"filter->params.{variable(name)}" and content in read
                   for content, path in self._params.items())
        }  # fmt: skip
        before = dict(number_paths(state, self._argument("step", 1)))
        kept_names = {path.partition(".")[0] for content, path in before.items() if content in read}
        fields = types.struct(state.cls).fields
        self.kept = {name: kind for name, kind in fields.items() if variable(name) in kept_names}
        self._before = {content: f"filter->{path}" for content, path in before.items()}
        types.public_names |= {self.params: "params", self.report: "report"}
        for kind in (self.params, self.report, *self.kept.values()):
            assert kind is not None
            types.publish(kind)
        self.whole.fields.update(params=self.params, **self.kept)

    def _argument(self, name: str, at: int) -> str:
        """The name of a kernel's argument."""
        return str(self._kernels[name].__code__.co_varnames[at])

    def _taken(self, name: str) -> set[str]:
        """The numbers that a root takes."""
        return {str(node.content) for node in self.program.arguments(name)}

    def write(self) -> dict[str, str]:
        """File name -> text."""
        self.kernels = self.body()  # first: it finds the constants
        program = self.program
        state, report = program.procedures["step"], program.procedures["read"]
        members = program.writer.result_members(state)
        values = dict(zip(dict(number_paths(self._state, self._argument("read", 0))), members.values(), strict=True))
        source = self.source(
            "axis.functions.c",
            values=join_lines(self.assignments(self.config.params, self.params, "filter->params")).rstrip(),
            first=program.writer.result_type(program.procedures["init"]),
            state=program.writer.result_type(state),
            report=program.writer.result_type(report),
            begin=program.call("init", {}, self._params | SAMPLE),
            kept_first=self._keep("init"),
            kept=self._keep("step"),
            step=program.call("step", {}, self._params | self._before | SAMPLE),
            read=program.call("read", {}, {content: f"state.{member}" for content, member in values.items()}),
        )
        return {f"{self.name}.h": self._header(), f"{self.name}.c": source}

    def _keep(self, name: str) -> str:
        """The lines that keep the part of a root's result that the next step reads."""
        members = self.program.writer.result_members(self.program.procedures[name])
        paths = dict(number_paths(self._state, "")).values()
        pairs = zip(paths, members.values(), strict=True)
        kept = {variable(one) for one in self.kept}
        return join_lines(
            f"{STEP}filter->{path} = state.{member};" for path, member in pairs if path.partition(".")[0] in kept
        ).rstrip()

    def _header(self) -> str:
        whole = ["/* A filter: its parameters, and its state from one sample to the next. */", "typedef struct {"]
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
