"""A guard over real recordings of all kinds: the default's error as a ratio to VQF's, set by set.

The bounds are what `levelhead bench accuracy` gave when they were written, and 3 % more. A recording that gets worse
than 1.2 × VQF's and is not among those that are known is named.
"""

import math
from pathlib import Path

import pytest

from levelhead.bench import Method, accuracy, contenders

# Geometric mean of the ratio, share of tilt errors beyond 4σ, and those known to be worse than 1.2 ×
SETS = {  # with magnetometers
    "broad": (0.594, 0.0, {"16_undisturbed_fast_translation_B"}),
    "repoimu": (0.776, 0.028, {"TStick_Test08_Trial2"}),
}
WITHOUT = {  # without
    "truth/tumvi": (0.51, 0.003, set()),
    "truth/euroc": (0.0343, 0.0, set()),
    "truth/openaxes": (0.88, 0.0, {"triangle200_radius"}),
    "truth/upenn": (0.296, 0.075, {"imu05"}),
}
MARGIN = 1.03
MORE_BEYOND = 0.002  # share


@pytest.mark.full
@pytest.mark.parametrize("place", [*SETS, *WITHOUT])
def test_no_data_set_gets_worse(data_dir: Path, place: str) -> None:
    if not contenders.BY_NAME["vqf.VQF"].installed:
        pytest.skip("vqf is not installed")
    if not (data_dir / place).is_dir():
        pytest.skip(f"{place} is not here")
    bound, beyond, known = (SETS | WITHOUT)[place]
    result = accuracy([data_dir / place], [Method("default"), Method("vqf.VQF")], with_mag=place in SETS, jobs=1)
    (ratios,) = result.ratios
    mean = math.exp(sum(math.log(one.value) for one in ratios.recordings) / len(ratios.recordings))
    worse = {one.recording: round(one.value, 2) for one in ratios.worse if one.recording not in known}
    assert not worse, f"worse than 1.2 × VQF: {worse}"
    surer = sum(one.figures.beyond_tilt or 0.0 for one in ratios.recordings) / len(ratios.recordings)
    assert surer < MARGIN * beyond + MORE_BEYOND, f"{surer:.4f} of the tilt errors are beyond 4σ"
    assert mean < MARGIN * bound, {one.recording: round(one.value, 2) for one in ratios.recordings}
