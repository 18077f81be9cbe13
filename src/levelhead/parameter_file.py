"""A ParameterFile: a filter with its numbers, and perhaps its guard, as JSON.

{"format": "levelhead parameters 1", "filter": "Mahony", "params": {"kp": 0.15}, "guard": {"rest_time": 3}}

`levelhead tune` writes it; `fuse`, `run` and `export` take it as ``--params FILE``. The output of
`levelhead sweep --json` is read too: there the minimum counts. By hand, "filter" and "params" are enough.
"""

import os
from dataclasses import dataclass, field

from levelhead import filters
from levelhead.errors import LevelheadError
from levelhead.filters.contract import Filter
from levelhead.filters.parameters import Params
from levelhead.guard import Guard
from levelhead.json_file import read_object, write_json
from levelhead.open_types import JsonObject

FORMAT = "levelhead parameters 1"


@dataclass(frozen=True)
class ParameterFile:
    """The contents of such a file.

    Attributes:
        params: the filter with its numbers.
        guard: thresholds of the guard in front of it; None: the file has none, so that the defaults hold.
        found: how they were found, in the words of `levelhead tune`; empty otherwise.
    """

    params: Params
    guard: Guard | None = None
    found: JsonObject = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, whole or not at all.

        Raises:
            LevelheadError: the path cannot be written.
        """
        whole: JsonObject = {"filter": filters.of(self.params).name, "params": dict(self.params._asdict())}
        whole |= {"guard": dict(self.guard._asdict())} if self.guard is not None else {}
        write_json(path, FORMAT, whole | ({"found": self.found} if self.found else {}))

    @classmethod
    def read(cls, path: str | os.PathLike[str], flt: Filter | None = None) -> "ParameterFile":
        """The file; ``flt``: the filter that it must be about, and is about if it names none.

        Raises:
            LevelheadError: it is not there, no such file, about another filter, or a number is out of its range.
        """
        source = f'{{"filter": "{"Mahony" if flt is None else flt.name}", "params": {{…}}}}'
        whole = read_object(path, "file of parameters", source)
        if not isinstance(whole.get("params"), dict):
            raise LevelheadError(f"{path} has no parameters; expected {source}")
        if whole.get("format", FORMAT) != FORMAT:
            raise LevelheadError(f"{path} has the format '{str(whole['format'])[:60]}'; this version reads '{FORMAT}'")
        named = whole.get("filter")
        if named is None and flt is None:
            raise LevelheadError(f'{path} does not name the filter of its parameters; expected "filter": "Mahony"')
        about = flt if named is None else filters.find(str(named))
        assert about is not None
        if flt is not None and about is not flt:
            raise LevelheadError(f"{path} holds parameters of {about.name}, not of {flt.name}")
        guard = whole.get("guard") or {}
        if not isinstance(guard, dict):
            raise LevelheadError(f"{path}: guard is {guard!r}, but it must hold thresholds by name")
        params, found = about.params(**whole["params"]), whole.get("found")
        swept, minimum = whole.get("parameter"), whole.get("minimum")
        if isinstance(swept, str) and isinstance(minimum, dict) and "value" in minimum:
            params = params._replace(**{swept: minimum["value"]})
        return cls(params, Guard(**guard) if guard else None, found if isinstance(found, dict) else {})
