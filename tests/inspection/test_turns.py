"""Wrong scale, wiring, mounting, lateness, iron and filters are found with their number, and nothing else is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import levelhead as lh
from levelhead.inspection import examine
from levelhead.inspection.agreement import BEYOND, Agreement, Hypothesis, _searched, agree
from levelhead.inspection.findings import Finding
from levelhead.inspection.repair import repair
from levelhead.inspection.turns import examine_turns
from levelhead.recording import Array, Recording
from levelhead.signals.turn_matrix import (
    ALL_NINE,
    IDENTITY,
    NONE,
    SHAPES,
    WIRINGS,
    _evaluate,
    _normal,
    cut,
    fit,
    integrate_rotation,
    predict_left,
    screen,
)
from levelhead.sources.formats.npz import load_arrays

FIELD = np.array([0.0, 18.0, -45.0])  # µT


def made(seed: int = 0, seconds: float = 120.0, rate: float = 50.0) -> Recording:
    """A sensor that turns smoothly about all axes, moved to and fro by a hand: closed forms, no simulator of ours."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    waves = [(rng.uniform(0.1, 0.6, 3), rng.uniform(0.0, 6.0, 3), rng.uniform(0.3, 0.6, 3)) for _ in range(4)]
    omega = sum(size * np.sin(2.0 * np.pi * f * t[:, None] + phase) for f, phase, size in waves)
    steps = Rotation.from_rotvec(omega / rate)
    turns = [Rotation.identity()]
    for i in range(len(t) - 1):
        turns.append(turns[-1] * steps[i])
    attitude = Rotation.concatenate(turns)
    moved = np.stack([0.6 * np.sin(2.0 * np.pi * f * t + p) for f, p in ((1.1, 0.0), (1.7, 1.0), (0.9, 2.0))], axis=1)
    back = (attitude * Rotation.from_rotvec(0.5 * omega / rate)).inv()
    acc = back.apply(moved + [0.0, 0.0, 9.80665]) + rng.normal(0.0, 0.02, omega.shape)
    mag = back.apply(FIELD) + rng.normal(0.0, 0.3, omega.shape)
    return Recording(t, omega + rng.normal(0.0, 2e-3, omega.shape), acc, mag)


@pytest.fixture(scope="module")
def clean() -> Recording:
    return made()


def changed(recording: Recording, **parts: object) -> Recording:
    kept = {name: getattr(recording, name) for name in ("t", "gyr", "acc", "mag")}
    return Recording(**(kept | parts))  # type: ignore[arg-type]


def findings(recording: Recording) -> dict[str, Finding]:
    return {one.name: one for one in examine_turns(recording) if isinstance(one, Finding)}


def test_rotations_are_those_of_scipy() -> None:
    rate = np.random.default_rng(0).normal(size=(37, 2, 3))
    turned, at = integrate_rotation(rate.transpose(2, 0, 1), np.full((37, 2), 0.05)), Rotation.identity()
    for k in range(37):
        bent = 0.05 / 24.0 * (rate[k + 1, 1] - rate[k - 1, 1]) if 0 < k < 36 else 0.0
        middle = at * Rotation.from_rotvec(0.025 * rate[k, 1] - bent)
        assert np.allclose(middle.as_matrix(), turned[..., k, 1], atol=1e-12)
        at = at * Rotation.from_rotvec(0.05 * rate[k, 1])


def test_the_matrix_and_its_covariance_are_those_put_in() -> None:
    wanted = np.array([[1.1, 0.05, 0.0], [-0.03, 0.9, 0.1], [0.02, 0.0, 1.2]])
    scores = []
    for seed in range(6):
        recording = made(seed)
        seg = cut(recording.t, recording.gyr @ np.linalg.inv(wanted).T, recording.acc, True)
        assert seg is not None
        found = fit(seg, np.eye(3), ALL_NINE)
        scores.append((found.matrix - wanted).ravel() / np.sqrt(np.diag(found.covariance)))
        assert np.abs(found.matrix - wanted).max() < 0.02
    assert 0.4 < np.sqrt(np.mean(np.square(scores))) < 2.0


