"""The constants of modules that kernels use, as constants in C."""

from levelhead.errors import LevelheadError
from levelhead.export.layout import add_comment, wrap_line
from levelhead.export.source import place, remark
from levelhead.export.type_table import TypeTable
from levelhead.kernels.single import REMARKS


class UniqueNames:
    """Names for things of modules: the last part of the module's name and the rest; more parts where that is taken."""

    def __init__(self) -> None:
        self._owners: dict[str, object] = {}

    def choose(self, owner: object, module: str, rest: str) -> str:
        """The name of one thing, the same at every call.

        Raises:
            LevelheadError: another thing of the same module has that name.
        """
        parts = module.split(".")
        for count in range(1, len(parts) + 1):
            name = "_".join(parts[-count:]) + rest
            if self._owners.setdefault(name, owner) == owner:
                return name
        raise LevelheadError(f"there are two of the name {module}{rest}")


class Constants:
    """The constants that were asked for so far.

    Attributes:
        values: (module, name) -> value.
    """

    def __init__(self, types: TypeTable) -> None:
        self._types, self._names = types, UniqueNames()
        self.values: dict[tuple[str, str], object] = {}

    def place(self, module: str, name: str, value: object) -> str:
        """The name in C of a constant that is defined in a module."""
        self.values.setdefault((module, name), value)
        return self._name(module, name)

    def lines(self) -> list[str]:
        """Their definitions, in the order of their modules."""
        lines: list[str] = []
        for module in dict.fromkeys(module for module, _ in self.values):
            names = [name for where, name in self.values if where == module]
            for name in sorted(names, key=lambda name: place(module, name)):
                lines += self._definition(module, name)
            lines.append("")
        return lines

    def _name(self, module: str, name: str) -> str:
        return self._names.choose((module, name), module, f"_{name}").upper()

    def _definition(self, module: str, name: str) -> list[str]:
        value = self.values[module, name]
        kind = self._types.kind_of(value)
        assert kind is not None
        try:
            number = self._types.literal(value, kind)
        except OverflowError as error:
            raise LevelheadError(f"the constant {name} of {module}: {error}") from None
        code = f"static const {self._types.name(kind)} {self._name(module, name)} = {number};"
        words = REMARKS.get(value, "") if isinstance(value, float) and self._types.real == "float" else ""
        return add_comment(wrap_line(code, ""), words or remark(module, name))
