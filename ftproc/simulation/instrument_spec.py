"""The text that names the errors of an instrument, such as `mislevel_mrad=0.6,stamp_jitter_s=0.005`."""

from __future__ import annotations

import math

from ftproc.errors import UsageError, nearest
from ftproc.simulation.instrument import InstrumentErrors

#: The fields of `InstrumentErrors`, and the largest size of each: m, rad, refractivity, s, samples.
LARGEST = {
    "range_zero_m": 1e5, "azimuth_zero_rad": 0.1, "elevation_zero_rad": 0.1, "mislevel_rad": 0.1,
    "mislevel_azimuth_rad": 2 * math.pi, "collimation_rad": 0.1, "refraction": 0.01, "servo_lag_s": 1.0,
    "servo_lag_s2": 1.0, "azimuth_eccentricity_rad": 0.1, "azimuth_ellipticity_rad": 0.1,
    "elevation_eccentricity_rad": 0.1, "elevation_ellipticity_rad": 0.1, "circle_zero_rad": 2 * math.pi,
    "range_walk_m": 1e4, "range_walk_at_m": 1e7, "echo_db": 40.0, "echo_s": 1e5, "range_wander_m": 1e5,
    "azimuth_wander_rad": 0.1, "elevation_wander_rad": 0.1, "wander_s": 1e5, "stamp_jitter_s": 10.0,
    "range_rounding_m": 1e5, "azimuth_rounding_rad": 0.1, "elevation_rounding_rad": 0.1, "range_held": 1000,
    "azimuth_held": 1000, "elevation_held": 1000,
}  # fmt: skip
ANGLES = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180, "arcsec": math.pi / 648_000}

INSTRUMENT_GRAMMAR = """\
NAME=VALUE,... or none. Those left out are zero. An angle may be in mrad, urad, rad, deg or arcsec, by the end of its
name.
  range_zero_m, azimuth_zero_mrad, elevation_zero_mrad
                        zero-set errors, added to the reading
  mislevel_mrad         tilt of the vertical axis,
  mislevel_azimuth_deg  towards this azimuth
  collimation_mrad      angle between the line of sight and the normal of the trunnion axis
  refraction            refractivity n - 1 at the station: 2.8e-4 for light, 3.2e-4 for radar
  servo_lag_s, servo_lag_s2
                        the mount is behind by so much times the rates of the angles, and times their accelerations
  azimuth_eccentricity_mrad, azimuth_ellipticity_mrad, elevation_eccentricity_mrad, elevation_ellipticity_mrad
                        first and second harmonic of the error of a divided circle,
  circle_zero_deg       zero at this angle
  range_walk_m          weak echoes read longer, by this times log(1 + (range / range_walk_at_m)^4),
  range_walk_at_m       with this range (10000 m)
  echo_db               echoes get stronger and weaker, by the aspect of the target, with this 1 sigma; the log then has
                        a column of their strength, by which they walk,
  echo_s                with this correlation time (5 s)
  range_wander_m, azimuth_wander_mrad, elevation_wander_mrad
                        1 sigma of a first-order Gauss-Markov offset,
  wander_s              with this correlation time (1 s)
  stamp_jitter_s        1 sigma by which time stamps are off, the same for the components of a sample
  range_rounding_m, azimuth_rounding_mrad, elevation_rounding_mrad
                        step to which the readings are rounded
  range_held, azimuth_held, elevation_held
                        samples for which a reading is repeated
"""


def parse_instrument(text: str) -> InstrumentErrors:
    """The errors in a text as INSTRUMENT_GRAMMAR describes it. Raises UsageError."""
    found: dict[str, float] = {}
    for item in [] if text.strip() == "none" else text.split(","):
        written, _, value = (part.strip() for part in item.partition("="))
        name, scale = _named(written)
        if name in found:
            raise UsageError(f"--instrument: {name.removesuffix('_rad')} is given twice; leave one out.")
        found[name] = _size(written, value, scale, (_least(name) / scale, LARGEST[name] / scale))
    return InstrumentErrors(**found)


def _named(written: str) -> tuple[str, float]:
    """The field of `InstrumentErrors` and the size of the unit that a name ends in. Raises UsageError."""
    known = {name: (name, 1.0) for name in LARGEST if not name.endswith("_rad")}
    for name in LARGEST:
        if name.endswith("_rad"):
            known |= {f"{name.removesuffix('_rad')}_{unit}": (name, size) for unit, size in ANGLES.items()}
    if written not in known:
        short = ", ".join(name.replace("_rad", "_mrad") for name in LARGEST)
        raise UsageError(
            f'--instrument: there is no error "{written}"{nearest(written, known) or "."} There are {short}.'
        )
    return known[written]


def _least(name: str) -> float:
    """The smallest value of a field: what is no offset has no sign."""
    if name.endswith(("_held", "_at_m")):
        return 1.0
    return 0.0 if any(word in name for word in ("wander", "jitter", "rounding", "echo")) else -LARGEST[name]


def _size(written: str, value: str, scale: float, bounds: tuple[float, float]) -> float:
    """The value in m, rad, refractivity, s or samples. Raises UsageError."""
    try:
        size = float(value)
    except ValueError:
        size = math.nan
    least, most = bounds
    whole = written.endswith("_held")
    if not least <= size <= most or (whole and size != int(size)):
        what = "a whole number" if whole else "a number"
        raise UsageError(f'--instrument: {written} = "{value}": expected {what} from {least:g} to {most:g}.')
    return size * scale
