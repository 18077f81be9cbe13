"""The width that ``arrays`` and its twins in ``native`` agree on."""

WIDE = 28  # numbers of the rows that ``subtract_rows`` takes, which vector registers hold at once
