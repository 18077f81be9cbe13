"""Where a sensor may be plugged in, as words for ``--source``: serial ports, and chips on I²C buses."""

from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject
from levelhead.sources.sensors.bus import open_bus
from levelhead.sources.sensors.discovery import find_chips, i2c_buses


def list_sources() -> list[str]:
    """The words for ``--source`` of all that is found.

    Raises:
        LevelheadError: pyserial is not installed.
    """
    chips = [chip["source"] for bus in i2c_chips() for chip in bus["chips"]]
    return [f"serial:{one['port']}" for one in serial_ports()] + [source for source in chips if source]


def serial_ports() -> list[dict[str, str]]:
    """The "port" and "description" of each serial port.

    Raises:
        LevelheadError: pyserial is not installed.
    """
    try:
        from serial.tools.list_ports import comports
    except ImportError:
        raise LevelheadError("serial ports are found with pyserial: pip install 'levelhead[live]'") from None
    found = sorted(comports(), key=lambda one: str(one.device))
    return [{"port": one.device, "description": "" if one.description == "n/a" else one.description} for one in found]


def i2c_chips() -> list[JsonObject]:
    """The "bus", "chips" and "failure" of each I²C bus; a chip has "address" and "source", "" where it is unknown."""
    listed: list[JsonObject] = []
    for number in i2c_buses():
        entry: JsonObject = {"bus": number, "chips": [], "failure": ""}
        listed.append(entry)
        try:
            bus = open_bus(number)
        except LevelheadError as error:
            entry["failure"] = str(error)
            continue
        try:
            entry["chips"] = [
                {"address": f"0x{chip.address:02x}", "source": f"{chip.name}@{number}" if chip.name else ""}
                for chip in find_chips(bus)
            ]
        except OSError as error:
            entry["failure"] = f"the bus does not work: {error.strerror}"
        finally:
            bus.close()
    return listed
