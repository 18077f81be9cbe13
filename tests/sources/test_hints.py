import pytest

from levelhead.errors import LevelheadError
from levelhead.sources import parse_counts, parse_map, parse_units
from levelhead.sources.hints import check


def test_words_of_the_command_line() -> None:
    assert parse_map(["gyr=gx,gy, gz", "t=time", "mag="]) == {"gyr": ["gx", "gy", "gz"], "t": ["time"], "mag": []}
    assert parse_map(['t="a, b"']) == {"t": ["a, b"]}
    assert parse_units(["gyr=deg/s"]) == {"gyr": "deg/s"}
    assert parse_counts(["gyr=131/deg/s", "acc=16384/g"]) == {"gyr": "131/deg/s", "acc": "16384/g"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [(["gyro=a,b,c"], "did you mean 'gyr'"), (["gyr"], "has no '='"), (["t=a", "t=b"], "given twice for t")],
)
def test_words_that_are_wrong(words: list[str], sentence: str) -> None:
    with pytest.raises(LevelheadError, match=sentence):
        parse_map(words)


def test_counts_have_a_divisor() -> None:
    scale = check(None, None, {"gyr": "131/deg/s"}, None).scale["gyr"]
    assert (scale.divisor, scale.factor) == (131.0, pytest.approx(0.017453292519943295))


@pytest.mark.parametrize(
    ("hints", "sentence"),
    [
        ({"map": {"gyr": ["a", "b"]}}, "map gives 2 columns for gyr"),
        ({"units": {"gyr": "deg/sek"}}, "did you mean 'deg/se?c?'"),
        ({"units": {"q": "deg"}}, "units names 'q'"),
        ({"counts": {"gyr": "deg/s"}}, "is not counts per unit"),
        ({"counts": {"gyr": "131"}}, "is not counts per unit"),
        ({"counts": {"gyr": "0/deg/s"}}, "is not counts per unit"),
        ({"counts": {"gyr": "131/dag/s"}}, "'dag/s' is not a unit"),
        ({"counts": {"acc": "1/g"}, "units": {"acc": "g"}}, "both units and counts"),
        ({"rate": 0.0}, "rate is 0.0"),
        ({"rate": float("nan")}, "rate is nan"),
    ],
)
def test_hints_that_are_wrong(hints: dict, sentence: str) -> None:
    with pytest.raises(LevelheadError, match=sentence):
        check(**({"map": None, "units": None, "counts": None, "rate": None} | hints))
