"""Tables in memory keep what the reader concludes from: origin, labels, units."""

import numpy as np

from levelhead.sources.interpret.interleaved_rows import parts_of
from levelhead.sources.table import ArrayTable, in_memory


def test_a_copy_keeps_origin_labels_and_units() -> None:
    words = np.array(["a", "b"])
    table = ArrayTable(
        "log.csv", {"t": np.arange(2), "x": np.ones(2)}, column_units={0: "ns"}, origin=("preamble",),
        labels={"side": words},
    )  # fmt: skip
    copy = in_memory(table, "name")
    assert copy.origin == ["preamble"] and copy.labels["side"] is words and copy.column_units == {0: "ns"}


def test_labels_of_other_rows_than_the_numbers_tell_nothing() -> None:
    labels = np.array(["LEFT", "RIGHT"] * 50)
    acc = np.random.default_rng(0).normal(0.0, 1.0, (99, 3))  # a torn line was left out
    assert parts_of(labels, acc) == {}
