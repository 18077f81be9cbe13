"""``levelhead ports``: places for a sensor, and the chips that answer there."""

from typing import Annotated

from cyclopts import Parameter

from levelhead.cli.options import print_json, print_line


def ports(*, json: Annotated[bool, Parameter(negative="")] = False) -> None:
    """List serial ports, and I²C buses with the chips on them, as words for ``levelhead run --source``.

    Args:
        json: Print the list as JSON.
    """
    from levelhead.sources.devices.ports import i2c_chips, serial_ports

    serial, buses = serial_ports(), i2c_chips()
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
