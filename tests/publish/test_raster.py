"""The picture that Pillow draws: what stands where, read back from its pixels."""

import subprocess
import sys

import numpy as np
import pytest

from levelhead.errors import LevelheadError
from levelhead.publish.plots import style
from levelhead.publish.plots.chart import draw
from levelhead.publish.plots.picture import Band, Bars, Line, Panel, Picture, ticks, y_limits

pytest.importorskip("matplotlib")  # whose letters are used
X = np.array([0.0, 10.0])


def pixels(path, *panels, columns=1):
    from PIL import Image

    draw(Picture("What it shows", panels, (0.0, 10.0), 6.0, 2.0 * len(panels) / columns + 1.0, columns), path)
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def places(image, color):
    """Rows and columns of the pixels of a colour."""
    wanted = [int(color[k : k + 2], 16) for k in (1, 3, 5)]
    return np.nonzero((np.abs(image - wanted) <= 2).all(axis=2))


def test_a_line_stands_where_its_numbers_are(tmp_path):
    low, high = Line(X, np.full(2, 1.0), style.BLUE, 3.0), Line(X, np.full(2, 3.0), style.VERMILION, 3.0)
    image = pixels(tmp_path / "a.png", Panel("two", "[m]", [low, high], (0.0, 4.0)))
    at = [np.median(places(image, color)[0]) for color in (style.BLUE, style.VERMILION)]
    rows, columns = places(image, "#666666")
    edge = rows[columns == np.bincount(columns).argmax()]  # the left one, with the mark of x = 0 below it
    top, bottom = edge.min(), edge.max() - 4
    share = (bottom - np.array(at)) / (bottom - top)
    np.testing.assert_allclose(share, [0.25, 0.75], atol=0.02)


def test_nan_breaks_line_and_band(tmp_path):
    x = np.linspace(0.0, 10.0, 1001)
    y = np.where((x > 4.0) & (x < 6.0), np.nan, 1.0)
    marks = [Band(x, y - 0.5, y + 0.5, style.GREEN, 1.0), Line(x, y, style.BLUE, 3.0)]
    image = pixels(tmp_path / "a.png", Panel("torn", "[m]", marks, (0.0, 2.0)))
    for color in (style.GREEN, style.BLUE):
        columns = np.unique(places(image, color)[1])
        assert (np.diff(columns) > 1).sum() == 1
        gap = np.diff(columns).max() / (columns.max() - columns.min())
        assert gap == pytest.approx(0.2, abs=0.02)


def test_rows_of_bars_and_empty_panels(tmp_path):
    rows = [Bars([(0.0, 2.0), (8.0, 2.0)], style.VERMILION, "stuck"), Bars([(0.0, 10.0)], style.GREEN, "at rest")]
    nothing = Panel("nothing", "[m]", [Line(X, np.full(2, np.nan), style.BLUE, 1.0)])
    image = pixels(tmp_path / "a.png", nothing, Panel("health", "", [], rows=rows), nothing, columns=2)
    assert (np.diff(np.unique(places(image, style.VERMILION)[1])) > 1).sum() == 1
    assert np.median(places(image, style.GREEN)[0]) > np.median(places(image, style.VERMILION)[0])


@pytest.mark.slow
def test_the_same_panels_as_vectors(tmp_path):
    marks = [Band(X, X, X + 1.0, style.GREEN, 0.5, "area"), Line(X, X, style.BLUE, 1.0, "line", dashed=True)]
    rows = [Bars([(0.0, 2.0)], style.VERMILION, "stuck")]
    panels = [Panel("three", "[m]", marks), Panel("health", "", [], rows=rows), Panel("one", "", marks)]
    draw(Picture("What it shows", panels, (0.0, 10.0), 8.0, 4.0, columns=2), tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    assert all(f"<!-- {words} -->" in text for words in ("What it shows", "three", "health", "line", "stuck"))


def test_numbers_on_an_axis():
    assert ticks(0.0, 119.0, 6)[1] == ["0", "20", "40", "60", "80", "100"]
    assert ticks(-0.35, 0.31, 4)[1] == ["−0.2", "0.0", "0.2"]
    assert ticks(-180.0, 180.0, 9, angle=True)[1] == ["−180", "−90", "0", "90", "180"]
    assert ticks(9.99999, 10.00001, 2)[1] == ["9.99999", "10.00000", "10.00001"]
    assert y_limits(Panel("", "", [Line(X, np.full(2, 2.0), style.BLUE, 1.0)])) == pytest.approx((1.9, 2.1))


def test_without_letters_the_error_names_the_extra(tmp_path, monkeypatch):
    from levelhead.publish.plots import raster

    raster._letters.cache_clear()
    monkeypatch.setattr(raster, "find_spec", lambda name: None)
    with pytest.raises(LevelheadError, match=r"levelhead\[plot\]"):
        draw(Picture("", [], (0.0, 1.0), 6.0, 3.0), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_png_needs_no_matplotlib_imported(tmp_path):
    code = (
        "import sys, levelhead as lh; from levelhead.publish.plots import track_picture;"
        "rec = lh.simulate.recording('MPU-6050', 'hand', duration=2.0); track_picture(rec, lh.fuse(rec), 'a.png');"
        "print('matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
