"""The dashboard in a real, headless Chromium: what it shows, and that its sliders act. Looked at by its text."""

import gc
import math
import re
import shutil
import threading
import time
from contextlib import nullcontext
from dataclasses import replace
from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest

import levelhead as lh
from levelhead.filters.parameters import Param, param_table

pytest.importorskip("viser", reason="viser is not installed (extra levelhead[view])")
from levelhead.live import Health, Node, open_source
from levelhead.publish.dashboard.chart_data import tilt_of, two_sigma, unwrap, unwrap_to, y_range
from levelhead.publish.dashboard.node_view import NodeView
from levelhead.publish.dashboard.page import sector
from levelhead.publish.dashboard.parameter_panel import ParameterPanel, SliderScale
from levelhead.publish.dashboard.recording_view import RecordingView

FREE = 18_080  # the first port that is tried
PATIENCE = 180.0  # s for what happens at once on a machine that is not busy: the browser draws 3-D on its CPU


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (extra levelhead[test])"
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("there is no Chromium here (apt install chromium): the dashboard was not looked at")
    with playwright.sync_playwright() as one:
        running = one.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        yield running
        running.close()


@pytest.fixture
def look(browser):
    """Opens a page; fails on requests to anywhere but this machine."""
    pages = []

    def opened(url: str):
        page = browser.new_page(viewport={"width": 900, "height": 600})
        page.set_default_timeout(1000.0 * PATIENCE)
        elsewhere = []
        page.on("request", lambda request: elsewhere.append(request.url) if "127.0.0.1" not in request.url and not request.url.startswith(("data:", "blob:")) else None)  # fmt: skip # noqa: E501
        page.goto(url)
        pages.append((page, elsewhere))
        return page

    yield opened
    for page, elsewhere in pages:
        page.close()
        assert elsewhere == []


def text_with(page, pattern: str, seconds: float = PATIENCE) -> re.Match:
    until, text = time.monotonic() + seconds, ""
    while time.monotonic() < until:
        text = page.inner_text("body")
        if found := re.search(pattern, text):
            return found
        page.wait_for_timeout(100)
    raise AssertionError(f"the page never said {pattern}; it says:\n{text}")


def eventually(what, seconds: float = PATIENCE) -> None:
    until = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < until, "it never happened"
        time.sleep(0.05)


def slider(page, label: str):
    """The slider whose label begins so."""
    row = page.locator(
        f"xpath=//label[starts-with(normalize-space(.), '{label}')]/ancestor::*[.//*[@role='slider']][1]"
    )
    return row.locator("[role=slider]").first


def box(page, label: str):
    """The box whose label begins so."""
    row = page.locator(f"xpath=//label[starts-with(normalize-space(.), '{label}')]/ancestor::*[.//input][1]")
    return row.locator("input").first


CURSORS = "Object.values(window.__viserTestpoints.uplots).map(one => one.chart.posToVal(one.chart.cursor.left, 'x'))"


@pytest.mark.slow
def test_a_recording_is_shown_played_and_fused_again_by_a_slider(look):
    recording = lh.simulate.recording("MPU-6050", "hand", duration=PATIENCE, rate=25)  # it plays until it is stopped
    view = RecordingView(recording, lh.Madgwick(), port=FREE)
    try:
        assert view.page.url.startswith("http://127.0.0.1:")
        page = look(view.page.url)
        said = text_with(page, r"roll\s([+-][\d.]+)°\s±[\d.]+°\s+pitch\s([+-][\d.]+)°\s±[\d.]+°\s+yaw\s([+-][\d.]+)°")
        np.testing.assert_allclose([float(x) for x in said.groups()], view.track.euler()[0], atol=0.06)
        text_with(page, r"t 0.00 s of 179.96 s, Madgwick")
        page.get_by_role("button", name="Play").click()
        text_with(page, r"t [1-9]\d*\.\d\d s of")
        page.get_by_role("button", name="Pause").click()
        before = view.track.quat.copy()
        scale = SliderScale(param_table(lh.Madgwick)["beta"], view.params.beta)
        moved = scale.value(scale.notch(view.params.beta) + 5)
        handle = slider(page, "beta")
        handle.focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        eventually(lambda: view.params.beta == moved)  # by all keys: a late one would write over what is typed below
        eventually(lambda: not np.array_equal(view.track.quat, before))
        value = box(page, "beta [")
        eventually(lambda: float(value.input_value()) == pytest.approx(view.params.beta))  # the value in its unit
        value.fill("0.3")
        eventually(lambda: view.params.beta == 0.3)
        eventually(lambda: view.track.params == view.params)
        np.testing.assert_array_equal(view.track.quat, lh.fuse(recording, view.params).quat)
        assert page.locator("canvas").count() >= 7  # the scene, four charts of angles and bias, two raw ones
    finally:
        view.stop()


