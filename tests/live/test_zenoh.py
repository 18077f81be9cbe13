"""Zenoh on the loopback: late joiners, restarts, another node, TLS with access rules."""

import shutil
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

import levelhead as lh
from levelhead.live.messages import ORIENTATION, TOPICS, Health, Orientation, Raw

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (extra levelhead[bus])")
from levelhead.live.zenoh_bus import ZenohBus
from levelhead.live.zenoh_reader import ParameterClient, subscribe
from levelhead.live.zenoh_session import configuration

SAID = Orientation(
    7, 0, 1.5, 123, (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (1e-3, 0.0, -1e-3), 2048, True, (0.1, 0.2, 0.3),
    (0.01, 0.02, 0.03), (0.0, 0.0, 9.81), (0.1, 0.2, 0.3),
)  # fmt: skip


def fresh(**changes) -> Orientation:
    """An orientation of this moment."""
    return SAID._replace(stamp=time.time_ns(), **changes)


@pytest.fixture
def endpoint():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{free.getsockname()[1]}"


def bus_of(endpoint, node=7, **options) -> ZenohBus:
    bus = ZenohBus(endpoint, **options)
    for topic in TOPICS:
        bus.advertise(topic, node)
    return bus


def reader(endpoint, count: int, more: str = "") -> subprocess.Popen:
    """Another process: the three lines of the docs."""
    program = f"""
        import sys
        from levelhead.live import subscribe
        for message in subscribe("imu/orientation", {endpoint!r}, history=4096{more}):
            if not message.valid:
                continue
            print(message.seq, message.quat, flush=True)
            if message.seq >= {count}:
                break
    """
    return subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, text=True)


def said(process, timeout: float = 20.0) -> list[int]:
    out, _ = process.communicate(timeout=timeout)
    assert process.returncode == 0
    return [int(line.split()[0]) for line in out.splitlines()]


@pytest.mark.slow
def test_three_lines_in_another_process_and_who_comes_late_gets_the_last(endpoint):
    bus = bus_of(endpoint)
    bus.publish(ORIENTATION, fresh(seq=4))
    bus.publish(ORIENTATION, fresh(seq=5))
    process = reader(endpoint, 100, ", max_age=60.0")
    first = process.stdout.readline()
    assert first.split()[0] == "5" and "(1.0, 0.0, 0.0, 0.0)" in first
    seq = 5
    while process.poll() is None and seq < 2000:
        seq += 1
        bus.publish(ORIENTATION, fresh(seq=seq))
        time.sleep(0.005)
    got = said(process)  # the program ends by itself
    assert got[-1] in range(100, 120) and got == sorted(set(got)) and len(got) > 80
    assert bus.troubles() == []
    bus.close()


@pytest.mark.slow
def test_a_subscriber_that_is_killed_or_stopped_does_not_hold_up_the_node(endpoint):
    """One is killed, one is stopped in the middle: publishing goes on at once, and a third one gets everything."""
    bus = bus_of(endpoint)
    bus.publish(ORIENTATION, fresh())
    killed, stopped, well = (reader(endpoint, 10**6, ", max_age=60.0") for _ in range(3))
    for process in (killed, stopped, well):
        process.stdout.readline()
    killed.kill()
    stopped.send_signal(signal.SIGSTOP)
    for seq in range(1, 2001):
        bus.publish(ORIENTATION, fresh(seq=seq))
        time.sleep(0.001)
    bus.publish(ORIENTATION, fresh(seq=10**6))
    got = said(well)
    assert got[-1] == 10**6 and len(got) > 1000  # what a slow machine dropped is missing, the newest never
    stopped.kill()
    for process in (killed, stopped):
        process.wait()
        process.stdout.close()
    bus.close()


@pytest.mark.slow
def test_the_subscriber_may_be_first_and_the_node_restarted(endpoint):
    subscription = subscribe(ORIENTATION, endpoint)
    assert subscription.get(timeout=0.2) is None
    for node in (1, 2):
        bus = bus_of(endpoint, node)
        until = time.monotonic() + 10.0
        message = None
        while message is None and time.monotonic() < until:
            bus.publish(ORIENTATION, fresh(node=node))
            message = subscription.get(timeout=0.1)
        assert message is not None and message.node == node
        bus.close()
        while subscription.get(timeout=0.2) is not None:
            pass
    subscription.close()
    assert subscription.get() is None


