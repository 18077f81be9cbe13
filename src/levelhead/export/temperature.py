"""The change of a sensor's biases with its temperature, as C: a call that takes the thermometer's reading."""

from collections.abc import Callable
from typing import NamedTuple

from levelhead.export.config import ExportConfig
from levelhead.export.layout import STEP, join_lines, template
from levelhead.kernels.tilt import NO_LENGTH
from levelhead.kernels.vec3 import Vec3


class BiasChange(NamedTuple):
    """The biases at the sensor's temperature less those at the reference."""

    gyr: Vec3  # rad/s
    acc: Vec3  # m/s²


NOTHING = BiasChange(Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))


def update_temperature(config: ExportConfig, number: Callable[[float], str]) -> str:
    """The function that takes a temperature; empty without curves."""
    lines = []
    for name, curve in config.curves.items():
        low, high, reference = (number(value) for value in (curve.low, curve.high, curve.reference))
        lines.append(f"{STEP}off = (celsius < {low} ? {low} : celsius > {high} ? {high} : celsius) - {reference};")
        for axis, row in zip("xyz", curve.value.tolist(), strict=True):
            first, second, third = (number(value) for value in row)
            lines.append(
                f"{STEP}filter->bias_change.{name}.{axis} = off * ({first} + off * ({second} + off * {third}));"
            )
    names = {"name": config.name, "real": config.real, "zero": number(0.0)}
    return template("temperature.c").substitute(names, lines=join_lines(lines).rstrip()) + "\n" if lines else ""


def declaration(config: ExportConfig) -> str:
    """Its declaration; empty without curves."""
    curves = config.curves
    if not curves:
        return ""
    ranges = " and ".join(
        f"{curve.low:.1f} to {curve.high:.1f} °C ({words}; at the start {curve.reference:.1f} °C)"
        for name, words in (("gyr", "gyroscope"), ("acc", "accelerometer"))
        if (curve := curves.get(name)) is not None
    )
    return template("temperature.h").substitute(name=config.name, real=config.real, ranges=ranges)


def subtract_change(config: ExportConfig, number: Callable[[float], str]) -> list[str]:
    """The lines that take the change off the readings; a silent accelerometer stays so."""
    lines = []
    if "gyr" in config.curves:
        lines += [f"{STEP}gyr[{i}] -= filter->bias_change.gyr.{axis};" for i, axis in enumerate("xyz")]
    if "acc" in config.curves:
        lines.append(f"{STEP}if (!(acc[0] * acc[0] + acc[1] * acc[1] + acc[2] * acc[2] <= {number(NO_LENGTH)})) {{")
        lines += [f"{STEP * 2}acc[{i}] -= filter->bias_change.acc.{axis};" for i, axis in enumerate("xyz")]
        lines.append(f"{STEP}}}")
    return lines
