"""Which axis is which: all 24 ways of mounting are found, the 24 mirrored ones refused."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.sample import Sample
from levelhead.sources.sensors import AxisMap, find_axes

WORDS = [
    ",".join(sign + axis for sign, axis in zip(signs, axes, strict=True))
    for axes in itertools.permutations("xyz")
    for signs in itertools.product(("", "-"), repeat=3)
]


def lean(mount: np.ndarray, turn=(1.0, 0.0, 0.0), angle: float = 0.9, still: float = 1.5) -> lh.Recording:
    """A body that is still and then leans about ``turn``, seen by a sensor whose axes are the rows of ``mount``."""
    t = np.arange(0.0, still + 2.0, 0.01)
    s = np.clip((t - still) / 1.5, 0.0, 1.0)
    size = angle * (3.0 * s**2 - 2.0 * s**3)
    axis = np.asarray(turn) / np.linalg.norm(turn)
    body = Rotation.from_rotvec(np.outer(size, axis))
    random = np.random.default_rng(5)
    gyr = np.outer(np.gradient(size, t), axis) + 0.002 * random.standard_normal((len(t), 3)) + (0.05, -0.03, 0.02)
    acc = body.inv().apply([0.0, 0.0, 9.81]) + 0.05 * random.standard_normal((len(t), 3))
    return lh.Recording(t, gyr @ mount, acc @ mount)


def matrix(words: str) -> np.ndarray:
    rows = np.zeros((3, 3))
    for row, word in enumerate(words.split(",")):
        rows[row, "xyz".index(word[-1])] = -1.0 if word[0] == "-" else 1.0
    return rows


@pytest.mark.parametrize("words", WORDS)
def test_every_mounting_is_found_and_every_mirror_image_refused(words):
    mount = matrix(words)
    if np.linalg.det(mount) < 0.0:
        with pytest.raises(lh.LevelheadError, match="mirror image") as caught:
            AxisMap.parse(words)
        meant = str(caught.value).split("perhaps ")[1].split(" is")[0]
        assert np.linalg.det(AxisMap.parse(meant).matrix) == pytest.approx(1.0)
        return
    found = find_axes(lean(mount))
    assert str(found) == words and AxisMap.parse(words) == found
    np.testing.assert_array_equal(found.matrix, mount)
    sample = found.apply(Sample(0.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0)))
    np.testing.assert_array_equal(sample.gyr, mount @ [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(sample.mag, mount @ [7.0, 8.0, 9.0])


def mirrored() -> lh.Recording:
    rec = lean(np.eye(3))
    return lh.Recording(rec.t, rec.gyr, rec.acc * [1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    "recording, said",
    [
        (mirrored, "contradict each other"),
        (lambda: lean(np.eye(3), turn=(0.0, 0.0, 1.0)), "contradict|about the vertical"),
        (lambda: lean(np.eye(3), angle=0.2), "there is no turn"),
        (lambda: lean(np.eye(3), turn=(1.0, 1.0, 0.0)), "45° off the sensor's"),
        (lambda: lean(Rotation.from_euler("y", 35, degrees=True).as_matrix()), "axis up is 35° off"),
        (lambda: lean(np.eye(3), still=0.2), "does not begin with a still second"),
        (lambda: lean(np.eye(3))[:50], "too short"),
    ],
)
def test_what_says_nothing_is_refused(recording, said):
    with pytest.raises(lh.LevelheadError, match=said):
        find_axes(recording())


@pytest.mark.parametrize(
    "words, said", [("x,y", "each of x, y, z once"), ("x,x,z", "once"), ("a,b,c", "are none"), ("--x,y,z", "are none")]
)
def test_words_that_are_no_axes(words, said):
    with pytest.raises(lh.LevelheadError, match=said):
        AxisMap.parse(words)