@pytest.mark.parametrize("role", ["acc", "mag"])
def test_the_gradient_is_that_of_finite_differences(clean: Recording, role: str) -> None:
    """Also far from the minimum: with iron of several fields, soft iron, a long arm and a delay."""
    seg = cut(clean.t, clean.gyr, getattr(clean, role), role == "acc")
    assert seg is not None
    rng = np.random.default_rng(0)
    more = [0.9, -0.7, 1.1, 0.02] if role == "acc" else [150.0, -90.0, 60.0, 0.01, *(0.1 * rng.normal(size=5))]
    x = np.concatenate([np.eye(3).ravel() + 0.05 * rng.normal(size=9), 0.05 * rng.normal(size=3), more])

    def half_cost(x: Array) -> float:
        return 0.5 * float(_evaluate(seg, x[:9].reshape(3, 3), x[9:12], x[12:]).cost.mean())

    gradient = _normal(seg, _evaluate(seg, x[:9].reshape(3, 3), x[9:12], x[12:]), ALL_NINE)[0].mean(axis=0)
    steps = 1e-5 * np.maximum(1.0, np.abs(x)) * np.eye(len(x))
    differences = [(half_cost(x + step) - half_cost(x - step)) / (2.0 * step.sum()) for step in steps]
    error = np.abs(gradient - differences)
    assert error.max() < 0.02 * np.abs(gradient[:12]).max(), "rotation to the middle of a sample is half of its φ"
    assert error[12:].max() < 1e-6 * np.abs(gradient).max()


@pytest.mark.parametrize("role", ["acc", "mag"])
def test_one_step_predicts_the_rest_of_a_whole_fit(clean: Recording, role: str) -> None:
    """The prediction is near the rest of all steps, on the way from the readings. Another wiring leaves far more."""
    bias = np.radians([2.0, -1.0, 1.5])
    seg = cut(clean.t, clean.gyr + bias, getattr(clean, role), role == "acc")
    assert seg is not None
    more = np.zeros(4 if role == "acc" else 4 + len(SHAPES))
    whole, as_read = fit(seg, IDENTITY, NONE).left, np.sqrt(_evaluate(seg, IDENTITY, 0.0 * bias, more).cost.mean())
    assert whole < 0.5 * as_read
    assert 0.9 * whole < predict_left(seg, IDENTITY) < whole + 0.1 * (as_read - whole)
    assert predict_left(seg, IDENTITY[[1, 0, 2]]) > 3.0 * whole


def test_iron_of_several_fields_hides_nothing(clean: Recording) -> None:
    """The fit leaves the noise alone, and the bias is right; without the iron in eq. 2 a fit leaves 5 µT."""
    assert clean.mag is not None
    iron, bias = np.array([87.0, -73.0, 90.0]), np.radians([-3.0, 4.0, 2.0])
    seg = cut(clean.t, clean.gyr + bias, clean.mag + iron, False)
    assert seg is not None
    found = fit(seg, np.eye(3), ALL_NINE)
    assert found.left < 0.3 and np.abs(found.iron - iron).max() < 0.5
    assert np.abs(found.bias + bias).max() < np.radians(0.1)


def test_screening_finds_the_wiring(clean: Recording) -> None:
    for wiring in WIRINGS[::5]:
        seg = cut(clean.t, clean.gyr @ wiring, clean.acc, True)
        assert seg is not None
        best = screen(seg)[0][1]
        assert np.allclose(best / np.abs(best).max(), wiring)


def test_a_clean_recording_has_no_finding(clean: Recording) -> None:
    assert findings(clean) == {}


@pytest.mark.parametrize("factor", [2.0, 0.5, 1.147, 1.1, 57.3])
def test_scale(clean: Recording, factor: float) -> None:
    one = findings(changed(clean, gyr=factor * clean.gyr))["gyro_scale"]
    assert one.value == pytest.approx(factor, rel=0.03) and one.interval is not None
    assert one.interval[0] < factor < one.interval[1]
    assert ("unit" in one.what) == (factor > 50)


def test_a_clock_that_runs_twice_as_fast_is_a_candidate(clean: Recording) -> None:
    one = findings(changed(clean, t=0.5 * clean.t))["gyro_scale"]
    assert "the clock is wrong, 100 Hz for 50" in one.what and one.value == pytest.approx(0.5, rel=0.03)


@pytest.mark.parametrize("role", ["gyr", "acc", "mag"])
@pytest.mark.parametrize("axes", [[[-1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 0], [1, 0, 0], [0, 0, 1]]])
def test_wiring_of_each_sensor(clean: Recording, role: str, axes: list[list[int]]) -> None:
    wiring = np.array(axes, dtype=float)
    found = findings(changed(clean, **{role: getattr(clean, role) @ wiring.T}))
    one = found["mag_axes" if role == "mag" else "axes_order"]
    assert one.mend is not None and one.mend.role == role and np.allclose(one.mend.matrix, wiring.T)


