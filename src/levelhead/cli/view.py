"""``levelhead view LOG`` and ``levelhead view --live``: the page in the browser."""

import gc
import sys
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from levelhead.cli.options import (
    FilterName,
    GuardWords,
    Reading,
    filter_names,
    parse_filter,
    parse_filter_spec,
    parse_guard,
    print_line,
)
from levelhead.cli.outputs import Outputs
from levelhead.errors import LevelheadError

if TYPE_CHECKING:
    from levelhead.publish.dashboard.node_view import NodeView
    from levelhead.publish.dashboard.recording_view import RecordingView

USUAL_THRESHOLD = (700, 10, 10)  # of Python's garbage collection


def view(
    log: Path | None = None,
    /,
    *,
    live: Annotated[bool, Parameter(negative="")] = False,
    endpoint: Annotated[str | None, Parameter(metavar="ENDPOINT")] = None,
    certificates: Annotated[Path | None, Parameter(metavar="DIR")] = None,
    filter: FilterName = None,
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = (),
    guard: GuardWords = (),
    second: Annotated[str | None, Parameter(name="--with", metavar="NAME[:K=V,…]", completer=filter_names)] = None,
    port: Annotated[int, Parameter(metavar="N")] = 8080,
    reading: Reading = Reading(),  # noqa: B008
    outputs: Outputs = Outputs(),  # noqa: B008
) -> None:
    """Show a recording or a running node in the browser, on this machine only.

    Args:
        log: A recording, as for `levelhead fuse`.
        live: Follow a node that runs with --publish.
        endpoint: Address of the node; tcp/127.0.0.1:7447 by default.
        certificates: Folder with ca.pem, own.pem and own.key, for a node on another machine.
        set: A parameter of the filter; may be given several times.
        second: Another filter whose angles are drawn as well, such as EKF or Kalman:r_measure=4.
        port: Port of the page on 127.0.0.1.
    """
    if outputs.any and log is None:
        _serve(outputs, endpoint, certificates)
        return
    if outputs.any:
        raise LevelheadError("--foxglove, --ros2 and --mavlink follow a node; give no log beside them")
    if (log is None) != live:
        raise LevelheadError("give either a log or --live, such as: levelhead view flight.csv")
    if not live and (endpoint is not None or certificates is not None):
        raise LevelheadError("--endpoint and --certificates are for --live")
    if live and second is not None:
        raise LevelheadError("--with is for a recording; a node runs one filter")
    shown = _node(endpoint, certificates) if log is None else None
    read = None if log is None else _reader(log, filter, set, guard, reading, second)
    from levelhead.publish.dashboard.server import PageServer

    with closing(PageServer(shown, port)) as server:
        print_line(f"{server.url}  (Ctrl-C ends it)")
        sys.stdout.flush()
        if read is not None:
            server.show(read())  # the browser builds the page meanwhile
        _collect_often()
        server.wait()


def _collect_often() -> None:
    """Garbage is collected as usual again: commands that end soon leave it, a page that is open for hours would keep
    100,000 objects of it. Present objects live as long as the page, and are not examined again.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(*USUAL_THRESHOLD)


def _reader(
    log: Path, name: str | None, pairs: Any, words: Any, reading: Reading, second: str | None
) -> "Callable[[], RecordingView]":
    """The function that reads the log and fuses it; options that do not fit are refused at once.

    Raises:
        LevelheadError: an unknown filter, a value out of range, or there is no such file.
    """
    from levelhead.sources.pipeline import check_there

    chosen, beside = (parse_filter(name, pairs), parse_guard(words)), parse_filter_spec(second) if second else None
    check_there(log)

    def read() -> "RecordingView":
        from levelhead.publish.dashboard.recording_view import RecordingView

        recording, (params, before) = reading.read(log), chosen
        if "live" in recording.meta and name is None and not pairs:
            from levelhead.cli.fuse import node_filter

            params, before = node_filter(recording.meta["live"], before, words)
        return RecordingView(recording, params, before, beside)

    return read


def _serve(outputs: Outputs, endpoint: str | None, certificates: Path | None) -> None:
    """Follows a node without a page: for viewers on this machine, until Ctrl-C."""
    from threading import Event

    from levelhead.live.zenoh_reader import ParameterClient, subscribe
    from levelhead.live.zenoh_session import ENDPOINT

    where = endpoint or ENDPOINT

    def follow(topic: str, **more: Any) -> Any:
        return subscribe(topic, where, certificates=certificates, **more)

    with outputs.open(follow, ParameterClient(where, certificates=certificates).set):
        sys.stdout.flush()
        Event().wait()


def _node(endpoint: str | None, certificates: Path | None) -> "NodeView":
    from levelhead.live.zenoh_reader import ParameterClient, subscribe
    from levelhead.live.zenoh_session import ENDPOINT
    from levelhead.publish.dashboard.node_view import NodeView

    where = endpoint or ENDPOINT
    client = ParameterClient(where, certificates=certificates)

    return NodeView(
        lambda topic, **more: subscribe(topic, where, certificates=certificates, **more),
        client.set,
        f"node at {where}",
        starts=lambda: _commands(where),
    )


def _commands(endpoint: str) -> list[str]:
    """Commands that start a node here: a line for each serial port, and one without hardware."""
    from levelhead.sources.devices.ports import serial_ports

    with suppress(LevelheadError):  # without pyserial there is no port
        found = [f"serial:{one['port']}" for one in serial_ports()]
        return [f"levelhead run --source {one} --publish {endpoint}" for one in [*found, "emulated:mpu6050"]]
    return [f"levelhead run --source emulated:mpu6050 --publish {endpoint}"]
