"""Earth frames: the names of their axes, and the turn from ENU, with the body's axes that go with each."""

from typing import NamedTuple

import numpy as np

from levelhead.errors import LevelheadError, nearest
from levelhead.recording import Array
from levelhead.rotations import FRD_TO_FLU, NED_TO_ENU, NWU_TO_ENU, ONE, conjugate, matrix, product


class EarthFrame(NamedTuple):
    """A frame of the earth and the axes of the body that are used with it.

    Attributes:
        name: such as "NED".
        axes: directions of x, y and z.
        body: directions of the body's x, y and z.
        to_enu: (4,) quaternion wxyz that turns vectors of this frame into ENU.
        to_flu: (4,) quaternion that turns vectors of the body into forward-left-up.
    """

    name: str
    axes: tuple[str, str, str]
    body: tuple[str, str, str]
    to_enu: Array
    to_flu: Array


class FrameChange(NamedTuple):
    """The turn of the axes from one frame to another.

    Attributes:
        earth: (4,) quaternion of the earth's axes.
        body: (4,) of the body's axes.
        earth_matrix: (3, 3) the same for vectors, of 0 and ±1.
        body_matrix: (3, 3)
    """

    earth: Array
    body: Array
    earth_matrix: Array
    body_matrix: Array


FLU = ("forward", "left", "up")
ENU = EarthFrame("ENU", ("east", "north", "up"), FLU, ONE, ONE)
NED = EarthFrame("NED", ("north", "east", "down"), ("forward", "right", "down"), NED_TO_ENU, FRD_TO_FLU)
NWU = EarthFrame("NWU", ("north", "west", "up"), FLU, NWU_TO_ENU, ONE)
FRAMES = {frame.name: frame for frame in (ENU, NED, NWU)}


def find_frame(name: str) -> EarthFrame:
    """A frame by its name in any case.

    Raises:
        LevelheadError: there is none.
    """
    found = FRAMES.get(name.upper()) if isinstance(name, str) else None
    if found is None:
        raise LevelheadError(f"'{name}' is not an earth frame; {nearest(str(name), FRAMES)}")
    return found


def frame_change(now: EarthFrame, wanted: EarthFrame) -> FrameChange:
    """From the axes of one frame to those of another."""
    earth = product(conjugate(wanted.to_enu), now.to_enu)
    body = product(conjugate(wanted.to_flu), now.to_flu)
    return FrameChange(earth[0], body[0], np.round(matrix(earth)[0]), np.round(matrix(body)[0]))