@pytest.mark.slow
def test_all_topics(endpoint):
    bus = bus_of(endpoint)
    messages = (
        fresh(),
        Raw(7, 1, 1.5, 1, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), None, None),
        Health(7, 1, 0.0, 1, "late", True, "µ"),
        Health(7, 1, 0.0, 1, "config", True, "", {"filter": "Mahony"}),
    )
    for topic, message in zip(TOPICS, messages, strict=True):
        bus.publish(topic, message)
        with subscribe(topic, endpoint, max_age=60.0) as subscription:
            assert subscription.get(timeout=10.0) == message
    bus.close()


@pytest.mark.slow
def test_parameters_are_asked_for_from_outside(endpoint):
    bus = bus_of(endpoint)
    client = ParameterClient(endpoint)

    def node() -> None:
        for answer in ("", "Madgwick: beta = -1 is not allowed"):
            while not bus.commands:
                time.sleep(0.01)
            bus.commands.popleft().answer(answer)

    answering = threading.Thread(target=node)
    answering.start()
    client.set(beta=0.25)
    with pytest.raises(lh.LevelheadError, match="beta = -1 is not allowed"):
        client.set(beta=-1.0)
    answering.join()
    bus.close()
    with pytest.raises(lh.LevelheadError, match="it does not run, or it lets in readers only"):
        client.set(beta=0.5)
    client.close()


@pytest.mark.slow
def test_a_second_node_is_noticed(endpoint):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        other = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    first = bus_of(endpoint, 1)
    with pytest.raises(lh.LevelheadError, match="is another node there"):
        ZenohBus(endpoint)
    second = bus_of(other, 2, connect=(endpoint,))
    until, troubles = time.monotonic() + 10.0, []
    while not troubles and time.monotonic() < until:
        second.publish(ORIENTATION, SAID._replace(node=2))
        time.sleep(0.02)
        troubles = first.troubles()
    assert [name for name, _ in troubles] == ["second_node"] and first.troubles() == []
    second.close()
    first.close()


@pytest.mark.parametrize(
    "words, said",
    [
        ({"endpoint": "tcp/0.0.0.0:7447"}, "tcp is open to all who reach it"),
        ({"endpoint": "tcp/192.168.1.5:7447"}, "expected tls/ADDRESS:PORT with certificates"),
        ({"endpoint": "tls/192.168.1.5:7447"}, "needs certificates"),
        ({"endpoint": "tls/localhost:7447"}, "needs certificates"),
        ({"endpoint": "udp/127.0.0.1:7447"}, "is not an endpoint"),
        ({"endpoint": "tls/192.168.1.5:7447", "certificates": Path("nowhere")}, "there is no nowhere/ca.pem"),
        ({"endpoint": "tcp/127.0.0.1:7447", "readers": ("robot",)}, "known by their certificates"),
    ],
)
def test_the_network_is_closed_unless_certificates_open_it(words, said):
    with pytest.raises(lh.LevelheadError) as caught:
        configuration(listen=True, **words)
    assert said in str(caught.value)


def test_a_topic_that_is_none_is_refused(endpoint):
    with pytest.raises(lh.LevelheadError, match="there is no topic 'imu/\\*\\*'"):
        subscribe("imu/**", endpoint)


