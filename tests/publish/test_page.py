"""The page of `levelhead view` in a real, headless Chromium: its values, its controls, a node that dies."""

import gc
import http.client
import http.server
import json
import math
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.reference.block import unpack_block
from tests.reference.page import PATIENCE, WEB, check_accessibility, eventually, numbers, seek

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.evaluate import evaluate
from levelhead.filters.health import FAULTS
from levelhead.live import Node, open_source
from levelhead.publish.dashboard.block import pack_block
from levelhead.publish.dashboard.description import filter_description
from levelhead.publish.dashboard.guide_view import GuideView
from levelhead.publish.dashboard.node_view import NodeView
from levelhead.publish.dashboard.recording_view import RecordingView
from levelhead.publish.dashboard.server import PageServer, page_file

FREE = 18_080  # the first port that is tried
needs_page = pytest.mark.skipif(page_file("index.html") is None, reason="the page is not built: make page")


@needs_page
@pytest.mark.slow
def test_a_recording_is_shown_as_python_has_it_and_fused_again_by_a_slider(look):
    recording = lh.simulate.recording("ICM-20948", "hand", duration=20.0, rate=50)
    gyr = recording.gyr.copy()
    gyr[400:410] = math.nan
    view = RecordingView(replace(recording, gyr=gyr), lh.Madgwick(), second=lh.Mahony())
    server = PageServer(view, FREE)
    try:
        page = look(server.url)
        check_values(page, view)
        check_accessibility(page)
        check_one_time(page, view)
        check_selection(page, view)
        check_parameters(page, view)
        check_filters(page, view)
        page.keyboard.press("t")
        eventually(lambda: page.locator(".table tr.now").count() == 1)
        page.keyboard.press("?")
        eventually(lambda: page.locator("#help[open]").count() == 1)
        check_accessibility(page)
    finally:
        server.close()


def check_values(page, view) -> None:
    angles, t = view.track(lh.Madgwick())[0].euler(), view.recording.t
    for row in (1, 350, 999):
        seek(page, float(t[row] - t[0]))
        eventually(lambda row=row: numbers(page, "roll", "pitch", "yaw") == pytest.approx(angles[row], abs=0.06))


def check_one_time(page, view) -> None:
    """Events, keys and the charts have one cursor."""
    page.get_by_role("button", name=re.compile("gyroscope missing")).first.click()
    eventually(lambda: page.inner_text("#now") == "8.000 s")
    eventually(lambda: page.get_attribute(".scene", "data-state") == "invalid")  # something is wrong with this sample
    faults = view.track(lh.Madgwick())[0].health & FAULTS
    began = view.recording.t[1:][(faults[1:] & ~faults[:-1]) > 0]
    last = float(began[began < 19.95][-1] - view.recording.t[0])
    for key, shown in (("End", "19.980 s"), ("ArrowLeft", "19.960 s"), ("[", f"{last:.3f} s")):
        page.keyboard.press(key)
        eventually(lambda shown=shown: page.inner_text("#now") == shown)
    box = page.locator("#chart-roll .u-over").bounding_box()
    page.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 20)
    eventually(lambda: float(page.inner_text("#now").split()[0]) == pytest.approx(5.0, abs=0.1))


def check_selection(page, view) -> None:
    """What is zoomed is downloaded, with the bits of the track."""
    box = page.locator("#chart-roll .u-over").bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 22, steps=4)
    page.mouse.up()
    with page.expect_download() as download:
        page.get_by_role("button", name="CSV").click()
    rows = np.genfromtxt(download.value.path(), delimiter=",", names=True)
    assert rows["t_s"][[0, -1]] == pytest.approx([10.0, 15.0], abs=0.2)
    first = int(np.searchsorted(view.recording.t, rows["t_s"][0]))
    np.testing.assert_array_equal(rows["qw"], view.track(lh.Madgwick())[0].quat[first : first + len(rows), 0])


