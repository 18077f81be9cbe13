"""The pages that run in the browser alone, in Chromium: a log with Python and without, the lesson, a phone."""

import base64
from dataclasses import replace

import numpy as np
import pytest
from tests.reference.page import check_accessibility, eventually, numbers, seek

import levelhead as lh
from levelhead.errors import LevelheadError
from levelhead.evaluate import compare
from levelhead.inspection import examine
from levelhead.inspection.explain import explain
from levelhead.sources.formats.csv_writer import write_csv
from levelhead.sources.formats.text.delimited import BIG

pytestmark = [pytest.mark.full, pytest.mark.slow]


def write_log(path, sensor: str = "MPU-6050") -> None:
    """A recording without truth, as a CSV of columns that name their unit."""
    write_csv(replace(lh.simulate.recording(sensor, "hand", duration=12.0, rate=50), truth=None), path)


def test_a_log_is_read_in_the_browser_itself(look, try_pages, tmp_path):
    log, bad = tmp_path / "log.csv", tmp_path / "bad.csv"
    write_log(log)
    bad.write_text("a,b\n1,2\n3,4\n")
    page = look(try_pages, "#file")
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


def test_a_log_that_lacks_a_rate_is_read_by_the_form_of_the_page(look, try_pages, tmp_path):
    log, made = tmp_path / "log.csv", lh.simulate.recording("MPU-6050", "hand", duration=12.0, rate=50)
    head = ",".join([*(f"u{i}" for i in range(3)), *(f"acc_{axis} (g)" for axis in "xyz")])
    np.savetxt(log, np.hstack([np.degrees(made.gyr), made.acc / 9.80665]), "%.6f", ",", header=head, comments="")
    page = look(try_pages, "#file")
    page.set_input_files("#file", log)
    page.wait_for_selector("#message:not([hidden])")
    page.get_by_label("columns", exact=True).fill("gyr=u0,u1,u2")
    page.get_by_label("units", exact=True).fill("gyr=deg/s")
    page.get_by_label("rate, Hz", exact=True).fill("50")
    page.get_by_role("button", name="Read again").click()
    page.wait_for_selector("body[data-ready]")
    track = lh.fuse(lh.read(log, map={"gyr": ["u0", "u1", "u2"]}, units={"gyr": "deg/s"}, rate=50))
    seek(page, 3.0)
    eventually(lambda: numbers(page, "roll", "pitch", "yaw") == pytest.approx(track.euler()[150], abs=0.06))


TRACK = """async ([script, name, text, chosen, filter]) => {
  const worker = new Worker(script, { type: "module" });
  const call = (name, args, file) => new Promise((take, fail) => {
    worker.onmessage = ({ data }) => (data.failure === undefined ? take(data.block) : fail(new Error(data.failure)));
    worker.postMessage({ id: 1, name, args, file });
  });
  try {
    const { header } = await call("open", {}, { name, bytes: new TextEncoder().encode(text).buffer });
    if (chosen !== null) await call("open", { chosen: { ...header.chosen, ...chosen } });
    const { columns } = await call("track", { filter });
    const { values } = columns.get("quat"), signs = [];
    const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
    for (let at = 0; at < bytes.length; at += 8192) signs.push(String.fromCharCode(...bytes.subarray(at, at + 8192)));
    return btoa(signs.join(""));
  } finally {
    worker.terminate();
  }
}"""


def track_in(page, name: str, text: str, params, chosen=None):
    """(n, 4) the quaternions of the page without Python."""
    found = page.evaluate(TRACK, ["plain_worker.js", name, text, chosen, type(params).__name__])
    return np.frombuffer(base64.b64decode(found)).reshape(-1, 4)


def test_a_csv_of_plain_columns_has_the_bits_of_python_without_python(look, try_pages, tmp_path):
    log = tmp_path / "log.csv"
    write_log(log, "ICM-20948")
    page = look(f"{try_pages}plain.html", "#file")
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    check_accessibility(page)
    page.set_input_files("#file", log)
    page.wait_for_selector("body[data-ready]")
    recording = lh.read(log, map={"mag": [f"mag_{axis} [µT]" for axis in "xyz"]})  # it stands beside iron
    track = lh.fuse(recording)
    seek(page, 3.0)
    eventually(lambda: numbers(page, "roll", "pitch", "yaw") == pytest.approx(track.euler()[150], abs=0.06))
    page.select_option("#filter", "Mahony")
    kp = page.get_by_label("kp, as a number")
    kp.fill("2")
    kp.press("Enter")
    wanted = lh.fuse(recording, lh.Mahony(kp=2.0)).euler()[150]
    eventually(lambda: numbers(page, "roll", "pitch", "yaw") == pytest.approx(wanted, abs=0.06))
    with page.expect_download() as download:
        page.get_by_role("button", name="CSV").click()
    assert len(np.genfromtxt(download.value.path(), delimiter=",", skip_header=1)) == len(track)
    check_accessibility(page)
    for params in (lh.ESKF(), lh.Mahony()):
        found = track_in(page, log.name, log.read_text(), params)
        np.testing.assert_array_equal(found, lh.fuse(recording, params).quat)
    assert not [url for url in asked if "pyodide" in url or "levelhead.zip" in url]


