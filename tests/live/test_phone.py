"""A phone as a source: the page in Chromium with emulated sensors, and recorded requests of apps."""

import json
import math
import socket
import ssl
import threading
import time
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import ClassVar

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.live import Node
from levelhead.live.phone.messages import SensorLogger, phyphox_buffers, read_datagram, read_page
from levelhead.live.phone.phyphox import PhyphoxSource
from levelhead.live.phone.source import PhoneSource, parse_phone, qr_code
from levelhead.live.phone.streams import SensorReading, SensorStreams
from levelhead.sources.sensors.bus import SensorError
from levelhead.units import GRAVITY


@pytest.fixture
def phone():
    """A source that listens on this machine, on a port that is free."""
    source = PhoneSource("127.0.0.1:0")
    source.start()
    yield source
    source.close()


def post(url: str, message: object, context: ssl.SSLContext | None = None) -> dict:
    body = message if isinstance(message, bytes) else json.dumps(message).encode()
    with urllib.request.urlopen(urllib.request.Request(url, body), timeout=5, context=context) as answer:
        return json.load(answer)


def refusal(url: str, message: object) -> tuple[int, str]:
    with pytest.raises(urllib.error.HTTPError) as caught:
        post(url, message)
    with caught.value as error:
        return error.code, error.read().decode()


def test_streams_are_joined_at_the_gyroscopes_times_by_interpolation():
    streams = SensorStreams()
    for t in (0.000, 0.010, 0.020, 0.030):
        streams.add(SensorReading("gyr", t, (t, 0.0, 0.0)))
    for t in (0.005, 0.013, 0.025):
        streams.add(SensorReading("acc", t, (100.0 * t, 0.0, GRAVITY)))
    streams.add(SensorReading("mag", 0.012, (1.0, 2.0, 3.0)))
    streams.add(SensorReading("pressure", 0.001, (101325.0,)))
    samples = streams.take()
    assert [sample.t for sample in samples] == [0.010, 0.020]  # none before the first force or after the last
    np.testing.assert_allclose([sample.acc[0] for sample in samples], [1.0, 2.0])  # the ramp itself
    assert [sample.mag for sample in samples] == [None, (1.0, 2.0, 3.0)]
    assert [sample.pressure for sample in samples] == [101325.0, None]
    assert streams.take() == []
    streams.add(SensorReading("acc", 0.040, (4.0, 0.0, GRAVITY)))
    assert streams.take()[0].acc[0] == pytest.approx(3.0)


@pytest.mark.parametrize("t, x", [(math.nan, 0.0), (0.0, math.inf), (-1.0, 0.0)])
def test_readings_that_are_not_finite_or_out_of_order_are_counted(t, x):
    streams = SensorStreams()
    streams.add(SensorReading("gyr", 0.0, (0.0, 0.0, 0.0)))
    streams.add(SensorReading("gyr", t, (x, 0.0, 0.0)))
    assert streams.unusable == 1


def logged(name: str, time: int, x: float, y: float, z: float) -> dict:
    """An entry of Sensor Logger's payload."""
    return {"name": name, "time": time, "values": {"x": x, "y": y, "z": z}}


def test_sensor_logger_sums_gravity_and_linear_acceleration_until_the_total_comes():
    now = 1_698_501_144_401_773_000
    logger = SensorLogger()
    payload = [
        logged("accelerometer", now, 0.1, 0.2, 0.3), logged("gravity", now, 0.0, 0.0, GRAVITY),
        logged("gyroscope", now, 0.01, 0.02, 0.03), logged("magnetometer", now, 20.0, 0.0, -40.0),
        {"name": "barometer", "time": now, "values": {"pressure": 1013.25, "relativeAltitude": 0.0}},
        {"name": "microphone", "time": now, "values": {"dBFS": -40.0}},
    ]  # fmt: skip
    found = {one.sensor: one for one in logger.read({"messageId": 0, "payload": payload})}
    assert found["acc"].values == pytest.approx((0.1, 0.2, 0.3 + GRAVITY))
    assert found["gyr"].values == (0.01, 0.02, 0.03) and found["gyr"].t == pytest.approx(now * 1e-9)
    assert found["pressure"].values == pytest.approx((101325.0,))
    total = {"payload": [logged("TotalAcceleration", now + 1, 0.0, 0.0, 9.7)]}
    assert logger.read(total)[0].values == (0.0, 0.0, 9.7)
    assert logger.read({"payload": payload[:2]}) == []  # one force, not two


def test_an_iphones_uncalibrated_force_is_in_g_and_points_down():
    entry = logged("accelerometeruncalibrated", 1, 0.0, 0.0, -1.0)
    assert SensorLogger().read({"payload": [entry]})[0].values == pytest.approx((0.0, 0.0, GRAVITY))


