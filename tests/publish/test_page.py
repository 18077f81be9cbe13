"""The page of `levelhead view` in a real, headless Chromium: its values, its controls, a node that dies."""

import gc
import http.client
import http.server
import json
import math
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.evaluate import compare, evaluate
from levelhead.filters.health import FAULTS
from levelhead.inspection import examine
from levelhead.inspection.explain import explain
from levelhead.live import Node, open_source
from levelhead.publish.dashboard.block import pack_block, unpack_block
from levelhead.publish.dashboard.description import filter_description
from levelhead.publish.dashboard.guide_view import GuideView
from levelhead.publish.dashboard.node_view import NodeView
from levelhead.publish.dashboard.recording_view import RecordingView
from levelhead.publish.dashboard.server import PageServer, page_file

WEB = Path(__file__).resolve().parents[2] / "web"
FREE = 18_080  # the first port that is tried
PATIENCE = 120.0  # s for what happens at once on a machine that is not busy: the browser draws 3-D on its CPU
needs_page = pytest.mark.skipif(page_file("app.js") is None, reason="the page is not built: make page")


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (extra levelhead[test])"
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("there is no Chromium here (apt install chromium): the page was not looked at")
    with playwright.sync_playwright() as one:
        running = one.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        yield running
        running.close()


@pytest.fixture
def look(browser):
    """Opens a page; fails on errors in its console and on requests to anywhere but this machine."""
    pages, wrong = [], []

    def opened(url: str):
        page = browser.new_page(viewport={"width": 900, "height": 700})
        page.set_default_timeout(1000.0 * PATIENCE)
        page.on(
            "request", lambda request: None if request.url.startswith((url, "blob:")) else wrong.append(request.url)
        )
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda line: wrong.append(line.text) if line.type == "error" else None)
        pages.append(page)
        page.goto(url)
        page.wait_for_selector("body[data-ready]")
        return page

    yield opened
    for page in pages:
        page.close()
    assert [words for words in wrong if "ERR_CONNECTION" not in words and "ERR_INCOMPLETE" not in words] == []


def eventually(what, seconds: float = PATIENCE) -> None:
    until = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < until, "it never happened"
        time.sleep(0.05)


def numbers(page, *names: str) -> list[float]:
    return [float(page.inner_text(f"#{name}").rstrip("°").replace("−", "-")) for name in names]


def seek(page, seconds: float) -> None:
    page.evaluate(
        "t => { const bar = document.querySelector('.seek'); bar.value = t; bar.dispatchEvent(new Event('input')); }",
        seconds,
    )


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


def check_accessibility(page) -> None:
    """No serious finding of axe-core."""
    page.evaluate((WEB / "node_modules" / "axe-core" / "axe.min.js").read_text())
    found = page.evaluate(
        "axe.run().then(({violations}) => violations.map(one => [one.impact, one.id, one.nodes[0].html]))"
    )
    assert [one for one in found if one[0] in ("serious", "critical")] == []


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
        assert page.get_attribute(".scene", "data-state") == "invalid"
        runs.start()
        eventually(lambda: not page.locator("#starts").is_visible())
        eventually(lambda: page.locator("#chart-yaw").count() == 1)
        stamp = page.get_attribute("#status", "data-stamp")
        assert abs(float(stamp) / 1000.0 - time.time()) < PATIENCE
        eventually(lambda: page.get_attribute("#status", "data-stamp") != stamp)
        assert page.get_attribute(".scene", "data-state") == "valid"
        page.locator("#parameter-beta").focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        eventually(lambda: node.params.beta > lh.Madgwick().beta)
        eventually(lambda: "parameters: beta=" in page.inner_text("#events"))
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
    finally:
        node.stop()
        server.close()
    eventually(lambda: "levelhead view does not answer" in page.inner_text("#status"))


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


