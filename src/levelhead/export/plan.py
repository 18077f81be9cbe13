"""Where in C each number is computed: in its own statement, inside of an expression, or by a load in time."""

from collections.abc import Iterator

from levelhead.export.graph import Branch, Call, Item, Items, Loop, Operand, Place, Put, Store, are_exclusive
from levelhead.export.homing import writes
from levelhead.export.liveness import Liveness
from levelhead.export.procedures import Procedure
from levelhead.open_types import Untyped

LARGEST = 16  # operations in one expression
ATOMS = ("const", "named", "argument", "load", "result", "phi", "carried", "counter", "memory", "local")


class StatementPlan:
    """The statements of one procedure.

    Attributes:
        items: block -> its items that are needed, in order.
        held: nodes that have a variable.
        saved: item -> loads that must be held before it, because its place is overwritten before the value is used.
    """

    def __init__(self, procedure: Procedure, live: Liveness) -> None:
        self._procedure, self._live = procedure, live
        self.items: dict[Items, list[Item]] = {}
        self._needed(procedure.graph.body)
        self.returned = [procedure.returned[i] for i in sorted(live.results[procedure])]
        self._count_uses()
        self._select(procedure.graph.body)
        self._count_uses()
        self.held = {node for node in self._computed() if not self._is_inner(node)}
        self._hold_in_time()
        self.saved: dict[Untyped, list[Operand]] = {}
        self._save_loads()

    def _needed(self, block: Items) -> None:
        found = self.items[block] = [item for item in block.items if self._is_needed(item)]
        for item in found:
            if isinstance(item, Branch | Loop):
                for arm in item.arms:
                    self._needed(arm)

    def _is_needed(self, item: Item) -> bool:
        live = self._live
        if isinstance(item, Store):
            return live.stores(item, self._procedure) and item.place.field not in self._procedure.graph.steady
        if isinstance(item, Put):
            return True
        if isinstance(item, Call):
            return item in live.calls
        return item in live.branches if isinstance(item, Branch | Loop) else item in live.nodes

    def phis(self, branch: Branch) -> list[Operand]:
        """The numbers that hold a value of either arm."""
        return [phi for phi in branch.phis.values() if phi in self._live.nodes and phi.op == "phi"]

    def carried(self, loop: Loop) -> list[Operand]:
        """The numbers that change from turn to turn, and that somebody takes."""
        return [phi for phi in loop.carried if phi in self._live.nodes]

    def arguments(self, call: Call) -> list[Operand]:
        """The numbers that a call passes."""
        pairs = zip(call.arguments, call.procedure.arguments, strict=True)
        return [given for given, argument in pairs if argument in self._live.nodes]

    def _computed(self) -> Iterator[Operand]:
        for items in self.items.values():
            yield from (item for item in items if isinstance(item, Operand))

    def walk(self, block: Items) -> Iterator[tuple[Items, Item]]:
        """All needed items in order."""
        for item in self.items[block]:
            yield block, item
            if isinstance(item, Branch | Loop):
                for arm in item.arms:
                    yield from self.walk(arm)

    # Uses

    def _count_uses(self) -> None:
        """Operand -> (block, item or returned) of each use."""
        self._uses: dict[Operand, list[tuple[Items, Untyped]]] = {}
        self._sizes: dict[Operand, int] = {}
        body = self._procedure.graph.body
        for block, item in self.walk(body):
            if isinstance(item, Operand):
                self._use(item.arguments, block, item)
            elif isinstance(item, Store):
                self._use((item.value,), block, item)
            elif isinstance(item, Put):
                self._use((item.array, *item.indices, item.value), block, item)
            elif isinstance(item, Call):
                self._use(self.arguments(item), block, item)
            elif isinstance(item, Loop):
                self._use(item.bounds, block, item)
                for phi in self.carried(item):
                    self._use(phi.arguments[:1], block, item)
                    self._use(phi.arguments[1:], item.arms[0], phi)
            else:
                self._use((item.condition,), block, item)
                for phi in self.phis(item):
                    for arm, value in zip(item.arms, phi.arguments, strict=True):
                        self._use((value,), arm, phi)
        self._use(self.returned, body, None)

    def _use(self, nodes: Untyped, block: Items, user: Untyped) -> None:
        for node in nodes:
            self._uses.setdefault(node, []).append((block, user))

    def _is_inner(self, node: Operand) -> bool:
        """Whether a number is written inside the expression that uses it."""
        if node.op == "row":
            return True
        return len(self._uses.get(node, ())) == 1 and self._size(node) <= LARGEST

    def _size(self, node: Operand) -> int:
        if node.op in ATOMS:
            return 0
        if node not in self._sizes:
            inner = [part for part in node.arguments if part.op not in ATOMS and self._is_inner(part)]
            self._sizes[node] = 1 + sum(self._size(part) for part in inner)
        return self._sizes[node]

    # Conditional expressions

    def _select(self, block: Items) -> None:
        """Branches that only choose a number become conditional expressions."""
        found: list[Item] = []
        for item in self.items[block]:
            if isinstance(item, Loop):
                self._select(item.arms[0])
            if isinstance(item, Branch):
                for arm in item.arms:
                    self._select(arm)
                phis = self.phis(item)
                inside = [one for arm in item.arms for one in self.items[arm]]
                if 0 < len(phis) <= 2 and len(inside) <= 4 and all(self._is_simple(one, phis) for one in inside):
                    for phi in phis:
                        phi.op, phi.arguments, phi.block = "select", (item.condition, *phi.arguments), block
                        found.append(phi)
                    for arm in item.arms:
                        del self.items[arm]
                    continue
            found.append(item)
        self.items[block] = found

    def _is_simple(self, item: Item, phis: list[Operand]) -> bool:
        return isinstance(item, Operand) and self._is_inner(item) and item.op != "select"

    # Elements of arrays

    def _hold_in_time(self) -> None:
        """Elements that are changed before the statement that uses them get a variable, or numbers computed from them
        do;
        so do numbers that a loop would compute anew at each turn."""
        for node in list(self._computed()):
            if node.op != "row" and node not in self.held:
                block, user = self._uses[node][0]
                bound = isinstance(user, Loop) and node in user.bounds and node.op not in ATOMS
                if bound or (node.block is not None and block.loop is not node.block.loop):
                    self.held.add(node)
        order, steps = self._steps()
        barriers = [order[item] for _, item in steps if isinstance(item, Put) or _puts(item)]
        for node in [one for one in self._computed() if one.op == "element"] if barriers else ():
            self._hold_before(node, order, barriers)

    def _hold_before(self, element: Operand, order: dict[Untyped, int], barriers: list[int]) -> None:
        chain: list[Operand] = [element]
        while chain[-1] not in self.held:
            _, user = self._uses[chain[-1]][0]
            if not isinstance(user, Operand) or user.op in ("phi", "carried"):
                break
            chain.append(user)
        if len(chain) > 1 and chain[-1] in self.held:
            last = order[chain[-1]]
        elif chain[-1] in self.held:
            return
        else:
            last = order[self._root(*reversed(self._uses[chain[-1]][0]))[0]]
        first = next(order[node] for node in chain if node in order)
        between = [at for at in barriers if first < at < last]
        if between:
            self.held.add([node for node in chain if node in order and order[node] < between[0]][-1])

    # Loads

    def _steps(self) -> tuple[dict[Untyped, int], list[tuple[Items, Untyped]]]:
        """Statement -> its number, and all of them."""
        order: dict[Untyped, int] = {}
        steps: list[tuple[Items, Untyped]] = []
        self._number(self._procedure.graph.body, order, steps)
        order[None] = len(steps)
        return order, steps

    def _save_loads(self) -> None:
        order, steps = self._steps()
        kills = [(block, item) for block, item in steps if isinstance(item, Store | Call)]
        uses: dict[Operand, list[tuple[Items, Untyped, int]]] = {}
        for node, found in self._uses.items():
            if node.op != "load":
                continue
            for block, user in found:
                root, where = self._root(user, block)
                uses.setdefault(node, []).append((where, root, order[root]))
        for load in sorted(uses, key=lambda one: one.content[1]):
            self._save(load, uses[load], kills, order)

    def _number(self, block: Items, order: dict[Untyped, int], steps: list[tuple[Items, Untyped]]) -> None:
        for item in self.items[block]:
            order[item] = len(steps)
            steps.append((block, item))
            if isinstance(item, Branch | Loop):
                for arm in item.arms:
                    self._number(arm, order, steps)
                    order[item, arm] = len(steps)  # where its arm gives its numbers
                    steps.append((arm, (item, arm)))

    def _root(self, user: Untyped, block: Items) -> tuple[Untyped, Items]:
        """The statement of a use, and its block."""
        while isinstance(user, Operand) and user.op not in ("phi", "carried") and user not in self.held:
            (block, user) = self._uses[user][0]
        if isinstance(user, Operand) and user.op in ("phi", "carried"):
            return (user.content, block), block
        return user, block

    def _save(
        self,
        load: Operand,
        uses: list[tuple[Items, Untyped, int]],
        kills: list[tuple[Items, Untyped]],
        order: dict[Untyped, int],
    ) -> None:
        place: Place = load.content[0]
        begin = self._begin(load, order)
        in_way = []
        for block, item in kills:
            if writes(item, place) and order[item] >= begin and load.after is not item:
                clash = [at for where, _, at in uses if order[item] < at and not are_exclusive(block, where)]
                if clash:
                    in_way.append((block, item, order[item]))
        if not in_way:
            return
        points = [*uses, *in_way]
        common = next(
            block for block in points[0][0].ancestors() if all(block in set(p[0].ancestors()) for p in points)
        )
        first = min(points, key=lambda point: point[2])
        item, block = first[1], first[0]
        while block is not common:
            assert block.branch is not None
            item, block = block.branch, block.branch.block
        self.held.add(load)
        self.saved.setdefault(item if item is not None else None, []).append(load)

    def _begin(self, load: Operand, order: dict[Untyped, int]) -> int:
        """The step from which a load is the content of its place."""
        after = load.after
        if after is None:
            return -1
        if after in order:
            last = order[after]
            if isinstance(after, Branch | Loop):
                last = max([last, *(order[after, arm] for arm in after.arms if (after, arm) in order)])
            return last
        assert load.block is not None  # the old content is not needed: the item before it
        before = load.block.items[: load.block.items.index(after)] if after in load.block.items else []
        found = [order[item] for item in before if item in order]
        return max(found, default=-1)


def _puts(item: Untyped) -> bool:
    return isinstance(item, Call) and bool(item.procedure.puts)
