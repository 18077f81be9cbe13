"""The report of a corpus as one HTML page: tables, the sensors over time, and a picture of each of the worst ten."""

import base64
from collections.abc import Iterator
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

from levelhead.atomic import atomic_path
from levelhead.calibration import Calibration
from levelhead.corpora.job import DOCTOR, NOISE, Job
from levelhead.corpora.overview import Summary, Table, said_of
from levelhead.corpora.places import Source, local_copy
from levelhead.corpora.work import read_recording, text_digest
from levelhead.errors import LevelheadError
from levelhead.open_types import JsonObject, ReadOnlyJson, Untyped

NAME = "report.html"
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 2em auto; max-width: 85em; padding: 0 1em }
table { border-collapse: collapse; margin: .5em 0 2em; font-variant-numeric: tabular-nums }
th, td { padding: .25em .8em; text-align: left; border-bottom: 1px solid #ddd; vertical-align: top }
th { border-bottom: 2px solid #666; vertical-align: bottom } .number { text-align: right }
td:last-child:not(.number) { min-width: 24em } td:first-child { overflow-wrap: anywhere; min-width: 16em }
img { max-width: 100% } figure { margin: 2em 0; max-width: 60em }
figcaption { font-weight: 600; margin-bottom: .5em }
"""


def write_page(folder: Path, table: Untyped, job: Job, storage: ReadOnlyJson, pictures: bool) -> Path:
    """Writes report.html into the folder of results; whole or not at all.

    Args:
        folder: of the results.
        table: its rows.
        job: the request.
        storage: options of fsspec, to read the worst recordings again.
        pictures: whether to draw.

    Raises:
        LevelheadError: the folder cannot be written.
    """
    summary = Summary(table, job.verb)
    parts = [f"<h1>{escape(summary.heading)}</h1>", _job_paragraph(job)]
    parts += [_html(one) for one in (*summary.tables(), *summary.spread())]
    if pictures:
        parts += list(_sensor_pictures(summary))
        parts += list(_worst_pictures(summary, table, job, storage))
    head = f'<meta charset="utf-8"><title>levelhead corpus {escape(job.verb)}</title><style>{STYLE}</style>'
    path = folder / NAME
    with atomic_path(path) as temporary:
        body = "\n".join(parts)
        text = f"<!doctype html><html><head>{head}</head><body>\n{body}\n</body></html>\n"
        temporary.write_text(text, encoding="utf-8")
    return path


def _job_paragraph(job: Job) -> str:
    methods = ", ".join(method.name for method in job.methods)
    words = [f"levelhead {job.version}", methods, f"parameters {job.digest}"]
    return f"<p>{escape('; '.join(word for word in words if word))}</p>"


def _html(table: Table) -> str:
    from levelhead.evaluate.text_table import drop_empty_columns

    columns = drop_empty_columns(table.columns, table.rows)
    head = "".join(f"<th>{escape(column.header)}</th>" for column in columns)
    lines = []
    for row in table.rows:
        cells = []
        for column in columns:
            kind = "" if isinstance(row[column.key], str) else ' class="number"'
            cells.append(f"<td{kind}>{escape(column.cell(row[column.key]))}</td>")
        lines.append(f"<tr>{''.join(cells)}</tr>")
    note = f"<p>{escape(table.note)}</p>" if table.note else ""
    body = "\n".join(lines)
    return f"<h2>{escape(table.title)}</h2><table><tr>{head}</tr>\n{body}</table>{note}"


def _sensor_pictures(summary: Summary) -> Iterator[str]:
    histories = summary.histories()
    if not histories:
        return
    from levelhead.publish.plots.sensor_history import sensor_picture

    with TemporaryDirectory(prefix="levelhead-") as folder:
        path = Path(folder, "sensors.png")
        sensor_picture(histories, path)
        yield _figure(path, "How each sensor's gyroscope bias has changed since its first recording")


def _worst_pictures(summary: Summary, table: Untyped, job: Job, storage: ReadOnlyJson) -> Iterator[str]:
    worst = summary.worst()
    if worst:
        yield "<h2>Pictures of the worst</h2>"
    columns = ["recording", "url", "prior", "sensor"] + (["calibration"] if job.sensor else [])
    wanted = {row["recording"] for row in worst}
    every = table.select(columns).to_pylist() if job.sensor else []
    known = {text_digest(row["calibration"]): row["calibration"] for row in every if row.get("calibration")}
    where = {row["recording"]: row for row in table.select(columns[:4]).to_pylist() if row["recording"] in wanted}
    with TemporaryDirectory(prefix="levelhead-") as folder:
        for i, row in enumerate(worst):
            path, place = Path(folder, f"{i}.png"), where[row["recording"]]
            source = Source(row["recording"], place["url"], "", 0)
            caption = f"{row['recording']}, {row['method']}: {said_of(row, summary.verb)}"
            try:
                _draw(job, row, source, known.get(place["prior"], ""), storage, path)
            except (LevelheadError, OSError) as error:
                yield f"<p>{escape(caption)}: no picture ({escape(str(error))})</p>"
                continue
            yield _figure(path, caption)


def _draw(job: Job, row: JsonObject, source: Source, prior: str, storage: ReadOnlyJson, path: Path) -> None:
    with local_copy(source, storage) as local:
        if job.verb == DOCTOR:
            from levelhead.inspection import inspect
            from levelhead.publish.plots.doctor import doctor_picture

            doctor_picture(inspect(local, **job.hints), path)
            return
        recording = read_recording(local, job)
    if job.verb == NOISE:
        from levelhead.noise import measure_noise
        from levelhead.publish.plots.noise_panels import allan_picture

        allan_picture(measure_noise(recording), path)
        return
    import json

    from levelhead.corpora.work import find_orientation
    from levelhead.publish.plots import track_picture

    known = Calibration.from_dict(json.loads(prior), "the prior") if prior else None
    method = next(method for method in job.methods if method.name == row["method"])
    track_picture(recording, find_orientation(job, method, recording, known), path)


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    words = escape(caption)
    return f'<figure><figcaption>{words}</figcaption><img alt="{words}" src="data:image/png;base64,{data}"></figure>'
