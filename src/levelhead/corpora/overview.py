"""The rows of a corpus in a few tables: by group, the worst ten, the failures, the sensors over time."""

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import degrees

from levelhead.corpora.distribution import COLUMNS, axis_note, distributions, folder_of, sensor_of
from levelhead.corpora.job import DOCTOR, NOISE
from levelhead.corpora.row_layout import HEALTH
from levelhead.evaluate.text_table import Column, Row, plain_table
from levelhead.filters import health
from levelhead.open_types import JsonObject, Untyped

WORST = 10
SENTENCES = 10  # of failures
KINDS = 3  # of faults or findings that are named of a recording
WHITE_NOISE = "gyr_white_noise_density_x_rad_s_sqrt_hz"
INSTABILITY = "gyr_bias_instability_x_rad_s"
FIGURES = {  # verb -> the columns of the tables: title, unit, digits, factor
    DOCTOR: {
        "sigma_tilt_deg": ("expected σ of tilt", "°", 2, 1.0),
        "heading_drift_deg_min": ("heading drift", "°/min", 2, 1.0),
    },
    NOISE: {
        WHITE_NOISE: ("gyroscope x white noise", "°/s/√Hz", 5, degrees(1.0)),
        INSTABILITY: ("gyroscope x bias instability", "°/h", 2, 3600.0 * degrees(1.0)),
    },
}
TRACK_FIGURES = {
    "total_deg": ("total error", "°", 2, 1.0),
    "tilt_deg": ("tilt error", "°", 2, 1.0),
    "sigma_tilt_deg": ("σ of tilt", "°", 2, 1.0),
    "sigma_heading_deg": ("σ of heading", "°", 2, 1.0),
    "share_faulty": ("with faults", "%", 2, 100.0),
}
BIASES = tuple(f"gyr_bias_{axis}_rad_s" for axis in "xyz")
SIGMAS = tuple(f"{bias}_sigma" for bias in BIASES)
MAX_NAME = 60  # letters of a method's name


