"""The columns of the rows of results, with type and meaning; units are at the end of their names."""

from typing import NamedTuple

from levelhead.bench.error_figures import ErrorFigures
from levelhead.calibration import QUANTITIES
from levelhead.corpora.job import DOCTOR, NOISE, TRACKING
from levelhead.filters import health
from levelhead.noise.model import UNITS
from levelhead.open_types import JsonObject, Untyped

TEXT, NUMBER, WHOLE, FLAG, TEXTS = "string", "double", "int64", "bool", "list"
UNITLESS = ("beyond_tilt", "beyond_heading", "tilt_ratio", "heading_ratio")
SUFFIX = {"rad/s": "_rad_s", "m/s²": "_m_s2", "µT": "_uT", "s": "_s", "rad": "_rad", "": ""}


class Kind(NamedTuple):
    """A column."""

    name: str
    type: str
    meaning: str


COMMON = (
    Kind("recording", TEXT, "path below the place that was named"),
    Kind("method", TEXT, "filter with the parameters that are not its defaults; another package's; the verb"),
    Kind("url", TEXT, "where it was read"),
    Kind("dataset", TEXT, "data set, by folder or name"),
    Kind("group", TEXT, "group in it"),
    Kind("sensor", TEXT, "sensor, where recordings of the same one are run in order of time"),
    Kind("position", WHOLE, "place in that order, from 0"),
    Kind("error", TEXT, "why there is no result, a sentence; null: there is one"),
    Kind("transient", FLAG, "the error is one of storage or of a worker: the next run tries again"),
    Kind("samples", WHOLE, "how many"),
    Kind("duration_s", NUMBER, "from the first to the last sample"),
    Kind("rate_hz", NUMBER, "samples a second, by the median interval"),
    Kind("start_s", NUMBER, "stamp of the first sample, where stamps count from a date"),
    Kind("magnetometer", FLAG, "whether one was used"),
    Kind("read_s", NUMBER, "time that reading took"),
    Kind("run_s", NUMBER, "time that the method took"),
    Kind("version", TEXT, "of levelhead"),
    Kind("parameters", TEXT, "digest of all that was asked for"),
    Kind("prior", TEXT, "digest of the calibration that the run started with; empty: none"),
    Kind("stamp", TEXT, "digest of size and time or ETag of the file, by which a changed one is known"),
    Kind("sha256", TEXT, "of the file"),
    Kind("bytes", WHOLE, "of the file"),
    Kind("gone", FLAG, "the file was no longer there at the last run"),
)

HEALTH = {
    bit: f"share_{name.lower()}" for name, bit in vars(health).items() if isinstance(bit, int) and bit in health.NAMES
}


PLACES = {  # of the numbers of a quantity, by how many there are
    1: ("",),
    2: ("_level", "_up"),
    3: ("_x", "_y", "_z"),
    5: ("_xx", "_yy", "_xy", "_xz", "_yz"),  # a symmetric matrix without trace
}


def _calibration_kinds() -> list[Kind]:
    kinds = []
    for name, block in QUANTITIES.items():
        for index in range(block.size):
            place = element(name, index)
            kinds.append(Kind(place, NUMBER, f"{block.meaning}, where the motion taught it"))
            kinds.append(Kind(f"{place}_sigma", NUMBER, "its 1σ"))
    return kinds


def element(name: str, index: int) -> str:
    """The column of one number of a calibration."""
    block = QUANTITIES[name]
    rows, columns = (block.shape[0], block.shape[1]) if len(block.shape) == 2 else (0, block.shape[0])
    place = "_" + "xyz"[index // columns] + "xyz"[index % columns] if rows else PLACES[columns][index]
    return f"{name}{place}{SUFFIX[block.unit]}"


TRACK = (
    *(Kind(name if name in UNITLESS else f"{name}_deg", NUMBER, "error against truth, see bench accuracy")
      for name in ErrorFigures._fields),
    Kind("sigma_tilt_deg", NUMBER, "1σ of inclination that the filter gives, median over the samples"),
    Kind("sigma_heading_deg", NUMBER, "the same of heading"),
    Kind("sigma_tilt_end_deg", NUMBER, "the same of inclination at the last sample"),
    Kind("sigma_heading_end_deg", NUMBER, "the same of heading"),
    Kind("share_faulty", NUMBER, "share of the samples with any fault"),
    *(Kind(column, NUMBER, f"share of the samples: {health.NAMES[bit]}") for bit, column in HEALTH.items()),
    *_calibration_kinds(),
    Kind("calibration", TEXT, "all that was learned, as JSON, to the last bit"),
)  # fmt: skip
EXAMINATION = (
    Kind("verdict", TEXT, "the doctor's, in a sentence"),
    Kind("exit_code", WHOLE, "0: fine, 1: findings, 2: unreadable"),
    Kind("sigma_tilt_deg", NUMBER, "1σ of inclination to expect of a track"),
    Kind("sigma_heading_deg", NUMBER, "the same of heading"),
    Kind("heading_drift_deg_min", NUMBER, "drift of heading in a minute, without a magnetometer"),
    Kind("findings", TEXTS, "names of the findings, the worst first"),
    Kind("sentences", TEXTS, "the findings"),
    Kind("cures", TEXTS, "what to do about it"),
)
COEFFICIENTS = {
    "white_noise_density": "_sqrt_hz",
    "bias_instability": "",
    "random_walk": "_sqrt_s",
    "quantisation_noise": "_times_s",
}


def coefficient(sensor: str, name: str, axis: str) -> str:
    """The column of one coefficient of noise."""
    return f"{sensor}_{name}_{axis}{SUFFIX[UNITS[sensor]]}{COEFFICIENTS[name]}"


ALLAN = (
    Kind("still_s", NUMBER, "length of the stretch at rest that was measured"),
    *(
        Kind(column, NUMBER, meaning)
        for sensor in UNITS
        for name in COEFFICIENTS
        for axis in "xyz"
        for column, meaning in (
            (coefficient(sensor, name, axis), name.replace("_", " ")),
            (f"{coefficient(sensor, name, axis)}_sigma", "its 1σ"),
        )
    ),
)
OF_VERB = dict.fromkeys(TRACKING, TRACK) | {DOCTOR: EXAMINATION, NOISE: ALLAN}


def schema(verb: str, facts: JsonObject) -> Untyped:
    """The Arrow schema of a verb's rows, with the request in its metadata."""
    import json

    import pyarrow as pa

    types = {TEXTS: pa.list_(pa.string()), TEXT: pa.string(), NUMBER: pa.float64(), WHOLE: pa.int64(), FLAG: pa.bool_()}
    fields = [
        pa.field(kind.name, types[kind.type], metadata={"meaning": kind.meaning}) for kind in (*COMMON, *OF_VERB[verb])
    ]
    return pa.schema(fields, metadata={"levelhead corpus": json.dumps(facts, sort_keys=True, default=str)})
