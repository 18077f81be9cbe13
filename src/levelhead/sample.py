"""One instant of a live source: the sensors' readings in SI units."""

from typing import NamedTuple

Triple = tuple[float, float, float]
Wxyz = tuple[float, float, float, float]


class Sample(NamedTuple):
    """Readings that arrived together.

    Attributes:
        t: s on the source's clock, strictly increasing; 0 is anything.
        gyr: rad/s.
        acc: m/s².
        mag: µT, or None where the magnetometer had nothing new.
        pressure: Pa, or None where the barometer had nothing new.
        temperature: °C, the last that a chip sent, or None.
        attitude: the source's own orientation, wxyz, as its maker defines it (sensor or body to earth), or None.
    """

    t: float
    gyr: Triple
    acc: Triple
    mag: Triple | None = None
    pressure: float | None = None
    temperature: float | None = None
    attitude: Wxyz | None = None
