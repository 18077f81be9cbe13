"""Which variables of a kernel are addresses in C, and where the values lie to which they point.

A large struct is not copied where an address serves: a variable that is only ever what a call returns, or a part of
what never changes, is declared as a pointer to constant, and what a call returns has a place of its own.
"""

import ast

from levelhead.compiler.mark import is_kernel
from levelhead.export.expressions import Names
from levelhead.export.inference import Inference, arguments
from levelhead.export.kinds import variable
from levelhead.export.scopes import Scopes, loaded_in, stored_in


class Pointers:
    """The pointers of one kernel.

    Attributes:
        names: the variables that are pointers.
        slots: name -> statement -> the place of what that statement stores.
    """

    def __init__(self, parameters: set[str], scopes: Scopes, inference: Inference, names: Names) -> None:
        self._parameters, self._scopes, self._known, self._c_names = parameters, scopes, inference, names
        self._slot_names: set[str] = set()
        self.names = {name for name in scopes.variables if name in inference.variables and self._can_point(name)}
        self.slots = {name: self._find_slots(name) for name in sorted(self.names)}

    def is_constant(self, value: ast.expr) -> bool:
        """Whether a value is part of something that never changes in this kernel."""
        while isinstance(value, ast.Attribute):
            value = value.value
        if not isinstance(value, ast.Name):
            return False
        seen = self._scopes.variables.get(value.id)
        return seen is None or seen.stores == (0 if value.id in self._parameters else 1)

    def in_own_block(self, name: str, statement: ast.stmt) -> bool:
        """Whether a statement stands in the very block in which a variable is declared."""
        return self._scopes.at[statement][0] == self._scopes.variables[name].block[-1][0]

    def _can_point(self, name: str) -> bool:
        seen = self._scopes.variables[name]
        if name in self._parameters or seen.stores < 2 or not self._c_names.by_address(self._known.variables[name]):
            return False
        blocks = {block for block, _ in seen.block}
        return all(
            self._outlives(statement, name, blocks) for statement in self._scopes.at if name in stored_in(statement)
        )

    def _outlives(self, statement: ast.stmt, name: str, blocks: set[int]) -> bool:
        """Whether what a statement gives to a variable lives as long as the variable, in one of these blocks."""
        value = statement.value if isinstance(statement, ast.Assign | ast.AnnAssign) else None
        unpacks = _is_unpacking(statement)
        if not unpacks and isinstance(value, ast.Call):
            return True
        if unpacks and isinstance(value, ast.Call):  # into a struct that is declared just there
            return self._scopes.at[statement][0] in blocks
        if not unpacks and not isinstance(value, ast.Attribute):
            return False
        if value is None or isinstance(value, ast.Tuple) or not self.is_constant(value) or name in loaded_in(value):
            return False
        root = next(iter(loaded_in(value)))
        if root in self._parameters or root not in self._scopes.variables:
            return True
        begins = [
            one for one in self._scopes.at if root in stored_in(one) and root in self._scopes.declared_before(one)
        ]
        return bool(begins) and self._scopes.at[begins[0]][0] in blocks

    def _find_slots(self, name: str) -> dict[ast.stmt, str]:
        """Statement -> the place of what it gives to a variable, where it has to have one.

        One place serves all inner blocks. A call may read what it overwrites: C takes care of that, because a value is
        stored when it is whole.
        """
        found: dict[ast.stmt, str] = {}
        shared = ""
        for statement in self._scopes.at:
            if name not in stored_in(statement) or not isinstance(statement, ast.Assign | ast.AnnAssign):
                continue
            call = statement.value
            if not isinstance(call, ast.Call) or _is_unpacking(statement) or self._returns_same(name, call):
                continue
            own = self.in_own_block(name, statement)
            found[statement] = self._slot_name(name) if own or not shared else shared
            shared = shared if own else found[statement]
        return found

    def _returns_same(self, name: str, call: ast.Call) -> bool:
        """Whether a call does no more than give a variable back."""
        function = self._known.resolve(call.func)
        at = self._c_names.returned_parameter(function) if is_kernel(function) else None
        given = None if at is None else arguments(call, function)[at]
        return isinstance(given, ast.Name) and given.id == name

    def _slot_name(self, name: str) -> str:
        stem, number = variable(name), 2
        while f"{stem}_{number}" in self._known.variables or f"{stem}_{number}" in self._slot_names:
            number += 1
        self._slot_names.add(f"{stem}_{number}")
        return f"{stem}_{number}"


def _is_unpacking(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Assign) and all(isinstance(target, ast.Tuple) for target in statement.targets)
