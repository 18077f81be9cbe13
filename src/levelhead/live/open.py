"""From words to a source: ``emulated:mpu6050``, ``mpu6050``, ``serial:/dev/ttyUSB0``, ``replay:flight.csv``."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from levelhead.axis_map import IDENTITY, AxisMap
from levelhead.errors import LevelheadError, nearest
from levelhead.open_types import JsonObject
from levelhead.recording import Recording
from levelhead.sample import Sample
from levelhead.sources import read
from levelhead.sources.devices.replay import Replay
from levelhead.sources.devices.serial_lines import SerialLines, parse_serial
from levelhead.sources.devices.source import Source
from levelhead.sources.hints import Hints, check
from levelhead.sources.sensors.board import CHIPS, BoardSpec, assemble_board, open_board, parse_board
from levelhead.sources.sensors.emulated import World, emulate_board

REMOTE = ("phone", "phyphox", "ros2", "mavlink")  # streams of other programs and devices
KINDS = ("emulated", "serial", *REMOTE, "replay", *CHIPS)
REST = 8.0  # s at the beginning, so that the node can read off the bias
PUT_DOWN = 24  # times that an emulated sensor is put down there, where it is for poses
HALF_LOOP = 60.0  # s that an emulated sensor is moved there, and back again
# Error models of emulated boards; a chip without a data sheet in the simulator has its nearest relative's.
CHIP_NAMES = {
    "mpu6050": "MPU-6050",
    "mpu9250": "MPU-6050",
    "lsm6dsox": "LSM6DS3",
    "lsm6dso32": "LSM6DSO32",
    "icm20948": "ICM-20948",
    "icm42688": "ICM-20948",
    "bno055": "LSM6DS3",
    "bno085": "LSM6DS3",
}
MAG_NAMES = {
    "hmc5883l": "HMC5883L", "qmc5883l": "QMC5883L", "lis3mdl": "QMC5883L", "ak8963": "AK09916", "ak09916": "AK09916",
    "bno055": "AK09916", "bno085": "AK09916",
}  # fmt: skip
IDEAL: JsonObject = {"quantisation": 0.0, "full_scale": math.inf}  # the emulated registers round and clip


def open_source(
    words: str, *, rate: float = 200.0, speed: float = 1.0, gyr_range: float = 500.0, acc_range: float = 4.0,
    axes: AxisMap = IDENTITY, motion: str = "hand", seed: int = 0, **hints: Any,
) -> Source:  # fmt: skip
    """A source, not started yet.

    Args:
        words: ``mpu6050``, ``mpu6050+hmc5883l@1`` (see ``parse_board``): chips on an I²C bus; ``emulated:`` and the
            same: chips that are not there; ``serial:/dev/ttyUSB0@115200``: lines of numbers; ``phone:192.168.1.5``: a
            page for a phone at this machine's address; ``phyphox:192.168.1.7:8080``: a phone's app; ``ros2``: a topic
            of ROS 2; ``replay:FILE``: a recording.
        rate: samples a second that a chip is asked for, Hz.
        speed: of a replay; inf: as fast as it goes.
        gyr_range: full scale of a chip, °/s.
        acc_range: full scale of a chip, g.
        axes: how a board sits on its body.
        motion: how an emulated board is moved: a style of ``simulate.motion``, or "poses".
        seed: of that motion and of the specimen of the chip.
        hints: ``map``, ``units``, ``counts`` for lines and files.

    Raises:
        LevelheadError: no such kind, chip, file, rate or range.
    """
    kind, colon, rest = words.partition(":")
    if speed != 1.0 and kind != "replay":
        raise LevelheadError(f"--speed is for a replay; '{words}' comes at its own")
    if colon and kind == "emulated":
        return _open_emulated(parse_board(rest), rate, gyr_range, acc_range, axes, motion, seed)
    if kind == "serial":
        port, baud = parse_serial(rest)
        said = check(hints.get("map"), hints.get("units"), hints.get("counts"), None)
        return _rotate(SerialLines(port, baud, Hints(said.map, said.scale, rate)), axes)
    if kind in REMOTE:
        return _rotate(_open_remote(kind, rest), axes)
    if kind == "replay":
        if not rest:
            raise LevelheadError("replay: names no file; expected such as replay:flight.csv")
        return _rotate(Replay(read(Path(rest), **hints), speed), axes)
    if kind == "emulated":
        raise LevelheadError(f"emulated: names no chip; expected such as emulated:{CHIPS[0]}")
    if not colon or "@" in words:
        if words.partition("@")[0].partition("+")[0].lower().replace("-", "") not in CHIPS:
            raise LevelheadError(f"there is no source '{words}'; {nearest(kind, KINDS)}")
        return open_board(words, rate=rate, gyr_range=gyr_range, acc_range=acc_range, axes=axes)
    raise LevelheadError(f"there is no source '{words}'; {nearest(kind, KINDS)}")


def _open_remote(kind: str, place: str) -> Source:
    """A source whose library is imported for it alone."""
    if kind == "phone":
        from levelhead.live.phone.source import PhoneSource

        return PhoneSource(place)
    if kind == "phyphox":
        from levelhead.live.phone.phyphox import PhyphoxSource

        return PhyphoxSource(place)
    if kind == "mavlink":
        from levelhead.live.mavlink import MavlinkSource

        return MavlinkSource(place)
    from levelhead.live.ros2 import Ros2Source, default_domain

    return Ros2Source(default_domain(), place or "imu/data_raw")


class _RotatedSource:
    """A source that sits on its body in some way; everything else is the source's own."""

    def __init__(self, source: Source, axes: AxisMap) -> None:
        self._source, self._axes = source, axes

    def __getattr__(self, name: str) -> Any:
        return getattr(self._source, name)

    def poll(self) -> list[Sample]:
        """The source's samples in the body's frame."""
        return [self._axes.apply(sample) for sample in self._source.poll()]


