"""The search for an alignment: every hypothesis is fitted, the simplest good one wins."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from levelhead.errors import LevelheadError, nearest, require
from levelhead.evaluate.align.quaternion_convention import (
    READINGS,
    SAME,
    TO_ENU,
    TO_REFERENCE,
    Convention,
    distinct_conventions,
)
from levelhead.evaluate.align.refine import Refinement, refine
from levelhead.evaluate.align.result import Alignment, Quaternion, residual_limit
from levelhead.evaluate.align.rotation_fit import (
    Earth,
    Fit,
    Freedom,
    Sensor,
    apply_frames,
    estimate_mounting,
    fit_rotations,
)
from levelhead.evaluate.align.series import MIN_SAMPLES, OrientationSeries, SeriesPair
from levelhead.evaluate.align.time_shift import estimate_shift
from levelhead.evaluate.score import rms
from levelhead.recording import Array
from levelhead.rotations import angle, conjugate, product, relative_rotation, rotvec, to_scipy

POINTS = 1_000  # instants by which hypotheses are ranked
_SHIFT_TOLERANCE = 2e-3  # s, a change of the shift that asks for another ranking


def align(
    t: ArrayLike,
    quat: ArrayLike,
    t_reference: ArrayLike,
    quat_reference: ArrayLike,
    *,
    earth: Earth = "any",
    sensor: Sensor = "any",
    convention: Literal["any", "same"] = "any",
    shift: bool | float = True,
    simplest: bool = True,
) -> Alignment:
    """Convention, constant rotations and shift in time that make an estimate match a reference.

    The reference counts as wxyz, sensor to earth, ENU; the result is how the estimate differs from it.

    **The rule.** Every hypothesis is fitted: order × direction × frames × which constant rotations are free. Its
    residual is the RMS angle over the best 90 % of the samples. Its cost is 1 for each departure from "the same
    convention" and 2 for each angle that was fitted. Of all hypotheses whose residual is at most 4/3 of the smallest
    (or 0.02° more), the cheapest wins, so that freedom alone wins nothing.

    Args:
        t: (n,) seconds of the estimate; any start, any rate.
        quat: (n, 4) its quaternions, convention unknown; NaN or zero where missing.
        t_reference: (m,) seconds of the reference.
        quat_reference: (m, 4) its quaternions wxyz; NaN or zero where missing.
        earth: which constant rotation of the earth frame may be found: "none", "heading" or "any".
        sensor: the same for the sensor's side (mounting): "none" or "any".
        convention: "same" if the estimate is known to be wxyz, sensor to earth, ENU.
        shift: whether to look for a shift in time; a number: not beyond so many seconds; False: both share a clock.
        simplest: False: take all the freedom that ``earth`` and ``sensor`` give, instead of the cheapest good one.

    Raises:
        LevelheadError: shapes, times, too few samples, an unknown option, no instant at which both are known, or SciPy
            is not installed.
    """
    require("scipy", "alignment of two orientations", "scipy")
    _check("earth", earth, get_args(Earth))
    _check("sensor", sensor, get_args(Sensor))
    _check("convention", convention, ("any", "same"))
    estimate, reference = (
        OrientationSeries.from_samples("the estimate", t, quat),
        OrientationSeries.from_samples("the reference", t_reference, quat_reference),
    )
    pairs = SeriesPair(estimate, reference)
    start = estimate_shift(estimate, reference, np.inf if shift is True else float(shift)) if shift else None
    late = 0.0 if start is None else start.seconds
    allowed = freedoms_within(earth, sensor) if simplest else [Freedom(earth, sensor)]
    for _ in range(2):
        fits = rank_hypotheses(pairs, late, allowed, convention)
        found = refine(choose_fit(fits), late, start is not None, pairs)
        settled, late = abs(found.shift - late) < _SHIFT_TOLERANCE, found.shift
        if settled:
            break
    return _report(found, fits, pairs, bool(shift))


def _check(option: str, word: str, known: Sequence[str]) -> None:
    if word not in known:
        raise LevelheadError(f"{option} is '{word}', which is not an option of align; {nearest(str(word), known)}")


def freedoms_within(earth: Earth, sensor: Sensor) -> list[Freedom]:
    """All constant rotations with at most this freedom."""
    earths: tuple[Earth, ...] = get_args(Earth)
    sensors: tuple[Sensor, ...] = get_args(Sensor)
    return [
        Freedom(left, right)
        for left in earths[: earths.index(earth) + 1]
        for right in sensors[: sensors.index(sensor) + 1]
    ]


def rank_hypotheses(pairs: SeriesPair, late: float, allowed: Sequence[Freedom], convention: str) -> list[Fit]:
    """Every hypothesis fitted at the shift ``late``.

    Raises:
        LevelheadError: there are too few instants at which both are known.
    """
    when = pairs.instants(late, POINTS)
    if len(when) < MIN_SAMPLES:
        raise LevelheadError(
            f"estimate ({pairs.estimate.t[0]:.6g} to {pairs.estimate.t[-1]:.6g} s) and reference "
            f"({pairs.reference.t[0]:.6g} to {pairs.reference.t[-1]:.6g} s) share {len(when)} instants, and their "
            f"rates determine no shift; expected at least {MIN_SAMPLES} on one clock"
        )
    quat, reference = pairs.at(late, when)
    fits = []
    for order, inverse in READINGS if convention == "any" else READINGS[:1]:
        reading = Convention(order, inverse)
        start = estimate_mounting(when, apply_frames(reading, quat), reference)
        for freedom in allowed:
            tried = distinct_conventions(order, inverse, *freedom) if convention == "any" else [SAME]
            fits += [fit_rotations(one, freedom, quat, reference, start) for one in tried]
    return fits


def choose_fit(fits: Sequence[Fit]) -> Fit:
    """The cheapest of those that are good enough; of equally cheap ones the best."""
    limit = np.radians(residual_limit(float(np.degrees(min(fit.trimmed for fit in fits)))))
    return min((fit for fit in fits if fit.trimmed <= limit), key=lambda fit: (fit.cost, fit.trimmed))


def _report(found: Refinement, fits: Sequence[Fit], pairs: SeriesPair, shift: bool) -> Alignment:
    others = [one for one in fits if one.freedom == found.fit.freedom and one.convention != found.fit.convention]
    second = min(others, key=lambda one: one.trimmed, default=None)
    quat, reference = _common_instants(pairs, found.shift)
    as_is, true = _common_instants(pairs, 0.0)
    if not len(as_is):  # other clocks: no residual without the shift
        as_is, true = quat, reference
    chosen = name_frames(found.fit)
    return Alignment(
        convention=chosen.convention,
        freedom=chosen.freedom,
        earth=_wxyz(chosen.earth),
        sensor=_wxyz(chosen.sensor),
        shift=found.shift,
        shift_error=found.shift_error,
        before=float(np.degrees(rms(angle(relative_rotation(true, as_is))))),
        after=float(np.degrees(rms(angle(relative_rotation(reference, found.fit.apply(quat)))))),
        trimmed=float(np.degrees(chosen.trimmed)),
        second_best=None if second is None else second.convention,
        second_best_trimmed=None if second is None else float(np.degrees(second.trimmed)),
        spread=_principal_turns(reference),
        samples=len(quat),
        shift_searched=shift,
    )


def _common_instants(pairs: SeriesPair, shift: float) -> tuple[Array, Array]:
    """(m, 4) estimate and reference where both are known."""
    left, right = pairs.at(shift)
    good = np.isfinite(left[:, 0]) & np.isfinite(right[:, 0])
    return left[good], right[good]


def name_frames(fit: Fit) -> Fit:
    """The same rotations with the frames named that leave the smaller angles; only where these are free."""
    convention, earth, sensor = fit.convention, fit.earth, fit.sensor
    if fit.freedom.earth == "any":
        left = product(earth, TO_ENU[convention.earth])
        rests = [product(left, conjugate(TO_ENU[name]))[0] for name in ("ENU", "NED")]
        best = _index_of_smaller(rests)
        convention, earth = convention._replace(earth=("ENU", "NED")[best]), rests[best]
    if fit.freedom.sensor == "any":
        right = product(TO_REFERENCE[convention.sensor], sensor)
        rests = [product(conjugate(name), right)[0] for name in TO_REFERENCE.values()]
        best = _index_of_smaller(rests)
        convention, sensor = convention._replace(sensor=("as the reference", "forward-right-down")[best]), rests[best]
    return fit._replace(convention=convention, earth=earth, sensor=sensor)


def _index_of_smaller(rests: Sequence[Array]) -> int:
    """1 if the second turn is clearly smaller than the first, else 0."""
    first, second = (2.0 * float(np.arccos(min(abs(rest[0]), 1.0))) for rest in rests)
    return int(second < first - 0.1)


def _wxyz(quat: Array) -> Quaternion:
    w, x, y, z = (float(part) for part in (quat if quat[0] >= 0.0 else -quat))
    return w, x, y, z


def _principal_turns(reference: Array) -> tuple[float, float, float]:
    """RMS turn in ° about the principal axes of the motion, away from the mean orientation."""
    middle = to_scipy(reference).mean().as_quat(scalar_first=True)
    away = rotvec(product(conjugate(middle), reference))
    first, second, third = np.degrees(np.linalg.svd(away, compute_uv=False) / len(away) ** 0.5).tolist()
    return first, second, third
