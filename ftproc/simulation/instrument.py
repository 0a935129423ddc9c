"""The measurement by an instrument: its zero-set, refraction, noise, late time stamps, rounding and held readings."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ftproc.core.model.frames import from_cartesian, to_cartesian, wrap
from ftproc.records import COMPONENTS, FloatArray
from ftproc.simulation.flights.kinematics import Flight

REFRACTION_SCALE_HEIGHT_M = 8000.0
DIFFERENCE_S = 0.01  # over which rates of angles are taken
WALKS_AT_DB, STRENGTH_DB = 13.0, 0.5  # of an echo at `range_walk_at_m`, and 1-sigma of its measurement


@dataclass(frozen=True)
class InstrumentErrors:
    """Errors of a station beside its white noise; the default is a perfect one. Angles in rad.

    range_zero_m, azimuth_zero_rad, elevation_zero_rad: added to the reading (zero-set errors).
    mislevel_rad: tilt of the vertical axis towards the azimuth mislevel_azimuth_rad.
    collimation_rad: angle between line of sight and normal of the trunnion axis; its azimuth error is this over cos E.
    refraction: refractivity n - 1 at the station, 2.8e-4 for light, about 3.2e-4 for radar, 0 for none.
    servo_lag_s, servo_lag_s2: the mount is behind the target by so much times the rates of its angles, and by so much
    times their accelerations.
    *_eccentricity_rad, *_ellipticity_rad: first and second harmonic of the error of a divided circle, zero at the angle
    circle_zero_rad.
    range_walk_m: by which a range is read longer, times log(1 + (range / range_walk_at_m)^4): the echo gets weaker.
    echo_db, echo_s: 1-sigma of first-order Gauss-Markov changes of the echo's strength, by the aspect of the target, of
    which the log then has a column; and their correlation time.
    *_wander_*: 1-sigma of a first-order Gauss-Markov offset of the component; wander_s: its correlation time.
    stamp_jitter_s: 1-sigma by which the instant of a sample differs from its time stamp, the same for its components.
    *_rounding_*: step to which the readings are rounded, 0 for none.
    *_held: samples for which a reading of the component is repeated, 1 for none.
    """

    range_zero_m: float = 0.0
    azimuth_zero_rad: float = 0.0
    elevation_zero_rad: float = 0.0
    mislevel_rad: float = 0.0
    mislevel_azimuth_rad: float = 0.0
    collimation_rad: float = 0.0
    refraction: float = 0.0
    servo_lag_s: float = 0.0
    servo_lag_s2: float = 0.0
    azimuth_eccentricity_rad: float = 0.0
    azimuth_ellipticity_rad: float = 0.0
    elevation_eccentricity_rad: float = 0.0
    elevation_ellipticity_rad: float = 0.0
    circle_zero_rad: float = 0.0
    range_walk_m: float = 0.0
    range_walk_at_m: float = 10_000.0
    echo_db: float = 0.0
    echo_s: float = 5.0
    range_wander_m: float = 0.0
    azimuth_wander_rad: float = 0.0
    elevation_wander_rad: float = 0.0
    wander_s: float = 1.0
    stamp_jitter_s: float = 0.0
    range_rounding_m: float = 0.0
    azimuth_rounding_rad: float = 0.0
    elevation_rounding_rad: float = 0.0
    range_held: float = 1.0
    azimuth_held: float = 1.0
    elevation_held: float = 1.0

    def of_components(self, what: str) -> tuple[float, float, float]:
        """The field that ends so (but for its unit) of range, azimuth and elevation: "wander", "rounding", "held"."""
        units = ("", "", "") if what == "held" else ("_m", "_rad", "_rad")
        found = (getattr(self, f"{c}_{what}{unit}") for c, unit in zip(COMPONENTS, units, strict=True))
        return next(found), next(found), next(found)


PERFECT = InstrumentErrors()


def systematic(position: FloatArray, errors: InstrumentErrors, echo_db: FloatArray | float = 0.0) -> FloatArray:
    """(n, 3) range m, azimuth rad, elevation rad that a noiseless instrument reads for (n, 3) true
    positions in m. echo_db: (n,) by which the echo is stronger than usual at this range.

    Order as the light travels: refraction, tilted axis, collimation, circles, zero-set. Azimuth is not yet wrapped.
    """
    reading = from_cartesian(position)
    reading[:, 2] += errors.refraction * _bending(position)
    if errors.mislevel_rad:
        reading = from_cartesian(to_cartesian(reading) @ _tilt(errors).T)
    # Within 1 mrad of the zenith no collimation error is defined: the mount cannot point there.
    reading[:, 1] += errors.collimation_rad / np.maximum(np.cos(reading[:, 2]), 1e-3)
    reading += _walk_and_circles(reading, errors, echo_db)
    zero_set = np.array([errors.range_zero_m, errors.azimuth_zero_rad, errors.elevation_zero_rad])
    return np.asarray(reading + zero_set)


def servo_lag(flight: Flight, time_s: FloatArray, errors: InstrumentErrors) -> FloatArray:
    """(n, 3) by which the mount is behind at (n,) times: 0, azimuth rad, elevation rad, to be subtracted."""
    lag = np.zeros((len(time_s), 3))
    if errors.servo_lag_s or errors.servo_lag_s2:
        before, now, after = (from_cartesian(flight.at(time_s + k * DIFFERENCE_S)[0])[:, 1:] for k in (-1, 0, 1))
        back, ahead = wrap(now - before), wrap(after - now)
        lag[:, 1:] = errors.servo_lag_s * (back + ahead) / (2 * DIFFERENCE_S)
        lag[:, 1:] += errors.servo_lag_s2 * (ahead - back) / DIFFERENCE_S**2
    return lag


def echoes(time_s: FloatArray, errors: InstrumentErrors, rng: np.random.Generator) -> FloatArray:
    """(n,) dB by which the echo is stronger than usual at its range."""
    changes: FloatArray = errors.echo_db * unit_noise(time_s, errors.echo_s, None, rng)[:, 0]
    return changes


def strength(
    range_m: FloatArray, echo_db: FloatArray, errors: InstrumentErrors, rng: np.random.Generator
) -> FloatArray:
    """(n,) dB above the noise of the receiver, as it measures the strength of an echo."""
    usual = WALKS_AT_DB - 40 * np.log10(np.maximum(range_m, 1.0) / errors.range_walk_at_m)
    measured: FloatArray = usual + echo_db + STRENGTH_DB * rng.standard_normal(len(range_m))
    return measured


def _walk_and_circles(reading: FloatArray, errors: InstrumentErrors, echo_db: FloatArray | float) -> FloatArray:
    """(n, 3) range walk m, and errors of the two circles rad."""
    weakness = (reading[:, 0] / errors.range_walk_at_m) ** 4 / 10 ** (np.asarray(echo_db) / 10)
    walk = errors.range_walk_m * np.log1p(weakness)
    azimuth, elevation = (reading[:, 1:] - errors.circle_zero_rad).T
    return np.stack(
        [
            walk,
            errors.azimuth_eccentricity_rad * np.sin(azimuth) + errors.azimuth_ellipticity_rad * np.sin(2 * azimuth),
            errors.elevation_eccentricity_rad * np.sin(elevation)
            + errors.elevation_ellipticity_rad * np.sin(2 * elevation),
        ],
        axis=1,
    )


def _bending(position: FloatArray) -> FloatArray:
    """(n,) apparent minus true elevation per unit of refractivity, rad.

    Snell's law in flat layers whose refractivity falls off as exp(-h/H): cot E (1 - (H/h)(1 - exp(-h/H))),
    in a form that stays finite on the horizon. Valid above about 2 degrees of elevation.
    """
    ground = np.hypot(position[:, 0], position[:, 1]) / REFRACTION_SCALE_HEIGHT_M
    height = position[:, 2] / REFRACTION_SCALE_HEIGHT_M
    near = np.abs(height) < 1e-3  # where the difference below cancels
    h = np.where(near, 1.0, height)
    return np.asarray(ground * np.where(near, 0.5 - height / 6, (h + np.expm1(-h)) / h**2))


def _tilt(errors: InstrumentErrors) -> FloatArray:
    """(3, 3) rotation from the level frame into the instrument's, whose vertical axis leans."""
    c, s = np.cos(errors.mislevel_rad), np.sin(errors.mislevel_rad)
    ca, sa = np.cos(errors.mislevel_azimuth_rad), np.sin(errors.mislevel_azimuth_rad)
    turn = np.array([[ca, sa, 0.0], [-sa, ca, 0.0], [0.0, 0.0, 1.0]])
    lean = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    return np.asarray(turn.T @ lean @ turn)