def check_parameters(page, view) -> None:
    """A slider fuses again, and so does a number; one that does not fit gets the sentence of the command line."""
    page.locator("#parameter-beta").focus()
    page.keyboard.press("ArrowRight")
    beta = page.get_by_label("beta, as a number")
    eventually(lambda: float(beta.input_value()) != lh.Madgwick().beta)
    beta.fill("0.3")
    beta.press("Enter")
    seek(page, 12.0)
    wanted = lh.fuse(view.recording, lh.Madgwick(beta=0.3)).euler()[600]
    eventually(lambda: numbers(page, "roll", "pitch", "yaw") == pytest.approx(wanted, abs=0.06))
    beta.fill("-1")
    beta.press("Enter")
    with pytest.raises(LevelheadError) as refused:
        lh.Madgwick(beta=-1.0)
    eventually(lambda: page.inner_text("#message") == str(refused.value))
    eventually(lambda: float(beta.input_value()) == 0.3)


def check_filters(page, view) -> None:
    """Another filter, with its figures against the truth."""
    page.select_option("#filter", "Kalman")
    score = evaluate(view.recording, lh.fuse(view.recording, lh.Kalman()))
    eventually(lambda: f"Kalman\t{score.tilt:.2f}°\t{score.heading:.2f}°" in page.inner_text("#filters"))


def check_focus(page, node) -> None:
    """An event of the list keeps the focus of the keyboard while others come."""
    entry, entries = page.locator("#events button").first, page.locator("#events button")
    entry.focus()
    words, listed = page.evaluate(FOCUSED), entries.count()
    for heading in (10.0, 20.0):
        node.set(heading=heading)
    eventually(lambda: entries.count() >= listed + 2)
    assert page.evaluate(FOCUSED) == words and entry.inner_text() != words


FOCUSED = "() => document.activeElement.innerText"


@needs_page
@pytest.mark.slow
def test_a_node_is_followed_steered_and_recorded_and_its_silence_is_grey(look, tmp_path):
    node = Node(open_source("emulated:mpu6050", rate=100.0), lh.Madgwick(), rate=100.0, calibrate=0)
    runs = threading.Thread(target=lambda: node.run(5.0 * PATIENCE), daemon=True)
    command = "levelhead run --source serial:/dev/ttyUSB0 --publish tcp/127.0.0.1:7447"
    view = NodeView(node.bus.subscribe, node.set, "a test", tmp_path, lambda: [command])
    server = PageServer(view, FREE + 60)
    try:
        page = look(server.url)
        eventually(lambda: command in page.inner_text("#starts"))
        eventually(lambda: page.get_attribute(".scene", "data-state") == "invalid")
        runs.start()
        eventually(lambda: not page.locator("#starts").is_visible())
        eventually(lambda: page.locator("#chart-yaw").count() == 1)
        stamp = page.get_attribute("#status", "data-stamp")
        assert abs(float(stamp) / 1000.0 - time.time()) < PATIENCE
        eventually(lambda: page.get_attribute("#status", "data-stamp") != stamp)
        eventually(lambda: page.get_attribute(".scene", "data-state") == "valid")
        page.locator("#parameter-beta").focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        eventually(lambda: node.params.beta > lh.Madgwick().beta)
        eventually(lambda: "parameters: beta=" in page.inner_text("#events"))
        assert "heading counts from the start" in page.inner_text("#facts")  # there is no magnetometer
        page.locator("#zero").click()
        eventually(lambda: "yaw is 0° from here on" in page.inner_text("#events"))
        check_focus(page, node)
        page.locator("#record").click()
        eventually(lambda: re.search(r"■ [1-9]\d+ samples", page.inner_text("#record")))
        page.locator("#record").click()
        eventually(lambda: "written: " in page.inner_text("#message"))
        (box,) = tmp_path.glob("levelhead-*.mcap")
        assert len(lh.read(box)) > 10
        node.stop()
        runs.join(timeout=PATIENCE)
        eventually(lambda: page.get_attribute(".scene", "data-state") == "invalid")
        assert "the node is silent" in page.inner_text("#status")
        check_accessibility(page)
    finally:
        node.stop()
        server.close()
    eventually(lambda: "levelhead view does not answer" in page.inner_text("#status"))


