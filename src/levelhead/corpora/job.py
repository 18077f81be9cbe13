"""The job of every recording of a corpus, and its digest: two runs with one digest give the same rows."""

import hashlib
import json
from dataclasses import dataclass, field
from typing import NamedTuple

from levelhead import filters
from levelhead.bench.methods import OURS, Method, distinct_methods, find_method, from_params
from levelhead.corpora.places import Source
from levelhead.engine.batch import DEFAULT_GUARD
from levelhead.errors import LevelheadError, nearest
from levelhead.filters.parameters import FilterChoice
from levelhead.guard import Guard
from levelhead.open_types import JsonObject, ReadOnlyJson
from levelhead.version import VERSION

FUSE, SMOOTH, BENCH, DOCTOR, NOISE = VERBS = ("fuse", "smooth", "bench", "doctor", "noise")
TRACKING = (FUSE, SMOOTH, BENCH)  # verbs that make a track


@dataclass(frozen=True)
class Job:
    """The work on each recording.

    Attributes:
        verb: one of ``VERBS``.
        methods: the filters; for ``bench`` other people's filters as well.
        guard: in front of levelhead's filters; None: none.
        hints: for the reader, as for ``levelhead.read``.
        magnetometer: whether magnetometers are used.
        tracks: whether each track is written to a file.
        sensor: which recordings are of the same sensor, a pattern of names or ``column:NAME``; "": each for itself.
        order: the key of their order in time, likewise; "": their names.
        version: of levelhead.
        engine: as for ``fuse_recordings``.
        axes: how the sensors sit on their bodies, for the tracks that are written; "": as they are.
        frame: of these tracks.
    """

    verb: str
    methods: tuple[Method, ...] = ()
    guard: Guard | None = DEFAULT_GUARD
    hints: ReadOnlyJson = field(default_factory=dict)
    magnetometer: bool = True
    tracks: bool = False
    sensor: str = ""
    order: str = ""
    version: str = VERSION
    engine: str = "auto"
    axes: str = ""
    frame: str = "ENU"

    @property
    def facts(self) -> JsonObject:
        """All of it, ready for JSON."""
        plain: JsonObject = {method.name: None for method in self.methods}
        for method in self.methods:
            if method.params is not None:
                plain[method.name] = {"filter": filters.of(method.params).name, **method.params._asdict()}
        facts: JsonObject = {
            "verb": self.verb,
            "methods": plain,
            "guard": None if self.guard is None else dict(self.guard._asdict()),
            "hints": {key: value for key, value in sorted(self.hints.items()) if value},
            "magnetometer": self.magnetometer,
            "tracks": self.tracks,
            "sensor": self.sensor,
            "order": self.order,
            "version": self.version,
        }
        usual = {"engine": "auto", "axes": "", "frame": "ENU"}  # left out, so that runs of before keep their digest
        return facts | {name: getattr(self, name) for name, value in usual.items() if getattr(self, name) != value}

    @classmethod
    def from_facts(cls, facts: ReadOnlyJson) -> "Job":
        """The job that has these facts."""
        methods = []
        for name, params in facts["methods"].items():
            given = dict(params or {})
            flt = given.pop("filter", None)
            methods.append(Method(name, None if flt is None else filters.find(flt).params(**given)))
        rest = {name: facts[name] for name in facts if name in cls.__dataclass_fields__}
        guard = None if facts["guard"] is None else Guard(**facts["guard"])
        return cls(**rest | {"methods": tuple(methods), "guard": guard})

    @property
    def digest(self) -> str:
        """Sixteen hexadecimal digits of the facts."""
        return hashlib.sha256(json.dumps(self.facts, sort_keys=True, default=str).encode()).hexdigest()[:16]


class Batch(NamedTuple):
    """Recordings that one worker takes one after the other.

    Attributes:
        sources: the recordings.
        sensor: the sensor that made all of them, in order of time, each of which starts with the calibration of the
            one before; "": each for itself.
        prior: that calibration for the first of them, as JSON; "": none.
        first: place of the first of them among the sensor's recordings.
    """

    sources: tuple[Source, ...]
    sensor: str = ""
    prior: str = ""
    first: int = 0


def choose_methods(verb: str, chosen: tuple[FilterChoice, ...]) -> tuple[Method, ...]:
    """The methods of a verb; without a choice the default filter, the smoother's, or all that there are.

    Raises:
        LevelheadError: no such verb or method, or one that this verb does not take.
    """
    if verb not in VERBS:
        raise LevelheadError(f"a corpus has no verb '{verb}'; {nearest(verb, VERBS)}")
    if verb not in TRACKING:
        if chosen:
            raise LevelheadError(f"{verb} examines recordings and takes no filter; leave {chosen[0]} out")
        return ()
    if verb == BENCH:
        if not chosen:
            return (Method("default"), Method("smoother"))
        return tuple(distinct_methods([find_method(one) if isinstance(one, str) else _own(one) for one in chosen]))
    if not chosen:
        chosen = (filters.offline() if verb == SMOOTH else filters.default(),)
    methods = [_own(one) for one in chosen]
    for method in methods:
        if verb == SMOOTH and method.params is not None and filters.of(method.params).smoothing is None:
            who = " or ".join(flt.name for flt in filters.ALL if flt.smoothing)
            raise LevelheadError(f"{method.name} has no smoother; {who} has")
    return tuple(distinct_methods(methods))


def _own(choice: FilterChoice) -> Method:
    return from_params(filters.resolve(choice))


def check_same_sensor(job: Job) -> None:
    """Makes sure that one recording can start with another's calibration.

    Raises:
        LevelheadError: several methods, or one that learns no calibration.
    """
    if not job.sensor:
        if job.order:
            raise LevelheadError("an order of time is for recordings of the same sensor; name them")
        return
    learning = [one for one in job.methods if one.params is not None and filters.of(one.params).calibration]
    if len(job.methods) != 1 or not learning or job.verb == BENCH:
        who = " or ".join(flt.name for flt in filters.ALL if flt.calibration)
        names = ", ".join(method.name for method in job.methods if method.package == OURS) or job.verb
        raise LevelheadError(
            f"learning across recordings takes one filter that learns its sensor, {who}, to fuse or smooth; not {names}"
        )