@pytest.mark.full
@pytest.mark.slow
def test_charts_the_3d_view_and_events_are_one(look):
    """A click in a chart, an event and a time typed in lead to the same instant everywhere; a drag selects."""
    recording = lh.simulate.recording("ICM-20948", "hand", duration=10.0)
    gyr = recording.gyr.copy()
    for first in range(400, 800, 25):
        gyr[first : first + 10] = math.nan
    recording = replace(recording, gyr=gyr)
    view = RecordingView(recording, lh.Madgwick(), port=FREE, second=lh.Mahony())
    try:
        page = look(view.page.url)
        text_with(page, r"t 0.00 s of 9.99 s")
        page.get_by_role("button", name=re.compile("gyroscope missing")).first.click()
        text_with(page, r"t 4.00 s of")
        charts = page.locator(".u-over")
        assert charts.count() == 7 and "truth" in page.inner_text("body") and "Mahony" in page.inner_text("body")
        charts.nth(0).scroll_into_view_if_needed()
        where = charts.nth(0).bounding_box()
        page.mouse.click(where["x"] + 0.75 * where["width"], where["y"] + 20)
        text_with(page, r"t 7.[45]\d s of")
        eventually(lambda: float(box(page, "t [s]").input_value()) == pytest.approx(7.5, abs=0.15))
        eventually(lambda: page.evaluate(CURSORS) == pytest.approx([7.5] * 7, abs=0.15))  # one time in all charts
        page.mouse.move(where["x"] + 0.3 * where["width"], where["y"] + 20)
        eventually(lambda: page.evaluate(CURSORS) == pytest.approx([3.0] * 7, abs=0.15))  # they follow the mouse
        page.mouse.move(5, 5)
        eventually(lambda: page.evaluate(CURSORS) == pytest.approx([7.5] * 7, abs=0.15))  # and are back where it leaves
        page.mouse.move(where["x"] + 0.5 * where["width"], where["y"] + 20)
        page.mouse.down()
        page.mouse.move(where["x"] + 0.75 * where["width"], where["y"] + 22, steps=4)
        page.mouse.up()
        text_with(page, r"5.0\d? to 7.[45]\d? s")
        with page.expect_download() as download:
            page.get_by_role("button", name="Download csv").click()
        rows = np.genfromtxt(download.value.path(), delimiter=",", names=True)
        np.testing.assert_array_equal(rows["qw"], view.track.quat[view.selection, 0])
        charts.nth(0).scroll_into_view_if_needed()
        where = charts.nth(0).bounding_box()
        page.mouse.dblclick(where["x"] + 30, where["y"] + 20)
        text_with(page, r"0.00 to 9.99 s, 1000 samples")
        text_with(page, r"1 to 12 of \d\d")
        page.get_by_role("button", name="Later events").click()
        text_with(page, r"13 to (\d\d) of \1")
        page.get_by_role("button", name=re.compile(r"^7\.75 s: gyroscope missing")).click()
        text_with(page, r"t 7.75 s of")
        page.get_by_role("button", name="Earlier events").click()
        text_with(page, r"1 to 12 of \d\d")
    finally:
        view.stop()