def test_a_big_log_has_the_bits_of_python_by_the_numbers_of_the_browser(look, try_pages, tmp_path):
    log, rows = tmp_path / "log.csv", lh.simulate.recording("MPU-6050", "hand", duration=100.0)
    names = ["ms", *(f"gyr_{axis} [deg/s]" for axis in "xyz"), *(f"acc_{axis} [g]" for axis in "xyz")]
    lines = [",".join(f"{x:.6f}" for x in one) for one in np.column_stack([rows.gyr, rows.acc / 9.80665]).tolist()]
    content = ",".join(names) + "\n" + "".join(f"{10 * row},{lines[row % len(lines)]}\n" for row in range(140_000))
    log.write_text(content)
    assert log.stat().st_size > BIG
    page = look(try_pages, "#file")
    found = np.frombuffer(base64.b64decode(page.evaluate(TRACK, ["worker.js", log.name, content, None, "ESKF"])), "f4")
    np.testing.assert_array_equal(found.reshape(-1, 4), lh.fuse(lh.read(log)).quat.astype(np.float32))


def test_columns_without_a_unit_are_chosen_on_the_page(look, try_pages, tmp_path):
    log, rows = tmp_path / "log.csv", lh.simulate.recording("MPU-6050", "hand", duration=12.0, rate=50)
    names = ["ms", "u", "v", "w", "acc_x (g)", "acc_y (g)", "acc_z (g)", "remark"]
    numbers_ = np.column_stack([np.round(1e3 * rows.t), np.degrees(rows.gyr), rows.acc / 9.80665])
    lines = [",".join([*map(repr, one.tolist()), "a word"]) for one in numbers_]
    log.write_text("\n".join([",".join(names), *lines]) + "\n")
    page = look(f"{try_pages}plain.html", "#file")
    page.set_input_files("#file", log)
    eventually(lambda: "choose it" in page.inner_text("#message"))
    check_accessibility(page)
    assert page.get_by_label("accelerometer y", exact=True).input_value() == "acc_y (g)"
    assert page.get_by_label("unit of the accelerometer").input_value() == "g"
    for label, value in (
        ("time", "ms"), ("unit of the time", "ms"), ("gyroscope x", "u"), ("gyroscope y", "v"),
        ("gyroscope z", "w"), ("unit of the gyroscope", "deg/s"),
    ):  # fmt: skip
        page.get_by_label(label, exact=True).select_option(value)
    page.get_by_role("button", name="Read", exact=True).click()
    page.wait_for_selector("body[data-ready]")
    recording = lh.read(log, map={"t": "ms", "gyr": ["u", "v", "w"]}, units={"t": "ms", "gyr": "deg/s"})
    chosen = {"t": {"columns": ["ms"], "unit": "ms"}, "gyr": {"columns": ["u", "v", "w"], "unit": "deg/s"}}
    found = track_in(page, log.name, log.read_text(), lh.ESKF(), chosen)
    np.testing.assert_array_equal(found, lh.fuse(recording).quat)


HEAD = "t [s],gyr_x [rad/s],gyr_y [rad/s],gyr_z [rad/s],acc_x [g],acc_y [g],acc_z [g]\n"
ROWS = "".join(f"{0.01 * k:.2f},0,0,0,0,0,1\n" for k in range(20))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x89PNG\r\n\x1a\n", "is no text in UTF-8"),
        (b"1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n", "does not begin with the names of its columns"),
        ((HEAD + ROWS + "0.2,0,0,,0,0,1\n").encode(), "line 22, column 'gyr_z [rad/s]': ''; expected a number"),
        ((HEAD + ROWS + "0.2,0,0,0,0,0\n").encode(), "line 22: 6 cells; expected 7"),
        ((HEAD + ROWS + "0.2,0x1,0,0,0,0,1\n").encode(), "column 'gyr_x [rad/s]': '0x1'"),
        ((HEAD + ROWS + "0.1,0,0,0,0,0,1\n").encode(), "row 21: its stamp 0.1 is not after 0.19"),
    ],
)
def test_what_is_not_plain_is_refused_in_favour_of_the_reader_in_python(look, try_pages, content, words):
    page = look(f"{try_pages}plain.html", "#file")
    page.set_input_files("#file", {"name": "log.csv", "mimeType": "text/csv", "buffer": content})
    page.wait_for_selector("#message:not([hidden])")
    assert words in page.inner_text("#message")
    assert "levelhead fuse, and this page with Python, read more" in page.inner_text("#message")


def test_the_lesson_runs_on_modules_alone(look, try_pages):
    """Its figures are those of `levelhead demo`, and a slider changes them."""
    from levelhead.cli.demo import LESSON

    rows = compare(lh.simulate.lesson(42), LESSON[:4], guard=None).rows
    page = look(f"{try_pages}lesson.html")
    assert page.locator("#figures td").all_inner_texts() == [f"{row.score.total:.4f}°" for row in rows]
    check_accessibility(page)
    page.get_by_label("r_measure, as a number").fill("0.5")
    page.keyboard.press("Enter")
    params = lh.Kalman(r_measure=0.5, q_per_sample=True)
    (row,) = compare(lh.simulate.lesson(42), [params], guard=None).rows
    eventually(lambda: page.locator("#figures td").last.inner_text() == f"{row.score.total:.4f}°")


LYING_ON_A_SLOPE = """() => {
  const force = { x: 0, y: 9.81 * Math.sin(Math.PI / 6), z: 9.81 * Math.cos(Math.PI / 6) };
  setInterval(() => {
    dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha: 0, beta: 30, gamma: 0 }));
    const rotationRate = { alpha: 0, beta: 0, gamma: 0 };
    dispatchEvent(new DeviceMotionEvent("devicemotion", { accelerationIncludingGravity: force, rotationRate }));
  }, 10);
}"""


def test_a_phone_is_its_own_sensor(look, try_pages):
    page = look(f"{try_pages}phone.html", width=390, height=844)
    check_accessibility(page)
    page.click("#start")
    page.evaluate(LYING_ON_A_SLOPE)
    eventually(lambda: page.locator("#figures td").all_inner_texts() == ["+30.0°", "+0.0°", "+0.0°"] * 3)
