"""The picture of a sensor's drift: change since the first recording, its σ, and the date."""

from datetime import UTC, datetime
from math import radians

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from levelhead.publish.plots import sensor_history, style


def row(name, bias, start=None):
    found = {"recording": name, "start_s": start}
    for axis, value in zip("xyz", (bias, 2.0, None), strict=True):
        column = f"gyr_bias_{axis}_rad_s"
        found |= {column: None if value is None else radians(value), f"{column}_sigma": radians(0.02)}
    return found


def drawn(histories, monkeypatch):
    """The figure, in place of its file."""
    kept = []
    monkeypatch.setattr(style, "save", lambda made, path: kept.append(made))
    sensor_history.sensor_picture(histories, "x.png")
    return kept[0].axes


@pytest.mark.slow
def test_a_drift_is_drawn_from_the_first_recording_over_the_dates_of_the_names(monkeypatch):
    rows = [row("SN1/2026-01-03.csv", 5.0), row("SN1/2026-02-03.csv", 5.1), row("SN1/20260303_2.csv", 5.3)]
    (axes,) = drawn({"SN1": rows}, monkeypatch)
    x, y = axes.containers[0][0].get_data()
    assert list(x) == [datetime(2026, month, 3, tzinfo=UTC) for month in (1, 2, 3)]
    assert np.allclose(y, [0.0, 0.1, 0.3])
    (bars,) = axes.containers[0][2]
    assert np.allclose(bars.get_segments()[1][:, 1], [0.08, 0.12])
    assert np.allclose(axes.containers[1][0].get_data()[1], 0.0) and axes.get_xlabel() == ""


@pytest.mark.parametrize("second", ["SN1/b.csv", "SN1/2026-13-03.csv", "SN1/120260203.csv"])
def test_without_a_date_of_all_recordings_they_are_counted(monkeypatch, second):
    (axes,) = drawn({"SN1": [row("SN1/2026-01-03.csv", 5.0), row(second, 5.1)]}, monkeypatch)
    assert list(axes.containers[0][0].get_data()[0]) == [1, 2] and axes.get_xlabel() == "recording"


def test_the_clock_counts_before_the_name(monkeypatch):
    (axes,) = drawn({"SN1": [row("SN1/2026-01-03.csv", 5.0, 86400.0)]}, monkeypatch)
    assert list(axes.containers[0][0].get_data()[0]) == [datetime(1970, 1, 2, tzinfo=UTC)]
