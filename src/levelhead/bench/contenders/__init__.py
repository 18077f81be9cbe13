"""Other people's filters, each by its own public way in, with its own defaults, in its own units and frames.

The result is always (n, 4) quaternions wxyz, sensor to earth (x east, y north, z up). None of them
accepts a missing reading, so they get complete recordings only.
"""

from collections.abc import Callable
from importlib.util import find_spec
from typing import NamedTuple

from levelhead.bench.contenders import ahrs_, imufusion_, riann_, vqf_
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
    Contender("vqf.VQF", vqf_.full),
    Contender("vqf.BasicVQF", vqf_.basic),
    Contender("vqf.offlineVQF", vqf_.run_offline),
    Contender("imufusion.Ahrs", imufusion_.run_plain),
    Contender("imufusion.Ahrs+", imufusion_.run_advanced),
    Contender("ahrs.Madgwick", ahrs_.madgwick),
    Contender("ahrs.Mahony", ahrs_.mahony),
    Contender("ahrs.EKF", ahrs_.ekf),
    Contender("ahrs.AQUA", ahrs_.aqua),
    Contender("ahrs.Complementary", ahrs_.complementary),
    Contender("riann.RIANN", riann_.tilt),
)
BY_NAME = {contender.name: contender for contender in ALL}
