"""Never an old angle that looks valid: slow, sleeping and orphaned readers, in the process and over Zenoh."""

import math
import os
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time

import pytest

import levelhead as lh
from levelhead.live import LocalBus, Orientation, Raw
from levelhead.live.clock_offset import ClockOffset
from levelhead.live.messages import ORIENTATION, RAW, TOPICS

SAID = Orientation(7, 0, 1.5, 123, (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (1e-3, 0.0, -1e-3), 0)
MAX_AGE = 0.25


def fresh(seq: int) -> Orientation:
    return SAID._replace(seq=seq, t=time.monotonic(), stamp=time.time_ns())


class Publisher:
    """200 orientations a second from a thread."""

    def __init__(self, bus) -> None:
        self._bus, self.seq, self._over = bus, 0, threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.005):
            self.seq += 1
            self._bus.publish(ORIENTATION, fresh(self.seq))

    def stop(self) -> None:
        self._over.set()
        self._thread.join()


# In the process


def test_a_slow_reader_gets_the_newest_and_not_the_next():
    bus = LocalBus()
    subscription = bus.subscribe(ORIENTATION)
    for seq in range(200):
        bus.publish(ORIENTATION, fresh(seq))
    assert subscription.get(timeout=0.0).seq == 199 and subscription.get(timeout=0.0) is None
    assert subscription.missed == 0 and bus.troubles() == []


def test_a_reader_that_sleeps_gets_an_invalid_one():
    bus = LocalBus()
    subscription, log = (
        bus.subscribe(ORIENTATION, max_age=0.02),
        bus.subscribe(ORIENTATION, history=9, max_age=math.inf),
    )
    bus.publish(ORIENTATION, fresh(1))
    time.sleep(0.05)
    late = subscription.get(timeout=0.0)
    assert not late.valid and late.quat == SAID.quat and subscription.age >= 0.05 and subscription.expired == 1
    assert bus.troubles() == [("subscriber_slow", "a subscriber of imu/orientation read 1 that were too old")]
    assert log.get(timeout=0.0).valid  # a log keeps what the node published
    queued = bus.subscribe(ORIENTATION, history=9, max_age=0.02)
    time.sleep(0.05)
    assert not queued.get(timeout=0.0).valid  # history does not make old ones valid


def test_silence_makes_the_last_one_invalid_once_without_anybody_s_help():
    bus = LocalBus()
    subscription = bus.subscribe(ORIENTATION, max_age=0.05)
    bus.publish(ORIENTATION, fresh(1))
    assert subscription.get().valid
    again = subscription.get()  # returns by itself
    assert not again.valid and again.seq == 1 and subscription.get(timeout=0.01) is None
    bus.publish(ORIENTATION, fresh(2))
    assert subscription.get().valid


def test_a_loop_that_polls_hears_of_silence_as_well():
    bus = LocalBus()
    subscription = bus.subscribe(ORIENTATION, max_age=0.05)
    bus.publish(ORIENTATION, fresh(1))
    assert subscription.latest(timeout=0.0).valid and subscription.latest(timeout=0.0) is None
    time.sleep(0.06)
    assert not subscription.latest(timeout=0.0).valid


def test_raw_samples_that_the_network_dropped_are_counted():
    bus = LocalBus()
    subscription = bus.subscribe(RAW, history=5)

    def send(*numbers: int, node: int = 7) -> None:
        for seq in numbers:
            bus.publish(RAW, Raw(node, seq, 0.0, time.time_ns(), (0.0,) * 3, (0.0,) * 3, None, None))
            subscription.get(timeout=0.0)

    send(1, 2, 5, 6)
    assert subscription.missed == 2
    for seq in range(7, 17):  # five of these drop out of the queue
        bus.publish(RAW, Raw(7, seq, 0.0, time.time_ns(), (0.0,) * 3, (0.0,) * 3, None, None))
    while subscription.get(timeout=0.0) is not None:
        pass
    assert subscription.missed == 2 + 5
    send(0, 1, node=8)  # the node was restarted
    assert subscription.missed == 7


@pytest.mark.slow
def test_latest_does_not_wait_for_ever():
    assert LocalBus().subscribe(ORIENTATION).latest() is None


def test_who_comes_late_to_a_bus_that_fell_silent():
    bus = LocalBus()
    bus.publish(ORIENTATION, fresh(1))
    time.sleep(0.05)
    assert not bus.subscribe(ORIENTATION, max_age=0.02).get(timeout=0.0).valid


@pytest.mark.parametrize("words", [{"history": 0}, {"max_age": 0.0}, {"max_age": math.nan}])
def test_arguments_that_make_no_sense(words):
    with pytest.raises(lh.LevelheadError, match="expected"):
        LocalBus().subscribe(ORIENTATION, **words)