@pytest.mark.full
@pytest.mark.parametrize("width, height", [(1400, 900), (900, 700), (390, 844)])
@pytest.mark.slow
def test_body_and_panel_are_seen_at_every_width(look, width, height):
    """The panel is beside the view, or below it on a phone, and covers nothing of it."""
    view = RecordingView(lh.simulate.recording("MPU-6050", "hand", duration=3.0), lh.Madgwick(), port=FREE)
    try:
        page = look(view.page.url)
        page.set_viewport_size({"width": width, "height": height})
        text_with(page, r"t 0.00 s of")

        def fits() -> bool:
            scene, chart = page.locator("canvas").first.bounding_box(), page.locator(".u-over").first.bounding_box()
            inside = chart["x"] >= 0.0 and chart["x"] + chart["width"] <= width
            if width < 576:
                return inside and scene["height"] < 0.5 * height and chart["width"] > 0.6 * width
            return inside and 0.45 * width < scene["x"] + scene["width"] <= chart["x"]

        eventually(fits)  # the browser lays the page out anew
    finally:
        view.stop()


@pytest.mark.full
@pytest.mark.slow
def test_a_node_is_followed_steered_and_its_silence_is_shown(look):
    node = Node(open_source("emulated:mpu6050", rate=100.0), lh.Madgwick(), rate=100.0, calibrate=0)
    runs = threading.Thread(target=lambda: node.run(5.0 * PATIENCE), daemon=True)
    view = NodeView(node.bus.subscribe, node.set, "a test", FREE)
    try:
        runs.start()
        page = look(view.page.url)
        first = int(text_with(page, r"sample (\d+), \d\d:\d\d:\d\d\.\d{3}, age \d+ ms")[1])
        eventually(lambda: int(text_with(page, r"sample (\d+), ")[1]) > first + 50)
        shown = datetime.strptime(text_with(page, r"sample \d+, ([\d:.]+)")[1], "%H:%M:%S.%f").time()
        now = datetime.now()
        assert abs((now - datetime.combine(now, shown)).total_seconds()) < 5.0
        text_with(page, r"started: MPU-6050 at 100 Hz through Madgwick")
        handle = slider(page, "beta")
        handle.focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        eventually(lambda: node.params.beta > lh.Madgwick().beta)
        text_with(page, r"parameters: beta=")
        node.bus.publish("imu/health", Health(1, 0, 0.0, 0, "refused", True, "{1 + 1} <b>bold</b> *two* `c`"))
        text_with(page, re.escape("refused: {1 + 1} <b>bold</b> *two* `c`"))  # shown, not run
        node.stop()
        runs.join(timeout=PATIENCE)
        text_with(page, r"no valid orientation for \d")
    finally:
        node.stop()
        view.stop()


def test_sliders_cover_the_range_of_a_parameter():
    by_factors = SliderScale(Param("", "", low=0.0, sweep=(0.001, 1.0), log=True), 0.03)
    assert by_factors.value(by_factors.notch(0.03)) == pytest.approx(0.03, rel=0.02)
    assert by_factors.value(0) == 0.001 and by_factors.value(200) == 1.0 and by_factors.value(100) == 0.03162
    even = SliderScale(Param("", "", low=0.0, high=1.0, sweep=(0.2, 0.8)), 0.9)  # a value outside is still on it
    assert (even.value(0), even.value(200), even.notch(0.9)) == (0.2, 0.9, 200)
    lonely = SliderScale(Param("", "", low=0.0), 0.0)
    assert lonely.low == 0.0 and lonely.value(lonely.notch(0.5)) == pytest.approx(0.5, abs=0.01)


def test_tilt_and_doubt_by_hand():
    angle = math.radians(30.0)
    acc = np.array(
        [[0.0, 9.81 * math.sin(angle), 9.81 * math.cos(angle)], [-9.81 * math.sin(angle), 0.0, 9.81 * math.cos(angle)]]
    )
    np.testing.assert_allclose(tilt_of(acc), [[30.0, 0.0], [0.0, 30.0]], atol=1e-9)
    np.testing.assert_allclose(two_sigma(np.radians([[3.0, 4.0, 7.0]])), [[10.0, 10.0, 14.0]])


