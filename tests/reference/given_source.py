"""A source whose samples a test gives."""

from levelhead.sample import Sample


class Given:
    """A source that gives what it is told, one list per poll."""

    name, rate, gyr_range, acc_range = "a list", 0.0, 0.0, 0.0

    def __init__(self, *batches) -> None:
        self.batches = list(batches)
        self.closed = 0

    @property
    def ended(self) -> bool:
        return not self.batches

    def start(self) -> None:
        pass

    restart = start

    def poll(self):
        return self.batches.pop(0) if self.batches else []

    def troubles(self):
        return []

    def close(self) -> None:
        self.closed += 1


def level(t: float, gyr=(0.0, 0.0, 0.001), acc=(0.0, 0.1, 9.8), mag=None) -> Sample:
    return Sample(t, gyr, acc, mag)