def test_a_line_of_sensorstream():
    line = "1234.5, 3, 0.1, 0.2, 9.8, 4, 0.01, 0.02, 0.03, 5, 20, 0, -40, 85, 1013.25"
    assert [(one.sensor, one.t) for one in read_datagram(line)] == [
        ("acc", 1234.5), ("gyr", 1234.5), ("mag", 1234.5), ("pressure", 1234.5)
    ]  # fmt: skip
    for bad in ("a, 3, 1, 2, 3", "1, 3, 1, 2", "1, 3, , 2, 3"):
        with pytest.raises(LevelheadError):
            read_datagram(bad)


@pytest.mark.parametrize(
    "message",
    [{}, {"rows": 3}, {"rows": [[1, 2]]}, {"rows": [[0, 1, 2, 3, 4, 5, "x"]]}, {"rows": [[0, 1, 2, 3, 4, 5, True]]}],
)
def test_other_rows_of_a_page_are_refused(message):
    with pytest.raises(LevelheadError):
        read_page(message)


def rows(count: int, start: float = 0.0, rate: float = 60.0) -> list[list[float]]:
    """A phone upright on a turntable: gravity along its y, 1 rad/s about it."""
    return [[start + i / rate, 0.0, 1.0, 0.0, 0.0, GRAVITY, 0.0] for i in range(count)]


def test_the_body_points_up_the_screen_and_another_phone_is_refused(phone):
    assert post(phone.url, {"session": "one", "rows": rows(10)}) == {"readings": 20}
    samples = phone.poll()
    assert len(samples) == 10
    assert samples[0].gyr == (1.0, 0.0, 0.0) and samples[0].acc == pytest.approx((GRAVITY, 0.0, 0.0))
    status, words = refusal(phone.url, {"session": "two", "rows": rows(10)})
    assert status == 400 and "another phone" in words
    assert [name for name, _ in phone.troubles()] == ["phone", "garbage"]


def test_messages_that_are_none_are_answered_with_a_sentence(phone):
    assert refusal(phone.url, b"{")[0] == 400
    assert refusal(phone.url, b"[" * 100_000)[0] == 400
    assert "list 'rows'" in refusal(phone.url, {})[1]
    assert refusal(phone.url.rpartition("/")[0] + "/guess", {"rows": rows(1)})[0] == 404
    assert len(phone.troubles()) == 3


def test_a_message_that_is_too_large_is_refused_unread(phone):
    host, port = phone.url.split("/")[2].split(":")
    with socket.create_connection((host, int(port)), timeout=5) as raw:
        raw.sendall(f"POST /{phone.token} HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999\r\n\r\n".encode())
        assert b" 413 " in raw.recv(4096)


def test_datagrams_come_on_the_same_port(phone):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for i in range(3):
            line = f"{i}, 3, 0, {GRAVITY}, 0, 4, 0, 1, 0"
            out.sendto(line.encode(), phone._datagrams.getsockname())
        out.sendto(b"hello", phone._datagrams.getsockname())
    until = time.monotonic() + 5
    samples = []
    while len(samples) < 3 and time.monotonic() < until:
        samples += phone.poll()
    assert [sample.gyr for sample in samples] == [(1.0, 0.0, 0.0)] * 3
    while not any(name == "garbage" for name, _ in phone.troubles()) and time.monotonic() < until:
        phone.poll()
    assert time.monotonic() < until


def test_https_and_http_share_the_port():
    pytest.importorskip("cryptography", reason="cryptography is not installed (extra levelhead[phone])")
    source = PhoneSource("127.0.0.2:0")
    source.start()
    try:
        assert source.url.startswith("https://127.0.0.2:")
        trusting = ssl.create_default_context()
        trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
        assert post(source.url, {"session": "a", "rows": rows(5)}, trusting) == {"readings": 10}
        assert post(source.url.replace("https", "http"), {"session": "a", "rows": rows(5, 1.0)}) == {"readings": 10}
        with urllib.request.urlopen(source.url, timeout=5, context=trusting) as page:
            assert b"This phone as a sensor" in page.read()
        words = source.instructions()
        assert source.url in words and source.url.replace("https", "http") in words
    finally:
        source.close()


def test_a_qr_code_is_made_of_half_blocks():
    pytest.importorskip("segno", reason="segno is not installed (extra levelhead[phone])")
    assert "▀" in qr_code("https://192.168.1.5:8443/abcd")


@pytest.mark.parametrize("text", ["phone.local", "1.2.3", "192.168.1.5:", "192.168.1.5:70000", "::1"])
def test_places_that_are_none(text):
    with pytest.raises(LevelheadError, match="expected"):
        parse_phone(text)


def test_a_node_waits_for_the_phone_and_fuses_its_turn(phone):
    """A quarter turn about the vertical: the upright phone's own y."""
    phone.close()
    source = PhoneSource("127.0.0.1:0")
    node = Node(source, rate=200.0, calibrate=0)
    node.begin()
    count = round(math.pi / 2 * 60)
    for i in range(0, count + 1, 4):
        post(source.url, {"session": "one", "rows": rows(min(4, count + 1 - i), 5.0 + i / 60)})
        node.tick()
    assert node.last is not None and node.last.valid
    assert node.samples == count + 1
    node.close()