def test_a_chart_ends_where_its_curves_do_whatever_sigma_the_first_second_and_spikes():
    t = np.arange(0.0, 20.0, 0.01)
    curve = np.linspace(0.0, 40.0, len(t))
    low, high = y_range(t, curve)
    assert -12.0 < low < -5.0 and 45.0 < high < 52.0
    wild = curve.copy()
    wild[:50], wild[700] = 1e3, -1e4
    assert y_range(t, wild) == pytest.approx((low, high), abs=1.5)
    assert y_range(t, np.full_like(t, math.nan)) == (-2.0, 2.0)


def test_curves_have_no_spikes_at_the_wrap():
    yaw = (np.arange(0.0, 1000.0, 7.0) + 180.0) % 360.0 - 180.0
    yaw[20] = math.nan
    smooth = unwrap(yaw[:, None])
    assert np.nanmax(np.abs(np.diff(smooth[:, 0]))) == pytest.approx(7.0) and np.isnan(smooth[20, 0])
    other = unwrap_to((yaw + 5.0)[:, None], smooth)
    np.testing.assert_allclose(np.delete(other - smooth, 20), 5.0, atol=1e-9)


def test_the_cone_of_heading():
    tip, *rim = sector(math.radians(30.0))
    angles = np.degrees([math.atan2(y, x) for x, y, _ in rim])
    assert tuple(tip) == (0.0, 0.0, 0.0) and (angles[0], angles[-1]) == pytest.approx((-30.0, 30.0))


@pytest.mark.slow
def test_a_page_that_is_open_for_hours_collects_its_garbage(monkeypatch, capsys):
    """The command line collects seldom, which is right for commands that end soon."""
    from levelhead.cli import main, view

    seen = []
    page = SimpleNamespace(page=SimpleNamespace(url=""), wait=lambda: seen.append(gc.get_threshold()), stop=int)
    monkeypatch.setattr(view, "_node", lambda *_: page)
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


def test_a_guided_calibration_shows_how_the_sensor_should_lie():
    from levelhead.calibrate.next_pose import Instruction
    from levelhead.publish.dashboard.guide_view import GuideView

    view = GuideView("calibration of {a} sensor", FREE + 40)
    try:
        now = Instruction("put it down {x}", np.array([0.0, -1.0, 0.0]), 0.0, 0.25, "+z", 3, ["scale x"], ["+z"], False)
        view.show(now)
        assert view.page.status.content == "**put it down &#123;x&#125;**"
        assert view._bar.value == 25.0
        assert "scale x" in view._told.content
        w, x, y, z = view.page._body.wxyz
        assert math.isclose(2.0 * (y * z + w * x), -1.0)  # y points down
    finally:
        view.stop()


class FakeGui:
    """Widgets without a page: what ``ParameterPanel`` asks of viser."""

    def __init__(self) -> None:
        self.widgets: dict = {}

    def add_html(self, _: str) -> None:
        """Style."""

    def add_folder(self, _: str):
        return nullcontext(SimpleNamespace(remove=lambda: None))

    def _add(self, value: float):
        widget = SimpleNamespace(value=value)
        widget.on_update = lambda act: setattr(widget, "act", act)
        return widget

    def add_checkbox(self, label, value, **_):
        return self.widgets.setdefault(label, self._add(value))

    def add_slider(self, name, low, high, step, value, **_):
        return self.widgets.setdefault(f"slider {name}", self._add(value))

    def add_number(self, label, value, **_):
        return self.widgets.setdefault(label, self._add(value))


@pytest.mark.parametrize("typed, refused_by", [(-1.0, "range"), (0.7, "node")])
def test_a_value_that_is_refused_leaves_its_box(typed, refused_by):
    """One out of range, and one that the node does not take: the box has the value in use again."""
    gui, asked = FakeGui(), []
    panel = ParameterPanel(gui)

    def change(name, value):
        asked.append(value)
        panel.set(lh.Madgwick(beta=0.1))  # as a view does that was refused

    panel.show(lh.Madgwick(beta=0.1), change)
    box = next(widget for label, widget in gui.widgets.items() if label.startswith("beta"))
    box.value = typed
    box.act(SimpleNamespace(client=1))
    assert box.value == 0.1 and asked == ([] if refused_by == "range" else [0.7])
