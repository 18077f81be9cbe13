"""``levelhead demo``: the classic lesson, its table and its pictures."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.options import NO_PICTURE, OUT_FOLDER, can_draw, folder, print_json, print_line
from levelhead.filters import AccelTilt, BiasRateKalman, Complementary, GyroIntegration, Kalman, RollPitchKalman

if TYPE_CHECKING:
    from levelhead.evaluate import Comparison

PER_SAMPLE = Kalman(r_measure=4.0, q_per_sample=True)
DENSITY = Kalman(r_measure=4.0)
# The lesson with its numbers: the two sensors alone, a line of code (alpha 0.98 at 100 Hz), a page of code.
LESSON = (AccelTilt(), GyroIntegration(), Complementary(), PER_SAMPLE, DENSITY, RollPitchKalman())


def demo(
    *,
    out: Annotated[Path, OUT_FOLDER] = Path("demo-output"),
    seed: int = 42,
    full: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """The lesson: an accelerometer that jitters, a gyroscope that drifts, and the result of the filters.

    Args:
        out: Folder for lesson.png (and, with --full, the other pictures).
        seed: Seed of the lesson; the published figures have seed 42.
        full: Also sweep alpha and r_measure, show the convergence of the Kalman gain, and run all filters on the hard
            case.
        json: Print the table as JSON.
    """
    from levelhead.evaluate import compare
    from levelhead.publish.progress import progress
    from levelhead.publish.terminal_table import print_table
    from levelhead.simulate import lesson

    target = folder(out) if can_draw() else out
    with progress("the lesson") as report:
        comparison = compare(lesson(seed), LESSON, guard=None, progress=report)  # each filter as published
    written, findings = list[Path](), list[str]()
    if can_draw():
        from levelhead.publish.plots import lesson_picture

        written.append(target / "lesson.png")
        lesson_picture(comparison, written[0])
    if full:
        more, findings = _more(comparison, seed, target)
        written += more
    if json:
        print_json(comparison.to_dict() | {"findings": findings, "written": [str(path) for path in written]})
        return
    print_table(comparison)
    print_line("")
    for finding in findings:
        print_line(f"{finding}.")
    errors = {repr(row.track.params): row.score.total for row in comparison.rows if row.score is not None}
    per_sample, density = errors[repr(PER_SAMPLE)], errors[repr(DENSITY)]
    print_line(
        "Neither sensor can be trusted alone: the accelerometer jitters, the gyroscope drifts. Together they agree."
    )
    print_line(
        f"The Kalman filter's Q added per sample: {per_sample:.4f}°; the same numbers as densities: {density:.4f}°."
    )
    print_line("written: " + ", ".join(str(path) for path in written) if written else NO_PICTURE)


def _more(comparison: "Comparison", seed: int, target: Path) -> tuple[list[Path], list[str]]:
    """The sweeps, the convergence of the gain and the hard case: their pictures and findings."""
    import numpy as np

    from levelhead.engine import fuse_axis
    from levelhead.evaluate import compare
    from levelhead.publish.plots import case_picture, gain_picture, sweep_picture
    from levelhead.publish.progress import progress
    from levelhead.simulate import hard_lesson
    from levelhead.tune import find_convergence, sweep

    recording = comparison.recording
    written, findings = list[Path](), list[str]()

    def draw(picture: Callable[..., None], name: str, *shown: object) -> None:
        if can_draw():
            written.append(target / name)
            picture(*shown, written[-1])

    for params, name in ((Complementary(), "alpha"), (Kalman(), "r_measure")):
        with progress(f"sweeping {name}") as report:
            result = sweep(recording, params, name, progress=report)
        draw(sweep_picture, f"sweep-{name}.png", result)
        findings.append(f"Sweep of {name}: {result.finding}")
    angle = np.degrees(np.arctan2(recording.acc[:, 1], recording.acc[:, 2]))
    axis = fuse_axis(recording.t, angle, np.degrees(recording.gyr[:, 0]), DENSITY, period=360.0)
    gains = np.stack([axis.gain_level, axis.gain_bias], axis=1)
    index = find_convergence(recording.t, gains)
    draw(gain_picture, "gain.png", recording.t, gains, index)
    findings.append(f"Kalman gain: converged at sample {index}, {recording.t[index]:.2f} s")
    every = (*LESSON, BiasRateKalman(r_measure=4.0))
    cases = {}
    for name, case in (("the lesson", recording), ("the hard case", hard_lesson(seed))):
        with progress(name) as report:
            cases[name] = compare(case, every, progress=report)
    draw(case_picture, "hard.png", cases)
    return written, findings
