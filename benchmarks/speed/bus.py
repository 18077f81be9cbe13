"""Zenoh on the loopback: latency from sample to subscriber at 200 Hz, and at 5,000 orientations a second.

The subscriber is another process. Latency is the time from the node's stamp to the subscriber's clock, the same on
one machine.
"""

import json
import subprocess
import sys
import textwrap
import time

from benchmarks.measure import options, show

from levelhead.bench.timing import Table
from levelhead.live.messages import ORIENTATION, TOPICS, Orientation
from levelhead.live.zenoh_bus import ZenohBus

ENDPOINT = "tcp/127.0.0.1:17447"
READY, LAST = 0, 2**40  # numbers of messages that mean something
SUBSCRIBER = f"""
    import json, time
    from levelhead.live import subscribe
    late, first = [], None
    for message in subscribe("imu/orientation", {ENDPOINT!r}, history=10**6, max_age=60.0):
        now = time.time_ns()
        if message.seq == {READY}:
            print("ready", flush=True)
        elif message.seq == {LAST}:
            break
        else:
            first = first or now
            late.append(now - message.stamp)
            last = now
    late.sort()
    at = lambda share: late[min(len(late) - 1, int(share * len(late)))] / 1e3
    print(json.dumps([len(late), at(0.5), at(0.99), at(0.999), (len(late) - 1) / max(1e-9, (last - first) * 1e-9)]))
"""


def message(seq: int) -> Orientation:
    """One orientation."""
    return Orientation(1, seq, 0.0, time.time_ns(), (1.0, 0.0, 0.0, 0.0), (0.1, 0.1, 0.1), (0.0, 0.0, 0.0), 0)


def measured(name: str, count: int, interval: float) -> dict[str, object]:
    """One run: ``count`` messages, one every ``interval`` s."""
    bus = ZenohBus(ENDPOINT)
    for topic in TOPICS:
        bus.advertise(topic, 1)
    program = [sys.executable, "-c", textwrap.dedent(SUBSCRIBER)]
    process = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    bus.publish(ORIENTATION, message(READY))
    process.stdout.readline()
    began = time.monotonic()
    for seq in range(1, count + 1):
        bus.publish(ORIENTATION, message(seq))
        time.sleep(max(0.0, began + seq * interval - time.monotonic()))
    time.sleep(1.0)
    bus.publish(ORIENTATION, message(LAST))
    got, p50, p99, p999, rate = json.loads(process.stdout.read().splitlines()[-1])
    process.wait()
    bus.close()
    return {"case": name, "sent": count, "got": got, "p50": p50, "p99": p99, "p99.9": p999, "per second": round(rate)}


def main() -> None:
    """Runs both cases."""
    parser = options(__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="length of the run at 200 Hz (default 60)")
    given = parser.parse_args()
    rows = [
        measured("200 Hz", round(200 * given.seconds), 1 / 200),
        measured("5,000 a second", 50_000, 1 / 5000),
    ]
    show([Table("Sample to subscriber over Zenoh, loopback; µs", {name: name for name in rows[0]}, rows)], given.json)


if __name__ == "__main__":
    main()
