"""The names and units that logs have: quantities, their aliases, and factors to SI (seconds, metres, radians)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from ftproc.records import COMPONENTS, FloatArray

#: What a log is made of, in the order of its canonical columns.
QUANTITIES = ("time", *COMPONENTS)

#: Names of each quantity, the full name first; small letters and digits only, as names of columns are compared.
ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("time", "t", "timestamp", "datetime", "utc", "gps", "tod", "sod", "tow", "sow", "epoch", "irig", "irigb"),
        *("jd", "mjd", "seconds", "secs", "sec", "elapsed", "elapsedtime", "elapsedseconds", "timeofday"),
        *("secondsofday", "secofday", "timeofweek", "secondsofweek", "gpstime", "gpstow", "gpsseconds", "utctime"),
        *("timeutc", "timegps", "utctimestamp", "utcdatetime", "datetimeutc", "dateandtime", "unix", "unixtime"),
        *(
            "posix",
            "posixtime",
            "epochtime",
            "juliandate",
            "julianday",
            "modifiedjuliandate",
            "stamp",
            "zulu",
            "utcsec",
        ),
        *("irigtime", "sampletime", "timetag", "clock", "systime", "itow", "utcsod", "utctod", "utcseconds"),
        *("timestamputc", "unixtimestamp", "excel", "exceldate", "exceltime", "missiontime", "ts", "met"),
        *("missionelapsedtime", "zeit", "uhrzeit", "temps", "tiempo", "tempo", "czas", "tid", "tijd", "cas", "время"),
        *("时间", "時間", "時刻", "시간"),
    ),
    "range": (
        "range",
        "r",
        "slantrange",
        "sr",
        "rng",
        "rho",
        "slrange",
        "slrng",
        "slantrng",
        "srange",
        "srng",
        "entfernung",
        "schragentfernung",
        "schragdistanz",
        *("distanceoblique", "distanciainclinada", "distanciaobliqua", "дальность", "наклоннаядальность"),
        *("斜距", "斜距离", "斜距離", "경사거리"),
    ),
    "azimuth": (
        *("azimuth", "az", "a", "azimuthangle", "azangle", "azim", "azi", "azmth", "bearing", "brg", "azimut"),
        *(
            "acimut",
            "azymut",
            "azimute",
            "gisement",
            "baring",
            "peilung",
            "азимут",
            "пеленг",
            "方位角",
            "方位",
            "방위각",
        ),
    ),
    "elevation": (
        "elevation",
        "el",
        "e",
        "elevationangle",
        "elangle",
        "elev",
        "elevangle",
        "altitudeangle",
        "hohenwinkel",
        *("elevationswinkel", "elevacion", "elevazione", "elevacao", "elevatie", "elewacja", "elevace", "hojdvinkel"),
        *("уголместа", "俯仰角", "俯仰", "仰角", "高低角", "高度角", "고각", "앙각"),
    ),
}

#: Names that other things have too: used where no column has one of ALIASES.
WEAK_ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": ("date", "gpst", "daytime"),
    "range": (
        *("dist", "sd", "distance", "slantdistance", "slopedistance", "slopedist", "slant", "distanz", "distancia"),
        *("distanza", "odległosc", "avstand", "afstand", "距离", "距離", "거리"),
    ),
    "azimuth": ("theta", "hz", "horizontalangle", "horizontaldirection", "hzangle", "hangle", "ha", "horangle"),
    "elevation": ("v", "verticalangle", "vertangle", "vangle", "va", "elv", "alt", "altitude", "site"),
}

#: Weak aliases that need an angle's unit, because alone they are a height or a place.
ANGLES_BY_UNIT = ("alt", "altitude", "site")

#: Names of angles of which none says whether it is the azimuth, and from where the other one counts.
EITHER_ANGLE = ("theta", "phi", "pan", "tilt")

#: Names in German, in which Grad are degrees.
GERMAN = frozenset(["zeit", "uhrzeit", "entfernung", "schragentfernung", "schragdistanz", "hohenwinkel", "distanz"])

#: Names of zenith angles, which are 90 degrees minus the elevation.
ZENITH_ALIASES = ("zenith", "zenithangle", "zenithdistance", "zen", "zd", "za", "zendist", "zenang", "zenithdist")

#: Words of a name that say nothing about the quantity.
QUALIFIERS = frozenset(
    [
        *("measured", "meas", "raw", "obs", "observed", "target", "tgt", "track", "trk", "radar", "sensor", "tracker"),
        *(
            "polar",
            "value",
            "angle",
            "reading",
            "laser",
            "instrument",
            "theodolite",
            "the",
            "true",
            "los",
            "look",
            "to",
        ),
        *("to", "from", "corrected", "station"),
    ]
)

#: Words that make a column something other than the quantity; they are not unknown units.
NOT_UNITS = frozenset(
    [
        *("rate", "dot", "sigma", "std", "err", "error", "bias", "res", "residual", "flag", "valid", "snr", "rcs"),
        *(
            "ok",
            "quality",
            "id",
            "status",
            "type",
            "gate",
            "ref",
            "mps2",
            "mode",
            "sd",
            "var",
            "variance",
            "rms",
            "outlier",
        ),
        *("velocity", "speed", "vel", "doppler", "acc", "cmd", "command", "commanded", "offset", "corr", "lag"),
        *("correction", "width", "beamwidth", "max", "min", "ground", "horizontal", "cov", "uncertainty", "idx"),
        *(
            "index",
            "count",
            "no",
            "number",
            "code",
            "lock",
            "signal",
            "power",
            "servo",
            "encoder",
            "counts",
            "raw",
            "true",
            "truth",
        ),
    ]
)


class Unit(NamedTuple):
    """SI value = value * multiply / divide. Two factors, so that milliseconds divide by an exact 1000."""

    name: str
    multiply: float = 1.0
    divide: float = 1.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """`values` of any shape in this unit -> the same in s, m or rad (a new array if anything changes)."""
        if self.multiply != 1.0:
            values = values * self.multiply
        return values / self.divide if self.divide != 1.0 else values


_TIMES = (
    *(Unit("s"), Unit("ms", divide=1e3), Unit("us", divide=1e6), Unit("ns", divide=1e9)),
    *(Unit("min", 60.0), Unit("h", 3600.0), Unit("d", 86400.0)),
)
_LENGTHS = (
    *(Unit("m"), Unit("km", 1e3), Unit("ft", 0.3048), Unit("nmi", 1852.0), Unit("nm", 1852.0), Unit("mi", 1609.344)),
    *(Unit("yd", 0.9144), Unit("kyd", 914.4), Unit("kft", 304.8), Unit("cm", divide=1e2), Unit("mm", divide=1e3)),
)
_ANGLES = (
    Unit("rad"),
    Unit("deg", math.pi, 180.0),
    Unit("mrad", divide=1e3),
    Unit("mil", math.pi, 3200.0),  # 6400 to the turn
    Unit("mil6300", math.pi, 3150.0),  # the Swedish streck
    Unit("mil6000", math.pi, 3000.0),  # of the former Warsaw Pact
    Unit("grad", math.pi, 200.0),  # 400 to the turn
    Unit("gon", math.pi, 200.0),  # the surveyors' name of grad
    Unit("mgon", math.pi, 200e3),
    Unit("arcmin", math.pi, 10_800.0),
    Unit("arcsec", math.pi, 648e3),
)

#: quantity -> unit name -> unit; the first of each is the SI unit.
UNITS: Mapping[str, Mapping[str, Unit]] = {
    quantity: {unit.name: unit for unit in units}
    for quantity, units in zip(QUANTITIES, (_TIMES, _LENGTHS, _ANGLES, _ANGLES), strict=True)
}

#: Unit -> its other spellings, in small letters without blanks and points.
_SPELLINGS: Mapping[str, tuple[str, ...]] = {
    "s": ("sec", "secs", "second", "seconds", "epsec", "с", "сек", "秒"),
    "ms": ("msec", "msecs", "millisec", "millisecond", "milliseconds", "мс", "毫秒"),
    "us": ("usec", "usecs", "microsec", "microsecond", "microseconds", "μs", "μsec"),
    "ns": ("nsec", "nsecs", "nanosec", "nanosecond", "nanoseconds"),
    "min": ("mins", "minute", "minutes"),
    "h": ("hr", "hrs", "hour", "hours"),
    "d": ("day", "days"),
    "m": ("meter", "meters", "metre", "metres", "mtr", "mtrs", "м", "米"),
    "km": ("kms", "kilometer", "kilometers", "kilometre", "kilometres", "км", "公里", "千米"),
    "ft": ("feet", "foot"),
    "kft": ("kilofeet", "kfeet"),
    "nmi": ("nauticalmile", "nauticalmiles", "nautmile", "nautmiles", "nautmi", "nautical"),
    "mi": ("mile", "miles", "smi", "sm", "statutemile", "statutemiles"),
    "yd": ("yds", "yard", "yards"),
    "kyd": ("kyds", "kyard", "kyards", "kiloyard", "kiloyards"),
    "cm": ("centimeter", "centimeters", "centimetre", "centimetres"),
    "mm": ("millimeter", "millimeters", "millimetre", "millimetres"),
    "rad": ("rads", "radian", "radians", "рад", "弧度"),
    "deg": ("degs", "degree", "degrees", "°", "dd", "decimaldegrees", "decdeg", "град", "度"),
    "mrad": ("mrads", "milliradian", "milliradians"),
    "mil": ("mils", "mil6400", "mils6400", "6400mil", "6400mils", "natomil", "natomils"),
    "mil6300": ("mils6300", "6300mil", "6300mils", "streck"),
    "mil6000": ("mils6000", "6000mil", "6000mils"),
    "gon": ("gons", "grads", "grade", "grades", "gradian", "gradians"),
    "mgon": ("milligon",),
    "arcmin": ("arcmins", "arcminute", "arcminutes", "minofarc"),
    "arcsec": ("arcsecs", "arcsecond", "arcseconds", "asec", "secofarc"),
}
_BY_SPELLING = {word: name for name, words in _SPELLINGS.items() for word in words}


def unit_named(quantity: str, word: str) -> Unit | None:
    """The unit of `quantity` that is written so, in any case, such as `km` or `Kilometres`; None if none."""
    plain = word.lower().replace(" ", "").replace(".", "").replace("_", "").replace("º", "°").replace("µ", "μ")
    return UNITS[quantity].get(plain) or UNITS[quantity].get(_BY_SPELLING.get(plain, ""))


def si_unit(quantity: str) -> Unit:
    """The SI unit of `quantity` (one of QUANTITIES)."""
    return next(iter(UNITS[quantity].values()))
