"""A guard over real recordings of all kinds: the default's error as a ratio to VQF's, set by set.

The bounds are what `levelhead bench accuracy` gave when they were written, and 3 % more. A recording that gets worse
than 1.2 × VQF's and is not among those that are known is named.
"""

from pathlib import Path
from statistics import fmean

import pytest

import levelhead as lh
from levelhead.bench import Method, accuracy, contenders
from levelhead.bench.datasets import load_recording
from levelhead.bench.error_figures import measure_errors
from levelhead.bench.ratios import geometric_mean
from levelhead.bench.reference import align_sensor

# Geometric means of the ratio of the error (without magnetometers: of the drift of heading) and of tilt, shares of tilt
# and of heading errors beyond 4σ, and those known to be worse than 1.2 ×
# Since north is a property of the field, heading is that of the gyroscope and a raw magnetometer costs little; a clean
# one gives less (BROAD 0.599 before), and RepoIMU's tilt (0.634), phones' recordings and the smoother (BROAD 0.620,
# RepoIMU 0.585, FIUMARG 0.213) got worse. The limb, the rig and the phone in a hand got better
# (docs/explanation/benchmarks.md).
# Since a block's mean velocity is measured and an even field is believed more, BROAD (smoothed too) and RepoIMU are
# better; phones, and the smoother on TUM-VI (0.764 before) and OpenAXES (1.245), are worse.
# Since a field corrects heading as far as its offset is known (eq. 19), a phone that swings is at 1.30, within σ, and
# the one that runs in a pocket at 1.07.
# Since a gyroscope's prior widens at 3.5 σ in the first 20 s, a phone in a back pocket that starts in motion with 5 °/s
# is at 1.49.
SETS = {  # with magnetometers
    "broad": (0.628, 0.913, 0.0, 0.0, set()),
    "repoimu": (0.555, 0.684, 0.006, 0.001, {"TStick_Test08_Trial2"}),
    "truth/fiumarg": (0.174, 0.616, 0.144, 0.072, set()),
    "truth/tyrex": (
        0.633, 0.538, 0.008, 0.018,
        {
            "Guillaume_Nexus5_Dist_FrontPocket", "Guillaume_Nexus5_Dist_BackPocket", "Guillaume_iPhone4S_Dist_Swinging",
            "Guillaume_iPhone4S_Dist_FrontPocket", "Guillaume_iPhone5_Dist_BackPocket",
            "Guillaume_Nexus5_NoDist_Swinging", "Guillaume_iPhone4S_NoDist_Phoning",
        },
    ),
    "truth/diodem": (0.0725, 0.295, 0.001, 0.0, set()),
    "truth/expsimon": (0.431, 0.922, 0.005, 0.0, set()),
    "truth/x3mate": (0.079, 0.835, 0.003, 0.001, set()),
}  # fmt: skip
WITHOUT = {  # without
    "truth/tumvi": (0.516, 0.357, 0.004, 0.0, set()),
    "truth/euroc": (0.012, 0.178, 0.0, 0.0, set()),
    "truth/openaxes": (0.610, 0.651, 0.0, 0.0, {"triangle200_radius"}),
    "truth/upenn": (0.139, 0.253, 0.003, 0.0, set()),
}
# The smoother's errors beside those of VQF's offline variant, and of its tilt
SMOOTHED = {
    "broad": (0.685, 1.012),
    "repoimu": (0.655, 0.775),
    "truth/fiumarg": (0.392, 1.006),
    "truth/tyrex": (0.447, 0.470),
    "truth/tumvi": (0.895, 0.538),
    "truth/euroc": (0.009, 0.242),
    "truth/openaxes": (1.290, 1.063),
    "truth/upenn": (0.146, 0.388),
}
NOT_BETTER = {"truth/fiumarg": 1.17, "truth/upenn": 1.05}  # the smoother's mean error beside the online filter's
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
    most = NOT_BETTER.get(place, 1.0) * fmean(one.ours for one in online.recordings)
    assert fmean(one.ours for one in smoothed.recordings) < most
    assert geometric_mean([one.value for one in smoothed.recordings]) < MARGIN * bound
    assert geometric_mean([one.tilt for one in smoothed.recordings]) < MARGIN * bound_tilt


@pytest.mark.full
@pytest.mark.parametrize("with_mag", [True, False])
def test_lost_samples_do_not_unsettle_mahony(data_dir: Path, with_mag: bool) -> None:
    """FIUMARG's logs have 72 intervals of more than twice the usual one. Mahony's error was 18.5° there at one time."""
    place = data_dir / "truth/fiumarg"
    if not place.is_dir():
        pytest.skip(f"{place.name} is not here")
    result = accuracy([place], [Method("Mahony", lh.Mahony())], with_mag=with_mag, jobs=1)
    errors = [outcome.figures.rotated for outcome in result.outcomes.values() if outcome.figures is not None]
    assert len(errors) == 2
    assert max(errors) < (8.0 if with_mag else 6.0)


@pytest.mark.full
def test_a_start_in_a_run_is_told_by_sigma(data_dir: Path) -> None:
    """A phone of ± 2 g in a runner's hand, clipped at each step: 68 % of its tilt errors were beyond 4σ at one time."""
    path = data_dir / "truth/tyrex/Guillaume_Nexus5_NoDist_RunningHand.npz"
    if not path.exists():
        pytest.skip("no truth/tyrex here")
    whole = load_recording(path, False)
    recording = whole[round(0.6 * len(whole)) :]
    track = lh.fuse(recording)
    figures = measure_errors(recording, track.quat, False, track.sigma, align_sensor(recording))
    assert figures.beyond_tilt is not None and figures.beyond_tilt < 0.03
