"""What an export knows of its own sensor, as C: what an earlier run has learned of it."""

import textwrap
from collections.abc import Iterator
from typing import Any

from levelhead.calibration import SHAPES
from levelhead.errors import LevelheadError
from levelhead.export.choice import Choice
from levelhead.export.expressions import variable
from levelhead.export.layout import STEP, WIDTH, comment, safe, wrapped
from levelhead.export.program import Program
from levelhead.export.statements import joined
from levelhead.filters.learned import Estimate, Learned

Place = tuple[str, int]  # a list inside a state, and an index in it


def _numbers(value: Any, path: str) -> Iterator[tuple[Place, float]]:
    """The numbers in the lists of a state."""
    if isinstance(value, list):
        yield from (((path, i), number) for i, number in enumerate(value))
    elif isinstance(value, tuple):
        for name in value._fields:  # type: ignore[attr-defined]
            yield from _numbers(getattr(value, name), f"{path}.{variable(name)}")


def _silent(part: Estimate | None) -> Estimate | None:
    """Nothing known of a quantity, in its shape."""
    return part and Estimate(*((0.0,) * len(numbers) for numbers in part))


def _told(choice: Choice) -> Iterator[tuple[str, dict[Place, float]]]:
    """Quantity -> the numbers in the state by which a filter knows of it before its first sample."""
    if choice.prior is None or choice.flt.calibration is None:
        return
    state, known = choice.begin().run.state, choice.prior.prior()
    nothing = Learned(*map(_silent, known))  # type: ignore[arg-type]
    before = dict(_numbers(choice.flt.calibration.told(state, nothing), "carry.run.state"))
    for name, part in known._asdict().items():
        told = choice.flt.calibration.told(state, nothing._replace(**{name: part}))
        after = dict(_numbers(told, "carry.run.state"))
        yield name, {at: number for at, number in after.items() if repr(number) != repr(before[at])}


def prior_table(choice: Choice, program: Program) -> str:
    """The numbers of the prior, to stand before the functions that need them; empty without one."""
    lines: list[str] = []
    for name, numbers in _told(choice):
        try:
            entries = [f"{{{at}, {program.number(number)}}}," for (_, at), number in numbers.items()]
        except OverflowError as error:
            raise LevelheadError(f"prior, {name}: {error}; export --double") from None
        unit = SHAPES[name][1]
        lines += [f"{STEP}/* {name}{unit and f', {unit}'} */", *wrapped(" ".join(entries), STEP)] if entries else []
    if not lines:
        return ""
    words = "What an earlier run has learned of this sensor: values and their 1 sigma, where the start looks for them."
    head = ["static const struct {", f"{STEP}int32_t at;", f"{STEP}{program.real} value;", "} prior[] = {"]
    return joined([*comment(words), *head, *lines, "};", ""])


def prior_start(choice: Choice) -> str:
    """The lines that tell a filter, before its first sample, what is in the table; empty without one."""
    lists = {path for _, numbers in _told(choice) for path, _ in numbers}
    if not lists:
        return ""
    (memory,) = lists
    count = "(int32_t)(sizeof prior / sizeof prior[0])"
    return joined([
        f"{STEP}for (int32_t i = 0; i < {count}; i++) {{",
        f"{STEP * 2}filter->{memory}[prior[i].at] = prior[i].value;",
        f"{STEP}}}",
    ])  # fmt: skip


def about(choice: Choice) -> str:
    """What the header says about it: lines of its first comment."""
    lines: list[str] = []
    if choice.prior is not None:
        lines.append("It starts with what an earlier run has learned of this sensor:")
        lines += [f"    {line}" for line in choice.prior.words()]
    folded = [part for line in lines for part in textwrap.wrap(line, WIDTH, subsequent_indent=" " * 8)]
    return "".join(f" * {safe(line)}\n" for line in ["", *folded] if lines)


def field_unit(choice: Choice) -> str:
    """The unit in which a magnetometer has to read, in words."""
    return "µT" if choice.prior is not None and choice.prior.mag_offset is not None else "any one unit"
