"""A clock that would leave few of the rows is refused, with the command that reads all of them."""

from pathlib import Path

import numpy as np
import pytest

from levelhead import read
from levelhead.sources.hints import NeedsHints


def test_stamps_of_three_digits_do_not_leave_a_few_rows(tmp_path: Path) -> None:
    """Milliseconds as 9.77E+02: rows that rest repeat their numbers, and all but a few would be left out."""
    acc = np.tile([0.0, 0.0, 9.81], (3914, 1))
    acc[::1500] += 0.01
    rows = np.column_stack([np.arange(3914) / 3000.0 + 977.0, acc, np.zeros((3914, 3))])
    np.savetxt(tmp_path / "log.csv", rows, ["%.2E"] + ["%.2f"] * 6, ",", header="time,ax,ay,az,gx,gy,gz", comments="")
    with pytest.raises(NeedsHints, match=r"only \d+ of 3914 rows") as caught:
        read(tmp_path / "log.csv")
    assert caught.value.suggested["map"]["t"] == []
    assert len(read(tmp_path / "log.csv", **caught.value.suggested)) == 3914
