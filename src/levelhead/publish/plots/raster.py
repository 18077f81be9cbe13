"""Panels as PNG by Pillow: lines and areas at twice the size, made smaller, which smooths them; then the words."""

import functools
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.publish.plots.picture import Band, Line, Panel, Picture, ticks, y_limits
from levelhead.recording import Array

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

DPI = 120
SMOOTH = 2  # so many times as large are lines drawn
GRID, EDGE, INK = "#E4E4E4", "#666666", "#000000"
TITLE, NAME, UNIT, NUMBER = 13.0, 10.5, 9.5, 9.0  # points, of letters
LEFT, SPACE = 0.62, 0.12  # inches: for numbers and unit; between things
FAST = 1  # of zlib: a third larger than by its default, in a third of the time


def write_png(picture: Picture, path: Path) -> None:
    """Write the picture, whole or not at all.

    Raises:
        LevelheadError: no matplotlib (whose letters are used), or a folder that is missing or cannot be written.
    """
    _letters(False)
    with atomic_path(path) as temporary:
        _draw(picture).save(temporary, format="png", compress_level=FAST, dpi=(DPI, DPI))


@functools.cache
def _letters(bold: bool) -> str:
    """The file of matplotlib's letters; the package is not imported."""
    found = find_spec("matplotlib")
    if found is None or not found.submodule_search_locations:
        raise LevelheadError("pictures need matplotlib: pip install 'levelhead[plot]'")
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return str(Path(found.submodule_search_locations[0], "mpl-data", "fonts", "ttf", name))


@functools.cache
def _font(points: float, bold: bool = False) -> "FreeTypeFont":
    from PIL import ImageFont

    return ImageFont.truetype(_letters(bold), round(points * DPI / 72.0))


def _pixels(inches: float) -> int:
    return round(inches * DPI)


class Frame(NamedTuple):
    """The rectangle of a panel on the page, pixels, and the numbers at its edges."""

    left: int
    top: int
    width: int
    height: int
    x: tuple[float, float]
    y: tuple[float, float]

    def across(self, x: Array) -> Array:
        """Pixels from the left edge."""
        at: Array = (x - self.x[0]) * (self.width / (self.x[1] - self.x[0]))
        return at

    def down(self, y: Array) -> Array:
        """Pixels from the upper edge."""
        at: Array = (self.y[1] - y) * (self.height / (self.y[1] - self.y[0]))
        return at


def _draw(picture: Picture) -> "Image":
    from PIL import Image, ImageDraw

    page = Image.new("RGB", (_pixels(picture.width), _pixels(picture.height)), "white")
    draw = ImageDraw.Draw(page)
    title = fill(picture.title, int(8.5 * picture.width), break_long_words=False)
    draw.multiline_text((_pixels(SPACE), _pixels(SPACE)), title, INK, _font(TITLE, bold=True))
    top = _pixels(0.15 + 0.22 * (title.count("\n") + 1))
    lowest = len(picture.panels) - picture.columns
    for k, (panel, frame) in enumerate(zip(picture.panels, _frames(picture, top), strict=True)):
        _panel(page, draw, panel, frame, picture.xlabel if k >= lowest else "")
    return page


def _frames(picture: Picture, top: int) -> Iterator[Frame]:
    """The place of each panel: columns of the same width, each with room for words to its right."""
    panels, columns = picture.panels, picture.columns
    each = _pixels(picture.width) // columns
    words = max((_font(NUMBER).getlength(word) for panel in panels for word in _words(panel)), default=0.0)
    right = int(words) + _pixels(0.42 if words else 0.1)
    heights = [panel.height for panel in panels[::columns]]
    name, foot = _pixels(0.28), _pixels(0.5)  # above each panel; below the last one
    between = _pixels(0.06)  # between the marks on an axis and the next name
    uneven = len(panels) % columns > 0  # the other columns end a row earlier, with numbers below them
    free = _pixels(picture.height) - top - foot - len(heights) * (name + between) - uneven * foot
    y = float(top)
    for row, height in enumerate(heights):
        y += name
        tall = free * height / sum(heights)
        for column, panel in enumerate(panels[row * columns : (row + 1) * columns]):
            left = column * each + _pixels(LEFT + SPACE)
            width = each - _pixels(LEFT + SPACE) - right
            limits = (len(panel.rows) - 0.4, -0.6) if panel.rows else y_limits(panel)
            yield Frame(left, round(y), width, round(tall), picture.limits, limits)
        y += tall + between + (foot if uneven and row == len(heights) - 2 else 0)


def _words(panel: Panel) -> list[str]:
    return [mark.label for mark in panel.marks if mark.label] + [row.words for row in panel.rows]