def test_without_a_field_a_force_reversed_is_told_from_a_mirrored_gyroscope(clean: Recording) -> None:
    """One reversed axis of the gyroscope mirrors, one of the accelerometer does not: det(A) A is a rotation."""
    bare = changed(clean, mag=None)
    for role in ("gyr", "acc"):
        one = findings(changed(bare, **{role: getattr(clean, role) * [1.0, 1.0, -1.0]}))["axes_order"]
        assert "z reversed" in one.what and ("gyroscope z" if role == "gyr" else "accelerometer z") in one.what


def test_fast_turns_are_no_smaller_at_half_the_rate() -> None:
    """Means over a step of rate and field, of a turn to and fro at 3 Hz: closed form; M is 1."""
    t = np.arange(0.0, 60.0, 1e-3)
    angle = np.stack([0.8 * np.sin(2.0 * np.pi * 3.0 * t), np.zeros_like(t), np.zeros_like(t)], axis=1)
    rate = 2.0 * np.pi * 3.0 * 0.8 * np.cos(2.0 * np.pi * 3.0 * t)
    field = Rotation.from_rotvec(angle).inv().apply(FIELD)
    every = 20
    mean_rate, mean_field = (
        one.reshape(-1, every, one.shape[1]).mean(axis=1) for one in (np.outer(rate, [1, 0, 0]), field)
    )
    seg = cut(t[::every], mean_rate, mean_field, False)
    assert seg is not None
    found = fit(seg, np.eye(3), np.eye(3)[None])
    assert found.matrix[0, 0] == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("degrees", [8.0, 25.0])
def test_mounting(clean: Recording, degrees: float) -> None:
    askew = Rotation.from_euler("x", degrees, degrees=True)
    one = findings(changed(clean, acc=askew.apply(np.array(clean.acc))))["mounting"]
    assert one.value == pytest.approx(degrees, abs=1.5) and "accelerometer" in one.what


def late(recording: Recording, values: Array, delay: float) -> Array:
    return np.stack([np.interp(recording.t - delay, recording.t, axis) for axis in values.T], axis=1)


@pytest.mark.parametrize("delay", [0.012, 0.04, 0.1])
def test_a_late_magnetometer(clean: Recording, delay: float) -> None:
    assert clean.mag is not None
    one = findings(changed(clean, mag=late(clean, clean.mag, delay)))["mag_delay"]
    assert one.value == pytest.approx(1e3 * delay, abs=3.0)


@pytest.mark.parametrize("share", [0.1, 0.3, 3.0])
def test_iron(clean: Recording, share: float) -> None:
    assert clean.mag is not None
    iron = share * np.linalg.norm(FIELD) * np.array([0.6, 0.0, 0.8])
    one = findings(changed(clean, mag=clean.mag + iron))["mag_offset"]
    assert one.value == pytest.approx(100.0 * share, rel=0.1)
    assert one.mend is not None and np.allclose(one.mend.offset, iron, atol=2.0)


def test_a_force_behind_a_filter(clean: Recording) -> None:
    acc, share = np.array(clean.acc), 1.0 - np.exp(-2.0 * np.pi * 0.5 / 50.0)
    for i in range(1, len(acc)):
        acc[i] = acc[i - 1] + share * (acc[i] - acc[i - 1])
    one = findings(changed(clean, acc=acc))["acc_low_passed"]
    assert one.value == pytest.approx(0.5, rel=0.2)


