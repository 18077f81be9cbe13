"""Options of ``levelhead fuse`` and ``levelhead smooth``: as they are typed, and as they are checked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from levelhead import filters
from levelhead.cli.calibrated_log import CalibrationFile
from levelhead.cli.options import (
    OUT_FOLDER,
    FilterName,
    FromFile,
    GuardWords,
    Reading,
    parse_filter,
    parse_guard,
    read_parameters,
    read_prior,
    require_self_calibration,
    require_writable,
)
from levelhead.cli.placement import Placement
from levelhead.errors import LevelheadError, require
from levelhead.filters.parameters import Params
from levelhead.guard import Guard

if TYPE_CHECKING:
    from levelhead.axis_map import AxisMap
    from levelhead.calibration import Calibration
    from levelhead.magnetic_model import EarthField
    from levelhead.recording import Recording
    from levelhead.track import Track

BAGS = ("mcap", "bag", "db3")  # formats of tracks that hold messages of ROS


@dataclass(frozen=True, kw_only=True)
class FuseOptions:
    """All options, checked before the first log is read.

    Attributes:
        params: the filter.
        named: whether the user chose the filter, or one of its parameters.
        guard: None: the filter alone.
        guard_words: as typed.
        declination: degrees.
        north: turn a relative heading to magnetic north where that was found.
        out: folder for the results.
        format: "csv", "parquet", "npz", or a bag of ROS: "mcap", "bag", "db3".
        plot: draw pictures.
        smooth: use the whole recording at every instant.
        prior: of the sensor.
        calibration: the file of the errors that are taken off the readings.
        save_calibration: the file for the calibration.
        first_pass: calibrate a raw magnetometer before a filter that does not learn its errors.
        reading: hints for the reader.
        as_json: print JSON in place of a summary.
        verbose: print every note and number.
        output_rate: Hz; None: every sample is written.
        mounting: from the sensor's axes to the body's; None: they are the same.
        frame: "ENU", "NED" or "NWU", of the written track.
        heading: degrees, the yaw at the start in that frame; None: as the filter found it.
        motion: write specific force, accelerations and rate too.
        heave: write heave too.
        field: that of the place; None: it was not named, or the log has it (``at_place``).
        place: latitude, longitude and altitude; "auto": those of the log; None: it was not asked for.
        date: of the log, as typed; None: its clock's.
    """

    params: Params
    named: bool
    guard: Guard | None
    guard_words: Sequence[str]
    declination: float | None
    north: bool
    out: Path
    format: str
    plot: bool
    smooth: bool
    prior: "Calibration | None"
    calibration: Path | None
    save_calibration: Path | None
    first_pass: bool
    reading: Reading
    as_json: bool
    verbose: bool
    output_rate: float | None
    mounting: "AxisMap | None"
    frame: str
    heading: float | None
    motion: bool
    heave: bool
    field: "EarthField | None"
    place: tuple[float, float, float] | Literal["auto"] | None
    date: str | None

    @property
    def needs_log(self) -> bool:
        """Whether the field of the place is to be found by the log's own position or clock."""
        return self.place is not None and self.field is None

    def at_place(self, recording: "Recording") -> "FuseOptions":
        """The same with the field of the place, as the prior of a filter that takes one of a magnetometer in µT.

        Raises:
            LevelheadError: the place or the date is that of the log, and it has none.
        """
        located = self._by_log(recording) if self.needs_log else self
        with_known_field = filters.of(self.params).with_known_field
        if located.field is None or with_known_field is None or recording.mag is None or "mag_unit" in recording.meta:
            return located
        return replace(located, params=with_known_field(located.params, located.field.strength, located.field.dip))

    def _by_log(self, recording: "Recording") -> "FuseOptions":
        """The same with the field by the log's satellite positions and clock, where these are needed."""
        from levelhead.magnetic_model import earth_field
        from levelhead.sources.place import date_of, place_of

        found = place_of(recording)
        if self.place == "auto" and found is None:
            raise LevelheadError("--place auto: the log has no satellite position; give --place LAT,LON")
        if self.place == "auto" and found is not None:
            where = found.latitude, found.longitude, found.altitude
        else:
            assert isinstance(self.place, tuple)
            where = self.place
        date = self.date or (None if found is None else found.date) or date_of(recording)
        if date is None:
            raise LevelheadError("--place needs the date, which is not in the log: --date 2026-05-17")
        field = earth_field(*where, date=date)
        return replace(self, field=field, declination=field.declination)

    def to_magnetic_north(self, track: "Track") -> "Track":
        """The track turned to magnetic north where that is known, unless the user has chosen another heading."""
        known = track.north is not None and track.north.known
        wanted = self.north and self.heading is None
        return track.to_north() if wanted and known else track

    def to_north(self, track: "Track") -> "Track":
        """The track turned to the north that was asked for, true or magnetic.

        Raises:
            LevelheadError: a declination was given, and there is no north from which it counts.
        """
        if self.declination is None:
            return self.to_magnetic_north(track)
        doubt = 0.0 if self.field is None else self.field.sigma_declination
        return track.to_true_north(self.declination, sigma=doubt)

    def of_body(self, track: "Track", recording: "Recording") -> "Track":
        """The track of the body, turned to the heading that was asked for, in ENU.

        A heading without a magnetometer is 0 at the start, also that of the body.
        """
        if self.mounting is not None:
            track = track.mount(self.mounting)
        if self.heading is not None:
            return track.to_frame(self.frame).with_heading(self.heading).to_frame("ENU")
        relative = recording.mag is None or "heading" not in filters.of(self.params).estimates
        if self.mounting is not None and relative and track.has_heading_at_start:
            return track.with_heading(0.0)
        return track

    @property
    def needs_start(self) -> bool:
        """Whether a track is turned by its start."""
        return self.heading is not None or self.mounting is not None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FuseArguments:
    """Options as they are typed; ``check`` makes ``FuseOptions`` of them."""

    filter: FilterName = None
    set: Annotated[tuple[str, ...], Parameter(name="--set", negative="", metavar="K=V")] = ()
    """A parameter of the filter, such as acc_tau=3; may be given several times."""
    guard: GuardWords = ()
    declination: Annotated[float | None, Parameter(metavar="DEG")] = None
    """Degrees from true to magnetic north at the place and time of the log, positive east. The track is then relative
    to true north."""
    north: bool = True
    """Turn the whole track to magnetic north, if the log has a magnetometer and σ of north is at most 30°. --no-north
    keeps the heading of the filter and only prints north. A live node turns to north by 2 °/s at most."""
    place: Annotated[str | None, Parameter(metavar="LAT,LON[,ALT]|auto", allow_leading_hyphen=True)] = None
    """Place of the log in degrees and m, or auto: by the satellite positions in the log. The World Magnetic Model gives
    the declination. Its strength and dip are printed beside those that were measured, and are the prior of ESKF's
    field (--set field_sigma=0.15); needs the extra levelhead[place]."""
    date: Annotated[str | None, Parameter(metavar="YYYY-MM-DD")] = None
    """Date of the log, for --place; by default its clock's."""
    out: Annotated[Path, OUT_FOLDER] = Path()
    """Folder for the results LOG-track.csv and LOG-track.png."""
    format: Literal["csv", "parquet", "npz", "mcap", "bag", "db3"] = "csv"
    """Format of the track. Above a million rows, Parquet takes a tenth of the time of CSV. mcap, db3 (ROS 2) and bag
    (ROS 1) hold the readings too, as sensor_msgs/Imu in enu."""
    output_rate: Annotated[float | None, Parameter(metavar="HZ")] = None
    """Maximum rows per second of the written track: the first sample of each period of 1/HZ s. The filter, the summary
    and the picture use every sample."""
    dry_run: Annotated[bool, Parameter(negative="")] = False
    """Print the reader's conclusions about each log, their basis, and the command line that leaves nothing to guess.
    Nothing is fused or written."""
    plot: bool = True
    """Draw the picture (needs the extra levelhead[plot]). A filter that calibrates its sensor gets a second one,
    LOG-calibration.png."""
    prior: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """Start with the calibration of the same sensor from an earlier --save-calibration. A filter that learns nothing
    gets the readings without these errors, as with --calibration."""
    calibration: CalibrationFile = None
    save_calibration: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """File for the calibration of the sensor from this run, with its 1σ, as JSON."""
    first_pass: bool = True
    """Find the offset of a raw magnetometer in the log before a filter that does not learn it, and take it off where
    that makes heading better on parts not used. --no-first-pass leaves the readings as they are."""
    tuned: FromFile = None
    noise: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """The sensor's noise, as written by `levelhead noise`: Q and R of an ESKF, EKF or Kalman. --set overrides it."""
    verbose: Annotated[bool, Parameter(name=["--verbose", "-v"], negative="")] = False
    """Print every parameter, every learned number, every kind of fault and every note."""
    json: Annotated[bool, Parameter(negative="")] = False
    """Print the summary as JSON, with all parameters and all learned numbers."""
    placement: Placement = Placement()  # noqa: RUF009
    heading: Annotated[float | None, Parameter(metavar="DEG")] = None
    """Yaw at the start, in the frame of the track: from east anticlockwise in enu, a bearing in ned."""
    motion: Annotated[bool, Parameter(negative="")] = False
    """Write specific force, acceleration without gravity in the axes of the body and of the earth, and the rate without
    its bias as well, each with its 1σ."""
    heave: Annotated[bool, Parameter(negative="")] = False
    """Write heave as well, the vertical motion of a boat or a buoy about its mean, up positive, with its 1σ (needs the
    extra levelhead[scipy])."""
    reading: Reading = Reading()  # noqa: RUF009

    def check(self, smooth: bool, logs: int) -> FuseOptions:
        """The options of ``fuse``, or of ``smooth``, for so many logs.

        Raises:
            LevelheadError: an option is wrong, does not fit the filter, or names a folder that cannot be written.
        """
        found = read_parameters(self.tuned, self.filter)
        params = parse_filter(self.filter, self.set, filters.offline if smooth else filters.default, self.noise, found)
        guard = parse_guard(self.guard, found)
        field = self._field()
        declination = self.declination if field is None else field.declination
        if self.declination is not None:
            from levelhead.track import declination_angle

            declination_angle(self.declination)
        if self.output_rate is not None:
            from levelhead.publish.output_rate import OutputRate

            OutputRate(self.output_rate)
        if self.save_calibration is not None:
            require_self_calibration(params, "--save-calibration")
            if logs > 1:
                raise LevelheadError("--save-calibration names one file for one sensor; give one log with it")
        if self.heading is not None and not abs(self.heading) <= 360.0:
            raise LevelheadError(f"the heading is {self.heading:g}; expected degrees within ±360")
        if self.heading is not None and self.declination is not None:
            raise LevelheadError("--heading and --declination both turn the heading; give one of them")
        prior, calibration = self._calibrations(params)
        require_writable(self.out)
        self._check_format()
        return FuseOptions(
            params=params,
            named=self.filter is not None or bool(self.set) or self.noise is not None or self.tuned is not None,
            guard=guard,
            guard_words=self.guard,
            declination=declination,
            north=self.north,
            out=self.out,
            format=self.format,
            plot=self.plot,
            smooth=smooth,
            prior=prior,
            calibration=calibration,
            save_calibration=self.save_calibration,
            first_pass=self.first_pass,
            reading=self.reading,
            as_json=self.json,
            verbose=self.verbose,
            output_rate=self.output_rate,
            mounting=self.placement.mounting,
            frame=self.placement.frame.upper(),
            heading=self.heading,
            motion=self.motion,
            heave=self.heave,
            field=field,
            place=self._place(),
            date=self.date,
        )

    def _check_format(self) -> None:
        """Makes sure that the format can be written, and holds all that was asked for."""
        if self.format == "parquet":
            require("pyarrow", "writing Parquet", "formats")
        if self.format in BAGS:
            require("rosbags", "writing a bag", "ros")
            if self.output_rate is not None or self.heave or self.placement.frame != Placement.frame:
                raise LevelheadError(
                    "a bag has every sample in enu (REP 103) and no heave; leave --output-rate, --heave and --frame "
                    "out, or give --format npz"
                )

    def _place(self) -> 'tuple[float, float, float] | Literal["auto"] | None':
        if self.place is None or self.place.lower() == "auto":
            return None if self.place is None else "auto"
        from levelhead.magnetic_model import parse_place

        return parse_place(self.place)

    def _calibrations(self, params: Params) -> "tuple[Calibration | None, Path | None]":
        """The filter's prior, and the file of the calibration to subtract from the readings."""
        if self.prior is None or filters.of(params).calibration is not None:
            return read_prior(self.prior, params), self.calibration
        if self.calibration is not None:
            raise LevelheadError("--prior and --calibration both correct the readings of this filter; give one of them")
        return None, self.prior

    def _field(self) -> "EarthField | None":
        if self.place is None:
            if self.date is not None:
                raise LevelheadError("--date is that of a --place; give the place too, such as --place 48.1,11.6")
            return None
        if self.declination is not None or self.heading is not None:
            raise LevelheadError("--place gives the declination; leave --declination and --heading out")
        require("pygeomag", "the field of a place", "place")
        from levelhead.magnetic_model import earth_field

        place = self._place()
        return None if place is None or place == "auto" or self.date is None else earth_field(*place, date=self.date)


def require_north(recording: "Recording", params: Params) -> None:
    """Makes sure that heading is relative to magnetic north.

    Raises:
        LevelheadError: there is no magnetometer, or the filter does not use it.
    """
    flt = filters.of(params)
    why = f"{flt.name} does not follow the magnetometer" if "heading" not in flt.estimates else ""
    why = "there is no magnetometer" if recording.mag is None else why
    if why:
        raise LevelheadError(f"--declination turns magnetic north, but {why}: heading is relative; leave it out")
