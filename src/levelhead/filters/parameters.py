"""Parameters that explain themselves: unit, range, default and meaning stand in the class, and nowhere else.

    @parameters()
    class Kalman(NamedTuple):
        ...

        r_measure: Annotated[float, positive("deg²", "variance of the measured angle", 0.1, 100.0)] = 0.03

Every object of such a class is checked when it is made.
"""

import functools
import inspect
import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, Protocol, Self, TypeVar, get_args, get_origin, get_type_hints

from levelhead.errors import LevelheadError, nearest

P = TypeVar("P")


class Param(NamedTuple):
    """Unit, range and meaning of one parameter: the only place where they stand.

    ``sweep`` is the part of the range worth searching, ``log`` whether to search it by factors,
    ``tune`` whether ``levelhead tune`` does so unasked.
    """

    unit: str
    doc: str
    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False
    sweep: tuple[float, float] | None = None
    log: bool = False
    tune: bool = True

    def allows(self, value: float) -> bool:
        """Whether the value lies inside the range."""
        above = value > self.low if self.low_open else value >= self.low
        below = value < self.high if self.high_open else value <= self.high
        return above and below

    @property
    def range(self) -> str:
        """The range in words: "greater than 0", "at least 0 and below 1"."""
        words = []
        if self.low != -math.inf:
            words.append(f"{'greater than' if self.low_open else 'at least'} {self.low:g}")
        if self.high != math.inf:
            words.append(f"{'below' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(words) or "any number"


def positive(unit: str, doc: str, low: float, high: float) -> Param:
    """A parameter greater than 0, worth searching by factors from ``low`` to ``high``."""
    return Param(unit, doc, low=0.0, low_open=True, sweep=(low, high), log=True)


def nonnegative(unit: str, doc: str, low: float = 0.0, high: float = 0.0) -> Param:
    """A parameter of at least 0, worth searching by factors from ``low`` to ``high``; not at all without these."""
    return Param(unit, doc, low=0.0, sweep=(low, high) if high > low else None, log=high > low)


POSITIVE = Param("", "an interval in seconds", low=0.0, low_open=True)


class Params(Protocol):
    """The parameters of a filter: a NamedTuple decorated by ``parameters``. Its class chooses the filter."""

    @property
    def _fields(self) -> tuple[str, ...]: ...

    @property
    def _field_defaults(self) -> dict[str, Any]: ...  # Any, as typeshed has it: float or bool

    def _asdict(self) -> dict[str, Any]: ...  # Any, as typeshed has it: float or bool

    def _replace(self, *args: Any, **kwargs: Any) -> Self: ...  # Any: each class has keywords of its own


FilterChoice = Params | type[Params] | str  # the choice of a filter: its parameters, their class, or its name


class Derived(NamedTuple):
    """Another name by which a parameter can be set, such as alpha for a time constant."""

    param: Param
    field: str
    forward: Callable[..., float]  # value, further keywords with defaults -> field
    back: Callable[[float], float]  # field -> value, with these defaults


def short_name(params: Params) -> str:
    """The filter's name, with the parameters that differ from its defaults."""
    return repr(params).removesuffix("()")


def param_table(params: type) -> dict[str, Param]:
    """Field name -> Param of a Params class, in order of definition."""
    table, tuned = {}, getattr(params, "_tuned", None)
    for name, hint in get_type_hints(params, include_extras=True).items():
        if get_origin(hint) is Annotated:
            param = next(item for item in get_args(hint) if isinstance(item, Param))
            table[name] = param._replace(tune=tuned is None or name in tuned)
    return table


def derived_table(params: type) -> dict[str, Derived]:
    """Other names by which parameters of the class can be set."""
    return getattr(params, "_derived", {})


def description(params: type) -> str:
    """The docstring of a Params class as it is written, without the generated *Args* section."""
    return str(getattr(params, "_description", ""))


def settable(params: type) -> dict[str, Param]:
    """Every name that can be set: the fields and the derived ones."""
    return param_table(params) | {name: derived.param for name, derived in derived_table(params).items()}


def _number(owner: str, name: str, value: object, param: Param, default: object) -> float | bool:
    if isinstance(default, bool):
        if isinstance(value, bool) or value in (0, 1):
            return bool(value)
        raise LevelheadError(f"{owner}: {name} is {value!r}, but it must be True or False")
    if isinstance(value, bool | str):  # float() would take both
        raise LevelheadError(f"{owner}: {name} is {value!r}, but it must be a number")
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:  # an integer of hundreds of digits
        number = math.inf
    except (TypeError, ValueError):
        raise LevelheadError(f"{owner}: {name} is {value!r}, but it must be a number") from None
    if not math.isfinite(number) or not param.allows(number):
        unit = f" {param.unit}" if param.unit else ""
        raise LevelheadError(f"{owner}: {name} = {number:g} is not allowed; it must be {param.range}{unit}")
    return number


def _companions(derived: Derived) -> list[str]:
    """Further keywords that a derived name takes, such as the dt at which an alpha is meant."""
    return list(inspect.signature(derived.forward).parameters)[1:]


def _translate(owner: type, given: dict[str, object]) -> dict[str, object]:
    """Derived names replaced by the fields that they stand for; unknown names refused."""
    fields = owner._fields  # type: ignore[attr-defined]
    values = dict(given)
    for name, derived in derived_table(owner).items():
        companions = {key: values.pop(key) for key in _companions(derived) if key in values}
        if name in values:
            if derived.field in values:
                raise LevelheadError(f"{owner.__name__}: give {name} or {derived.field}, not both; they are one thing")
            number = _number(owner.__name__, name, values.pop(name), derived.param, 0.0)
            keywords = {key: _number(owner.__name__, key, value, POSITIVE, 0.0) for key, value in companions.items()}
            values[derived.field] = derived.forward(number, **keywords)
        elif companions:
            raise LevelheadError(f"{owner.__name__}: {', '.join(companions)} only goes with {name}; give both")
    for name in values:
        if name not in fields:
            hint = nearest(name, [*fields, *derived_table(owner)])
            raise LevelheadError(f"{owner.__name__} has no parameter '{name}'; {hint}")
    return values


def _replace_values(params: Params, changes: dict[str, object]) -> Params:
    """A new Params object with some values changed, derived names included; checked like any other."""
    derived = derived_table(type(params))
    replaced = {derived[name].field for name in changes if name in derived}
    kept = {name: value for name, value in params._asdict().items() if name not in replaced and name not in changes}
    return type(params)(**kept, **changes)


def parameters(*, tuned: tuple[str, ...] | None = None, **derived: Derived) -> Callable[[type[P]], type[P]]:
    """Class decorator for a NamedTuple of parameters: checks every value when an object is made.

    A value outside its range and a name that does not exist raise ``LevelheadError`` (the latter names the nearest
    parameter). ``tuned``: the fields that ``levelhead tune`` searches unasked, all by default. ``derived`` are further
    names by which a field can be set and read.
    """

    def decorate(cls: type[P]) -> type[P]:
        fields: tuple[str, ...] = cls._fields  # type: ignore[attr-defined]
        defaults: dict[str, float | bool] = cls._field_defaults  # type: ignore[attr-defined]
        table = param_table(cls)

        def make(new_cls: type, *args: object, **given: object) -> tuple[float, ...]:
            if len(args) > len(fields):
                raise LevelheadError(f"{cls.__name__} has {len(fields)} parameters, {len(args)} were given")
            for name in fields[: len(args)]:
                if name in given:
                    raise LevelheadError(f"{cls.__name__}: {name} is given twice")
            values = defaults | _translate(new_cls, dict(zip(fields, args, strict=False)) | given)
            missing = [name for name in fields if name not in values]
            if missing:
                raise LevelheadError(f"{cls.__name__} needs {', '.join(missing)}")
            checked = [
                _number(cls.__name__, name, values[name], table[name], defaults.get(name, 0.0)) for name in fields
            ]
            return tuple.__new__(new_cls, checked)

        members: dict[str, object] = {
            "__new__": make,
            "__slots__": (),
            "__doc__": f"{inspect.cleandoc(cls.__doc__ or '')}\n\n{_arguments(table, defaults, derived)}",
            "_description": inspect.cleandoc(cls.__doc__ or ""),
            "__signature__": _signature(table, defaults, derived),
            "__module__": cls.__module__,
            "__qualname__": cls.__qualname__,
            "__repr__": _repr,
            "_derived": derived,
            "_tuned": tuned,
            "_replace": lambda self, **changes: _replace_values(self, changes),
        }
        for name, d in derived.items():
            members[name] = property(functools.partial(_read_derived, d), doc=_meaning(d.param))
        for name, param in table.items():
            getattr(cls, name).__doc__ = _meaning(param)
        return type(cls.__name__, (cls,), members)

    return decorate


def _meaning(param: Param) -> str:
    """Meaning, unit and range of a parameter in one line."""
    return "; ".join(filter(None, (param.doc, param.unit and f"unit {param.unit}", param.range)))


def _arguments(table: dict[str, Param], defaults: dict[str, float | bool], derived: dict[str, Derived]) -> str:
    """The *Args* section of a docstring: type, unit, meaning, range and default of every parameter."""
    lines = ["Args:"]
    for name, param in table.items():
        default = defaults.get(name)
        if isinstance(default, bool):
            lines.append(f"    {name} (bool): {param.doc}; default {default}.")
            continue
        ending = "" if default is None else f"; default {default:g}"
        lines.append(
            f"    {name} (float{f', {param.unit}' if param.unit else ''}): {param.doc}; {param.range}{ending}."
        )
    for name, one in derived.items():
        with_keywords = "".join(f", with {key}" for key in _companions(one))
        lines.append(f"    {name} (float): sets {one.field}{with_keywords}: {one.param.doc}; {one.param.range}.")
    return "\n".join(lines)


def _signature(
    table: dict[str, Param], defaults: dict[str, float | bool], derived: dict[str, Derived]
) -> inspect.Signature:
    """The call as it may be written: the fields with their defaults, then the derived names as keywords."""
    entries = []
    for name in table:
        kind = bool if isinstance(defaults.get(name), bool) else float
        default = defaults.get(name, inspect.Parameter.empty)
        entries.append(
            inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD, default=default, annotation=kind)
        )
    for name, one in derived.items():
        for key in (name, *_companions(one)):
            entries.append(
                inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=float | None)
            )
    return inspect.Signature(entries)


def _read_derived(derived: Derived, params: Params) -> float:
    return derived.back(getattr(params, derived.field))


def _repr(self: Params) -> str:
    """Only the parameters that differ from the defaults, as one would type them."""
    changed = [f"{k}={v:g}" if not isinstance(v, bool) else f"{k}={v}" for k, v in self._asdict().items()
               if v != self._field_defaults.get(k)]  # fmt: skip
    return f"{type(self).__name__}({', '.join(changed)})"