def _rotate(source: Source, axes: AxisMap) -> Source:
    return source if axes == IDENTITY else cast(Source, _RotatedSource(source, axes))


def _open_emulated(
    wanted: BoardSpec, rate: float, gyr_range: float, acc_range: float, axes: AxisMap, motion: str, seed: int
) -> Source:
    world = World(closed_motion(wanted, rate, motion, seed))
    bus = emulate_board(wanted, world, drift=0.005)
    return assemble_board(wanted, bus, rate=rate, gyr_range=gyr_range, acc_range=acc_range, axes=axes)


def closed_motion(wanted: BoardSpec, rate: float, style: str, seed: int, half: float = HALF_LOOP) -> Recording:
    """The readings of a motion that returns to its start, so that it can go on for ever.

    The second half is the first one backwards: rates and velocities change their sign, accelerations do not. The
    magnetometer is one that has been calibrated.
    """
    from levelhead.simulate import Motion, imu, motion, observe, poses

    there = poses(PUT_DOWN, seed, rate=rate) if style == "poses" else motion(seed, half, rate, style=style, still=REST)
    both = [slice(None), slice(None, None, -1)]
    sign = (1.0, -1.0)
    track = Motion(
        np.arange(2 * len(there)) / rate,
        np.concatenate([there.quat[rows] for rows in both]),
        np.concatenate([s * there.gyr[rows] for s, rows in zip(sign, both, strict=True)]),
        np.concatenate([there.position[rows] for rows in both]),
        np.concatenate([s * there.velocity[rows] for s, rows in zip(sign, both, strict=True)]),
        np.concatenate([there.acceleration[rows] for rows in both]),
    )
    mag = MAG_NAMES.get(wanted.mag or wanted.inertial)
    chip = imu(CHIP_NAMES[wanted.inertial], mag=mag)
    fine = replace(chip, gyr=replace(chip.gyr, **IDEAL), acc=replace(chip.acc, **IDEAL))
    if chip.mag is not None:
        fine = replace(fine, mag=replace(chip.mag, turn_on_bias=0.0, scale_factor=0.0, misalignment=0.0, **IDEAL))
    return observe(track, fine, seed)
