"""How far the node's clock is from the reader's, by questions and answers (RFC 5905, section 8)."""

import math
from typing import NamedTuple

RENEWAL = 60.0  # s after which an estimate is replaced by a worse one: two quartz clocks drift by 0.1 ms/s at most


class OffsetEstimate(NamedTuple):
    """An offset between two clocks.

    Attributes:
        offset: the node's clock minus the reader's, s.
        uncertainty: half of the round trip, s: the offset is wrong by no more.
        time: when it was measured, s on the reader's clock.
    """

    offset: float
    uncertainty: float
    time: float


UNKNOWN = OffsetEstimate(math.nan, math.inf, -math.inf)


class ClockOffset:
    """The best of several measurements.

    Attributes:
        estimate: the one in use.
    """

    def __init__(self) -> None:
        self.estimate = UNKNOWN

    def add(self, sent: float, node_time: float, received: float) -> None:
        """A question that was sent at ``sent`` and answered at ``received`` (s on the reader's clock).

        The answer has ``node_time`` (s on the node's clock), which was read in between. The measurement replaces the
        estimate if its round trip is shorter, if both contradict each other (a clock was set), or if the estimate is
        old.
        """
        new = OffsetEstimate(node_time - 0.5 * (sent + received), 0.5 * (received - sent), received)
        old = self.estimate
        contradicts = abs(new.offset - old.offset) > new.uncertainty + old.uncertainty
        if new.uncertainty <= old.uncertainty or contradicts or received - old.time > RENEWAL:
            self.estimate = new

    def age(self, stamp: float, now: float) -> float:
        """s at ``now`` (reader's clock) since ``stamp`` (node's clock); inf: clocks not compared, or set since.

        A stamp from the future is one of a clock that was set after the comparison.
        """
        offset, uncertainty, _ = self.estimate
        age = now + offset - stamp
        return max(0.0, age) if age >= -uncertainty - 1e-3 else math.inf
