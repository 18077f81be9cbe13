"""``levelhead export``: what it writes, and what it refuses."""

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from levelhead import filters, fuse, read, simulate
from levelhead.evaluate import evaluate

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, REFERENCE = DOCS / "howto" / "export.md", DOCS / "reference" / "exported-c.md"
GCC = pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("gcc") is None, reason="no cmake and gcc here")


@pytest.mark.slow
def test_files(levelhead, tmp_path):
    said = levelhead("export", "EKF", "--set", "acc_tau=3", "--float", "-o", tmp_path / "out", "--json")
    assert said.code == 0 and said.json["params"]["acc_tau"] == 3.0
    names = {"lh_ekf.h", "lh_ekf.c", "lh_ekf_selftest.c", "CMakeLists.txt", "lh_ekf_mpu6050/lh_ekf_mpu6050.ino"}
    folder = tmp_path / "out"
    assert {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} == names
    assert sorted(said.json["written"]) == sorted(str(folder / name) for name in names)
    header = (folder / "lh_ekf.h").read_text(encoding="utf-8")
    assert "`levelhead export EKF --set acc_tau=3 --float`" in header and 'extern "C"' in header
    assert "float acc_tau; /* s: low-pass of specific force in the earth frame (at least 0) */" in header
    assert "filter.acc_tau = 3.0f; /* set */" in (folder / "lh_ekf.c").read_text(encoding="utf-8")


def test_a_library_for_the_arduino_ide(levelhead, tmp_path):
    assert levelhead("export", "kalman", "--axis", "--arduino", "-o", tmp_path).code == 0
    library = tmp_path / "lh_kalman_axis"
    properties = dict(line.split("=", 1) for line in (library / "library.properties").read_text().splitlines())
    assert properties["name"] == "lh_kalman_axis" and properties["includes"] == "LhKalmanAxis.h"
    sources = {"lh_kalman_axis.h", "lh_kalman_axis.c", "LhKalmanAxis.h"}
    assert {path.name for path in (library / "src").iterdir()} == sources
    sketch = (library / "examples" / "mpu6050" / "mpu6050.ino").read_text(encoding="utf-8")
    assert "#include <lh_kalman_axis.h>" in sketch
    simple = (library / "examples" / "simple" / "simple.ino").read_text(encoding="utf-8")
    assert "#include <LhKalmanAxis.h>" in simple


