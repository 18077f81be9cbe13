"""A file of text with a word before each number, as a table."""

from pathlib import Path

import numpy as np

from levelhead.errors import LevelheadError
from levelhead.sources.conclusion import Basis, Conclusion
from levelhead.sources.formats.text.cells import lines_of
from levelhead.sources.formats.text.encoding import Encoding
from levelhead.sources.formats.text.header import rate_in
from levelhead.sources.formats.text.labelled import records
from levelhead.sources.table import ArrayTable

_RARE = 0.05  # share of the samples below which a name is not a column


def labelled_table(path: Path, shown: str, encoding: Encoding) -> ArrayTable:
    """The numbers of a text by their names, NaN where a sample lacks one.

    Raises:
        LevelheadError: no sample at all.
    """
    text = path.read_bytes()[encoding.skip :].decode(encoding.name, "replace")
    lines = lines_of(text)
    found = [record for _, record in records(lines)]
    if not found:
        raise LevelheadError(f"{shown} has no line with a word before each number; expected such as ax=0.01 ay=…")
    counts: dict[str, int] = {}
    for record in found:
        for name in record:
            counts[name] = counts.get(name, 0) + 1
    names = [name for name, count in counts.items() if count > _RARE * len(found)]
    arrays = {name: np.array([record.get(name, np.nan) for record in found]) for name in names}
    kind = Conclusion("file.kind", "labelled", "labelled text", Basis.HEADER, {"names": ", ".join(names[:12])})
    return ArrayTable(shown, arrays, rate=rate_in(lines[:30]), conclusions=[kind])