@needs_page
@pytest.mark.full
@pytest.mark.slow
def test_a_node_that_is_killed_turns_the_body_grey_at_once(look):
    """Of three processes, as at home: the node gets no chance to say goodbye."""
    pytest.importorskip("zenoh", reason="zenoh is not installed (extra levelhead[live])")
    endpoint, program = "tcp/127.0.0.1:17453", [sys.executable, "-m", "levelhead"]
    run = [*program, "run", "--source", "emulated:mpu6050", "--rate", "100", "--calibrate", "0", "--publish", endpoint]
    show = [*program, "view", "--live", "--endpoint", endpoint, "--port", str(FREE + 240)]
    with (
        subprocess.Popen(run, stdout=subprocess.DEVNULL) as node,
        subprocess.Popen(show, stdout=subprocess.PIPE, text=True) as view,
    ):
        try:
            page = look(view.stdout.readline().split()[0])
            eventually(lambda: page.get_attribute(".scene", "data-state") == "valid")
            page.evaluate(GREY)
            node.send_signal(signal.SIGKILL)
            killed = time.time()
            grey = page.evaluate("() => window.grey") / 1000.0
            sys.stdout.write(f"grey {grey - killed:.2f} s after the kill\n")
            eventually(lambda: "the node is silent: this is its last orientation" in page.inner_text("#status"))
            assert page.get_attribute(".scene", "data-state") == "invalid"
            assert "invalid" in page.get_attribute("body", "class").split()
        finally:
            node.kill()
            view.terminate()


# When the body is grey first.
GREY = """() => { window.grey = new Promise((done) => new MutationObserver(() => {
  if (document.querySelector(".scene").dataset.state === "invalid") done(Date.now());
}).observe(document.querySelector(".scene"), { attributes: true })); }"""


@needs_page
@pytest.mark.full
@pytest.mark.slow
def test_body_and_charts_are_seen_at_every_width(look):
    view = RecordingView(lh.simulate.recording("MPU-6050", "hand", duration=3.0), lh.Madgwick())
    server = PageServer(view, FREE + 120)
    try:
        page = look(server.url)
        for width, height in ((1600, 1000), (900, 700), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})

            def fits(width=width) -> bool:
                scene, chart = page.locator(".scene").bounding_box(), page.locator("#chart-roll .u-over").bounding_box()
                wide = page.evaluate("document.documentElement.scrollWidth")
                beside = width < 700 or scene["x"] + scene["width"] <= chart["x"]
                return wide <= width and beside and chart["width"] > 0.55 * width and chart["height"] > 60

            eventually(fits)
    finally:
        server.close()


@pytest.mark.slow
def test_the_curves_of_the_page():
    """Node's own test runner: what is drawn of a stretch, gaps, angles without jumps."""
    if not (WEB / "node_modules").is_dir():
        pytest.skip("the packages of web/ are not installed: make page")
    done = subprocess.run(["npm", "test", "--silent"], cwd=WEB, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_a_block_comes_back():
    columns = {"t": np.arange(3.0), "quat": np.ones((3, 4), np.float32), "health": np.arange(3, dtype=np.uint32)}
    columns["file"] = np.frombuffer(b"abcde", np.uint8)
    header, found = unpack_block(pack_block({"σ": [1, None]}, columns))
    assert header == {"σ": [1, None]}
    for name, values in columns.items():
        np.testing.assert_array_equal(found[name], values)


class Answers:
    """A view with one call."""

    def __init__(self) -> None:
        self.calls = {"twice": lambda asked: pack_block({"twice": 2 * asked["value"]})}

    def stream(self):
        return iter([pack_block({"n": 1}), pack_block({"n": 2})])

    def close(self) -> None:
        self.calls = {}


@pytest.fixture
def ask(monkeypatch):
    """Asks a server of ``Answers``, as any program on this machine could."""
    monkeypatch.setattr("levelhead.publish.dashboard.server.page_file", {"index.html": b"<p>"}.get)
    server = PageServer(Answers(), FREE + 180)

    def asked(method: str, path: str, body: str = "", **headers: str) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5.0)
        connection.request(method, path, body, {"Content-Type": "application/json"} | headers)
        with closing(connection), connection.getresponse() as answer:
            return answer.status, answer.read()

    yield asked
    server.close()


