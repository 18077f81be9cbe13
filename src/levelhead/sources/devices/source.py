"""The interface of every live source: boards, serial lines, replays."""

from typing import Protocol

from levelhead.sample import Sample


class Source(Protocol):
    """Samples as they come.

    Attributes:
        name: its name.
        rate: samples a second; 0: not known.
        gyr_range: full scale in °/s; 0: not known.
        acc_range: full scale in m/s²; 0: not known.
        ended: nothing more will ever come.
        start_limit: s without a first sample before the source counts as silent; optional.
        silence_limit: s without a sample, at least, before it does later; optional.
        instructions: gives lines for the terminal on how to make it send, once it is started; optional.
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def rate(self) -> float: ...  # noqa: D102
    @property
    def gyr_range(self) -> float: ...  # noqa: D102
    @property
    def acc_range(self) -> float: ...  # noqa: D102
    @property
    def ended(self) -> bool: ...  # noqa: D102

    def start(self) -> None:
        """Makes it ready.

        Raises:
            SensorError: it cannot be reached, or is another device.
        """
        ...

    def restart(self) -> None:
        """Makes it ready again after a failure; raises as ``start`` does."""
        ...

    def poll(self) -> list[Sample]:
        """The new samples, the oldest first, without waiting.

        Raises:
            SensorError: it cannot be reached any more.
        """
        ...

    def troubles(self) -> list[tuple[str, str]]:
        """Faults since the last call that did not end the source: (name of the event, sentence)."""
        ...

    def close(self) -> None:
        """Lets go of it."""
        ...
