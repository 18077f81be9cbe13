"""The needs of a program: the numbers that reach a result, through the fields of its states; all else is left out.

A store is needed if its field is read by something that is needed. The search begins with nothing but the results and
goes on until nothing is added, so that fields which serve only one another are left out as well.
"""

from collections.abc import Iterable, Mapping

from levelhead.export.graph import Branch, Call, Items, Loop, Operand, Put, RecordField, Store, items_within
from levelhead.export.procedures import Procedure, outer_place


class Liveness:
    """The numbers needed.

    Attributes:
        members: fields that are read.
        nodes: numbers.
        calls: calls.
        branches: branches and loops of which an arm holds something.
        results: procedure -> numbers of those that it returns.
    """

    def __init__(
        self,
        procedures: Iterable[Procedure],
        outputs: Iterable[Procedure],
        members: Iterable[RecordField],
        prefixes: Mapping[str, tuple[RecordField, ...]],
    ) -> None:
        self._procedures, self._outputs, self._prefixes = list(procedures), set(outputs), prefixes
        self._lasting: set[tuple[RecordField, ...]] = set()
        self.members: set[RecordField] = set(members)
        self.nodes: set[Operand] = set()
        self.calls: set[Call] = set()
        self.branches: set[Branch | Loop] = set()
        self.results: dict[Procedure, set[int]] = {one: set() for one in self._procedures}
        for one in self._outputs:
            self.results[one] = set(range(len(one.returned)))
        size = -1
        while size != self._size():
            size = self._size()
            for one in self._procedures:
                self._visit(one)

    def _size(self) -> int:
        held = len(self.members) + len(self.nodes) + len(self.calls) + len(self.branches) + len(self._lasting)
        return held + sum(map(len, self.results.values()))

    def stores(self, store: Store, procedure: Procedure) -> bool:
        """Whether a store is needed."""
        if store.final and procedure in self._outputs:
            prefix = self._prefixes.get(store.place.root)
            return prefix is None or (*prefix, *store.place.members) in self._lasting
        return self.members.issuperset(store.place.members)

    def writes(self, call: Call) -> bool:
        """Whether a call writes something that is needed."""
        if call.procedure.puts:
            return True
        for store in call.procedure.stores():
            inside = store.place.root in call.procedure.by_place and self.stores(store, call.procedure)
            if inside and self.members.issuperset(outer_place(call, store.place).members):
                return True
        return any(
            self.writes(inner)
            for inner in call.procedure.calls()
            if any(place.root in call.procedure.by_place for place in inner.places.values())
        )

    def _visit(self, procedure: Procedure) -> None:
        for i in self.results[procedure]:
            self._need(procedure.returned[i], procedure)
        for block, item in items_within(procedure.graph.body):
            if (
                isinstance(item, Store)
                and self.stores(item, procedure)
                and item.place.field not in procedure.graph.steady
            ):
                self._need_block(block, procedure)
                self._need(item.value, procedure)
            elif isinstance(item, Put):
                self._need_block(block, procedure)
                for node in (item.array, *item.indices, item.value):
                    self._need(node, procedure)
            elif isinstance(item, Call) and (item in self.calls or self.writes(item)):
                self._need_call(item, block, procedure)

    def _need_call(self, call: Call, block: Items, procedure: Procedure) -> None:
        self.calls.add(call)
        self._need_block(block, procedure)
        for given, argument in zip(call.arguments, call.procedure.arguments, strict=True):
            if argument in self.nodes:
                self._need(given, procedure)
        for at in call.procedure.reads:
            if self.members.issuperset(at.members):
                self.members |= set(call.places[at.root].members)
                if at in call.reads:
                    self._need(call.reads[at], procedure)

    def _need_block(self, block: Items, procedure: Procedure) -> None:
        for one in block.ancestors():
            if one.branch is not None and one.branch not in self.branches:
                self.branches.add(one.branch)
                for node in one.branch.bounds if isinstance(one.branch, Loop) else (one.branch.condition,):
                    self._need(node, procedure)

    def _need(self, node: Operand, procedure: Procedure) -> None:
        if node in self.nodes:
            return
        self.nodes.add(node)
        for part in node.arguments:
            self._need(part, procedure)
        if node.op == "load":
            place = node.content[0]
            self.members |= set(place.members)
            if procedure in self._outputs and not isinstance(node.after, Call):
                self._lasting.add((*self._prefixes.get(place.root, ()), *place.members))
        elif node.op == "phi":
            self.branches.add(node.content)
            self._need(node.content.condition, procedure)
            self._need_block(node.content.block, procedure)
        elif node.op == "memory":
            self.members |= set(node.content.members)
        elif node.op in ("carried", "counter"):
            self._need_block(node.content.arms[0], procedure)
        elif node.op == "result":
            call, i = node.content
            self.results[call.procedure].add(i)
            assert node.block is not None
            self._need_call(call, node.block, procedure)
        elif node.block is not None:
            self._need_block(node.block, procedure)