@pytest.fixture(scope="module")
def try_page(tmp_path_factory):
    """Address of the page that reads a log in the browser itself."""
    release = os.environ.get("PYODIDE_DIST") or WEB.parent / "build" / "pyodide"
    if not any(Path(release).glob("numpy-*")) or not (WEB / "node_modules").is_dir():
        pytest.skip("there is no NumPy for Pyodide: make page build/pyodide, or set PYODIDE_DIST")
    folder = tmp_path_factory.mktemp("site") / "try"
    command = [sys.executable, str(WEB / "try_page.py"), str(folder), "ESKF"]
    subprocess.run(command, env=os.environ | {"PYODIDE_DIST": str(release)}, check=True)
    handler = partial(QuietHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    """The test's terminal is for the test."""

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.mark.full
@pytest.mark.slow
def test_a_log_is_read_in_the_browser_itself(browser, try_page, tmp_path):
    recording = lh.simulate.recording("MPU-6050", "hand", duration=12.0, rate=50)
    log, bad = tmp_path / "log.csv", tmp_path / "bad.csv"
    names = ["t [s]", *(f"gyr_{axis} [rad/s]" for axis in "xyz"), *(f"acc_{axis} [m/s²]" for axis in "xyz")]
    rows = np.column_stack([recording.t, recording.gyr, recording.acc])
    np.savetxt(log, rows, delimiter=",", header=",".join(names), comments="", encoding="utf-8")
    bad.write_text("a,b\n1,2\n3,4\n")
    page = browser.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    wrong = []
    page.on(
        "request", lambda request: None if request.url.startswith((try_page, "blob:")) else wrong.append(request.url)
    )
    page.on("pageerror", lambda error: wrong.append(str(error)))
    try:
        page.goto(try_page)
        check_accessibility(page)
        page.set_input_files("#file", bad)
        with pytest.raises(LevelheadError) as refused:
            lh.read(bad)
        page.wait_for_selector("#message:not([hidden])")
        assert page.inner_text("#message") == str(refused.value).replace(f"{tmp_path}/", "")
        page.set_input_files("#file", log)
        page.wait_for_selector("body[data-ready]")
        track = lh.fuse(lh.read(log))
        seek(page, 3.0)
        eventually(lambda: numbers(page, "roll", "pitch", "yaw") == pytest.approx(track.euler()[150], abs=0.06))
        with page.expect_download() as download:
            page.get_by_role("button", name="CSV").click()
        rows = np.genfromtxt(download.value.path(), delimiter=",", names=True)
        np.testing.assert_array_equal(rows["qw"], track.quat[:, 0])  # the module for WebAssembly has the bits of Python
        page.get_by_text("Doctor", exact=True).click()
        eventually(lambda: str(examine(lh.read(log), log.name)).splitlines()[0] in page.inner_text("#side"))
        page.get_by_text("Why does it drift?").click()
        page.click("#why")
        eventually(lambda: "Mahony" in page.inner_text("#why + div"))
        assert str(explain(lh.read(log), source="log.csv")) in page.inner_text("#why + div")
        page.get_by_text("Columns and units").click()
        assert str(lh.interpret(log)).partition("\n")[2].splitlines()[0] in page.inner_text("#side")
        check_accessibility(page)
        assert wrong == []
    finally:
        page.close()


@pytest.mark.full
@pytest.mark.slow
def test_the_lesson_runs_on_modules_alone(browser, try_page):
    """Its figures are those of `levelhead demo`, and a slider changes them."""
    from levelhead.cli.demo import LESSON

    rows = compare(lh.simulate.lesson(42), LESSON[:4], guard=None).rows
    page = browser.new_page()
    page.set_default_timeout(1000.0 * PATIENCE)
    try:
        page.goto(f"{try_page}lesson.html")
        page.wait_for_selector("body[data-ready]")
        assert page.locator("#figures td").all_inner_texts() == [f"{row.score.total:.4f}°" for row in rows]
        check_accessibility(page)
        page.get_by_label("r_measure, as a number").fill("0.5")
        page.keyboard.press("Enter")
        params = lh.Kalman(r_measure=0.5, q_per_sample=True)
        (row,) = compare(lh.simulate.lesson(42), [params], guard=None).rows
        eventually(lambda: page.locator("#figures td").last.inner_text() == f"{row.score.total:.4f}°")
    finally:
        page.close()


LYING_ON_A_SLOPE = """() => {
  const force = { x: 0, y: 9.81 * Math.sin(Math.PI / 6), z: 9.81 * Math.cos(Math.PI / 6) };
  setInterval(() => {
    dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha: 0, beta: 30, gamma: 0 }));
    const rotationRate = { alpha: 0, beta: 0, gamma: 0 };
    dispatchEvent(new DeviceMotionEvent("devicemotion", { accelerationIncludingGravity: force, rotationRate }));
  }, 10);
}"""


@pytest.mark.full
@pytest.mark.slow
def test_a_phone_is_its_own_sensor(browser, try_page):
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.set_default_timeout(1000.0 * PATIENCE)
    try:
        page.goto(f"{try_page}phone.html")
        page.wait_for_selector("body[data-ready]")
        check_accessibility(page)
        page.click("#start")
        page.evaluate(LYING_ON_A_SLOPE)
        eventually(lambda: page.locator("#figures td").all_inner_texts() == ["+30.0°", "+0.0°", "+0.0°"] * 3)
    finally:
        page.close()


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
