"""A clock that would leave few of the rows is refused, with the command that reads all of them."""

from pathlib import Path

import numpy as np
import pytest

from levelhead import LevelheadError, read
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


def test_a_table_that_is_no_log_is_not_fused(tmp_path: Path) -> None:
    """A catalogue of logs with a few rows of x, y, z; most of its rows are incomplete."""
    lines = [f"{k}," + (",".join(["0.1"] * 3 + ["9.8"] * 3) if k % 8 == 0 else ",,,,,") for k in range(30)]
    (tmp_path / "log.csv").write_text("row,gx,gy,gz,ax,ay,az\n" + "\n".join(lines) + "\n")
    with pytest.raises(LevelheadError, match="30 rows, which are less than a second at 100 Hz") as caught:
        read(tmp_path / "log.csv")
    assert not isinstance(caught.value, NeedsHints)
    for rate in (10.0, 100.0):
        with pytest.raises(LevelheadError, match=r"too few samples .* \(4 of 30 rows\)"):
            read(tmp_path / "log.csv", rate=rate)
