"""How old orientations are at a slow reader in another process, and how soon a dead node is noticed.

    python -m benchmarks.speed.staleness

A node at 200 Hz on an emulated chip; a reader that takes 50 messages a second; the node is killed (-9) or stopped ten
times each.
"""

import os
import signal
import subprocess
import sys
import time

import numpy as np

from levelhead.live import subscribe

ENDPOINT = "tcp/127.0.0.1:7519"
NODE = [
    sys.executable,
    "-m",
    "levelhead",
    "run",
    "--source",
    "emulated:mpu6050",
    "--calibrate",
    "0",
    "--publish",
    ENDPOINT,
]


def first_valid(subscription):
    """Waits for the node."""
    while (message := subscription.get()) is None or not message.valid:
        pass
    return message


def slow_reader(seconds: float = 20.0) -> None:
    """Ages at a reader that takes 50 messages a second."""
    with subscribe("imu/orientation", ENDPOINT) as subscription:
        first_valid(subscription)
        ages, valid, end = [], [], time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0.02)
            message = subscription.latest()
            if message is not None:
                ages.append(1e-9 * (time.time_ns() - message.stamp))
                valid.append(message.valid)
        p50, p99 = 1e3 * np.quantile(ages, [0.5, 0.99])
        oldest = 1e3 * max(age for age, good in zip(ages, valid, strict=True) if good)
        print(f"50 of 200 a second: age p50 {p50:.1f} ms, p99 {p99:.1f} ms, oldest valid {oldest:.0f} ms")
        print(f"clock offset {1e3 * subscription.clock_offset:+.2f} ± {1e3 * subscription.clock_uncertainty:.2f} ms")


def detection(how: signal.Signals, times: int = 10) -> None:
    """From the signal to the first invalid orientation at a reader that waits for the next one."""
    found = []
    for _ in range(times):
        node = subprocess.Popen(NODE, stdout=subprocess.DEVNULL)
        with subscribe("imu/orientation", ENDPOINT) as subscription:
            first_valid(subscription)
            time.sleep(1.0)
            os.kill(node.pid, how)
            at = time.monotonic()
            while (message := subscription.get()) is not None and message.valid:
                pass
            found.append(time.monotonic() - at)
        node.kill()
        node.wait()
    print(
        f"{how.name}: noticed after {1e3 * np.median(found):.0f} ms, at most {1e3 * max(found):.0f} ms ({times} times)"
    )


if __name__ == "__main__":
    process = subprocess.Popen(NODE, stdout=subprocess.DEVNULL)
    slow_reader()
    process.terminate()
    process.wait()
    detection(signal.SIGKILL)
    detection(signal.SIGSTOP)