def openssl(*words: object) -> None:
    subprocess.run(["openssl", *map(str, words)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """A folder each for node, robot and stranger, of one authority, as docs/howto/live.md makes them."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed; it makes the certificates")
    folder = tmp_path_factory.mktemp("certificates")
    key, authority = folder / "ca.key", folder / "ca.pem"
    openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", 30,
            "-subj", "/CN=bench", "-keyout", key, "-out", authority)  # fmt: skip
    for name in ("node", "robot", "stranger"):
        own = folder / name
        own.mkdir()
        shutil.copy(authority, own / "ca.pem")
        (own / "ext").write_text("subjectAltName=DNS:localhost\n")
        openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", f"/CN={name}",
                "-keyout", own / "own.key", "-out", own / "own.csr")  # fmt: skip
        openssl("x509", "-req", "-in", own / "own.csr", "-CA", authority, "-CAkey", key, "-CAcreateserial", "-days", 30,
                "-extfile", own / "ext", "-out", own / "own.pem")  # fmt: skip
    return folder


def published(bus, subscription, seconds: float = 15.0):
    """What a subscriber gets of messages that are sent until it does."""
    until, message = time.monotonic() + seconds, None
    while message is None and time.monotonic() < until:
        bus.publish(ORIENTATION, fresh())
        message = subscription.get(timeout=0.1)
    return message


@pytest.mark.slow
def test_certificates_open_it_to_those_who_may_read(endpoint, certificates):
    """The robot is let in and reads; a stranger of the same authority gets nothing, nor who has no certificate."""
    tls = endpoint.replace("tcp/127.0.0.1", "tls/localhost")
    bus = bus_of(tls, certificates=certificates / "node", readers=("robot",))
    robot = subscribe(ORIENTATION, tls, certificates=certificates / "robot")
    stranger = subscribe(ORIENTATION, tls, certificates=certificates / "stranger")
    nobody = subscribe(ORIENTATION, endpoint)
    assert published(bus, robot).quat == SAID.quat
    assert published(bus, stranger, 0.5) is None and nobody.get(timeout=0.0) is None
    for one in (robot, stranger, nobody):
        one.close()
    bus.close()
    bus = bus_of(tls, certificates=certificates / "node")  # without the rule the stranger is no stranger
    with subscribe(ORIENTATION, tls, certificates=certificates / "stranger") as stranger:
        assert published(bus, stranger).quat == SAID.quat
    bus.close()


@pytest.fixture
def node_with_tls(endpoint, certificates):
    """A node that lets in the robot; its endpoint by the name that its certificate holds."""
    tls = endpoint.replace("tcp/127.0.0.1", "tls/localhost")
    bus = bus_of(tls, certificates=certificates / "node", readers=("robot",))
    bus.publish(ORIENTATION, fresh())
    yield tls
    bus.close()


@pytest.fixture(scope="module")
def forged(certificates):
    """A reader that calls itself robot, by an authority of its own."""
    own = certificates / "forged"
    own.mkdir()
    shutil.copy(certificates / "ca.pem", own / "ca.pem")
    openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", 30,
            "-subj", "/CN=robot", "-keyout", own / "own.key", "-out", own / "own.pem")  # fmt: skip
    return own


@pytest.mark.slow
@pytest.mark.parametrize("open_it", [lambda *a, **k: subscribe(ORIENTATION, *a, **k), ParameterClient])
def test_who_is_refused_by_tls_is_told_why(node_with_tls, certificates, forged, open_it):
    """The wrong name of the node, a wrong authority on either side: a sentence at once, no waiting."""
    by_address = node_with_tls.replace("localhost", "127.0.0.1")
    with pytest.raises(lh.LevelheadError, match="connect by a name that it holds, such as tls/localhost:PORT"):
        open_it(by_address, certificates=certificates / "robot")
    with pytest.raises(lh.LevelheadError, match="own.pem must be signed by the authority of the node"):
        open_it(node_with_tls, certificates=forged)
    shutil.copy(forged / "own.pem", forged / "ca.pem")
    with pytest.raises(lh.LevelheadError, match=r"the node's certificate is refused \(.*ca.pem of the same authority"):
        open_it(node_with_tls, certificates=forged)
    shutil.copy(certificates / "ca.pem", forged / "ca.pem")


@pytest.mark.parametrize("name", ["stranger", "robot"])
@pytest.mark.slow
def test_parameters_without_permission_are_refused_with_a_sentence(node_with_tls, certificates, name):
    """--readers lets them read, and nobody may write."""
    client = ParameterClient(node_with_tls, certificates=certificates / name)
    with pytest.raises(lh.LevelheadError, match=r"lets in readers only \(--readers\) and takes no parameters"):
        client.set(beta=0.1)
    client.close()


@pytest.mark.full
@pytest.mark.slow
def test_a_reader_that_is_connected_and_gets_nothing_is_told_why(node_with_tls, certificates):
    """A stranger, who may connect and not read; and a reader without TLS, for whom no connection comes about."""
    stranger = subscribe(ORIENTATION, node_with_tls, certificates=certificates / "stranger")
    plain = subscribe(ORIENTATION, node_with_tls.replace("tls/localhost", "tcp/127.0.0.1"))
    with stranger, pytest.raises(lh.LevelheadError, match="certificate is not among the node's --readers"):
        stranger.get(timeout=60.0)
    with plain, pytest.raises(lh.LevelheadError, match="does not answer as a node that this reader understands"):
        plain.get(timeout=60.0)


@pytest.mark.full
@pytest.mark.slow
def test_a_node_that_comes_later_and_is_refused(endpoint, certificates, forged):
    """What was no error at the start becomes one when the node is there."""
    tls = endpoint.replace("tcp/127.0.0.1", "tls/localhost")
    with subscribe(ORIENTATION, tls, certificates=forged) as reader_before:
        assert reader_before.get(timeout=0.2) is None
        bus = bus_of(tls, certificates=certificates / "node")
        with pytest.raises(lh.LevelheadError, match="own.pem must be signed by the authority of the node"):
            reader_before.get(timeout=60.0)
        bus.close()