def test_a_page_answers_this_machine_alone(ask):
    status, body = ask("POST", "/call/twice", '{"value": 4}')
    assert status == 200 and unpack_block(body)[0] == {"twice": 8}
    assert ask("GET", "/")[0] == 200
    assert ask("GET", "/", Host="evil.example")[0] == 403  # a name that was rebound to 127.0.0.1
    assert ask("POST", "/call/twice", '{"value": 4}', Origin="http://evil.example")[0] == 403
    assert ask("POST", "/call/twice", '{"value": 4}', **{"Content-Type": "text/plain"})[0] == 404
    assert ask("GET", "/../server.py")[0] == 404
    for body in ("[]", "{", "{}"):
        status, said = ask("POST", "/call/twice", body)
        assert status == 400 and unpack_block(said)[0]["error"]
    stream = ask("GET", "/stream")[1]
    assert int.from_bytes(stream[:4], "little") == (len(stream) - 8) // 2


def test_a_page_that_was_not_built(monkeypatch):
    monkeypatch.setattr("levelhead.publish.dashboard.server.page_file", lambda _: None)
    with pytest.raises(LevelheadError, match="make page"):
        PageServer(Answers())
    with pytest.raises(LevelheadError, match="there is no port 0"):
        PageServer(Answers(), 0)


def test_the_slider_of_a_parameter_covers_the_range_worth_a_search():
    described = {one["name"]: one for one in filter_description(lh.Madgwick(beta=5.0))["parameters"]}
    assert described["beta"]["low"] > 0.0 and described["beta"]["high"] == 5.0 and described["beta"]["log"]
    json.dumps(filter_description(lh.ESKF()), allow_nan=False)


def test_a_guided_calibration_shows_how_the_sensor_should_lie():
    from levelhead.calibrate.next_pose import Instruction

    view = GuideView("calibration of a sensor")
    view.show(Instruction("put it down", np.array([0.0, -1.0, 0.0]), 0.0, 0.25, "+z", 3, ["scale x"], ["+z"], False))
    guide = unpack_block(next(view.stream()))[0]["state"]["guide"]
    assert guide["words"] == "put it down" and guide["fraction"] == 0.25
    assert any("scale x" in note for note in guide["notes"])
    w, x, y, z = guide["quat"]
    assert math.isclose(2.0 * (y * z + w * x), -1.0)  # y points down
    view.close()


@needs_page
@pytest.mark.slow
def test_the_guide_of_a_calibration_is_read_and_reached_by_everyone(look):
    from levelhead.calibrate.next_pose import Instruction

    view = GuideView("calibration of a sensor")
    view.show(Instruction("put it down", np.array([0.0, -1.0, 0.0]), 0.0, 0.25, "+z", 3, ["scale x"], ["+z"], False))
    server = PageServer(view, FREE + 300)
    try:
        page = look(server.url)
        eventually(lambda: "put it down" in page.inner_text("body"))
        check_accessibility(page)
    finally:
        view.close()
        server.close()


@pytest.mark.slow
def test_a_page_that_is_open_for_hours_collects_its_garbage(monkeypatch):
    """The command line collects seldom, which is right for commands that end soon."""
    from levelhead.cli import main, view
    from levelhead.publish.dashboard import server

    seen = []
    page = SimpleNamespace(url="", wait=lambda: seen.append(gc.get_threshold()), close=int)
    monkeypatch.setattr(view, "_node", lambda *_: page)
    monkeypatch.setattr(server, "PageServer", lambda *_: page)
    before = gc.get_threshold()
    try:
        assert main(["view", "--live"]) == 0
    finally:
        gc.set_threshold(*before)
    assert seen == [(700, 10, 10)]


@pytest.mark.slow
def test_bad_words(capsys):
    from levelhead.cli import main

    for words, said in (
        (["view"], "give either a log or --live"),
        (["view", "a.csv", "--live"], "give either a log or --live"),
        (["view", "no-such.csv"], "there is no file no-such.csv"),
        (["view", "--live", "--with", "EKF"], "--with is for a recording"),
        (["view", "a.csv", "--endpoint", "tcp/127.0.0.1:1"], "are for --live"),
        (["view", "--live", "--endpoint", "tcp/10.0.0.1:1"], "tcp is open to all"),
    ):
        assert main(words) == 2
        assert said in capsys.readouterr().err
