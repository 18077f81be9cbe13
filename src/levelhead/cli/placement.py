"""How the sensor sits on its body, and the frame in which results are written: options that several verbs share."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from levelhead.cli.options import Axes

if TYPE_CHECKING:
    from levelhead.axis_map import AxisMap

FrameName = Annotated[Literal["enu", "ned", "nwu"], Parameter(name="--frame")]
AS_MOUNTED = "x,y,z"


@Parameter(name="*")
@dataclass(frozen=True)
class Placement:
    """The mounting of the sensor and the frame of the results."""

    frame: FrameName = "enu"
    """Earth frame of the result: enu, nwu, or ned with the body's axes forward-right-down."""
    axes: Axes = AS_MOUNTED
    """How the sensor sits on its body (x forward, y left, z up): its axes for x, y, z, such as -y,x,z, which
    `levelhead axes` finds; Euler angles in degrees, such as ZYX:90,0,10; or a quaternion wxyz. The orientation is the
    body's."""

    @property
    def mounting(self) -> "AxisMap | None":
        """The rotation from the sensor's axes to the body's; None: they are the same.

        Raises:
            LevelheadError: no such axes.
        """
        from levelhead.axis_map import IDENTITY, AxisMap

        found = AxisMap.parse(self.axes)
        return None if found == IDENTITY else found