def test_the_offset_of_clocks_is_that_of_the_shortest_round_trip():
    """The node's clock is 1000 s ahead; answers take 1 to 50 ms, and not the same time both ways."""
    clocks = ClockOffset()
    assert clocks.age(0.0, 0.0) == math.inf
    for sent, there, back in ((0.0, 0.04, 0.01), (1.0, 0.002, 0.001), (2.0, 0.001, 0.03)):
        clocks.add(sent, sent + there + 1000.0, sent + there + back)
    assert clocks.estimate.uncertainty == pytest.approx(0.0015)
    assert abs(clocks.estimate.offset - 1000.0) <= clocks.estimate.uncertainty
    assert clocks.age(1009.9, 10.0) == pytest.approx(0.1, abs=0.002)
    assert clocks.age(1011.0, 10.0) == math.inf  # from the future: a clock was set
    clocks.add(10.0, 10.01 + 5000.0, 10.02)  # it was
    assert clocks.age(5010.0, 10.1) == pytest.approx(0.1, abs=0.011)


# Between processes


@pytest.fixture
def endpoint():
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (extra levelhead[bus])")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{free.getsockname()[1]}"


@pytest.fixture
def bus(endpoint):
    from levelhead.live.zenoh_bus import ZenohBus

    one = ZenohBus(endpoint)
    for topic in TOPICS:
        one.advertise(topic, 7)
    yield one
    one.close()


def first_valid(subscription, seconds: float = 20.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        message = subscription.get(timeout=0.5)
        if message is not None and message.valid:
            return message
    raise AssertionError("no valid orientation came")


@pytest.mark.slow
def test_a_reader_that_takes_50_of_200_a_second_reads_what_is_new(bus, endpoint):
    """Through Zenoh: never older than the limit and valid, and the clocks of one machine agree."""
    from levelhead.live.zenoh_reader import subscribe

    publisher = Publisher(bus)
    try:
        with subscribe(ORIENTATION, endpoint) as subscription:
            first_valid(subscription)
            behind = []
            for _ in range(100):
                time.sleep(0.02)
                message = subscription.latest()
                age = 1e-9 * (time.time_ns() - message.stamp)
                assert not (message.valid and age > MAX_AGE + subscription.clock_uncertainty + 0.05)
                behind.append(publisher.seq - message.seq)
            assert sorted(behind)[50] <= 10  # and not hundreds: nothing queues up
            assert abs(subscription.clock_offset) <= subscription.clock_uncertainty + 1e-3
    finally:
        publisher.stop()


NODE = """
    import time
    from levelhead.live.messages import ORIENTATION, Orientation
    from levelhead.live.zenoh_bus import ZenohBus
    bus, seq = ZenohBus({endpoint!r}), 0
    bus.advertise(ORIENTATION, 7)
    print("ready", flush=True)
    while True:
        seq += 1
        quat = 1.0, 0.0, 0.0, 0.0
        bus.publish(ORIENTATION, Orientation(7, seq, 0.0, time.time_ns(), quat, (0.1,) * 3, (0.0,) * 3, 0))
        time.sleep(0.005)
"""


@pytest.fixture
def node(endpoint):
    """A process that publishes."""
    program = textwrap.dedent(NODE).format(endpoint=endpoint)
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize("history", [None, 4096])
def test_orphans_get_nothing_valid(node, endpoint, how, history):
    """Killed or stopped without a word: what waits in the queue is invalid as well."""
    from levelhead.live.zenoh_reader import subscribe

    with subscribe(ORIENTATION, endpoint, history=history) as subscription:
        first_valid(subscription)
        os.kill(node.pid, how)
        killed = time.monotonic()
        message = subscription.get(timeout=2.0)
        while message is not None and message.valid:
            message = subscription.get(timeout=2.0)
        assert message is not None and not message.valid
        assert time.monotonic() - killed < 5.0  # the machine may be busy; benchmarks/speed/staleness.py measures it
        time.sleep(0.3)
        while (message := subscription.get(timeout=0.0)) is not None:
            assert not message.valid
        if how == signal.SIGSTOP:  # and is back
            os.kill(node.pid, signal.SIGCONT)
            assert first_valid(subscription).valid


@pytest.mark.slow
def test_a_slow_reader_in_another_process_is_named(bus, endpoint):
    from levelhead.live.zenoh_reader import subscribe

    with subscribe(RAW, endpoint, history=10) as subscription:
        until, troubles = time.monotonic() + 20.0, []
        while not troubles and time.monotonic() < until:
            for seq in range(50):
                bus.publish(RAW, Raw(7, seq, 1.5, time.time_ns(), (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), None, None))
            time.sleep(0.05)
            troubles = bus.troubles()
        assert subscription.missed > 0 and troubles[0][0] == "subscriber_slow"
        assert troubles[0][1].startswith("a subscriber of imu/raw in another process missed ")
