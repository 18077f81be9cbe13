"""A joint: its angle over time with σ, its axis, and whether the motion shows both."""

from dataclasses import dataclass, field

import numpy as np

from levelhead.joints.axes_fit import AxesFit
from levelhead.recording import Array

MIN_SPREAD = 3.0  # degrees, RMS of the joint's motion from which its axis can be found
MAX_AXIS_SIGMA = 5.0  # degrees
MAX_SIGMA = 8.0  # degrees, median of an angle's σ
MIN_LIKELIHOOD = 3.0  # log of the ratio to the fit with the other sign: 20 to 1
MAX_RESIDUAL = 15.0  # degrees: a residual of the axis beyond that of soft tissue


@dataclass(frozen=True, eq=False)
class Joint:
    """The angles of a joint.

    Attributes:
        t: (n,) s.
        angle: degrees; of a hinge (n,), continuous, positive where the lower segment turns about the axis by the right
            hand; of more axes (n, 3): about the axis of the upper segment, the floating one, that of the lower segment.
        sigma: degrees, 1σ of the angles after a constant, of the same shape.
        axes: 1, 2 or 3.
    """

    t: Array
    angle: Array
    sigma: Array
    fit: AxesFit = field(repr=False)
    axes: int = 1

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
        """The reason for which the angle is doubtful, in a sentence; "" where it can."""
        if self.fit.referenced:
            return ""
        spread = float(np.degrees(self.fit.spread))
        if spread < MIN_SPREAD:
            about = "about its second axis " if self.axes == 2 else ""
            return (
                f"the joint moves {about}by {spread:.2g}° RMS; its axes cannot be found below {MIN_SPREAD:g}°. "
                "Record a motion that bends the joint about each"
            )
        if self.residual > MAX_RESIDUAL:
            more = "give tracks with north" if self.axes == 3 else f"give axes={self.axes + 1}"
            return (
                f"the sensors disagree on the axis by {self.residual:.2g}° RMS: this joint has more than "
                f"{'one axis' if self.axes != 2 else 'two axes'} ({more}), or the clocks of the sensors differ. "
                "`levelhead.align` shows a shift"
            )
        advice = "Record a motion that bends the joint while both segments also turn in other directions"
        if max(self.sigma_axes) > MAX_AXIS_SIGMA:
            return f"the direction of the axis is known to {max(self.sigma_axes):.2g}° only. {advice}"
        if self.fit.likelihood < MIN_LIKELIHOOD:
            return f"the axis stayed level, and the lower sensor may as well head the other way. {advice}"
        sigma = float(np.max(np.median(self.sigma, axis=0)))
        return f"the angles are known to {sigma:.2g}° only. {advice}" if sigma > MAX_SIGMA else ""

    def __repr__(self) -> str:
        span = ", ".join(f"{one:.0f}°" for one in np.atleast_1d(np.ptp(self.angle, axis=0)))
        return (
            f"Joint({len(self.t)} samples, range {span}, σ {np.median(self.sigma):.2g}°"
            f"{', not trusted: ' + self.fault if self.fault else ''})"
        )
