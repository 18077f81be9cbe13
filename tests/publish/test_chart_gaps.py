"""Curves with missing values can be drawn, and what is missing is seen."""

import numpy as np

from levelhead.publish.dashboard.chart_data import SHORT_GAP, at_edge


def test_a_short_gap_is_bridged_and_a_long_one_lies_on_the_edge():
    curve = np.linspace(0.0, 1.0, 200)
    gappy = curve.copy()
    gappy[:10] = gappy[50:55] = gappy[100 : 101 + SHORT_GAP] = gappy[-10:] = np.nan
    drawn = at_edge(gappy, -2.0)
    np.testing.assert_allclose(drawn[50:55], curve[50:55])
    for missing in (drawn[:10], drawn[100 : 101 + SHORT_GAP], drawn[-10:]):
        assert (missing == -2.0).all()
    np.testing.assert_array_equal(drawn[10:50], curve[10:50])


def test_nothing_missing_and_nothing_known():
    np.testing.assert_array_equal(at_edge(np.arange(5.0), -2.0), np.arange(5.0))
    np.testing.assert_array_equal(at_edge(np.full(5, np.nan), -2.0), np.full(5, -2.0))