@pytest.mark.compiled
@GCC
@pytest.mark.parametrize("words", [[], ["--arduino"]], ids=["folder", "library"])
def test_cmake_builds_it_and_its_test_passes(levelhead, tmp_path, words):
    assert levelhead("export", "Triad", "--guard", "off", *words, "-o", tmp_path).code == 0
    source = tmp_path / "lh_triad" if words else tmp_path
    for command in (["cmake", "-S", source, "-B", tmp_path / "build"], ["cmake", "--build", tmp_path / "build"]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0 and "warning" not in done.stdout + done.stderr, done.stdout + done.stderr
    assert subprocess.run(["ctest"], cwd=tmp_path / "build", check=False, capture_output=True).returncode == 0


@pytest.mark.compiled
@GCC
def test_filters_in_one_folder_are_one_project(levelhead, tmp_path):
    """Whichever was exported last: both are built, with the self-test of each."""
    for words in (["Triad"], ["Complementary", "--float"], ["Kalman", "--axis"]):
        assert levelhead("export", *words, "-o", tmp_path / "board").code == 0
    for command in (["cmake", "-S", tmp_path / "board", "-B", tmp_path], ["cmake", "--build", tmp_path]):
        assert subprocess.run(command, capture_output=True, check=False).returncode == 0
    done = subprocess.run(["ctest"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    passed = set(re.findall(r"(lh_\w+) \.+ +Passed", done.stdout))
    assert passed == {"lh_triad_selftest", "lh_complementary_selftest", "lh_kalman_axis_selftest"}


@pytest.mark.full
@pytest.mark.skipif(
    not all(map(shutil.which, ("arm-none-eabi-gcc", "qemu-system-arm"))), reason="no arm-none-eabi-gcc and QEMU here"
)
@pytest.mark.parametrize("double", [False, True], ids=["float", "double"])
def test_qemu_as_the_page_types_it(levelhead, tmp_path, monkeypatch, double):
    monkeypatch.chdir(tmp_path)
    page = REFERENCE.read_text(encoding="utf-8")
    Path("benchmarks").symlink_to(DOCS.parent / "benchmarks")
    (block,) = (one for one in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) if "qemu" in one)
    first, _, rest = block.partition("\n")
    if double:
        first = first.replace(" --float", "")
        rest = re.sub(r"-mcpu=.* -mfpu=\S+", re.search(r"use\s+`(-mcpu=\S+ -mthumb)`", page)[1], rest)
    assert levelhead(*shlex.split(first)[1:]).code == 0
    done = subprocess.run(["sh", "-e", "-c", rest], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0 and done.stdout.startswith("lh_ekf: all 96 samples are right"), (
        done.stdout + done.stderr
    )


@pytest.mark.compiled
def test_what_a_sweep_found_goes_to_the_board(levelhead, tmp_path):
    swept = levelhead(
        "sweep", "--simulate", "hand", "-f", "Madgwick", "-p", "beta", "--values", "0.03", "0.3", "--json"
    )
    (tmp_path / "tuned.json").write_text(swept.out, encoding="utf-8")
    said = levelhead("export", "Madgwick", "--params", tmp_path / "tuned.json", "-o", tmp_path, "--json")
    assert said.json["params"]["beta"] == swept.json["minimum"]["value"]
    given = {"filter": "Madgwick", "params": {"beta": 0.2}, "guard": {"rest_time": 3.0}}
    (tmp_path / "tuned.json").write_text(json.dumps(given), encoding="utf-8")
    said = levelhead(
        "export", "Madgwick", "--params", tmp_path / "tuned.json", "--set", "zeta=0.01", "-o", tmp_path, "--json"
    )
    assert said.json["params"] == {"beta": 0.2, "zeta": 0.01}
    assert "guard.rest_time = 3.0; /* set */" in (tmp_path / "lh_madgwick.c").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "words, said",
    [
        (["Kalmann"], "there is no filter 'Kalmann'; did you mean 'Kalman'?"),
        (["Kalman", "--set", "r_mesure=1"], "Kalman has no parameter 'r_mesure'; did you mean 'r_measure'?"),
        (["Kalman", "--set", "r_measure=0"], "r_measure = 0 is not allowed; it must be greater than 0"),
        (["Kalman", "--set", "r_measure=nan"], "r_measure = nan is not allowed"),
        (
            ["EKF", "--set", "gate=1e60", "--float"],
            "gate: 1e+60 is out of the range of single precision; export --double",
        ),
        (["EKF", "--float", "--double"], "--float and --double contradict each other; give one of them"),
        (["EKF", "--axis"], "EKF needs an IMU; on one level and its rate work Complementary, Kalman, BiasRateKalman"),
        (["EKF", "--guard", "rest_tim=1"], "Guard has no parameter 'rest_tim'; did you mean 'rest_time'?"),
        (["EKF", "--params", "nowhere.json"], "cannot read the file of parameters nowhere.json"),
        (["EKF", "--prior", "nowhere.json"], "--prior needs a filter that learns its sensor, which EKF does not"),
        (["ESKF", "--prior", "nowhere.json"], "cannot read the calibration nowhere.json: No such file"),
        (["EKF", "--calibration", "nowhere.json"], "cannot read the calibration nowhere.json: No such file"),
        (["EKF", "--axes", "x,y,-z"], "axes 'x,y,-z' are a mirror image: no way of mounting a sensor does that"),
        (["EKF", "--axes", "-y,x"], "axes '-y,x' do not name each of x, y, z once"),
        (["Kalman", "--axis", "--axes", "-y,x,z"], "one level and its rate have no three axes"),
        (["Kalman", "--axis", "--frame", "ned"], "one level and its rate have no earth frame: leave the frame out"),
    ],
)
def test_refused(refused, tmp_path, words, said):
    assert said in refused("export", *words, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_what_a_run_learned_goes_to_the_board(levelhead, refused, tmp_path):
    """The file of `fuse --save-calibration`: a prior for the filter that learned it, a calibration for others."""
    recording = simulate.recording("ICM-20948", "hand", duration=8.0)
    fuse(recording, filters.ESKF()).calibration.save(tmp_path / "sensor.json")
    words = ["--axes", "-y,x,z", "-o", tmp_path]
    assert levelhead("export", "ESKF", "--prior", tmp_path / "sensor.json", *words).code == 0
    assert levelhead("export", "EKF", "--calibration", tmp_path / "sensor.json", *words).code == 0
    for name, option in (("eskf", "--prior"), ("ekf", "--calibration")):
        header = (tmp_path / f"lh_{name}.h").read_text(encoding="utf-8")
        assert f"`levelhead export {name.upper()} {option} sensor.json --axes -y,x,z --double`" in header
        assert "are the sensor's -y, x, z." in header and "gyroscope bias x " in header and "mag µT" in header
    both = ["--prior", tmp_path / "sensor.json", "--calibration", tmp_path / "sensor.json"]
    assert "would take the same errors off twice" in refused("export", "ESKF", *both, "-o", tmp_path / "out")
    (tmp_path / "wrong.json").write_text("{}", encoding="utf-8")
    for option in ("--prior", "--calibration"):
        words = ["export", "ESKF", option, tmp_path / "wrong.json", "-o", tmp_path / "out"]
        assert "wrong.json is not a calibration" in refused(*words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "text, said",
    [
        ("{", "is not a file of parameters"),
        ("[1]", 'is not a file of parameters; expected {"filter": "EKF", "params": {…}}'),
        ('{"filter": "Kalman", "params": {}}', "holds parameters of Kalman, not of EKF"),
        ('{"params": {"gain": 1}}', "EKF has no parameter 'gain'"),
        ('{"params": {}, "guard": 3}', "guard is 3, but it must hold thresholds by name"),
        ('{"params": {"gate": "high"}}', "gate is 'high', but it must be a number"),
    ],
)
def test_a_wrong_file_of_parameters(refused, tmp_path, text, said):
    path = tmp_path / "tuned.json"
    path.write_text(text, encoding="utf-8")
    assert said in refused("export", "EKF", "--params", path, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_folder_that_cannot_be_made_or_written(refused, tmp_path):
    (tmp_path / "file").touch()
    assert "cannot make the folder" in refused("export", "EKF", "-o", tmp_path / "file" / "out")
    (tmp_path / "out" / "lh_ekf.h").mkdir(parents=True)
    assert "lh_ekf.h: it is a folder" in refused("export", "EKF", "-o", tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["lh_ekf.h"]


@pytest.mark.slow
def test_every_filter_is_exported_under_its_own_name(levelhead, tmp_path):
    for flt in filters.ALL:
        assert levelhead("export", flt.name, "-o", tmp_path).code == 0
    assert len(list(tmp_path.glob("lh_*_selftest.c"))) == len(filters.ALL)


@pytest.mark.compiled
def test_the_page_works_as_written(levelhead, tmp_path, monkeypatch):
    """From a log to a library: the commands of docs/howto/export.md, one after the other."""
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    lines = [line.strip() for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) for line in block.splitlines()]
    commands = [shlex.split(line) for line in lines if line.startswith("levelhead ")]
    verbs = [command[1] for command in commands]
    steps = ["simulate", "sweep", "export", "fuse", "compare"]  # the log of the last two comes from a board
    assert verbs == [*steps, "export", "fuse", "export", "export"]

    def run(command):
        target = command[command.index(">") + 1] if ">" in command else None
        words = command[1 : command.index(">")] if target else command[1:]
        said = levelhead(*(word.replace("~/Arduino/libraries", "libraries") for word in words))
        assert said.code == 0, said.err
        if target:
            Path(target).write_text(said.out, encoding="utf-8")

    for command in commands[:3]:
        run(command)
    swept = json.loads(Path("tuned.json").read_text(encoding="utf-8"))
    best, low, high = swept["minimum"], swept["flat"]["low"], swept["flat"]["high"]
    words = (
        f"`kp={best['value']:g}` with an error of {best['error_deg']:.2f}° RMS; from {low:.2g} to {high:.2g} the error"
    )
    assert words in page.replace("\n   ", " ") and best["edge"] is None
    recording = read("motion.csv")
    untuned = evaluate(recording, fuse(recording, filters.Mahony())).total
    assert f"The default of `Mahony` has {untuned:.2f}°" in page.replace("\n   ", " ")
    library = tmp_path / "libraries" / "lh_mahony"
    source = (library / "src" / "lh_mahony.c").read_text(encoding="utf-8")
    found = re.search(r"filter\.kp = ([^f]+)f; /\* set \*/", source)
    assert found and float(found[1]) == pytest.approx(best["value"], rel=1e-6)
    assert (library / "examples" / "mpu6050" / "mpu6050.ino").exists()
    for command in commands[5:]:
        run(command)
    assert "--lean" in (library / "src" / "lh_mahony.c").read_text(encoding="utf-8")
    corrected = (tmp_path / "board" / "lh_mahony.c").read_text(encoding="utf-8")
    bias = json.loads(Path("sensor.json").read_text(encoding="utf-8"))["gyr_bias"]["value"]
    assert re.findall(r"errors\.gyr_bias\.[xyz] = (.*);", corrected) == [str(value) for value in bias]
    assert "} prior[] = {" in (tmp_path / "board" / "lh_eskf.c").read_text(encoding="utf-8")
