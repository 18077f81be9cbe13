"""Durations as a histogram of constant size."""

import math

STEP = math.log(1.05)  # a bucket is 5 % wide
MIN_LATENCY = 1e-6  # s
BUCKETS = 400  # up to 5 minutes


class LatencyHistogram:
    """Durations, counted in buckets of 5 %, so that hours cost no memory."""

    def __init__(self) -> None:
        self._counts = [0] * BUCKETS
        self.count = 0
        self.largest = 0.0

    def add(self, seconds: float) -> None:
        """Counts one duration."""
        self.count += 1
        self.largest = max(self.largest, seconds)
        bucket = int(math.log(seconds / MIN_LATENCY) / STEP) if seconds > MIN_LATENCY else 0
        self._counts[min(bucket, BUCKETS - 1)] += 1

    def quantile(self, share: float) -> float:
        """The duration that ``share`` of all do not exceed, to 5 %; NaN without any."""
        if self.count == 0:
            return math.nan
        left = share * self.count
        for bucket, count in enumerate(self._counts):
            left -= count
            if left <= 0.0:
                return min(MIN_LATENCY * math.exp(STEP * (bucket + 1)), self.largest)
        return self.largest

    def figures(self) -> dict[str, float]:
        """p50, p99, p99.9 and the largest, in µs; empty without any duration."""
        return {
            name: round(1e6 * value, 1)
            for name, value in (
                ("p50_us", self.quantile(0.5)),
                ("p99_us", self.quantile(0.99)),
                ("p99.9_us", self.quantile(0.999)),
                ("max_us", self.largest),
            )
            if self.count
        }
