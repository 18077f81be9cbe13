"""A guard over real recordings of all kinds: the default's error as a ratio to VQF's, set by set.

The bounds are what `levelhead bench accuracy` gave when they were written, and 3 % more. A recording that gets worse
than 1.2 × VQF's and is not among those that are known is named.
"""

from pathlib import Path
from statistics import fmean

import pytest

from levelhead.bench import Method, accuracy, contenders
from levelhead.bench.ratios import geometric_mean

# Geometric means of the ratio of the error (without magnetometers: of the drift of heading) and of tilt, shares of tilt
# and of heading errors beyond 4σ, and those known to be worse than 1.2 ×
SETS = {  # with magnetometers
    "broad": (0.599, 0.933, 0.0, 0.0, {"16_undisturbed_fast_translation_B"}),
    "repoimu": (0.660, 0.634, 0.005, 0.0, {"TStick_Test08_Trial2"}),
    "truth/fiumarg": (0.146, 0.614, 0.131, 0.0, set()),
    "truth/tyrex": (0.703, 0.522, 0.006, 0.005, {"Guillaume_Nexus5_Dist_Swinging", "Guillaume_iPhone4S_Dist_Swinging"}),
}
WITHOUT = {  # without
    "truth/tumvi": (0.518, 0.362, 0.003, 0.0, set()),
    "truth/euroc": (0.012, 0.179, 0.0, 0.0, set()),
    "truth/openaxes": (0.588, 0.674, 0.0, 0.0, {"triangle200_radius"}),
    "truth/upenn": (0.151, 0.263, 0.004, 0.001, set()),
}
# The smoother's errors beside those of VQF's offline variant, and of its tilt
SMOOTHED = {
    "broad": (0.620, 1.048),
    "repoimu": (0.585, 0.685),
    "truth/fiumarg": (0.213, 0.686),
    "truth/tyrex": (0.443, 0.458),
    "truth/tumvi": (0.767, 0.554),
    "truth/euroc": (0.010, 0.245),
    "truth/openaxes": (1.245, 1.084),
    "truth/upenn": (0.142, 0.402),
}
MARGIN = 1.03
MORE_BEYOND = 0.002  # share


def skip_unless_there(folder: Path) -> None:
    """Both need VQF and the data set."""
    if not contenders.BY_NAME["vqf.VQF"].installed:
        pytest.skip("vqf is not installed")
    if not folder.is_dir():
        pytest.skip(f"{folder.name} is not here")


@pytest.mark.full
@pytest.mark.parametrize("place", [*SETS, *WITHOUT])
def test_no_data_set_gets_worse(data_dir: Path, place: str) -> None:
    skip_unless_there(data_dir / place)
    bound, bound_tilt, beyond, beyond_heading, known = (SETS | WITHOUT)[place]
    result = accuracy([data_dir / place], [Method("default"), Method("vqf.VQF")], with_mag=place in SETS, jobs=1)
    (ratios,) = result.ratios
    mean = geometric_mean([one.value for one in ratios.recordings])
    tilt = geometric_mean([one.tilt for one in ratios.recordings])
    worse = {one.recording: round(one.value, 2) for one in ratios.worse if one.recording not in known}
    assert not worse, f"worse than 1.2 × VQF: {worse}"
    surer = fmean(one.figures.beyond_tilt or 0.0 for one in ratios.recordings)
    assert surer < MARGIN * beyond + MORE_BEYOND, f"{surer:.4f} of the tilt errors are beyond 4σ"
    surer = fmean(one.figures.beyond_heading or 0.0 for one in ratios.recordings)
    assert surer < MARGIN * beyond_heading + MORE_BEYOND, f"{surer:.4f} of the heading errors are beyond 4σ"
    assert tilt < MARGIN * bound_tilt, {one.recording: round(one.tilt, 2) for one in ratios.recordings}
    assert mean < MARGIN * bound, {one.recording: round(one.value, 2) for one in ratios.recordings}


@pytest.mark.full
@pytest.mark.parametrize("place", SMOOTHED)
def test_the_smoother_is_better_than_online(data_dir: Path, place: str) -> None:
    """On the mean of each set, and no worse beside VQF's offline variant than it was."""
    skip_unless_there(data_dir / place)
    bound, bound_tilt = SMOOTHED[place]
    methods = [Method(name) for name in ("default", "vqf.VQF", "smoother", "vqf.offlineVQF")]
    result = accuracy([data_dir / place], methods, with_mag=place in SETS, jobs=1)
    online, smoothed = result.ratios
    assert fmean(one.ours for one in smoothed.recordings) < fmean(one.ours for one in online.recordings)
    assert geometric_mean([one.value for one in smoothed.recordings]) < MARGIN * bound
    assert geometric_mean([one.tilt for one in smoothed.recordings]) < MARGIN * bound_tilt
