"""A node at an autopilot: readings from MAVLink over UDP, and the node's attitude back.

MAVLink's body is x forward, y right, z down, and its earth north, east, down; levelhead's are forward, left, up and
east, north, up.
"""

import math
import re
import socket
from collections.abc import Callable

from levelhead.errors import LevelheadError
from levelhead.kernels.quat import Euler, Quat, from_euler, multiply, to_euler
from levelhead.live.messages import ORIENTATION, Message, Orientation
from levelhead.live.output import NodeOutput
from levelhead.live.subscription import Subscription
from levelhead.sample import Sample, Triple, Wxyz
from levelhead.sources.formats.mavlink_codec import (
    ATTITUDE,
    ATTITUDE_QUATERNION,
    HIGHRES_IMU,
    RAW_IMU,
    SCALED_IMU,
    SCALED_PRESSURE,
    MavlinkMessage,
    pack_mavlink,
    unpack_mavlink,
)
from levelhead.units import GRAVITY

PLACE = re.compile(r"^udp:(?:(\d+\.\d+\.\d+\.\d+|localhost):)?(\d{1,5})$")
LOOPBACK, LAST_PORT = "127.0.0.1", 65_535
DATAGRAM, MAX_DATAGRAMS = 65_535, 1000  # bytes of a datagram, and datagrams of a poll
MILLI, GAUSS, HECTOPASCAL = 1e-3, 100.0, 100.0  # milli; µT per gauss; Pa per hPa
NO_MAG = (0.0, 0.0, 0.0)
HALF = math.sqrt(0.5)
TO_NED, FROM_FRD = Quat(0.0, HALF, HALF, 0.0), Quat(0.0, 1.0, 0.0, 0.0)  # east-north-up to NED; FRD to forward-left-up


def parse_place(text: str) -> tuple[str, int]:
    """Address and port from ``udp:14550`` or ``udp:0.0.0.0:14550``.

    Raises:
        LevelheadError: neither.
    """
    found = PLACE.match(text)
    if found is None or not 1 <= int(found[2]) <= LAST_PORT:
        raise LevelheadError(f"'{text}' is not a place of MAVLink; expected such as udp:14550 or udp:0.0.0.0:14550")
    return found[1] or LOOPBACK, int(found[2])


class MavlinkSource:
    """Samples from HIGHRES_IMU, SCALED_IMU or RAW_IMU, SCALED_PRESSURE and the autopilot's attitude; see ``Source``.

    The first of the three that comes is kept to. RAW_IMU has no unit in the standard; ArduPilot's mG, mrad/s and mgauss
    are taken, and reported.

    Args:
        place: see ``parse_place``; without an address only this machine is heard.
    """

    rate = gyr_range = acc_range = 0.0
    ended = False

    def __init__(self, place: str) -> None:
        self._address = parse_place(place)
        self.name = f"MAVLink at {place}"
        self._socket: socket.socket | None = None
        self._kind: tuple[int, int, int] | None = None  # message, system, component
        self._pressure: float | None = None
        self._attitude: Wxyz | None = None  # the autopilot's newest that no sample has yet
        self._has_quaternion = False
        self._last = -math.inf
        self._troubles: list[tuple[str, str]] = []

    def start(self) -> None:
        """Listens.

        Raises:
            LevelheadError: the port is taken, or no such address.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(self._address)
        except OSError as error:
            self._socket.close()
            raise LevelheadError(f"cannot listen on {self._address[0]}:{self._address[1]}: {error.strerror}") from None

    def restart(self) -> None:
        """A datagram needs no connection."""

    def poll(self) -> list[Sample]:
        """The samples since the last call."""
        samples: list[Sample] = []
        assert self._socket is not None
        for _ in range(MAX_DATAGRAMS):
            try:
                data = self._socket.recv(DATAGRAM)
            except BlockingIOError:
                break
            for message in unpack_mavlink(data):
                self._add(message, samples)
        return samples

    def _add(self, message: MavlinkMessage, samples: list[Sample]) -> None:
        if message.number == SCALED_PRESSURE:
            self._pressure = message.fields["press_abs"] * HECTOPASCAL
            return
        if message.number in (ATTITUDE, ATTITUDE_QUATERNION):
            self._add_attitude(message)
            return
        if message.number not in (HIGHRES_IMU, SCALED_IMU, RAW_IMU):
            return
        kind = message.number, message.system, message.component
        if self._kind is None:
            self._kind = kind
            if message.number == RAW_IMU:
                words = "RAW_IMU has no unit in the standard; mG, mrad/s and mgauss are assumed, as of ArduPilot"
                self._troubles.append(("assumed", words))
        if kind != self._kind:
            return
        sample = sample_of(message, self._pressure)._replace(attitude=self._attitude)
        self._pressure = self._attitude = None
        if sample.t > self._last:
            self._last = sample.t
            samples.append(sample)

    def _add_attitude(self, message: MavlinkMessage) -> None:
        """The autopilot's own attitude goes with its next sample; ATTITUDE only where no ATTITUDE_QUATERNION comes."""
        if self._kind is not None and (message.system, message.component) != self._kind[1:]:
            return
        fields = message.fields
        if message.number == ATTITUDE_QUATERNION:
            self._has_quaternion = True
            quat = Quat(fields["q1"], fields["q2"], fields["q3"], fields["q4"])
        elif self._has_quaternion:
            return
        else:
            quat = from_euler(Euler(fields["roll"], fields["pitch"], fields["yaw"]))
        if math.isfinite(sum(quat)) and any(quat):
            w, x, y, z = to_ned(quat)  # the same turn leads back
            self._attitude = w, x, y, z

    def troubles(self) -> list[tuple[str, str]]:
        """See ``Source``."""
        found, self._troubles = self._troubles, []
        return found

    def close(self) -> None:
        """Listens no more."""
        if self._socket is not None:
            self._socket.close()


