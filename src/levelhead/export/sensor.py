"""The sensor of an export, as C: its mounting, its errors, and the learned calibration of an earlier run."""

import textwrap
from collections.abc import Iterator

from levelhead.axis_map import IDENTITY
from levelhead.calibration import QUANTITIES, Calibration
from levelhead.compiler.tree import Tree
from levelhead.errors import LevelheadError
from levelhead.export.config import ExportConfig
from levelhead.export.kinds import variable
from levelhead.export.layout import STEP, WIDTH, add_comment, comment, escape, join_lines, wrap_line
from levelhead.export.type_table import TypeTable
from levelhead.filters.eskf import state as at
from levelhead.filters.eskf.calibration import Estimate

Place = tuple[str, int]  # a list inside a state, and an index in it
READINGS = ("gyr", "acc", "mag")


def _numbers(value: Tree, path: str) -> Iterator[tuple[Place, float]]:
    """The numbers in the lists of a state."""
    if isinstance(value, list):
        yield from (((path, i), number) for i, number in enumerate(value))
    elif isinstance(value, tuple):
        for name in value._fields:  # type: ignore[attr-defined]
            yield from _numbers(getattr(value, name), f"{path}.{variable(name)}")


def _silent(part: Estimate) -> Estimate:
    """Nothing known of a quantity, in its shape."""
    return Estimate(*((0.0,) * len(numbers) for numbers in part))


def _prior_numbers(config: ExportConfig) -> Iterator[tuple[str, dict[Place, float]]]:
    """Quantity -> the numbers in the state that a filter has of it before its first sample."""
    if config.prior is None or config.flt.calibration is None:
        return
    state, known = config.begin().run.state, config.prior.prior()
    nothing = {name: _silent(part) for name, part in known.items()}
    before = dict(_numbers(config.flt.calibration.with_prior(state, nothing), "carry.run.state"))
    for name, part in known.items():
        told = config.flt.calibration.with_prior(state, nothing | {name: part})
        after = dict(_numbers(told, "carry.run.state"))
        yield name, {at: number for at, number in after.items() if repr(number) != repr(before[at])}


def prior_table(config: ExportConfig, types: TypeTable) -> str:
    """The numbers of the prior, to stand before the functions that need them; empty without one."""
    lines: list[str] = []
    for name, numbers in _prior_numbers(config):
        try:
            entries = [f"{{{at}, {types.number(number)}}}," for (_, at), number in numbers.items()]
        except OverflowError as error:
            raise LevelheadError(f"prior, {name}: {error}; export --double") from None
        unit = QUANTITIES[name].unit
        lines += [f"{STEP}/* {name}{unit and f', {unit}'} */", *wrap_line(" ".join(entries), STEP)] if entries else []
    if not lines:
        return ""
    words = "The calibration of this sensor by an earlier run: values and their 1 sigma, read at the start."
    head = ["static const struct {", f"{STEP}int32_t at;", f"{STEP}{types.real} value;", "} prior[] = {"]
    return join_lines([*comment(words), *head, *lines, "};", ""])


def prior_start(config: ExportConfig) -> str:
    """The lines that give a filter the table before its first sample; empty without one."""
    lists = {path for _, numbers in _prior_numbers(config) for path, _ in numbers}
    if not lists:
        return ""
    (memory,) = lists
    count = "(int32_t)(sizeof prior / sizeof prior[0])"
    return join_lines([
        f"{STEP}for (int32_t i = 0; i < {count}; i++) {{",
        f"{STEP * 2}filter->{memory}[prior[i].at] = prior[i].value;",
        f"{STEP}}}",
    ])  # fmt: skip


def learned_errors(config: ExportConfig) -> tuple[str, dict[str, object]]:
    """The fields of a filter's calibration, and the gaps of the function that reads them."""
    if config.flt.calibration is None:
        return "", {}
    fields, calls = [], []
    for block in at.BLOCKS:
        if block.calibration:
            name, size = block.name, block.size
            words = f"{block.unit}: {block.meaning}" if block.unit else block.meaning
            fields += add_comment([f"{STEP}{config.real} {name}[{size}], {name}_sigma[{size}];"], words)
            unit = "1.0" if config.real == "double" else "1.0f"
            if block.exists == at.WITH_MAG:
                unit = "norm" if block.relative else "there"
            calls.append(f"{STEP}learned(filter, {block.first}, {size}, {unit}, found.{name}, found.{name}_sigma);")
    root = "sqrt" if config.real == "double" else "sqrtf"
    numbers = {"p": at.P, "row": at.ROW, "mean": at.MEAN, "root": root, "calls": "\n".join(calls)}
    return "\n".join(fields), numbers


def about(config: ExportConfig) -> str:
    """The header's lines about it, in its first comment."""
    lines: list[str] = []
    if config.axes != IDENTITY:
        axes = str(config.axes).replace(",", ", ")
        lines.append(f"Readings are turned first: the body's x (forward), y (left), z (up) are the sensor's {axes}.")
    if config.frame == "NED":
        lines.append(
            "Answers are in NED, of a body forward-right-down: y and z of the readings, turned, point against it."
        )
    elif config.frame != "ENU":
        lines.append(f"Answers are in {config.frame}.")
    if config.calibration is not None:
        lines.append("The errors of this sensor are subtracted from its readings (filter.errors):")
        lines += _words(config.calibration)
    if config.prior is not None:
        lines.append("It starts with the calibration of this sensor by an earlier run:")
        lines += _words(config.prior)
    folded = [part for line in lines for part in textwrap.wrap(line, WIDTH, subsequent_indent=" " * 8)]
    return "".join([" *\n", *(f" * {escape(line)}\n" for line in folded)]) if lines else ""


def _words(found: Calibration) -> list[str]:
    """The calibration without the field, which belongs to the place."""
    return [f"    {line}" for line in found.without("field").words()]


def field_unit(config: ExportConfig) -> str:
    """The unit in which a magnetometer has to read, in words."""
    found = config.prior or config.calibration
    return "any one unit" if found is None or found.mag_offset is None else "µT"


def frame(config: ExportConfig) -> str:
    """The body of the orientation."""
    return "sensor" if config.axes == IDENTITY and config.frame != "NED" else "body"


def axes_comment(config: ExportConfig) -> str:
    """A comment on the axes; empty where they are those of the sensor."""
    if config.axes == IDENTITY:
        return ""
    return (
        f"/* Readings in the axes of the body: its x (forward), y (left), z (up) are the sensor's {config.axes}. */\n"
    )
