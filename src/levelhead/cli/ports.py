"""``levelhead ports``: where a sensor may be plugged in, and what answers there."""

from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import print_json, print_line
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject


def ports(*, json: Annotated[bool, Parameter(negative="")] = False) -> None:
    """List serial ports, and I²C buses with the chips on them, as words for ``levelhead run --source``.

    Args:
        json: print the list as JSON.
    """
    serial, buses = _serial_ports(), _i2c_buses()
    if json:
        print_json({"serial": serial, "i2c": buses})
        return
    for one in serial:
        print_line(f"serial:{one['port']}  {one['description']}".rstrip())
    for bus in buses:
        state = bus["failure"] or ("" if bus["chips"] else "nothing answers")
        print_line(f"I²C bus {bus['bus']}" + (f": {state}" if state else ""))
        for chip in bus["chips"]:
            print_line(f"  {chip['source'] or 'a chip that is not known'}  at {chip['address']}")
    if not serial and not buses:
        print_line("no serial port and no I²C bus; without hardware: levelhead run --source emulated:mpu6050")


def _serial_ports() -> list[dict[str, str]]:
    try:
        from serial.tools.list_ports import comports
    except ImportError:
        raise LevelheadError("serial ports are found with pyserial: pip install 'levelhead[live]'") from None
    found = sorted(comports(), key=lambda one: str(one.device))
    return [{"port": one.device, "description": "" if one.description == "n/a" else one.description} for one in found]


def _i2c_buses() -> list[JsonObject]:
    from levelhead.sources.sensors.bus import open_bus
    from levelhead.sources.sensors.discovery import find_chips, i2c_buses

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