def sample_of(message: MavlinkMessage, pressure: float | None) -> Sample:
    """A sample in forward, left, up from one of the three messages; ``pressure`` in Pa."""
    fields = message.fields
    fine = message.number == HIGHRES_IMU
    acc, gyr, mag = (1.0, 1.0, GAUSS) if fine else (MILLI * GRAVITY, MILLI, MILLI * GAUSS)
    field = _turn_axes(fields, "mag", mag)
    t = fields["time_boot_ms"] * MILLI if "time_boot_ms" in fields else fields["time_usec"] * 1e-6
    if fine and fields["abs_pressure"] > 0.0:
        pressure = fields["abs_pressure"] * HECTOPASCAL
    known = None if field == NO_MAG else field
    return Sample(t, _turn_axes(fields, "gyro", gyr), _turn_axes(fields, "acc", acc), known, pressure)


def _turn_axes(fields: dict[str, float], name: str, scale: float) -> Triple:
    """A vector from forward, right, down."""
    x, y, z = (scale * fields[f"{axis}{name}"] for axis in "xyz")
    return x, 0.0 - y, 0.0 - z


def to_ned(quat: tuple[float, float, float, float]) -> Quat:
    """An attitude of forward, left, up in east, north, up as one of forward, right, down in north, east, down.

    It is its own inverse.
    """
    w, x, y, z = multiply(multiply(TO_NED, Quat(*quat)), FROM_FRD)
    return Quat(-w, -x, -y, -z) if w < 0.0 else Quat(w, x, y, z)


class MavlinkPublisher(NodeOutput):
    """Sends ATTITUDE and ATTITUDE_QUATERNION with their rates for each valid orientation, until it is closed.

    Args:
        subscribe: gives the Subscription of a topic.
        place: where they go, see ``parse_place``.
    """

    def __init__(self, subscribe: Callable[..., Subscription], place: str) -> None:
        self._address = parse_place(place)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._seq = 0
        self._begin(subscribe, (ORIENTATION,))

    def _send(self, message: Message) -> None:
        if not isinstance(message, Orientation) or not message.valid:
            return
        quat = to_ned(message.quat)
        roll, pitch, yaw = to_euler(quat)
        p, q, r = message.rate
        rates = (p, 0.0 - q, 0.0 - r) if math.isfinite(p + q + r) else (0.0, 0.0, 0.0)  # forward, right, down
        time_ms = round(1e3 * message.t) % 2**32
        for number, values in ((ATTITUDE, (roll, pitch, yaw)), (ATTITUDE_QUATERNION, tuple(quat))):
            data = pack_mavlink(number, self._seq, time_ms, *values, *rates)
            self._seq += 1
            try:
                self._socket.sendto(data, self._address)
            except OSError:  # there is no listener yet
                return

    def close(self) -> None:
        """No more messages."""
        super().close()
        self._socket.close()