def test_a_bias_that_jumps(clean: Recording) -> None:
    gyr = np.array(clean.gyr)
    gyr[len(gyr) // 2 :, 1] += np.radians(3.0)
    one = findings(changed(clean, gyr=gyr))["bias_jumps"]
    assert one.value == pytest.approx(3.0, abs=0.3) and "jumps by +" in one.what and "(y)" in one.what


def test_a_motion_that_tells_nothing_is_not_judged() -> None:
    """A drone's force stays along its body, however it tilts: a gyroscope of half its scale fits better, and is not."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 60.0, 0.01)
    roll = 0.3 * np.sin(2.0 * np.pi * 0.2 * t)
    gyr = np.stack([np.gradient(roll, t), 0.0 * t, 0.0 * t], axis=1) + rng.normal(0.0, 1e-3, (len(t), 3))
    acc = np.stack([0.0 * t, 0.0 * t, 9.80665 / np.cos(roll)], axis=1) + rng.normal(0.0, 0.05, (len(t), 3))
    assert agree(Recording(t, gyr, acc)).fault is None
    assert "acc_gyr_test_invalid" in findings(Recording(t, gyr, acc))


@pytest.mark.parametrize(("role", "axis"), [("gyr", 0), ("acc", 1)])
def test_an_axis_that_stands(clean: Recording, role: str, axis: int) -> None:
    values = np.array(getattr(clean, role))
    values[1000:, axis] = values[1000, axis]
    names = {one.name: one for one in examine(changed(clean, **{role: values})).findings}
    assert f"'s {'xyz'[axis]}" in names[f"stuck_{role}"].what


def test_gravity_that_somebody_took_off(clean: Recording) -> None:
    rng = np.random.default_rng(1)
    report = examine(changed(clean, acc=rng.normal(0.0, 0.5, clean.acc.shape), mag=None))
    assert "gravity_removed" in report.names() and report.exit_code == 1


@pytest.mark.parametrize("change", [lambda gyr: 2.0 * gyr, lambda gyr: gyr * [1.0, 1.0, -1.0]])
def test_the_verdict_has_the_tilt_that_a_fault_costs(change: Callable[[Array], Array]) -> None:
    recording = lh.simulate.recording("MPU-6050", "hand", duration=60.0, seed=2)
    faulty = changed(recording, gyr=change(recording.gyr), mag=None)
    report = examine(faulty)
    assert recording.truth is not None and report.sigma_tilt is not None
    up = [
        Rotation.from_quat(q, scalar_first=True).inv().apply([0, 0, 1])
        for q in (lh.fuse(faulty).quat, recording.truth.quat)
    ]
    off = np.degrees(np.arccos(np.clip((up[0] * up[1]).sum(axis=1), -1.0, 1.0)))[600:]
    assert 0.5 < np.sqrt((off**2).mean()) / report.sigma_tilt < 2.0


def test_the_fix_is_made_where_the_other_half_shows_it(clean: Recording) -> None:
    faulty = changed(clean, gyr=2.0 * clean.gyr)
    mended, changes = repair(examine(faulty))
    assert np.allclose(mended.gyr, clean.gyr, rtol=0.02, atol=1e-3)
    assert any("times smaller" in one and "mended" in one for one in changes)


def test_a_right_gyroscope_is_left_alone_where_the_force_is_slow(clean: Recording) -> None:
    """Behind a filter gravity seems to turn against the gyroscope; the gyroscope's signs stay."""
    acc, share = np.array(clean.acc), 1.0 - np.exp(-2.0 * np.pi * 0.5 / 50.0)
    for i in range(1, len(acc)):
        acc[i] = acc[i - 1] + share * (acc[i] - acc[i - 1])
    mended, _ = repair(examine(changed(clean, acc=acc)))
    assert np.array_equal(mended.gyr, clean.gyr)


def test_a_rival_beside_twins_is_told_from_them():
    """Tuples that hold arrays cannot be compared; the doctor failed where a rival had the role of a twin."""
    wirings = {(1, 1, -1): 0.0, (-1, -1, 1): 1.0, (1, -1, 1): 2.0}
    fault, twin, rival = (
        Hypothesis("wiring", "acc", np.diag(np.array(signs, dtype=float)), chi, 6.0) for signs, chi in wirings.items()
    )
    assert [one is rival for one in Agreement((), (fault, twin, rival), 1.0).rivals(fault)] == [True]


@pytest.mark.parametrize("longer", [0.25, 0.5])
def test_soft_iron(clean: Recording, longer: float) -> None:
    assert clean.mag is not None
    found = findings(changed(clean, mag=clean.mag * [1.0, 1.0 + longer, 1.0]))
    one = found["mag_shape"]
    assert set(found) == {"mag_shape"} and one.value == pytest.approx(100.0 * longer, abs=4.0) and "near y" in one.what
    assert one.mend is not None
    round_again = one.mend.apply(changed(clean, mag=clean.mag * [1.0, 1.0 + longer, 1.0]))
    length = np.linalg.norm(round_again.mag, axis=1)
    assert length.std() / length.mean() < 0.03


def test_hard_iron_beside_soft_iron_is_that_of_the_readings(clean: Recording) -> None:
    assert clean.mag is not None
    iron = np.linalg.norm(clean.mag, axis=1).mean() * np.array([0.1, 0.5, -0.2])
    one = findings(changed(clean, mag=clean.mag * [1.0, 1.5, 1.0] + iron))["mag_offset"]
    assert one.mend is not None
    np.testing.assert_allclose(one.mend.offset, iron, atol=0.1 * np.linalg.norm(iron))


@pytest.mark.parametrize(("axis", "size"), [(0, 3.0), (2, 5.0)])
def test_a_jump_of_the_bias_is_found_with_its_time_and_mended(clean: Recording, axis: int, size: float) -> None:
    gyr = np.array(clean.gyr)
    gyr[2500:, axis] += np.radians(size)
    found = findings(changed(clean, gyr=gyr))
    one = found["bias_jumps"]
    assert set(found) <= {"bias_jumps", "gyro_bias"} and one.value == pytest.approx(size, abs=0.4)
    assert one.mend is not None and one.mend.since == pytest.approx(50.0, abs=4.0)
    left = one.mend.apply(changed(clean, gyr=gyr)).gyr - clean.gyr
    assert np.abs(np.degrees(left[3000:, axis])).max() < 0.4 and np.allclose(left[:2200], 0.0)


def test_a_rate_that_no_gyroscope_has_is_a_wrong_unit_even_where_nothing_can_be_compared() -> None:
    """A sensor that hardly turns: deg/s read as rad/s are beyond every range."""
    calm = made(3)
    rate = np.radians(70.0) * np.sign(np.sin(2.0 * np.pi * 5.0 * calm.t))[:, None] * [1.0, 0.0, 0.0]
    acc = np.tile([0.0, 0.0, 9.80665], (len(calm.t), 1))
    one = findings(Recording(calm.t, 57.3 * rate, acc + np.random.default_rng(1).normal(0.0, 0.02, acc.shape)))[
        "gyro_scale"
    ]
    assert one.value == pytest.approx(57.3, rel=0.01) and "its unit is wrong" in one.what


@pytest.mark.parametrize("seed", [1, 2])
def test_iron_of_several_fields_does_not_pull_the_turn(seed):
    """A drone turns little, and a raw chip's iron is four times the field: the gyroscope is right to 1 %."""
    recording = lh.simulate.recording("ICM-20948", "drone", duration=60.0, seed=seed)
    segments = cut(recording.t, recording.gyr, recording.mag, False, 10)
    np.testing.assert_allclose(fit(segments, IDENTITY).matrix, IDENTITY, atol=0.05)
    assert agree(recording, 10).fault is None


@pytest.mark.parametrize("role", ["gyr", "acc"])
def test_a_late_sensor_is_named_with_its_delay(clean: Recording, role: str) -> None:
    values = getattr(clean, role)
    late = np.stack([np.interp(clean.t - 0.04, clean.t, axis) for axis in values.T], axis=1)
    found = findings(changed(clean, **{role: late}))
    one = found["sensor_delay"]
    assert one.severity == "warning" and one.mend is not None and one.mend.role == role
    assert one.value == pytest.approx(40.0 if role == "acc" else -40.0, abs=4.0)
    assert "mag_delay" not in found  # a gyroscope that is late is one cause
    assert "sensor_delay" not in findings(clean)
    assert "sensor_delay" not in findings(one.mend.apply(changed(clean, **{role: late})))


@pytest.mark.parametrize(("motion", "seed"), [("hand", 2), ("walking", 1)])
def test_the_whole_delay_is_found_although_forces_hide_a_part(motion: str, seed: int) -> None:
    """An arm's and a walker's forces explain a part of each shift: the fit alone moves by 30 ms of 40."""
    clean = changed(lh.simulate.recording("ICM-20948", motion, duration=60.0, seed=seed), mag=None)
    before = agree(clean).seen[0].fit.delay
    for delay in (0.04, 0.08):
        found = agree(changed(clean, gyr=late(clean, clean.gyr, delay))).seen[0].fit
        assert before - found.delay == pytest.approx(delay, abs=0.002)
        assert abs(found.delay + delay) < 2.0 * found.sigma[3]


def test_the_field_shows_a_late_gyroscope_where_forces_hide_it() -> None:
    """A drone's force stays along its body. Its magnetometer cannot come before the field, so the gyroscope is late."""
    clean = lh.simulate.recording("LSM6DSO32", "drone", duration=60.0, seed=1, mag="HMC5883L")
    behind = changed(clean, gyr=late(clean, clean.gyr, 0.08))
    one = findings(behind)["sensor_delay"]
    assert "than the accelerometer and the magnetometer" in one.what and one.mend.role == "gyr"
    assert one.interval[0] <= -80.0 <= one.interval[1] and one.value == pytest.approx(-80.0, abs=15.0)
    assert "sensor_delay" not in findings(changed(behind, mag=None)) | findings(clean)
    behind = np.stack([np.interp(clean.t - 0.08, clean.t, axis) for axis in clean.mag.T], axis=1)
    found = findings(changed(clean, mag=behind))
    assert found["mag_delay"].value == pytest.approx(80.0, abs=5.0) and "sensor_delay" not in found


@pytest.mark.parametrize("force", [0.0, 1.0, 2.0])
def test_a_slow_motion_in_another_unit_is_named(force: float) -> None:
    """Forces in m/s² hide part of the turn of gravity: no gyroscope at all would explain it hardly worse."""
    recording, rng = made(seed=3), np.random.default_rng(0)
    noise = np.stack([np.convolve(rng.normal(size=len(recording)), np.hanning(25), "same") for _ in range(3)], axis=1)
    acc = recording.acc + force * noise / noise.std()
    slow = changed(recording, t=5.0 * recording.t, gyr=np.degrees(0.2 * recording.gyr), acc=acc, mag=None)
    assert np.abs(slow.gyr).max() < BEYOND  # no rate is impossible
    assert findings(slow)["gyro_scale"].what.endswith("its unit is wrong")
    assert not findings(changed(slow, gyr=np.radians(slow.gyr)))


def test_a_vigorous_motion_is_compared_in_finer_means() -> None:
    """Means of 20 ms at 10 rad/s lose a percent of a turn, and a scale that is right would be off by that."""
    recording = made(seed=4, seconds=150.0, rate=200.0)
    faster = changed(recording, t=recording.t / 6.0, gyr=6.0 * recording.gyr)
    (seen,) = [
        one for one in agree(changed(faster, acc=np.tile([0.0, 0.0, 9.8], (len(faster), 1)))).seen if one.role == "mag"
    ]
    assert np.abs(seen.fit.matrix - IDENTITY).max() < 0.003


def test_a_recording_of_twelve_seconds_is_compared_and_a_shorter_one_is_said_to_be_too_short() -> None:
    recording = made(seed=5, seconds=12.0)
    turned = findings(changed(recording, gyr=recording.gyr[:, [1, 2, 0]]))
    assert "axes_order" in turned and "acc_gyr_test_invalid" not in turned
    short = findings(recording[: 8 * 50])
    assert "so short a recording" in short["acc_gyr_test_invalid"].what


@pytest.mark.parametrize("axis", range(3))
def test_the_search_begins_at_a_mounting_that_is_askew(clean: Recording, axis: int) -> None:
    askew = Rotation.from_rotvec(np.radians(35.0) * IDENTITY[axis]).as_matrix()
    seg = cut(clean.t, clean.gyr @ askew.T, clean.acc, True)
    assert seg is not None
    first = _searched(seg)[0]
    assert np.degrees(np.arccos((np.trace(first @ askew) - 1.0) / 2.0)) < 10.0, "the inverse of the mounting"


def test_a_mounting_is_likelier_than_one_axis_three_times_too_large(data_dir: Path) -> None:
    """A calm hand hardly turns about z: both faults explain its turns."""
    path = data_dir / "truth" / "advio" / "advio_04.npz"
    if not path.is_file():
        pytest.skip("no truth/advio among the real recordings")
    log = load_arrays(path)
    rows = log["t"] < log["t"][0] + 60.0
    askew = Rotation.from_rotvec([np.radians(30.0), 0.0, 0.0]).as_matrix()
    recording = Recording(log["t"][rows], log["gyr"][rows] @ askew.T, log["acc"][rows])
    best = agree(recording).faults[0]
    assert best.kind == "mounting"
    assert np.degrees(np.arccos((np.trace(best.matrix) - 1.0) / 2.0)) == pytest.approx(30.0, abs=3.0)