@dataclass(frozen=True)
class Table:
    """A titled table of a summary."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Row]
    note: str = ""

    def __str__(self) -> str:
        parts = [self.title, plain_table(self.columns, self.rows), self.note]
        return "\n".join(part for part in parts if part)


class Summary:
    """Tables of the rows of one verb.

    Args:
        table: rows as ``levelhead.corpus`` gives them.
        verb: the verb that made them.
    """

    def __init__(self, table: Untyped, verb: str) -> None:
        self.verb = verb
        known = set(table.column_names)
        named = ("recording", "method", "dataset", "group", "sensor", "position", "start_s", "error", "verdict",
                 "exit_code", "findings", "sha256", "gone", *HEALTH.values(), *BIASES, *SIGMAS,
                 *self.figures)  # fmt: skip
        rows: list[JsonObject] = table.select([name for name in dict.fromkeys(named) if name in known]).to_pylist()
        self.rows = [row for row in rows if not row.get("gone")]
        self.gone = sorted({row["recording"] for row in rows if row.get("gone")})

    @property
    def figures(self) -> dict[str, tuple[str, str, int, float]]:
        """Column of the rows -> title, unit, digits and factor in the tables."""
        return FIGURES.get(self.verb, TRACK_FIGURES)

    @cached_property
    def good(self) -> list[JsonObject]:
        """The rows with a result."""
        return [row for row in self.rows if not row["error"]]

    @property
    def without_result(self) -> list[JsonObject]:
        """The rows without one."""
        return [row for row in self.rows if row["error"]]

    @property
    def heading(self) -> str:
        """How many recordings there are, and how many gave no result."""
        every, bad = ({row["recording"] for row in rows} for rows in (self.rows, self.without_result))
        words = f"{self.verb}: {len(every):,} recording{'' if len(every) == 1 else 's'}"
        words += f", {len(bad):,} without a result" if bad else ""
        return words + (f", {len(self.gone):,} no longer there" if self.gone else "")

    def groups(self) -> Table:
        """The mean of every figure by group and method."""
        parts: dict[tuple[str, str], list[JsonObject]] = {}
        for row in self.good:
            parts.setdefault((row["group"] or "", row["method"]), []).append(row)
        several = len({method for _, method in parts}) > 1
        rows: list[Row] = []
        for (group, method), members in sorted(parts.items()):
            cells: dict[str, str | float | None] = {"group": group, "recordings": float(len(members))}
            cells["method"] = method[:MAX_NAME] if several else None
            cells |= {key: _mean(members, key, figure[3]) for key, figure in self.figures.items()}
            if self.verb == DOCTOR:
                cells["fine"] = float(sum(row["exit_code"] == 0 for row in members))
                cells["findings"] = _most(name for row in members for name in row["findings"])
            rows.append(cells)
        columns = [Column("group", "group"), Column("method", "method"), Column("recordings", "recordings", "", 0)]
        if self.verb == DOCTOR:
            columns += [Column("fine", "fine", "", 0), Column("findings", "most frequent findings")]
        return Table("Means by group", [*columns, *self._columns()], rows)

    def _columns(self) -> list[Column]:
        return [Column(key, title, unit, digits) for key, (title, unit, digits, _) in self.figures.items()]

    def worst(self) -> list[JsonObject]:
        """The ten worst rows: by error where truth is known, then by σ; the doctor's by findings."""
        return sorted(self.good, key=self._badness, reverse=True)[:WORST]

    def _badness(self, row: JsonObject) -> tuple[float, ...]:
        if self.verb == DOCTOR:
            return (float(row["exit_code"]), float(len(row["findings"])), row["sigma_tilt_deg"] or 0.0)
        order = [row.get(key) for key in self.figures]
        truth = order[0] is not None
        return (float(truth), *(-1.0 if value is None else float(value) for value in order))

    def worst_table(self) -> Table:
        """The same with their health in words."""
        rows: list[Row] = []
        for row in self.worst():
            cells: dict[str, str | float | None] = {"recording": row["recording"], "method": row["method"][:MAX_NAME]}
            cells |= {key: _scale(row.get(key), figure[3]) for key, figure in self.figures.items()}
            rows.append(cells | {"said": said_of(row, self.verb)})
        said = Column("said", "findings" if self.verb == DOCTOR else "health")
        return Table(
            f"The worst {len(rows)}",
            [Column("recording", "recording"), Column("method", "method"), *self._columns(), said],
            rows,
        )

    def failures(self) -> Table:
        """Why recordings gave no result."""
        rows: list[Row] = [{"recording": row["recording"], "why": row["error"]} for row in self.without_result]
        note = f"{len(rows) - SENTENCES:,} more stand in the rows, column error." if len(rows) > SENTENCES else ""
        columns = [Column("recording", "recording"), Column("why", "why")]
        return Table("Without a result", columns, rows[:SENTENCES], note)

    def duplicates(self) -> Table:
        """Recordings whose files are the same, byte by byte."""
        names: dict[str, dict[str, None]] = {}
        for row in self.rows:
            if row.get("sha256"):
                names.setdefault(row["sha256"], {})[row["recording"]] = None
        rows: list[Row] = [
            {"recording": first, "same": ", ".join(others)}
            for first, *others in sorted(map(sorted, names.values()))
            if others
        ]
        return Table("The same file twice", [Column("recording", "recording"), Column("same", "same as")], rows)

    def missing(self) -> Table:
        """Recordings with results whose file is no longer there."""
        rows: list[Row] = [{"recording": name} for name in self.gone]
        return Table("No longer there", [Column("recording", "recording")], rows, "Their rows stay, column gone.")

    def spread(self) -> list[Table]:
        """Quantiles and histograms by folder and by sensor."""
        made = []
        for title, place in (("folder", folder_of), ("sensor", sensor_of)):
            rows = distributions(self.good, self.figures, place)
            made.append(Table(f"Distribution by {title}", COLUMNS, rows, axis_note(rows)))
        return [table for table in made if table.rows]

    def sensors(self) -> Table:
        """Of each sensor, how its gyroscope's bias went from its first recording to its last."""
        rows: list[Row] = []
        for sensor, members in self.histories().items():
            cells: dict[str, str | float | None] = {"sensor": sensor, "recordings": float(len(members))}
            for column, axis in zip(BIASES, "xyz", strict=True):
                values = [degrees(row[column]) for row in members if row[column] is not None]
                cells[f"first_{axis}"] = values[0] if values else None
                cells[f"change_{axis}"] = values[-1] - values[0] if values else None
                cells[f"spread_{axis}"] = statistics.pstdev(values) if values else None
            rows.append(cells)
        columns = [Column("sensor", "sensor"), Column("recordings", "recordings", "", 0)]
        for axis in "xyz":
            columns += [Column(f"{kind}_{axis}", f"{axis} {kind}", "°/s", 3) for kind in ("first", "change", "spread")]
        return Table("Gyroscope bias of each sensor, from its first recording to its last", columns, rows)

    def histories(self) -> dict[str, list[JsonObject]]:
        """Sensor -> its rows in order of time."""
        found: dict[str, list[JsonObject]] = {}
        for row in sorted(self.good, key=lambda row: row["position"] or 0):
            if row["sensor"]:
                found.setdefault(row["sensor"], []).append(row)
        return dict(sorted(found.items()))

    def tables(self) -> list[Table]:
        """All that have rows."""
        makers: list[Callable[[], Table]] = [
            self.groups, self.worst_table, self.sensors, self.failures, self.duplicates, self.missing
        ]  # fmt: skip
        return [table for make in makers if (table := make()).rows]

    def __str__(self) -> str:
        return "\n\n".join([self.heading, *map(str, self.tables())])


def said_of(row: JsonObject, verb: str) -> str:
    """The words of a track's health, or of the doctor, for a recording, the most frequent first."""
    if verb == DOCTOR:
        return ", ".join(row["findings"][:KINDS]) or "fine"
    shares = {
        bit: row[column] for bit, column in HEALTH.items() if bit & health.FAULTS and row.get(column)
    }  # fmt: skip
    most = sorted(shares, key=lambda bit: -shares[bit])[:KINDS]
    return "; ".join(f"{100 * shares[bit]:.2g} % {health.NAMES[bit]}" for bit in most) or "no faults"


def _mean(rows: Iterable[JsonObject], key: str, factor: float) -> float | None:
    values = [row[key] for row in rows if row.get(key) is not None]
    return factor * statistics.fmean(values) if values else None


def _scale(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _most(names: Iterable[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in Counter(names).most_common(KINDS)) or "none"
