"""The frame of an export's answers: constant turns of the filter's output, the same sums in Python and as C.

A filter computes in ENU with a body forward-left-up. In another frame its quaternion q is e q b*, which is linear in q,
and the vectors of earth and body change places and signs.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from levelhead.axis_map import AxisMap
from levelhead.earth_frame import ENU, find_frame, frame_change
from levelhead.export.layout import STEP, join_lines
from levelhead.filters.contract import Output
from levelhead.kernels.quat import Quat
from levelhead.kernels.vec3 import Vec3
from levelhead.rotations import conjugate, product

Terms = list[list[tuple[int, float]]]  # of each number of an answer: index and factor of its addends
BEARING = {"ENU": "{quarter} - yaw", "NED": "yaw", "NWU": "-yaw"}  # from the yaw in C
YAW = {"ENU": "anticlockwise from east", "NED": "clockwise from north", "NWU": "anticlockwise from north"}


class FrameTerms(NamedTuple):
    """The sums of which answers are made.

    Attributes:
        quat: of a quaternion.
        bias: of a vector of the body.
        sigma: of 1σ about the axes of the earth.
        earth: of a vector of the earth.
    """

    quat: Terms
    bias: Terms
    sigma: Terms
    earth: Terms


@cache
def frame_terms(frame: str) -> FrameTerms:
    """Those from ENU to a frame."""
    change = frame_change(ENU, find_frame(frame))
    turned = product(change.earth, np.eye(4), conjugate(change.body)).T
    earth, body = AxisMap.from_quaternion(change.earth), AxisMap.from_quaternion(change.body)
    sigma = [[(axis, abs(factor)) for axis, factor in row] for row in earth.terms]
    return FrameTerms(
        [[(i, x) for i, x in enumerate(row) if x != 0.0] for row in turned.tolist()], body.terms, sigma, earth.terms
    )


def _sums(terms: Terms, values: Sequence[float]) -> list[float]:
    return [sum([values[i] * factor for i, factor in row[1:]], values[row[0][0]] * row[0][1]) for row in terms]


def turned_output(frame: str, found: Output) -> Output:
    """A filter's result in a frame."""
    if frame == ENU.name:
        return found
    terms = frame_terms(frame)
    bias, sigma = Vec3(*_sums(terms.bias, found.bias)), Vec3(*_sums(terms.sigma, found.sigma))
    return found._replace(quat=Quat(*_sums(terms.quat, found.quat)), bias=bias, sigma=sigma)


def sum_in_c(row: list[tuple[int, float]], names: Sequence[str], number: Callable[[float], str]) -> str:
    """One such sum in C; the order is Python's."""
    parts = [{1.0: names[i], -1.0: f"-{names[i]}"}.get(factor, f"{names[i]} * {number(factor)}") for i, factor in row]
    return " + ".join(parts)


def answer_lines(frame: str, field: str, kind: str, call: str, number: Callable[[float], str]) -> str:
    """The body of a function that gives one of the answers: the filter's output, turned to a frame."""
    if frame == ENU.name or field not in FrameTerms._fields:
        return f"{STEP}return {call};"
    axes = "wxyz" if field == "quat" else "xyz"
    names = [f"enu.{axis}" for axis in axes]
    rows: Terms = getattr(frame_terms(frame), field)
    lines = [f"{STEP}const {kind} enu = {call};", f"{STEP}{kind} found;"]
    lines += [f"{STEP}found.{axis} = {sum_in_c(row, names, number)};" for axis, row in zip(axes, rows, strict=True)]
    return join_lines([*lines, f"{STEP}return found;"]).rstrip()


def aiding_lines(frame: str, kind: str, real: str, number: Callable[[float], str]) -> dict[str, str]:
    """The gaps of aiding by vectors of the earth: into ENU, and the result out of it."""
    if frame == ENU.name:
        return {"into": "", "enu": "value", "deviation": "sigma", "turned": ""}
    back = AxisMap.from_quaternion(frame_change(find_frame(frame), ENU).earth).terms
    sizes = [[(i, abs(factor)) for i, factor in row] for row in back]
    enu, deviation = (
        ", ".join(sum_in_c(row, [f"{name}[{i}]" for i in range(3)], number) for row in rows)
        for name, rows in (("value", back), ("sigma", sizes))
    )
    terms = frame_terms(frame)
    lines = [f"{STEP}const {kind} enu = found;"]
    for field, rows in (("position", terms.earth), ("velocity", terms.earth), ("sigma_position", terms.sigma),
                        ("sigma_velocity", terms.sigma)):  # fmt: skip
        names = [f"enu.{field}.{axis}" for axis in "xyz"]
        lines += [
            f"{STEP}found.{field}.{axis} = {sum_in_c(row, names, number)};"
            for axis, row in zip("xyz", rows, strict=True)
        ]
    return {
        "into": f"{STEP}const {real} enu[3] = {{{enu}}}, deviation[3] = {{{deviation}}};\n",
        "enu": "enu",
        "deviation": "deviation",
        "turned": join_lines(lines),
    }


def axes_words(frame: str) -> str:
    """The axes of the earth, such as "x east, y north, z up"."""
    return ", ".join(f"{name} {axis}" for name, axis in zip("xyz", find_frame(frame).axes, strict=True))


def axes_list(frame: str) -> str:
    """The same in a sentence: "east, north and up"."""
    x, y, z = find_frame(frame).axes
    return f"{x}, {y} and {z}"
