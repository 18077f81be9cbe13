"""Real recordings that do not serve the sensor lab: one sentence, exit code 2, and no file."""

import pytest

FAST, STILL = "broad/21_undisturbed_fast_combined.mat", "repoimu/TStick_Test01_Static.csv"

PHONE, DRONE = "truth/tyrex/Guillaume_iPhone5_NoDist_Texting.npz", "truth/euroc/V1_02_medium.npz"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "log", "words", "sentence"),
    [
        ("calibrate", FAST, (), "still in 2 poses with 1 direction of gravity; expected at least 4"),
        ("calibrate", STILL, (), "still in 1 pose with 1 direction of gravity; expected at least 4"),
        ("calibrate", PHONE, (), "still in 5 poses with 1 direction of gravity; expected at least 4"),
        ("calibrate", DRONE, (), "still in 2 poses with 1 direction of gravity; expected at least 4"),
        ("calibrate", "wild/yei_3space.txt", (), "still in 8 poses with 2 directions of gravity"),
        ("noise", PHONE, (), "still for 0 s at most in 124 s; noise needs 20 s at rest"),
        ("noise", STILL, ("--tau", "3600"), "needs 10800 s at rest; the recording was still for 181 s"),
        ("tune", FAST, ("-f", "AccelTilt"), "AccelTilt has no parameter to tune"),
        ("tune", FAST, ("-f", "Mahony", "-p", "gain"), "Mahony has no parameter 'gain'; known: kp"),
        ("sweep", FAST, ("-f", "Mahony", "-p", "gain"), "Mahony has no parameter 'gain'; known: kp"),
    ],
)
def test_a_real_log_that_does_not_serve_is_refused(refused, data_dir, tmp_path, verb, log, words, sentence):
    out = ("-o", tmp_path) if verb != "sweep" else ()
    assert sentence in refused(verb, data_dir / log, *words, *out)
    assert list(tmp_path.iterdir()) == []
