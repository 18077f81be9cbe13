"""Parameters explain themselves and refuse nonsense in a sentence."""

import math

import pytest

import levelhead as lh
from levelhead import filters
from levelhead.filters.kalman import Kalman
from levelhead.filters.parameters import param_table, settable


@pytest.mark.parametrize("flt", filters.ALL, ids=lambda f: f.name)
def test_every_filter_says_what_it_is(flt):
    table = param_table(flt.params)
    assert tuple(table) == flt.params._fields
    for name, value in flt.params()._asdict().items():
        param = table[name]
        assert param.doc
        assert isinstance(value, bool) or (param.allows(value) and param.sweep is not None)
    assert flt.params.__doc__ and any(c.isdigit() for c in flt.citation)
    assert flt.name == flt.params.__name__


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: lh.Kalman(r_measure=0), "r_measure = 0 is not allowed; it must be greater than 0 deg²"),
        (lambda: lh.Kalman(r_measure=-1.0), "r_measure = -1 is not allowed"),
        (lambda: lh.Kalman(r_mesure=1.0), "no parameter 'r_mesure'; did you mean 'r_measure'?"),
        (lambda: lh.Kalman(r_measure=math.nan), "r_measure = nan is not allowed"),
        (lambda: lh.Kalman(r_measure="much"), "r_measure is 'much', but it must be a number"),
        (lambda: lh.Kalman(r_measure="0.1"), "r_measure is '0.1', but it must be a number"),
        (lambda: lh.Kalman(r_measure=True), "r_measure is True, but it must be a number"),
        (lambda: lh.Kalman(r_measure=10**400), "r_measure = inf is not allowed"),
        (lambda: lh.Kalman(joseph=2), "joseph is 2, but it must be True or False"),
        (lambda: lh.Complementary(alpha=1.0), "alpha = 1 is not allowed; it must be at least 0 and below 1"),
        (lambda: lh.Complementary(alpha=-0.1), "alpha = -0.1 is not allowed"),
        (lambda: lh.Complementary(alpha=0.9, tau=1.0), "give alpha or tau, not both"),
        (lambda: lh.Complementary(dt=0.01), "dt only goes with alpha"),
        (lambda: lh.Complementary(alpha=0.9, dt=0.0), "dt = 0 is not allowed"),
        (lambda: lh.Complementary(0.1, tau=0.2), "tau is given twice"),
        (lambda: lh.AccelTilt(1.0), "AccelTilt has 0 parameters, 1 were given"),
        (lambda: filters.find("madgwik"), "there is no filter 'madgwik'"),
        (lambda: filters.find("kalmn"), "did you mean 'Kalman'?"),
        (lambda: filters.resolve(3), "3 chooses no filter"),
    ],
)
def test_nonsense_is_refused_in_a_sentence(make, words):
    with pytest.raises(lh.LevelheadError) as caught:
        make()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_alpha_and_tau_are_one_thing():
    assert lh.Complementary(alpha=0.98).tau == pytest.approx(0.49)
    assert lh.Complementary(alpha=0.98, dt=0.005).tau == pytest.approx(0.245)
    assert lh.Complementary(tau=0.49).alpha == pytest.approx(0.98)
    assert lh.Complementary()._replace(alpha=0.9).alpha == pytest.approx(0.9)
    assert "alpha" in settable(lh.Complementary) and "alpha" not in param_table(lh.Complementary)


def test_parameters_are_plain_data():
    params = lh.Kalman(r_measure=4)
    assert params == Kalman(r_measure=4.0) and isinstance(params.r_measure, float)
    assert repr(params) == "Kalman(r_measure=4)"
    assert params._replace(q_angle=0.5) == lh.Kalman(r_measure=4, q_angle=0.5)
    assert filters.resolve("kalman") == filters.resolve(lh.Kalman) == lh.Kalman()
    with pytest.raises(lh.LevelheadError):
        params._replace(r_measure=0.0)


def test_the_lesson_numbers_are_the_defaults():
    params = lh.Kalman()
    assert (params.q_angle, params.q_bias, params.r_measure) == (0.001, 0.003, 0.03)
    assert lh.Complementary().alpha == pytest.approx(0.98)
    assert lh.Complementary().alpha_max == 0.999 and lh.Complementary().alpha_slope == 0.005


def test_a_title_has_the_parameters_that_somebody_chose():
    assert filters.title(lh.ESKF()) == "ESKF"
    assert filters.title(lh.Mahony(kp=0.5)) == "Mahony(kp=0.5)"
    assert filters.title(filters.offline()) == "ESKF, offline"
    assert filters.title(filters.offline()._replace(velocity_density=1.0)).startswith("ESKF(gyr_noise=")
