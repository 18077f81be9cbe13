"""Calls of procedures: the place of each record for a call, its stores before it, and its writes behind it."""

import ast
from collections.abc import Sequence

from levelhead.export.graph import ARRAY, Call, Operand, Place, Record, Store, Value, leaves, placed_leaves
from levelhead.export.graph_builder import GraphBuilder
from levelhead.export.source import read_source
from levelhead.open_types import Untyped


class ProcedureCalls:
    """The calls that one procedure makes of others.

    Args:
        graph: of the procedure that calls.
        read_only: its parameters at places without stores, because they are not the result.
    """

    def __init__(self, graph: GraphBuilder, read_only: frozenset[str]) -> None:
        self._graph, self._read_only = graph, read_only
        self._temporaries = 0

    def call(self, procedure: Untyped, given: Sequence[Value]) -> Value | None:
        """The result of a procedure for arguments."""
        call = Call(procedure, {}, [])
        records: dict[str, Value] = {}
        for part, shape in procedure.parts:
            value, name = part.of(given), part.name
            if name not in procedure.by_place:
                call.arguments += [
                    self._graph.number(got, wanted.kind)
                    for wanted, got in zip(leaves(shape), leaves(value), strict=True)
                ]
                continue
            assert isinstance(value, Record)
            place = self._place_of(value, value.place, call, name)
            for at, leaf in placed_leaves(value, place):
                inner = Place(name, at.members[len(place.members) :])
                if leaf.kind == ARRAY:
                    self._graph.claim(leaf, at)
                if inner not in procedure.reads:
                    continue
                if self._graph.contents.get(at) is not leaf:
                    self._store(at, leaf)
                elif leaf.op == "load":
                    call.reads[inner] = leaf
            call.places[name], records[name] = place, value
        for name, shape in procedure.outputs.items():
            call.places[name] = self._place_of(shape, None, call, name)
        self._graph.block.items.append(call)
        for inner, kind in procedure.writes.items():
            self._graph.load(Place(call.places[inner.root].root, call.places[inner.root].members + inner.members), kind)
        call.results = [
            Operand("result", (), node.kind, (call, i), self._graph.block, node.hint)
            for i, node in enumerate(procedure.returned)
        ]
        for argument, place in procedure.graph.claims.items():
            root = call.places[place.root]
            outer = Place(root.root, root.members + place.members)
            self._graph.claim(procedure.outside(argument, call, self._graph), outer)
        return self._result(procedure.answer, call, records)

    def _place_of(self, record: Record, place: Place | None, call: Call, name: str) -> Place:
        """Where a record lies for a call: where it came from, its class's one place, or in a struct of its own."""
        place, cls = place or self._graph.homes.get(record.cls), record.cls
        if place is not None and place.root in self._read_only and self._changes(record, place, call, name):
            place = None
        if place is None or any(_overlap(place, other) for other in call.places.values()):
            if any(leaf.kind == ARRAY for leaf in leaves(record)):
                raise read_source(call.procedure.function).refuse(
                    ast.Pass(), f"{cls.__name__} has an array: there can be one of it, that of the state"
                )
            self._temporaries += 1
            place = Place(f"{name}_{self._temporaries}", ())
            call.temporaries[place.root] = cls
        return place

    def _changes(self, record: Record, place: Place, call: Call, name: str) -> bool:
        """Whether a call would change the content of a place, itself or by another record that is put there first."""
        procedure = call.procedure
        if any(inner.root == name for inner in procedure.writes):
            return True
        return any(
            self._graph.contents.get(at) is not leaf
            for at, leaf in placed_leaves(record, place)
            if Place(name, at.members[len(place.members) :]) in procedure.reads
        )

    def _store(self, place: Place, value: Operand) -> None:
        self._graph.block.items.append(Store(place, value))
        if place.field not in self._graph.steady:  # there it is only compared
            self._graph.contents[place] = value

    def _result(self, answer: Untyped, call: Call, given: dict[str, Value]) -> Value | None:
        """The value of a call: numbers that it returns, and records that lie where it has written them."""
        if answer is None:
            return None
        if isinstance(answer, int):
            return call.results[answer]
        if isinstance(answer, Operand):
            return call.procedure.outside(answer, call, self._graph)  # type: ignore[no-any-return]
        if isinstance(answer, str):
            place = call.places[answer]
            if answer in call.procedure.outputs:
                return self._placed(call.procedure.outputs[answer], place)
            return self._written(given[answer], place, call, Place(answer, ()))
        cls, parts = answer
        return Record(cls, tuple(self._result(part, call, given) for part in parts))  # type: ignore[misc]

    def _placed(self, shape: Value, place: Place) -> Value:
        """A record that a call has put at a place."""
        if isinstance(shape, Operand):
            if shape.kind == ARRAY:
                return self._graph.memory(place, shape.shape)
            if place.field in self._graph.steady:
                return self._graph.constant(self._graph.steady[place.field])
            return self._graph.contents[place]
        names: Sequence[str] = shape.cls._fields  # type: ignore[attr-defined]
        parts = zip(names, shape.values, strict=True)
        return Record(
            shape.cls, tuple(self._placed(part, place.member(shape.cls, name)) for name, part in parts), place
        )

    def _written(self, before: Value, place: Place, call: Call, inner: Place) -> Value:
        if isinstance(before, Operand):
            if before.kind == ARRAY:
                return before
            procedure = call.procedure
            if place.field in self._graph.steady:
                return before
            return self._graph.contents[place] if inner in procedure.writes else before
        names: Sequence[str] = before.cls._fields  # type: ignore[attr-defined]
        values = []
        for name, part in zip(names, before.values, strict=True):
            values.append(self._written(part, place.member(before.cls, name), call, inner.member(before.cls, name)))
        return Record(before.cls, tuple(values), place)


def _overlap(one: Place, other: Place) -> bool:
    shared = min(len(one.members), len(other.members))
    return one.root == other.root and one.members[:shared] == other.members[:shared]
