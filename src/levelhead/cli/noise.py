"""``levelhead noise LOG``: how noisy a sensor is."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from levelhead.cli.options import (
    OUT_FOLDER,
    Reading,
    can_draw,
    folder,
    print_json,
    print_line,
    print_written,
    require_writable,
)

if TYPE_CHECKING:
    from levelhead.calibration import Calibration
    from levelhead.noise import NoiseModel


def noise(
    log: Annotated[Path, Parameter(metavar="LOG")],
    /,
    *,
    tau: Annotated[float | None, Parameter(metavar="S")] = None,
    chip: Annotated[str | None, Parameter(metavar="NAME")] = None,
    temperature: Annotated[Path | None, Parameter(metavar="FILE")] = None,
    kalibr: Annotated[bool, Parameter(negative="")] = False,
    out: Annotated[Path, OUT_FOLDER] = Path(),
    plot: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
    reading: Reading = Reading(),  # noqa: B008
) -> None:
    """Measure a sensor's noise from a log at rest: Allan deviation, coefficients with σ, and a file for filters.

    Writes LOG-noise.json, for the --noise of `fuse`, `export` and `simulate`, and the picture LOG-noise.png. If the log
    has a temperature, it also finds the bias against it and writes LOG-temperature.png.

    Args:
        log: A recording. Its longest stretch at rest is used: at least 20 s, better an hour.
        tau: Longest averaging time in seconds; a third of the stretch by default.
        chip: Compare with the data sheet of MPU-6050, BMI160, LSM6DS3, LSM6DSO32 or ICM-20948; by default with all.
        temperature: Calibration file for `levelhead fuse`, to which the change of the biases with temperature is added.
        kalibr: Also write LOG-imu.yaml with noise densities and random walks, for Kalibr (--imu) and OpenVINS.
        out: Folder for the results.
        plot: Draw the picture (needs the extra levelhead[plot]).
        json: Print coefficients, verdict and Allan deviations as JSON.
    """
    from levelhead.noise import calibrate_temperature, measure_noise
    from levelhead.noise.assessment import find_chip
    from levelhead.publish.noise_table import noise_facts, noise_table
    from levelhead.publish.progress import progress

    page = None if chip is None else find_chip(chip)
    require_writable(out)
    known = _read_known(temperature)
    with progress(f"reading {log.name}"):
        recording = reading.read(log)
    with progress("measuring noise") as report:
        model = measure_noise(recording, tau=tau, progress=report)
    warmed = None if temperature is None else calibrate_temperature(model, known)
    written = [folder(out) / f"{log.stem}-noise.json"]
    model.save(written[0])
    if warmed is not None and temperature is not None:
        warmed.save(temperature)
        written.append(temperature)
    if kalibr:
        written.append(out / f"{log.stem}-imu.yaml")
        model.save_kalibr(written[-1])
    if plot and can_draw():
        written += _draw(model, out, log.stem)
    if json:
        print_json(noise_facts(model, page) | {"written": [str(path) for path in written]})
        return
    print_line(noise_table(model, page))
    if recording.mag is not None and model.mag is None:
        print_line(
            "magnetometer: left out, as its readings have no unit; --units mag=uT or --counts mag=10/uT gives them one"
        )
    print_written(written, plot)


def _read_known(path: Path | None) -> "Calibration | None":
    """The calibration to which a temperature model is added, where its file exists."""
    from levelhead.calibration import Calibration

    if path is None:
        return None
    require_writable(path.parent)
    return Calibration.read(path) if path.exists() else None


def _draw(model: "NoiseModel", out: Path, stem: str) -> list[Path]:
    """Draws Allan deviations, and bias against temperature where that is known; the files."""
    from levelhead.publish.plots.noise_panels import allan_picture
    from levelhead.publish.plots.temperature_panels import temperature_picture

    written = [out / f"{stem}-noise.png"]
    allan_picture(model, written[0])
    if any(triad.drift is not None for triad in model.triads.values()):
        written.append(out / f"{stem}-temperature.png")
        temperature_picture(model, written[1])
    return written
