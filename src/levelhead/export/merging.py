"""Values behind a branch: one arm's or the other's, in a variable or at the place where one of them lies already."""

from collections.abc import Sequence

from levelhead.export.graph import ARRAY, FLOAT, Branch, Operand, Place, Record, Store, Value
from levelhead.export.graph_builder import GraphBuilder
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3

MANY = 12  # numbers of a record that had better stay where they are than in variables


class ArmMerger:
    """Merges the values of arms in one procedure.

    Args:
        graph: of the procedure.
        read_only: its parameters at places without stores, because they are not the result.
    """

    def __init__(self, graph: GraphBuilder, read_only: frozenset[str]) -> None:
        self._graph, self._read_only = graph, read_only

    def merge(self, branch: Branch, one: Value, other: Value, place: Place | None = None, many: bool = False) -> Value:
        """The value of either arm, which lies or would lie at a place; ``many``: together with many others."""
        if one is other:
            return one
        if isinstance(one, Record) and isinstance(other, Record):
            return self._merge_records(branch, one, other, place)
        assert isinstance(one, Operand) and isinstance(other, Operand)
        if one.kind == ARRAY:  # of one field, as ``_require_alike`` has found
            return self._graph.memories[one.content.members[-1]]
        if one.kind != other.kind:
            return self.merge(branch, self._graph.convert(one, FLOAT), self._graph.convert(other, FLOAT))
        if place is not None:
            self._home(branch, one, other, place, many)
        for lies, node in branch.contents[0].items():
            if node is one and branch.contents[1].get(lies) is other:
                held = self._graph.contents.get(lies)
                return held if held is not None else self._graph.load(lies, one.kind)
        if (one, other) not in branch.phis:
            hint = one.hint or other.hint
            branch.phis[one, other] = Operand("phi", (one, other), one.kind, branch, branch.block, hint)
        return branch.phis[one, other]

    def _merge_records(self, branch: Branch, one: Record, other: Record, place: Place | None) -> Record:
        """The same of a record, field by field."""
        home = None if one.cls in (Vec3, Quat) else one.place or other.place or self._graph.homes.get(one.cls) or place
        many = sum(isinstance(part, Operand) for part in one.values) >= MANY
        names: Sequence[str] = getattr(one.cls, "_fields", ()) or [""] * len(one.values)
        values = tuple(
            self.merge(branch, a, b, home and home.member(one.cls, name), many)
            for name, a, b in zip(names, one.values, other.values, strict=True)
        )
        return Record(one.cls, values, home)

    def _home(self, branch: Branch, one: Operand, other: Operand, place: Place, many: bool) -> None:
        """Stores the number of an arm where the number of the other lies already, or one of many where it belongs."""
        if place in branch.homed or place.field in self._graph.steady or branch.block.loop is not None:
            return
        if place.root in self._read_only:
            return
        lies = [contents.get(place) is node for contents, node in zip(branch.contents, (one, other), strict=True)]
        if not any(lies) and not (many and all(place in contents for contents in branch.contents)):
            return
        branch.homed.add(place)
        self._graph.contents.pop(place, None)
        for arm, contents, node, there in zip(branch.arms, branch.contents, (one, other), lies, strict=True):
            if not there:
                arm.items.append(Store(place, node))
                contents[place] = node
