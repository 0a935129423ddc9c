"""Every key of a station file: its section, kind of value, option and meaning."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ftproc.config.kinds import (
    Kind,
    file_name,
    flag,
    method,
    number,
    parameters,
    positive,
    prior,
    text,
    whole,
    widths,
    words,
)
from ftproc.files.units import UNITS
from ftproc.records import COMPONENTS
from ftproc.settings import AUTO, EDITING, LEAST_NOISE, MOST_ERROR, MOTIONS, Air, FilterSettings


class Key(NamedTuple):
    """option: the option that it sets, by its name on the command line. part: of an option with several parts.

    example: shown in a comment, in example_unit; the default where there is one. quantity: of a value whose key ends in
    its unit, such as bias_mrad. least, most: of a value with a unit, in SI units.
    """

    option: str
    kind: Kind
    example: Any
    meaning: str
    part: int | str | None = None
    quantity: str | None = None
    default: Any = None
    example_unit: str = ""
    least: float = -math.inf
    most: float = math.inf

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(UNITS[self.quantity]) if self.quantity else ()


SECTIONS: Mapping[str, str] = {
    "site": "The position of the station, for latitudes, earth-centred coordinates and maps.",
    "file": "How the log is written.",
    "time": "Each quantity: its column in the log, and what is known of the instrument.",
    "range": "",
    "azimuth": "",
    "elevation": "",
    "height": "",
    "refraction": "Refraction of light in the air, for optical instruments, not for radars.",
    "filter": "As the options of the same names.",
}


def _column(quantity: str, example: str) -> dict[str, Key]:
    names = tuple(UNITS[quantity])
    known = "its unit, if the name does not state it: " + ", ".join(names)
    return {
        "column": Key("columns", text, example, 'name of the column, or "none"', quantity),
        "unit": Key("units", words(*names), names[0], known, quantity),
    }


def _errors(quantity: str, sigma: float, bias: float) -> dict[str, Key]:
    index, unit = COMPONENTS.index(quantity), "m" if quantity == "range" else "mrad"
    least, most = LEAST_NOISE[index], MOST_ERROR[index]
    return {
        "sigma": Key("noise", positive(), sigma, _SIGMA, index, quantity, None, unit, least, most),
        "bias": Key("bias", number(), bias, _BIAS, index, quantity, 0.0, unit, -most, most),
    }


_MOST_S = 1e10
_SIGMA = "noise, 1 sigma; left out: estimated from the log"
_BIAS = "reading minus truth, subtracted from every reading"
_FROM_X = "x: A = atan2(y, x); north: then x is north, y east"
_SENSE = "seen from above; left out: clockwise from north, anticlockwise from x"
_OFFSET = "added to every time"
_ZERO = "azimuth where it reads zero"
_WIDTHS = "of fixed-width columns, in characters"
_TURN = "in which range rates are ambiguous; left out: they are not"
_PRIOR = "of the target above the station, and 1 sigma, where no elevation is measured"
_GEOID = "height of the geoid above the ellipsoid, for KML"
_MODEL = "packaged, none, or a file beside this one"
_PATCH = "longest patch of outliers expected (forward editing)"

KEYS: Mapping[str, Mapping[str, Key]] = {
    "site": {
        "lat_deg": Key("site", number(-90, 90), 48.0812, "geodetic latitude, north positive", 0),
        "lon_deg": Key("site", number(-180, 360), 11.2803, "longitude, east positive", 1),
        "height_m": Key("site", number(-1000, 100_000), 612.0, "above the ellipsoid, not above the sea", 2),
        "geoid_m": Key("geoid_m", number(-150, 150), 46.2, _GEOID),
        "datum": Key("datum", words("WGS-84"), "WGS-84", "no other is understood", default="WGS-84"),
    },
    "file": {"widths": Key("widths", widths, "10,12,12,12", _WIDTHS)},
    "time": {
        **_column("time", "UTC"),
        "offset": Key("time_offset_s", number(), 12.0, _OFFSET, None, "time", 0.0, "ms", -_MOST_S, _MOST_S),
    },
    "range": {
        **_column("range", "RNG"),
        **_errors("range", 3.0, 2.5),
        "rate_interval_mps": Key("range_rate_interval_mps", positive(), 60.0, _TURN, default=0.0),
    },
    "azimuth": {
        **_column("azimuth", "AZ"),
        "from": Key("azimuth_from", words("x", "north"), "north", _FROM_X),
        "sense": Key("azimuth_sense", words("clockwise", "anticlockwise"), "clockwise", _SENSE),
        "zero": Key(
            "azimuth_zero_rad", number(), 14.5, _ZERO, None, "azimuth", 0.0, "deg", -MOST_ERROR[1], MOST_ERROR[1]
        ),
        **_errors("azimuth", 0.2, 0.1),
    },
    "elevation": {
        **_column("elevation", "EL"),
        "from": Key("elevation_from", words("horizon", "zenith"), "horizon", "left out: as the column is called"),
        **_errors("elevation", 0.2, 0.1),
    },
    "height": {**_column("height", "FL"), "prior_m": Key("height", prior, (0.0, 100.0), _PRIOR)},
    "refraction": {
        "correct": Key("refraction", flag, False, "subtract it from the elevation", default=False),
        "temperature_c": Key("temperature_c", number(-90, 60), Air.temperature_c, "at the station", default=15.0),
        "pressure_hpa": Key(
            "pressure_hpa", number(300, 1100), Air.pressure_hpa, "at the station, not at the sea", default=1013.25
        ),
    },
    "filter": {
        "method": Key("method", method, FilterSettings.method, "see --list-methods", default=FilterSettings.method),
        "model": Key("model", file_name, "packaged", _MODEL, default="packaged"),
        "smooth": Key("smooth", flag, False, "add the fixed-interval smoother", default=False),
        "editing": Key("editing", words(*EDITING), "two-pass", "how outliers are found", default="two-pass"),
        "lag_s": Key("lag", number(0, 3600), 2.0, "of live editing", default=0.0),
        "jerk_psd_m2ps5": Key("jerk", positive(), 10.0, "process noise (jerk PSD); left out: estimated"),
        "motion": Key("motion", words(*MOTIONS), AUTO, "model of motion; auto: the likelier", default=AUTO),
        "gate": Key("gate", positive(), FilterSettings.gate, "in sigmas of the residual", default=FilterSettings.gate),
        "max_patch_s": Key("max_patch", positive(), 5.0, _PATCH),
        "weight_form": Key("weight_form", words("noise", "gain"), "noise", "in forward editing", default="noise"),
        "set": Key("set", parameters, "window=6,m=0.01", "parameters of the method, see --list-methods NAME"),
        "particles": Key("particles", whole(20), 100, "of the ensemble and particle filters", default=100),
        "seed": Key("seed", whole(0), 0, "of their random numbers", default=0),
        "ecef": Key("ecef", flag, False, "add earth-centred coordinates", default=False),
        "derived": Key("derived", flag, False, "add ground speed, track, load factor and more", default=False),
        "keep_columns": Key("keep_columns", flag, False, "carry other columns through", default=False),
    },
}


def every() -> Iterator[tuple[str, str, Key]]:
    """Section, name and key of all keys, in the order of the file."""
    for section, keys in KEYS.items():
        for name, key in keys.items():
            yield section, name, key
