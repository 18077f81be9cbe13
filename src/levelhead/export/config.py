"""The exported program: a filter with its numbers, with or without the guard, or on one axis, in single or double, and
its sensor's calibration.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from levelhead import filters
from levelhead.axis_map import IDENTITY, AxisMap
from levelhead.calibration import Calibration, TemperatureCurve
from levelhead.earth_frame import ENU, find_frame
from levelhead.engine.binding import bind, is_guarded
from levelhead.engine.driver import Carry, Settings
from levelhead.engine.prior import Warmth, apply_prior
from levelhead.errors import LevelheadError, nearest
from levelhead.export.layout import snake
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params, param_table
from levelhead.guard import Guard
from levelhead.kernels.correction import Readings, correct_readings
from levelhead.kernels.vec3 import ZERO, Vec3

DEFAULT_GUARD = Guard()
DISPENSABLE = ("sigma", "health", "bias", "mag", "parameters")
ANSWERS = {"quaternion": "quat", "bias": "bias", "sigma": "sigma", "health": "health"}  # and the field of ``Output``
LEAN = frozenset({"sigma", "health", "parameters"})  # and the guard


@dataclass(frozen=True)
class ExportConfig:
    """One export.

    Attributes:
        params: of the filter, whose class names it.
        guard: in front of it; None: the filter sees every reading as it is.
        real: the type of all numbers.
        axis: the filter of one level and its rate instead of that of an IMU.
        prior: the calibration of the same sensor by an earlier run: the filter starts with it.
        axes: how the sensor sits on its body; all else, calibration and prior included, is in the body's axes.
        frame: "ENU", "NED" or "NWU": of the answers; with NED their body is forward-right-down.
        calibration: its errors are taken off the readings before anything else sees them.
        without: outputs that the program does not call ("sigma", "health", "bias"), an absent sensor ("mag"), and
            "parameters": they are constants of the program.
        board: the board that is to hold the sketch, as ``board.BOARDS`` names it; "": whichever.
        chip: that the sketch reads, as ``chips.chips`` names it.
        command: the words that do it again.
    """

    params: Params
    guard: Guard | None = DEFAULT_GUARD
    real: Literal["float", "double"] = "double"
    axis: bool = False
    prior: Calibration | None = None
    axes: AxisMap = IDENTITY
    frame: str = ENU.name
    calibration: Calibration | None = None
    without: frozenset[str] = frozenset()
    board: str = ""
    chip: str = "MPU-6050"
    command: str = "levelhead export"

    def __post_init__(self) -> None:
        for word in sorted(self.without):
            if word not in DISPENSABLE:
                raise LevelheadError(f"there is no '{word}' to leave out; {nearest(word, DISPENSABLE)}")
        object.__setattr__(self, "frame", find_frame(self.frame).name)
        if self.axis and self.frame != ENU.name:
            raise LevelheadError("one level and its rate have no earth frame: leave the frame out")
        if self.without and self.axis:
            raise LevelheadError("one level and its rate have none of these parts: leave --without and --lean out")
        if self.axis and self.flt.axis is None:
            having = ", ".join(flt.name for flt in filters.ALL if flt.axis)
            raise LevelheadError(f"{self.flt.name} needs an IMU; on one level and its rate work {having}")
        if self.axis and self.corrects:
            raise LevelheadError("one level and its rate have no three axes: leave out axes and calibration")
        if self.prior is not None and self.calibration is not None:
            raise LevelheadError(
                "a prior and a calibration would take the same errors off twice; give a filter that learns its sensor "
                "a prior, any other a calibration"
            )
        self.begin()

    @property
    def answers(self) -> dict[str, str]:
        """The calls of a program for a result, and the field of ``contract.Output`` that it is."""
        return {name: field for name, field in ANSWERS.items() if name not in self.without}

    @property
    def flt(self) -> Filter:
        """The filter."""
        return filters.of(self.params)

    @property
    def settings(self) -> Settings:
        """The driver's settings."""
        return Settings(self.params, self.guard or Guard())

    def begin(self) -> Carry:
        """The driver's carry before the first sample, in plain Python.

        Raises:
            LevelheadError: the filter learns nothing of its sensor, and there is a prior.
        """
        return apply_prior(self.flt, bind(self.flt, self.guard is not None).begin(self.settings), self.prior)

    @property
    def corrects(self) -> bool:
        """Whether something is done to the readings before anything else sees them."""
        return self.axes != IDENTITY or self.corrections is not None or bool(self.curves)

    @property
    def curves(self) -> Mapping[str, TemperatureCurve]:
        """How the biases of the sensor change with its temperature; empty: they do not."""
        known = self.calibration or self.prior
        return {} if known is None else known.temperature

    @property
    def test_temperature(self) -> float:
        """°C at which the self-test runs: off the reference, within each range or beyond it."""
        return round(
            max((curve.low + 0.8 * (curve.high - curve.low) for curve in self.curves.values()), default=0.0), 2
        )

    @property
    def corrections(self) -> Calibration | None:
        """The correction of the readings: the calibration, or the matrices of a prior from poses; None: nothing."""
        if self.calibration is not None or self.prior is None:
            return self.calibration
        return self.prior.matrices()

    def readings(self, gyr: Vec3, acc: Vec3, mag: Vec3) -> Readings:
        """The filter's input for these readings, at ``test_temperature``."""
        turned = [Vec3(*self.axes.turn(v)) for v in (gyr, acc, mag)]
        if self.curves:
            warmth = Warmth(self.curves)
            warmth.set(self.test_temperature)
            turned[:2] = [Vec3(*warmth.less(name, v)) for name, v in zip(("gyr", "acc"), turned, strict=False)]
        if "mag" in self.without:
            turned[2] = ZERO
        return Readings(*turned) if self.corrections is None else correct_readings(self.corrections.errors, *turned)

    @property
    def guarded(self) -> bool:
        """Whether the guard is part of it."""
        return self.guard is not None and is_guarded(self.flt) and not self.axis

    @property
    def name(self) -> str:
        """Of the files and in front of all names: lh_ekf, lh_kalman_axis."""
        return f"lh_{snake(self.flt.name)}" + ("_axis" if self.axis else "")


def remarks(params: type) -> dict[str, str]:
    """Field -> unit, meaning and range of a parameter."""
    said = {}
    for name, param in param_table(params).items():
        inside = "" if param.range == "any number" else f" ({param.range})"
        said[name] = f"{param.unit}: {param.doc}{inside}" if param.unit else f"{param.doc}{inside}"
    return said
