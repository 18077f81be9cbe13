"""Tables of a report from rows by hand: what health says, duplicates, rows of files that are gone, quantiles."""

import numpy as np
import pytest

from levelhead.corpora import html_report
from levelhead.corpora.job import Job
from levelhead.corpora.overview import Summary, said_of
from levelhead.corpora.row_layout import HEALTH, schema
from levelhead.corpora.runner import choose_methods
from levelhead.corpora.work import text_digest
from levelhead.filters import health

pa = pytest.importorskip("pyarrow")


def table(*rows):
    layout = schema("fuse", {})
    return pa.Table.from_pylist([{"method": "ESKF", "group": "", "gone": False, **row} for row in rows], layout)


def summary(*rows):
    return Summary(table(*rows), "fuse")


def titles(found):
    return {one.title: one for one in (*found.tables(), *found.spread())}


def test_health_is_said_of_faults_that_are_there():
    fault = next(bit for bit in HEALTH if bit & health.FAULTS)
    other = next(bit for bit in HEALTH if not bit & health.FAULTS)
    assert said_of({HEALTH[fault]: 0.25, HEALTH[other]: 0.9}, "fuse") == f"25 % {health.NAMES[fault]}"
    assert said_of({HEALTH[fault]: 0.0, HEALTH[other]: 0.9}, "fuse") == "no faults"


def test_files_that_are_the_same_are_named_together():
    found = summary(
        {"recording": "b.csv", "sha256": "1"}, {"recording": "a.csv", "sha256": "1"},
        {"recording": "a.csv", "method": "EKF", "sha256": "1"}, {"recording": "c.csv", "sha256": "2"},
        {"recording": "x.csv", "error": "unreadable"}, {"recording": "y.csv", "error": "unreadable"},
    )  # fmt: skip
    assert titles(found)["The same file twice"].rows == [{"recording": "a.csv", "same": "b.csv"}]


def test_rows_of_files_that_are_gone_count_no_more():
    found = summary({"recording": "a.csv", "tilt_deg": 1.0}, {"recording": "b.csv", "tilt_deg": 9.0, "gone": True})
    assert found.heading == "fuse: 1 recording, 1 no longer there"
    assert titles(found)["No longer there"].rows == [{"recording": "b.csv"}]
    assert found.groups().rows[0]["tilt_deg"] == 1.0


def test_quantiles_are_those_of_numpy_by_folder_and_sensor():
    values = np.geomspace(0.1, 10.0, 21)
    rows = [
        {"recording": f"{'near' if i % 2 else 'far'}/{i}.csv", "sensor": "s" if i < 5 else None, "tilt_deg": value}
        for i, value in enumerate(values.tolist())
    ]
    found = titles(summary(*rows))
    near = next(row for row in found["Distribution by folder"].rows if row["place"] == "near")
    assert near["recordings"] == 10 and near["figure"] == "tilt error [°]"
    for name, share in (("low", 0.1), ("middle", 0.5), ("high", 0.9), ("most", 1.0)):
        assert near[name] == pytest.approx(np.quantile(values[1::2], share))
    assert len(near["histogram"]) == 12 and set(near["histogram"]) <= set(" ▁▂▃▄▅▆▇█")
    (sensor,) = found["Distribution by sensor"].rows
    assert sensor["place"] == "s" and sensor["recordings"] == 5
    assert sensor["histogram"].replace(" ", "") == "█" * 5  # evenly on a logarithmic axis


@pytest.mark.parametrize("sensor", ["", "(unit)"])
def test_a_picture_is_drawn_with_the_prior_of_its_run(tmp_path, monkeypatch, sensor):
    prior, seen = '{"learned": 1}', []
    monkeypatch.setattr(html_report, "_draw", lambda job, row, source, known, *rest: seen.append((source.name, known)))
    monkeypatch.setattr(html_report, "_figure", lambda path, caption: caption)
    monkeypatch.setattr(html_report, "_sensor_pictures", lambda summary: [])
    rows = (
        {"recording": "a.csv", "tilt_deg": 1.0, "url": "a", "calibration": prior, "prior": ""},
        {"recording": "b.csv", "tilt_deg": 2.0, "url": "b", "prior": text_digest(prior)},
    )
    job = Job("fuse", choose_methods("fuse", ()), sensor=sensor)
    text = html_report.write_page(tmp_path, table(*rows), job, {}, pictures=True).read_text()
    assert seen == [("b.csv", prior if sensor else ""), ("a.csv", "")]
    assert "Pictures of the worst" in text and "Distribution by folder" in text
