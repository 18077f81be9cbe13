"""A joint: its angle over time with σ, its axis, and whether the motion shows both."""

from dataclasses import dataclass, field

import numpy as np

from levelhead.joints.hinge import HingeFit
from levelhead.recording import Array

MIN_SPREAD = 3.0  # degrees, RMS of the joint's motion from which its axis can be found
MAX_AXIS_SIGMA = 5.0  # degrees
MAX_RESIDUAL = 15.0  # degrees: a residual of the axis beyond that of soft tissue


@dataclass(frozen=True, eq=False)
class Joint:
    """The angle of a hinge.

    Attributes:
        t: (n,) s.
        angle: (n,) degrees, continuous; positive where the lower segment turns about the axis by the right hand.
        sigma: (n,) degrees, 1σ of the angle after a constant.
    """

    t: Array
    angle: Array
    sigma: Array
    fit: HingeFit = field(repr=False)

    @property
    def axis_upper(self) -> Array:
        """(3,) unit vector of the axis in the frame of the upper sensor."""
        return self.fit.upper

    @property
    def axis_lower(self) -> Array:
        """(3,) unit vector of the axis in the frame of the lower sensor."""
        return self.fit.lower

    @property
    def sigma_axes(self) -> tuple[float, float]:
        """Degrees, 1σ of the direction of the axis in the upper and in the lower sensor."""
        return float(np.degrees(self.fit.sigma_upper)), float(np.degrees(self.fit.sigma_lower))

    @property
    def residual(self) -> float:
        """Degrees, RMS by which the two sensors disagree on the direction of the axis; near 0 for a pure hinge."""
        return float(np.degrees(self.fit.residual))

    @property
    def heading(self) -> Array:
        """(n,) degrees by which the heading of the lower sensor is ahead of the upper one's."""
        return np.degrees(self.fit.heading)

    @property
    def fault(self) -> str:
        """A sentence on why the angle cannot be trusted; "" where it can."""
        spread = float(np.degrees(self.fit.spread))
        if spread < MIN_SPREAD:
            return (
                f"the joint moves by {spread:.2g}° RMS; its axis cannot be found below {MIN_SPREAD:g}°. "
                "Record a motion that bends the joint"
            )
        if self.residual > MAX_RESIDUAL:
            return (
                f"the sensors disagree on the axis by {self.residual:.2g}° RMS: this joint has more than one axis, or "
                "the clocks of the sensors differ. `levelhead.align` shows a shift"
            )
        if max(self.sigma_axes) > MAX_AXIS_SIGMA:
            return (
                f"the direction of the axis is known to {max(self.sigma_axes):.2g}° only. "
                "Record a motion that bends the joint while both segments also turn in other directions"
            )
        return ""

    def __repr__(self) -> str:
        spread = float(np.ptp(self.angle))
        return (
            f"Joint({len(self.t)} samples, range {spread:.0f}°, σ {np.median(self.sigma):.2g}°"
            f"{', not trusted: ' + self.fault if self.fault else ''})"
        )
