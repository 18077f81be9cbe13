"""``levelhead run --source WHAT``: a live node."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.options import (
    Axes,
    FilterName,
    FromFile,
    GuardWords,
    parse_filter,
    parse_guard,
    print_json,
    print_line,
    read_parameters,
)
from levelhead.cli.outputs import Outputs
from levelhead.cli.placement import AS_MOUNTED, FrameName
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, Untyped

CALIBRATED = ("replay", "phone", "phyphox")  # sources whose gyroscope was calibrated before


def run(
    *,
    source: Annotated[str, Parameter(name=["--source", "-s"], metavar="WHAT")],
    rate: Annotated[float, Parameter(metavar="HZ")] = 200.0,
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    tuned: FromFile = None,
    guard: GuardWords = (),
    calibrate: Annotated[int | None, Parameter(metavar="N")] = None,
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    duration: Annotated[float | None, Parameter(metavar="S")] = None,
    box: Annotated[Path | None, Parameter(metavar="FILE.mcap")] = None,
    publish: Annotated[str | None, Parameter(metavar="ENDPOINT")] = None,
    certificates: Annotated[Path | None, Parameter(metavar="DIR")] = None,
    readers: Annotated[tuple[str, ...], Parameter(negative="", metavar="NAME")] = (),
    speed: Annotated[float, Parameter(metavar="X")] = 1.0,
    axes: Axes = AS_MOUNTED,
    frame: FrameName = "enu",
    heading: Annotated[float | None, Parameter(metavar="DEG")] = None,
    gyr_range: Annotated[float, Parameter(metavar="DEG/S")] = 500.0,
    acc_range: Annotated[float, Parameter(metavar="G")] = 4.0,
    map: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=gx,gy,gz")] = (),
    units: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=deg/s")] = (),
    counts: Annotated[tuple[str, ...], Parameter(negative="", metavar="gyr=131/deg/s")] = (),
    give_up: Annotated[float, Parameter(metavar="S")] = 10.0,
    foot: Annotated[bool, Parameter(negative="")] = False,
    realtime: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    outputs: Outputs = Outputs(),  # noqa: B008
) -> None:
    """Run a node: samples in, orientation out, until Ctrl-C.

    With a magnetometer heading turns to north by 2 °/s at most, without a jump; --set north_rate=0 keeps it relative.

    Args:
        source: The sensor: emulated:mpu6050 (no hardware), mpu6050 or another chip on I²C (mpu6050+hmc5883l@1:0x69),
            serial:/dev/ttyUSB0@115200, phone:192.168.1.5 (a page at this machine's address, also for Sensor Logger),
            phyphox:192.168.1.7:8080, ros2 (imu/data_raw and imu/mag), mavlink:udp:14550, or replay:FILE.
        rate: Ticks per second, which is also the sample rate of a chip.
        set: A parameter of the filter; may be given several times.
        calibrate: Samples at rest for the initial gyroscope bias; by default 500; 0 for a replay, a phone and --prior.
        prior: Calibration file of the sensor, as for `levelhead fuse`. Its biases follow the source's thermometer.
        duration: Seconds until the node ends; without it, Ctrl-C or the end of a replay ends it.
        box: File of a black box that records everything (needs the extra levelhead[box]); `levelhead fuse` reads it.
        publish: Publish to other processes as well (needs the extra levelhead[bus]): tcp/127.0.0.1:7447 for this
            machine, or tls/ADDRESS:PORT with certificates.
        certificates: Folder with ca.pem, own.pem and own.key.
        readers: Names in the certificates of permitted subscribers; by default all with a certificate of the authority.
        speed: Speed of a replay: 2 is twice as fast, inf as fast as possible.
        axes: Mounting of the sensor on its body, as for `levelhead fuse`: -y,x,z, ZYX:90,0,10 or a quaternion wxyz.
        frame: Earth frame of the angles on the terminal. Messages are always in enu (REP 103).
        heading: Yaw at the start, in degrees in that frame. A command can set the parameter heading later.
        gyr_range: Full scale of a chip's gyroscope.
        acc_range: Full scale of a chip's accelerometer.
        map: Columns of lines or files, as for `levelhead fuse`.
        units: Units of lines or files without them, as for `levelhead fuse`.
        counts: Raw counts per unit, as for `levelhead fuse`.
        give_up: Seconds without a sample after which the node ends, with exit code 3.
        foot: The sensor is on a foot: its stances bound position. Each is printed and published, with position and σ.
        realtime: Request real-time priority, if permitted.
        json: Print the figures of the run as JSON at its end, instead of a line each second.
    """
    from levelhead.axis_map import AxisMap
    from levelhead.calibration import Calibration
    from levelhead.cli.node_terminal import SignalHandlers, StatusLines
    from levelhead.live.box import BlackBox
    from levelhead.live.node import Node
    from levelhead.live.open import open_source
    from levelhead.live.static_calibration import SAMPLES
    from levelhead.sources import parse_counts, parse_map, parse_units

    found = read_parameters(tuned, filter)
    params, before = parse_filter(filter, set, filters.live, tuned=found), parse_guard(guard, found)
    if duration is not None and not duration > 0.0:
        raise LevelheadError(f"the duration is {duration:g}; expected seconds, more than 0")
    if calibrate is not None and calibrate < 0:
        raise LevelheadError(f"--calibrate {calibrate}: expected a number of samples, or 0 for none")
    hints: JsonObject = {"map": parse_map(map), "units": parse_units(units), "counts": parse_counts(counts)}
    mounted = AxisMap.parse(axes)
    live = open_source(source, rate=rate, speed=speed, gyr_range=gyr_range, acc_range=acc_range, axes=mounted, **hints)
    known = None if prior is None else Calibration.read(prior)
    if known is not None and calibrate:
        raise LevelheadError("--prior and --calibrate both give the gyroscope's bias; give one of them")
    calibrated = known is not None or source.partition(":")[0] in CALIBRATED
    still = (0 if calibrated else SAMPLES) if calibrate is None else calibrate
    with ExitStack() as held:
        bus = _bus(publish, certificates, readers)
        held.callback(bus.close)
        kept = None if box is None else held.enter_context(BlackBox(box))
        node = Node(
            live, params, guard=before, rate=rate, calibrate=still, bus=bus, box=kept, realtime=realtime,
            give_up=give_up, known=known, foot=foot,
        )  # fmt: skip
        served = outputs.open(node.bus.subscribe, node.set, json)
        if heading is not None:
            node.set(heading=90.0 - heading if frame == "ned" else heading + (90.0 if frame == "nwu" else 0.0))
        with node, served, SignalHandlers(node), StatusLines(node, quiet=json, frame=frame.upper()):
            figures = node.run(duration)
    if json:
        print_json(figures)
    else:
        print_line(_summary(figures))
        if kept is not None:
            print_line(kept.failure or f"written: {box}")


def _bus(publish: str | None, certificates: Path | None, readers: tuple[str, ...]) -> Untyped:
    """The bus that the options ask for."""
    from levelhead.live.bus import LocalBus

    if publish is None:
        if certificates is not None or readers:
            raise LevelheadError("--certificates and --readers are for --publish; give an endpoint as well")
        return LocalBus()
    from levelhead.live.zenoh_bus import ZenohBus

    return ZenohBus(publish, certificates=certificates, readers=readers)


def _summary(figures: JsonObject) -> str:
    late, work = figures["lateness"], figures["work"]
    times = ""
    if late and work:
        times = (
            f"; lateness p50 {late['p50_us']:g}, p99 {late['p99_us']:g}, p99.9 {late['p99.9_us']:g} µs"
            f"; work of a tick p50 {work['p50_us']:g}, p99 {work['p99_us']:g} µs"
        )
    return (
        f"{figures['samples']} samples, {figures['lost']} losses, {figures['missed']} of "
        f"{figures['ticks'] + figures['missed']} ticks missed{times}"
    )
