"""Possible meanings of four numbers: order, direction, frames.

**A wrong order equals a rotation.** Reading x, y, z, w as w, x, y, z permutes four numbers cyclically. That is
an orthogonal map of determinant −1, and every such map is q ↦ p q* r with two constant unit quaternions (J. H. Conway,
D. A. Smith, On Quaternions and Octonions, 2003, section 4.1). Here p = (1 + j)/√2 and r = (i + k)/√2. So a wrong order
is the same as an inverse with two constant rotations: where both are free, only two of the four readings differ. The
cheaper hypothesis decides between the others.
"""

from itertools import product
from typing import Literal, NamedTuple

from levelhead.recording import Array
from levelhead.rotations import FRD_TO_FLU, NED_TO_ENU, NWU_TO_ENU, ONE, conjugate

Order = Literal["wxyz", "xyzw"]
EarthFrame = Literal["ENU", "NED", "NWU"]
SensorFrame = Literal["as the reference", "forward-right-down"]

TO_ENU: dict[str, Array] = {  # E of eq. (1), wxyz
    "ENU": ONE,
    "NED": NED_TO_ENU,
    "NWU": NWU_TO_ENU,
}
TO_REFERENCE: dict[str, Array] = {  # D of eq. (1), wxyz
    "as the reference": ONE,
    "forward-right-down": FRD_TO_FLU,
}


class Convention(NamedTuple):
    """The discrete part of eq. (1): C, E and D."""

    order: Order = "wxyz"
    inverse: bool = False
    earth: EarthFrame = "ENU"
    sensor: SensorFrame = "as the reference"

    @property
    def cost(self) -> int:
        """Distance from "the same": 1 for each departure; NED together with forward-right-down is one."""
        frames = (self.earth != "ENU") + (self.sensor != "as the reference")
        both = self.earth == "NED" and self.sensor == "forward-right-down"
        return (self.order != "wxyz") + self.inverse + frames - both

    def read(self, quat: Array) -> Array:
        """(n, 4) C(A): the numbers as wxyz, sensor to earth."""
        wxyz = quat if self.order == "wxyz" else quat[:, [3, 0, 1, 2]]
        return conjugate(wxyz) if self.inverse else wxyz

    def __str__(self) -> str:
        parts = [f"order {self.order}"] if self.order != "wxyz" else []
        parts += ["inverse (earth to sensor)"] if self.inverse else []
        if self.earth == "NED" and self.sensor == "forward-right-down":
            return ", ".join([*parts, "frames NED and forward-right-down"])
        parts += [f"earth frame {self.earth}"] if self.earth != "ENU" else []
        parts += [f"sensor axes {self.sensor}"] if self.sensor != "as the reference" else []
        return ", ".join(parts) or "the same convention"


SAME = Convention()
READINGS: tuple[tuple[Order, bool], ...] = (("wxyz", False), ("wxyz", True), ("xyzw", False), ("xyzw", True))


def distinct_conventions(order: Order, inverse: bool, earth: str, sensor: str) -> list[Convention]:
    """The conventions that differ, given how free the constant rotations are (see ``rotation_fit.Freedom``)."""
    if earth == "any" and sensor == "any" and order != "wxyz":
        return []  # the same as the other direction, see above
    frames: dict[str, tuple[EarthFrame, ...]] = {"none": ("ENU", "NED", "NWU"), "heading": ("ENU", "NED")}
    axes: tuple[SensorFrame, ...] = ("as the reference", "forward-right-down")
    pairs = product(frames.get(earth, ("ENU",)), axes if sensor == "none" else axes[:1])
    return [Convention(order, inverse, frame, body) for frame, body in pairs]
