"""Operations that are done before the program runs, where the result is the same in every precision."""

from collections.abc import Callable, Sequence

from levelhead.export.graph import FLOAT, Operand
from levelhead.kernels.single import single

COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}
COMPUTE: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "|": lambda a, b: a | b,
    "&": lambda a, b: a & b,
    "^": lambda a, b: a ^ b,
    "neg": lambda a: -a,
    "abs": abs,
    "min": lambda a, b: b if b < a else a,
    "max": lambda a, b: b if b > a else a,
}
MOST_WHOLE = 2.0**24  # below, every precision has each whole number
Constant = Callable[[float], Operand]


def _number(node: Operand) -> float | None:
    if node.op == "const":
        return node.content  # type: ignore[no-any-return]
    return node.content[2] if node.op == "named" else None


def _is(node: Operand, value: float) -> bool:
    return node.op == "const" and type(node.content) is type(value) and repr(node.content) == repr(value)


def fold(op: str, given: Sequence[Operand], constant: Constant) -> Operand | None:
    """The result of an operation that needs none at run time; None for any other."""
    values = [_number(node) for node in given]
    numbers = [value for value in values if value is not None]
    if op in COMPARE and len(numbers) == len(values):
        return constant(COMPARE[op](*numbers))
    if op in COMPUTE and all(node.op == "const" for node in given):
        result = COMPUTE[op](*numbers)
        if all(isinstance(value, int) or _is_single(value) for value in (*numbers, result)):
            return constant(result)
    if op in ("sqrt", "/") and all(node.op == "const" for node in given):
        exact = _exact_root(*numbers) if op == "sqrt" else _exact_quotient(*numbers)
        if exact is not None:
            return constant(exact)
    return _neutral(op, given, constant)


def _is_single(value: float) -> bool:
    """Whether single precision has a number as it is."""
    try:
        return single(value) == value
    except OverflowError:
        return False


def _exact_root(square: float) -> float | None:
    """The root of the square of a whole number, which no precision rounds."""
    root = float(round(abs(square) ** 0.5)) if abs(square) < MOST_WHOLE else 0.0
    return root if root * root == square and repr(square) != "-0.0" else None


def _exact_quotient(a: float, b: float) -> float | None:
    """The quotient of whole numbers that is a whole number."""
    whole = b != 0.0 and abs(a) < MOST_WHOLE and abs(b) < MOST_WHOLE and a % b == 0.0 and float(b).is_integer()
    return float(a) / float(b) if whole else None


def possible_bits(node: Operand) -> int:
    """The bits of a whole number that may be set; all of them where nothing is known."""
    if node.op == "const":
        return int(node.content)
    if node.op in ("|", "^"):
        return possible_bits(node.arguments[0]) | possible_bits(node.arguments[1])
    if node.op == "&":
        return possible_bits(node.arguments[0]) & possible_bits(node.arguments[1])
    if node.op == "phi":
        one, other = node.arguments
        return possible_bits(one) | possible_bits(other)
    return -1


def _neutral(op: str, given: Sequence[Operand], constant: Constant) -> Operand | None:
    """An operation with a neutral element."""
    if len(given) != 2:
        return None
    a, b = given
    if (op == "/" and _is(b, 1.0)) or (op == "-" and a.kind == FLOAT and _is(b, 0.0)):
        return a
    for value, other in ((a, b), (b, a)):
        if (op == "*" and (_is(value, 1.0) or _is(value, 1))) or (op in "+|" and _is(value, 0)):
            return other
        if op == "&" and _is(value, 0):
            return value
        if op == "&" and value.op == "const" and not possible_bits(value) & possible_bits(other):
            return constant(0)
    return a if op == "|" and a is b else None
