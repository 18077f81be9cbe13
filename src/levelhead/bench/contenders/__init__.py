"""Other people's filters, each by its own public way in, with its own defaults, in its own units and frames.

What comes out is always the same: (n, 4) quaternions wxyz, sensor to earth (x east, y north, z up). None of them has a
notion of a missing reading, so they are given whole recordings only.
"""

from collections.abc import Callable
from importlib.util import find_spec
from typing import NamedTuple

from levelhead.bench.contenders import fusion, textbook, versatile
from levelhead.recording import Array, Recording

INSTALL = "pip install 'levelhead[bench]'"


class Contender(NamedTuple):
    """One method of another package; without a magnetometer in the recording it runs on the other two sensors."""

    name: str
    run: Callable[[Recording], Array]

    @property
    def package(self) -> str:
        """The package that it comes in."""
        return self.name.partition(".")[0]

    @property
    def installed(self) -> bool:
        """Whether that package is there."""
        return find_spec(self.package) is not None


ALL: tuple[Contender, ...] = (
    Contender("vqf.VQF", versatile.full),
    Contender("vqf.BasicVQF", versatile.basic),
    Contender("vqf.offlineVQF", versatile.offline),
    Contender("imufusion.Ahrs", fusion.plain),
    Contender("imufusion.Ahrs+", fusion.advanced),
    Contender("ahrs.Madgwick", textbook.madgwick),
    Contender("ahrs.Mahony", textbook.mahony),
    Contender("ahrs.EKF", textbook.ekf),
    Contender("ahrs.AQUA", textbook.aqua),
    Contender("ahrs.Complementary", textbook.complementary),
)
BY_NAME = {contender.name: contender for contender in ALL}
