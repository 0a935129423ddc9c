"""Every default that a user may change. Frozen dataclasses; units in the names or the comments."""

from __future__ import annotations

from dataclasses import dataclass

EDITING = ("two-pass", "live", "forward", "none")
AUTO = "auto"
MOTIONS = (AUTO, "white-jerk", "turning-force", "ballistic", "orbital")
PACKAGED, NO_MODEL = "packaged", "none"  # values of `model` that are not files
EPOCHS = {"l-bfgs": 400, "momentum": 1000}  # most that an optimiser of `train` is given, where the user says nothing

#: The smallest noise that is understood, 1 sigma of range m, azimuth rad, elevation rad: no instrument is so good, and
#: of far smaller ones nothing is left beside the rounding of the readings. And the largest known error.
LEAST_NOISE = (1e-6, 1e-9, 1e-9)
MOST_ERROR = (1e9, 20.0, 20.0)

Noise = tuple[float | None, float | None, float | None]
Parameters = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Air:
    """The air at a station, for the refraction of light."""

    temperature_c: float = 15.0
    pressure_hpa: float = 1013.25


@dataclass(frozen=True)
class Station:
    """The conventions and the known errors of an instrument's readings.

    azimuth_from: `x` or `north`, the axis that the azimuth is counted from, see `ftproc.files.conventions`; None: north
        if the column's name says so, else x.
    azimuth_sense: `clockwise` or `anticlockwise` from above; None: from north clockwise, from x anticlockwise.
    azimuth_zero_rad: the azimuth where the instrument reads zero.
    elevation_from: `horizon` or `zenith`; None: zenith if the column's name says so, else horizon.
    bias: reading minus truth of range m, azimuth rad, elevation rad; subtracted from every reading.
    time_offset_s: added to every time.
    refraction: the air, for the elevation of an optical instrument; None: no correction.
    range_rate_interval_mps: in which range rates are ambiguous, m/s: they read between minus and plus half of it.
    """

    azimuth_from: str | None = None
    azimuth_sense: str | None = None
    azimuth_zero_rad: float = 0.0
    elevation_from: str | None = None
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_offset_s: float = 0.0
    refraction: Air | None = None
    range_rate_interval_mps: float = 0.0


@dataclass(frozen=True)
class FilterSettings:
    """Settings of `filter`; None means: estimated from the log.

    method: the filter, see `ftproc filter --list-methods`.
    editing: how outliers are found: `two-pass` (from the whole log), `live` (as a live system can), `forward`
        (recursively) or `none`.
    smooth: add the fixed-interval smoother: the best estimate of trajectory.
    noise: 1-sigma of range m, azimuth rad, elevation rad; each may be None.
    jerk_psd_m2ps5: process noise, the spectral density of white jerk in m2/s5: 1 for gentle turns, 100 for a fighter.
    motion: the model of motion: `auto` (the likeliest by the log's readings), or one of MOTIONS.
    gate: in sigmas; a reading whose innovation is larger is suspected of being an outlier.
    max_patch_s: the longest patch of outliers that is expected, in s, for the recursive gate.
    particles, seed: members of the ensemble and particle filters, and the seed of their random numbers.
    gain_form: forward editing scales the gain by m (the letter of Zuo et al. 2021) instead of R by 1/m.
    site: latitude deg, longitude deg, and height m above the WGS-84 ellipsoid of the station: adds lat_deg, lon_deg and
        height_m.
    ecef: with a site: adds earth-centred, earth-fixed coordinates.
    derived: adds ground speed, track, climb rate, flight path angle, turn rate and load factor, with their sigmas.
    geoid_m: height of the geoid above the ellipsoid at the site, for KML.
    parameters: (name, value) pairs of the method; `ftproc filter --list-methods NAME` explains them.
    lag_s: of live editing: the estimate at t rests on readings up to t + lag_s seconds, and no later one.
    height: of the target above the station, m, and its 1-sigma, where no elevation is measured; None: by the log's
        heights, else a prior, see `ftproc.methods.height`.
    """

    method: str = "ga-bpnn-ukf"
    editing: str = "two-pass"
    smooth: bool = False
    noise: Noise | None = None
    jerk_psd_m2ps5: float | None = None
    gate: float = 4.0
    max_patch_s: float | None = None
    particles: int = 100
    seed: int = 0
    gain_form: bool = False
    site: tuple[float, float, float] | None = None
    ecef: bool = False
    geoid_m: float | None = None
    parameters: Parameters = ()
    lag_s: float = 0.0
    derived: bool = False
    motion: str = AUTO
    height: tuple[float, float] | None = None

    def parameter(self, name: str) -> float | None:
        """The parameter of the method by its name; None when it is not set."""
        return dict(self.parameters).get(name)


@dataclass(frozen=True)
class TrainSettings:
    """GA-BPNN training: network size, genetic search, back-propagation, hold-out verdict.

    features: `auto` (chosen by held-out flights) or one of `ftproc.correction.feature_sets`.
    hidden: units of the hidden layer; None: as many as the feature set usually needs.
    population, generations: of the genetic search.
    epochs: most that the optimiser is given.
    flights: simulated, when a scenario is trained on.
    seed: of all random numbers.
    method: the filter whose error is learned.
    optimiser: `l-bfgs`, or `momentum` as in the paper.
    start: initial weights, see `ftproc.correction.training.initial_weights`.
    """

    features: str = "auto"
    hidden: int | None = None
    population: int = 40
    generations: int = 60
    epochs: int = 400
    flights: int = 24
    seed: int = 0
    method: str = "ga-bpnn-ukf"
    optimiser: str = "l-bfgs"
    start: str = "packaged"