def unit_noise(
    time_s: FloatArray, correlation_s: float, tails_dof: float | None, rng: np.random.Generator
) -> FloatArray:
    """(n, 3) noise of unit variance: white, or a first-order Gauss-Markov process of that correlation time.

    x_k = f x_{k-1} + sqrt(1 - f^2) w_k with f = exp(-dt/correlation time), exact at
    irregular times. With Student-t tails, w is scaled to unit variance.
    """
    shape = (len(time_s), 3)
    if tails_dof is None:
        white = rng.standard_normal(shape)
    else:
        white = rng.standard_t(tails_dof, shape) * np.sqrt((tails_dof - 2) / tails_dof)
    if not correlation_s:
        return white
    memory = np.exp(-np.diff(time_s) / correlation_s)
    fresh = np.sqrt(1.0 - memory**2)
    columns = []
    for w in white.T:
        steps = zip(memory.tolist(), (fresh * w[1:]).tolist(), strict=True)
        columns.append(list(accumulate(steps, lambda x, step: step[0] * x + step[1], initial=float(w[0]))))
    return np.array(columns).T


def gauss_markov_offsets(time_s: FloatArray, errors: InstrumentErrors, rng: np.random.Generator) -> FloatArray:
    """(n, 3) first-order Gauss-Markov offsets: range m, azimuth rad, elevation rad."""
    return np.asarray(errors.of_components("wander") * unit_noise(time_s, errors.wander_s, None, rng))


def rounded(reading: FloatArray, errors: InstrumentErrors) -> FloatArray:
    """(n, 3) readings on the instrument's grid."""
    step = np.array(errors.of_components("rounding"))
    return np.where(step > 0, np.round(reading / np.where(step > 0, step, 1.0)) * step, reading)


def held(values: np.ndarray, errors: InstrumentErrors) -> np.ndarray:
    """(n, 3) of each component the value that it had when it was last taken."""
    sample = np.arange(len(values))
    every = np.array(errors.of_components("held"), int)
    return np.stack([values[sample - sample % every[c], c] for c in range(3)], axis=1)


def readable(reading: FloatArray) -> FloatArray:
    """(n, 3) as an instrument displays it: range from 0, azimuth in [-pi, pi), elevation within +-pi/2."""
    azimuth = wrap(reading[:, 1])
    azimuth = np.where(azimuth >= np.pi, -np.pi, azimuth)  # modulo of a tiny negative angle rounds up
    return np.stack([np.maximum(reading[:, 0], 0.0), azimuth, np.clip(reading[:, 2], -np.pi / 2, np.pi / 2)], axis=1)
