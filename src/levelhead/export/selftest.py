"""The self-test: a C program that feeds the filter with a vector and compares its output with Python's."""

import math
from collections.abc import Iterable

from levelhead.export.c_api import CApi
from levelhead.export.config import ExportConfig
from levelhead.export.layout import join_lines, template, wrap_line
from levelhead.export.test_vectors import axis_rows, vector_rows
from levelhead.export.type_table import decimal
from levelhead.kernels.single import shortest, single

PERIOD = 360.0
BOUND = 2e-3  # of each number in single precision, and of its size; tests/export/test_selftest.py holds 1/4 of that


def selftest(api: CApi) -> dict[str, str]:
    """File name -> text of the self-test."""
    config = api.config
    bound = api.number(BOUND)
    same = template("same.double.c" if config.real == "double" else "same.float.c").template.strip()
    gaps = api.common_gaps() | {
        "bound": bound,
        "same": same.replace("$bound", bound),
        "promise": "the same to the bit" if config.real == "double" else f"the same to within {BOUND:g} (1 + its size)",
    }
    gaps["two"] = ", 2 if only last digits differ." if config.real == "double" else "."
    if config.axis:
        gaps |= _axis(config)
    else:
        gaps |= _imu(config)
    name = "selftest.axis.c" if config.axis else "selftest.imu.c"
    return {f"{config.name}_selftest.c": template(name).substitute(gaps)}


def literal(value: float, real: str) -> str:
    """A literal that reads back exactly; infinity and NaN by their names."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY"
    return decimal(float(value)) if real == "double" else f"{decimal(shortest(single(value)))}f"


def _group(values: Iterable[float], real: str) -> str:
    return "{" + ", ".join(literal(value, real) for value in values) + "}"


def _imu(config: ExportConfig) -> dict[str, object]:
    real, lines = config.real, []
    found = vector_rows(config)
    numbers = [field for field in config.answers.values() if field != "health"]
    healthy = "health" in config.answers
    for sample, taken, output in found:
        inputs = ", ".join(_group(values, real) for values in (sample.gyr, sample.acc, sample.mag))
        answers = _group((x for field in numbers for x in getattr(output, field)), real)
        health = f", {output.health}" if healthy else ""
        lines += [f"    {{{literal(sample.dt, real)}, {inputs}, {str(taken).lower()},", f"     {answers}{health}}},"]
    got = [f"out->{field}.{axis}" for field in numbers for axis in ("wxyz" if field == "quat" else "xyz")]
    return {
        "rows": join_lines(lines).rstrip(),
        "count": len(found),
        "numbers": len(got),
        "got": join_lines(wrap_line(f"const {real} got[{len(got)}] = {{{', '.join(got)}}};", "    ")).strip(),
        "health": "\n    int32_t health;" if healthy else "",
        "healthy": "out->health == row->health" if healthy else "true",
        "warm": f"\n    {config.name}_update_temperature(&filter, {literal(config.test_temperature, real)});"
        if config.curves
        else "",
        "equal": " Health must be equal." if healthy else "",
    }


def _axis(config: ExportConfig) -> dict[str, object]:
    real, first = config.real, 171.5
    found = axis_rows(config, first, PERIOD)
    assert config.flt.axis is not None
    fields: tuple[str, ...] = config.flt.axis.report._fields  # type: ignore[attr-defined]
    lines = [
        f"    {{{literal(row.level, real)}, {literal(row.rate, real)}, {literal(row.dt, real)}, "
        f"{str(row.taken).lower()},"
        f"\n     {_group(_flat(row.report), real)}}},"
        for row in found
    ]
    return {
        "rows": join_lines(lines).rstrip(),
        "count": len(found),
        "first": literal(first, real),
        "period": literal(PERIOD, real),
        "fields": len(fields),
        "values": ", ".join(f"now.{name}" for name in fields),
    }


def _flat(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]
