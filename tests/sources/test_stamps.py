"""Dates and clock times in text against Python's own calendar."""

from datetime import UTC, datetime

import pytest

from levelhead.sources.formats.text.dates import NS, nanoseconds


@pytest.mark.parametrize(
    "text", ["2022-10-22 18:36:35", "22.10.2022 18:36:35", "22-Oct-2022 18:36:35", "10/22/2022 6:36:35 PM"]
)
def test_a_date_is_that_of_the_calendar(text):
    assert nanoseconds(text) == int(datetime(2022, 10, 22, 18, 36, 35, tzinfo=UTC).timestamp()) * NS


@pytest.mark.parametrize("text", ["9022-10-22 18:36:35", "1022-10-22 18:36:35"])
def test_a_year_that_64_bits_cannot_hold_is_no_stamp(text):
    with pytest.raises(ValueError, match=text):
        nanoseconds(text)
