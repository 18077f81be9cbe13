"""A guard over real recordings of all kinds: the default's error as a ratio to VQF's, set by set.

The bounds are what `levelhead bench accuracy` gave when they were written, and 3 % more. A recording that gets worse
than 1.2 × VQF's and is not among those that are known is named.
"""

import math
from pathlib import Path

import pytest

from levelhead.bench import Method, accuracy, contenders

SETS = {  # with magnetometers: geometric mean of the ratio; those known to be worse than 1.2 ×
    "broad": (0.594, {"16_undisturbed_fast_translation_B"}),
    "repoimu": (0.776, {"TStick_Test08_Trial2"}),
}
WITHOUT = {  # without
    "truth/tumvi": (0.51, set()),
    "truth/euroc": (0.0343, set()),
    "truth/openaxes": (0.88, {"triangle200_radius"}),
}
MARGIN = 1.03


@pytest.mark.full
@pytest.mark.parametrize("place", [*SETS, *WITHOUT])
def test_no_data_set_gets_worse(data_dir: Path, place: str) -> None:
    if not contenders.BY_NAME["vqf.VQF"].installed:
        pytest.skip("vqf is not installed")
    if not (data_dir / place).is_dir():
        pytest.skip(f"{place} is not here")
    bound, known = (SETS | WITHOUT)[place]
    result = accuracy([data_dir / place], [Method("default"), Method("vqf.VQF")], with_mag=place in SETS, jobs=1)
    (ratios,) = result.ratios
    mean = math.exp(sum(math.log(one.value) for one in ratios.recordings) / len(ratios.recordings))
    worse = {one.recording: round(one.value, 2) for one in ratios.worse if one.recording not in known}
    assert not worse, f"worse than 1.2 × VQF: {worse}"
    assert mean < MARGIN * bound, {one.recording: round(one.value, 2) for one in ratios.recordings}