class _Phyphox(BaseHTTPRequestHandler):
    """phyphox's remote interface, as its page documents it: 100 Hz, a phone flat on a turntable."""

    began = 0.0
    asked: ClassVar[list[str]] = []

    def do_GET(self) -> None:
        self.asked.append(self.path)
        path, _, query = self.path.partition("?")
        if path == "/config":
            inputs = [
                {"source": kind, "outputs": [{"x": f"{n}X"}, {"y": f"{n}Y"}, {"z": f"{n}Z"}, {"t": f"{n}_time"}]}
                for kind, n in (("accelerometer", "acc"), ("gyroscope", "gyro"))
            ]
            found: dict = {"title": "Both", "inputs": inputs, "buffers": []}
        elif path == "/control":
            found = {"result": True}
        else:
            values = {"accX": 0.0, "accY": 0.0, "accZ": GRAVITY, "gyroX": 0.0, "gyroY": 0.0, "gyroZ": 0.5}
            ends = round(100 * (time.monotonic() - self.began))
            times = [i / 100 for i in range(ends)]
            found = {"buffer": {}, "status": {"measuring": True}}
            for word in query.split("&"):
                name, _, since = word.partition("=")
                bound = -1.0 if since == "full" else float(since.partition("%7C")[0])
                kept = [t for t in times if t > bound]
                found["buffer"][name] = {"buffer": kept if name.endswith("_time") else [values[name]] * len(kept)}
        body = json.dumps(found).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        pass


def test_phyphox_is_asked_for_what_is_new():
    _Phyphox.began, _Phyphox.asked = time.monotonic(), []
    served = HTTPServer(("127.0.0.1", 0), _Phyphox)
    threading.Thread(target=served.serve_forever, args=(0.02,), daemon=True).start()
    source = PhyphoxSource(f"127.0.0.1:{served.server_address[1]}")
    source.start()
    samples, until = [], time.monotonic() + 10
    while len(samples) < 30 and time.monotonic() < until:
        samples += source.poll()
        time.sleep(0.01)
    source.close()
    served.shutdown()
    served.server_close()
    times = [sample.t for sample in samples]
    assert len(samples) >= 30 and times == [i / 100 for i in range(len(times))]  # none twice, none lost
    assert samples[0].gyr == (0.0, 0.0, 0.5) and samples[0].acc == pytest.approx((0.0, 0.0, GRAVITY))
    assert _Phyphox.asked[0] == "/config" and "cmd=start" in _Phyphox.asked[1]
    assert any("%7Cgyro_time" in path for path in _Phyphox.asked[3:])


def test_phyphox_without_an_answer_or_a_sensor():
    with pytest.raises(SensorError, match="remote access"):
        PhyphoxSource("127.0.0.1:1").start()
    with pytest.raises(LevelheadError, match="no gyroscope"):
        phyphox_buffers({"inputs": [], "buffers": [{"name": name} for name in ("acc_time", "accX", "accY", "accZ")]})
    with pytest.raises(LevelheadError, match="expected"):
        PhyphoxSource("192.168.1.7/x")


SENSORS = {
    "gyroscope": {"x": 0.1, "y": 0.2, "z": 0.3},  # rad/s
    "accelerometer": {"x": 0.0, "y": GRAVITY * math.sin(0.5), "z": GRAVITY * math.cos(0.5)},
    "linear-acceleration": {"x": 0.0, "y": 0.0, "z": 0.0},
}


@pytest.mark.slow
def test_the_page_in_chromium_sends_what_its_sensors_measure(phone):
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (extra levelhead[test])")
    with sync_api.sync_playwright() as play:
        try:
            browser = play.chromium.launch(
                executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-background-networking"]
            )
        except sync_api.Error:
            pytest.skip("there is no Chromium at /usr/bin/chromium")
        page = browser.new_page(viewport={"width": 390, "height": 844})
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        tools = page.context.new_cdp_session(page)
        for kind, reading in SENSORS.items():
            tools.send("Emulation.setSensorOverrideEnabled", {"type": kind, "enabled": True, "metadata": {}})
            tools.send("Emulation.setSensorOverrideReadings", {"type": kind, "reading": {"xyz": reading}})
        page.goto(phone.url)
        page.get_by_role("button", name="Start").click()
        samples, until = [], time.monotonic() + 20
        while len(samples) < 20 and time.monotonic() < until:
            page.wait_for_timeout(50)
            samples += phone.poll()
        assert page.get_by_role("status").inner_text() == "It sends. Turn the phone."
        browser.close()
    assert errors == []
    assert len(samples) >= 20
    last = samples[-1]
    np.testing.assert_allclose(last.gyr, (0.2, -0.1, 0.3), atol=2e-3)  # Chromium rounds, against fingerprints
    np.testing.assert_allclose(last.acc, (GRAVITY * math.sin(0.5), 0.0, GRAVITY * math.cos(0.5)), atol=0.06)
    intervals = np.diff([sample.t for sample in samples])
    assert 0.005 < np.median(intervals) < 0.1