def _panel(page: "Image", draw: "ImageDraw", panel: Panel, frame: Frame, xlabel: str) -> None:
    from PIL import Image, ImageDraw

    along, x_texts = ticks(*frame.x, max(frame.width // _pixels(0.55), 1))
    up, y_texts = ticks(*frame.y, max(frame.height // _pixels(0.25), 3), panel.angle) if not panel.rows else ([], [])
    across, down = frame.across(np.asarray(along)), frame.down(np.asarray(up, float))
    large = Image.new("RGB", (SMOOTH * frame.width, SMOOTH * frame.height), "white")
    canvas = ImageDraw.Draw(large, "RGBA")
    for x in across.tolist():
        canvas.line((SMOOTH * x, 0, SMOOTH * x, large.height), GRID, SMOOTH)
    for y in down.tolist():
        canvas.line((0, SMOOTH * y, large.width, SMOOTH * y), GRID, SMOOTH)
    for mark in panel.marks:
        _line(canvas, mark, frame) if isinstance(mark, Line) else _band(canvas, mark, frame)
    for level, row in enumerate(panel.rows):
        high, low = (SMOOTH * frame.down(np.array([level - 0.3, level + 0.3]))).tolist()
        for start, length in row.spans:
            begin, end = (SMOOTH * frame.across(np.array([start, start + length]))).tolist()
            canvas.rectangle((begin, min(high, low), end, max(high, low)), row.color)
    page.paste(large.reduce(SMOOTH), (frame.left, frame.top))
    _edges(draw, frame, [frame.left + x for x in across.tolist()], [frame.top + y for y in down.tolist()])
    bottom, small = frame.top + frame.height, _font(NUMBER)
    draw.text((frame.left, frame.top - 5), panel.title, INK, _font(NAME), anchor="ls")
    for y, text in zip(down.tolist(), y_texts, strict=True):
        draw.text((frame.left - 8, frame.top + y), text, INK, small, anchor="rm")
    if xlabel:
        for x, text in zip(across.tolist(), x_texts, strict=True):
            draw.text((frame.left + x, bottom + 8), text, INK, small, anchor="mt")
        draw.text((frame.left + frame.width / 2, bottom + _pixels(0.25)), xlabel, INK, _font(UNIT), anchor="mt")
    _upright(page, panel.ylabel, frame)
    _legend(draw, panel, frame)


def _edges(draw: "ImageDraw", frame: Frame, across: Sequence[float], down: Sequence[float]) -> None:
    """The left and the lower edge, with a short mark at each number."""
    bottom = frame.top + frame.height
    draw.line((frame.left, frame.top, frame.left, bottom), EDGE, 1)
    draw.line((frame.left, bottom, frame.left + frame.width, bottom), EDGE, 1)
    for x in across:
        draw.line((x, bottom, x, bottom + 4), EDGE, 1)
    for y in down:
        draw.line((frame.left - 4, y, frame.left, y), EDGE, 1)


def _upright(page: "Image", text: str, frame: Frame) -> None:
    """The unit, from below to above, beside the numbers."""
    if not text:
        return
    from PIL import Image, ImageDraw

    font = _font(UNIT)
    strip = Image.new("RGB", (round(font.getlength(text)) + 2, _pixels(0.19)), "white")
    ImageDraw.Draw(strip).text((1, strip.height // 2), text, INK, font, anchor="lm")
    turned = strip.rotate(90, expand=True)
    left = frame.left - _pixels(LEFT + SPACE / 2)
    page.paste(turned, (left, frame.top + (frame.height - turned.height) // 2))


def _legend(draw: "ImageDraw", panel: Panel, frame: Frame) -> None:
    """To the right of the panel, where it hides nothing."""
    font, left, step = _font(NUMBER), frame.left + frame.width, _pixels(0.19)
    for level, row in enumerate(panel.rows):
        y = frame.top + float(frame.down(np.array([float(level)]))[0])
        draw.text((left + _pixels(0.08), y), row.words, INK, font, anchor="lm")
    y = frame.top + _pixels(0.08)
    for mark in panel.marks:
        if not mark.label:
            continue
        start, end = left + _pixels(0.08), left + _pixels(0.32)
        if isinstance(mark, Band):
            draw.rectangle((start, y - 5, end, y + 5), _lighter(mark))
        else:
            parts = ((start, start + 11), (end - 11, end)) if mark.dashed else ((start, end),)
            for a, b in parts:
                draw.line((a, y, b, y), mark.color, 4)
        draw.text((left + _pixels(0.37), y), mark.label, INK, font, anchor="lm")
        y += step


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def _lighter(band: Band) -> tuple[int, int, int]:
    """A band's colour on white."""
    red, green, blue = (round(255 + band.alpha * (part - 255)) for part in _rgb(band.color))
    return red, green, blue


def _pieces(*columns: Array) -> Iterator[NDArray[np.float64]]:
    """Rows of columns without NaN, piece by piece between them."""
    table = np.column_stack(columns)
    good = np.isfinite(table).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    for first, stop in edges.reshape(-1, 2).tolist():
        yield table[first:stop]


def _clip_places(values: Array, size: int) -> Array:
    """Places far outside of the panel, brought nearer: Pillow counts pixels in 16 bits."""
    return np.clip(values, -2.0 * size, 3.0 * size)


def _line(canvas: "ImageDraw", line: Line, frame: Frame) -> None:
    x, y = SMOOTH * frame.across(line.x), SMOOTH * _clip_places(frame.down(line.y), frame.height)
    width = max(round(SMOOTH * line.width * DPI / 72.0), 1)
    for piece in _pieces(x, y):
        if line.dashed:
            _dashes(canvas, piece, line.color, width)
        elif len(piece) == 1:
            a, b = piece[0].tolist()
            canvas.ellipse((a - width, b - width, a + width, b + width), line.color)
        else:
            canvas.line(piece.reshape(-1).tolist(), line.color, width)


def _dashes(canvas: "ImageDraw", piece: Array, color: str, width: int) -> None:
    """A level line, in dashes."""
    (begin, y), (end, _) = piece[0].tolist(), piece[-1].tolist()
    step = 9.0 * width
    for x in np.arange(begin, end, step).tolist():
        canvas.line((x, y, min(x + 0.6 * step, end), y), color, width)


def _band(canvas: "ImageDraw", band: Band, frame: Frame) -> None:
    x = SMOOTH * frame.across(band.x)
    low, high = (SMOOTH * _clip_places(frame.down(values), frame.height) for values in (band.low, band.high))
    colour = (*_rgb(band.color), round(255 * band.alpha))
    for piece in _pieces(x, low, high):
        outline = np.concatenate([piece[:, :2], piece[::-1, ::2]])
        if len(piece) > 1:
            canvas.polygon(outline.reshape(-1).tolist(), colour)
