"""The units that logs have: their spellings, and factors to SI (seconds, metres, radians)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

from ftproc.files.words import FURTHER_ALIASES, QUANTITIES
from ftproc.records import FloatArray

LIGHT_MPS = 299_792_458.0


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
    *(
        Unit("yd", 0.9144),
        Unit("kyd", 914.4),
        Unit("kft", 304.8),
        Unit("cm", divide=1e2),
        Unit("mm", divide=1e3),
        Unit("dmi", 1828.8),  # data mile of radars: 6000 ft
        Unit("inch", 0.0254),
        Unit("usft", 1200.0, 3937.0),  # of surveys in the United States
        Unit("cable", 185.2),  # a tenth of a nautical mile
        Unit("fathom", 1.8288),
    ),
)
_HEIGHTS = (*_LENGTHS, Unit("fl", 30.48))  # of 100 ft
_SPEEDS = (
    *(Unit("mps"), Unit("kmps", 1e3), Unit("kmh", divide=3.6), Unit("kt", 1852.0, 3600.0), Unit("fps", 0.3048)),
    *(Unit("mph", 0.44704), Unit("mmps", divide=1e3), Unit("cmps", divide=1e2)),
)
_LEVELS = (Unit("db"),)  # over any reference
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
    Unit("urad", divide=1e6),
    Unit("mdeg", math.pi, 180e3),
    Unit("cdeg", math.pi, 18e3),
    Unit("turn", 2 * math.pi),
    Unit("bam16", math.pi, 32768.0),  # 65536 to the turn
    Unit("arcmin", math.pi, 10_800.0),
    Unit("arcsec", math.pi, 648e3),
)

#: quantity -> unit name -> unit; the first of each is the SI unit.
UNITS: Mapping[str, Mapping[str, Unit]] = {
    quantity: {unit.name: unit for unit in units}
    for quantity, units in zip(
        (*QUANTITIES, *FURTHER_ALIASES), (_TIMES, _LENGTHS, _ANGLES, _ANGLES, _HEIGHTS, _SPEEDS, _LEVELS), strict=True
    )
}

#: Unit -> its other spellings, in small letters without blanks and points.
SPELLINGS: Mapping[str, tuple[str, ...]] = {
    name: tuple(words.split())
    for name, words in {
        "s": "sec secs second seconds epsec seconde secondes segundo segundos secondi sekunde sekunden sekunder "
        "sekundy saniye sn с сек секунды 秒 초",
        "ms": "мс 毫秒",
        "min": "mins minute minutes minuten minutos minuti minuty minuter minutter dakika мин минута минуты минут хв "
        "分 分钟 분",
        "h": "hr hrs hour hours ч",
        "d": "day days",
        "m": "meter meters metre metres mtr mtrs mètre mètres metros metri metrów metrů метр метры метров м 米 公尺 "
        "メートル 미터",
        "km": "kms kilómetros chilometri км 公里 千米",
        "ft": "feet foot",
        "inch": "inches",
        "usft": "ftus surveyft surveyfeet ussurveyft ussurveyfeet",
        "kft": "kilofeet kfeet",
        "fl": "flightlevel flightlevels",
        "kmh": "kph",
        "kt": "kts knot knots kn",
        "db": "dbm dbw dbsm dbhz db-hz dbmv dbfs decibel decibels дб дбм 分贝",
        "nmi": "nauticalmile nauticalmiles nautmile nautmiles nautmi nautical mn seemeile seemeilen millenautique "
        "millesnautiques millanáutica millasnáuticas migliomarino miglianautiche sjömil sømil zeemijl "
        "zeemijlen морскаямиля морскиемили мормили 海里",
        "mi": "mile miles smi sm stmi statmi statutemi statutemile statutemiles usstatutemile usstatutemiles",
        "yd": "yds yard yards",
        "dmi": "datamile datamiles",
        "cable": "cables cbl cbls cablelength cablelengths kabellänge kabellängen encablure encablures каб кабельтов "
        "кабельтова кабельтовых кабельтовы 链",
        "fathom": "fathoms fth fths ftm ftms faden",
        "kyd": "kyds kyard kyards kiloyard kiloyards",
        "rad": "rads radian radians рад 弧度 라디안",
        "deg": "degs degree degrees ° dd decimaldegrees decdeg град гр 度 도 degré degrés degre degres grados graus "
        "gradi graden grader stopni stopnie stopień stupně stupňů derece fok astetta градусы градусов градус",
        "turn": "turns rev revs revolution revolutions cycles",
        "bam16": "bam bams",
        "mil": "mils mil6400 mils6400 6400mil 6400mils natomil natomils strich artilleriestrich a‰ ‰ ₥ millième "
        "millièmes milésimas millesimi",
        "mil6300": "mils6300 6300mil 6300mils streck",
        "mil6000": "mils6000 6000mil 6000mils ду тд тыс tys tysięczne tysięcznych",
        "gon": "gr gons grads grade grades gradian gradians",
        "arcmin": "arcmins arcminute arcminutes minofarc",
        "arcsec": "arcsecs arcsecond arcseconds asec secofarc",
    }.items()
}
_BY_SPELLING = {word: name for name, words in SPELLINGS.items() for word in words}
#: A length over a time: m/s, m s^-1, km_h, meters_per_second; without anything between them where both are short.
_OVER_TIME = re.compile(
    r"(?P<length>.+?)(?:/|per|p)(?P<time>[^\W\d_]+)|(?P<short>[^\W\d_]{1,3})[·*]?(?P<inverse>[^\W\d_]+)(?:\^?\(?-1\)?)?"
)
_OF_SPEEDS = {"s": 1.0, "h": 3600.0}

_PREFIXES = {
    **dict.fromkeys(("kilo", "k"), 3),
    **dict.fromkeys(("hecto", "h"), 2),
    **dict.fromkeys(("deca", "deka", "da"), 1),
    **dict.fromkeys(("deci", "d"), -1),
    **dict.fromkeys(("centi", "c"), -2),
    **dict.fromkeys(("milli", "m"), -3),
    **dict.fromkeys(("micro", "u", "μ"), -6),
    **dict.fromkeys(("nano", "n"), -9),
}
_WITH_PREFIXES = ("m", "s", "rad", "deg", "gon", "grad", "turn", "arcsec")
_LONGEST_SPELT = 80  # characters, factor and blanks included
_NUMBER = r"(?:\d{1,10}(?:\.\d{0,20})?|\.\d{1,20})(?:e[+-]?\d{1,2})?"
_FACTOR = re.compile(
    rf"(?:[x×*·]\s*)?(?:10(?:\^|\*\*)\(?(?P<power>[+-]?\d{{1,2}})\)?|(?P<of>{_NUMBER})(?:\s*/\s*(?P<by>{_NUMBER}))?)"
    r"\s*(?:[x×*·]\s*)?(?P<unit>[^\W\d].*|[°º].*)",
    re.IGNORECASE,
)
_TENS = {"ten": 10, "hundred": 100, "thousand": 1000}
_TENTHS = re.compile(rf"^\s*({'|'.join(_TENS)})ths? (?:of )?(?:an? )?(?=\w)", re.IGNORECASE)  # tenths of a second
_COUNTS = r"(?:encoder )?(?:counts?|ticks?|pulses|steps)"
_TURN = r"(?:an? )?(?:full )?(?:turn|rev|revolution|circle|360 ?(?:deg|°))"
_BITS = re.compile(
    rf"(?:(?:bams?|{_COUNTS}(?: of)?)\W{{1,2}})?(?:(?P<bits>[1-3]?\d)[ -]?bits?(?: (?:bams?|encoder|{_COUNTS}))?"
    rf"|2(?:\^|\*\*)(?P<power>[1-3]?\d) ?(?:{_COUNTS})? ?(?:per|/|to|in) ?{_TURN})|bams?[ -]?(?P<bam>\d\d)",
    re.IGNORECASE,
)
_PER_TURN = re.compile(
    rf"(?:{_COUNTS}\W{{1,2}})?(?P<many>\d{{3,10}}) ?(?:[cp]pr|(?:{_COUNTS})? ?(?:per|/|to|in) ?{_TURN})"
    rf"|{_COUNTS}/{_TURN} ?= ?(?P<of>\d{{3,10}})",
    re.IGNORECASE,
)


def unit_named(quantity: str, word: str) -> Unit | None:
    """The unit of `quantity` that is written so, in any case, such as `km` or `Kilometres`, perhaps behind a factor:
    `100 ns`, `x1000 ft`, `1/128 s`, `10^-3 deg`. None if none."""
    if len(word) > _LONGEST_SPELT:
        return None
    word = _TENTHS.sub(lambda of: f"1/{_TENS[of[1].lower()]} ", word)
    counts = _BITS.fullmatch(word.strip()) or _PER_TURN.fullmatch(word.strip())
    known = _plainly_named(quantity, word)
    if counts and counts.lastgroup and not known and quantity in ("azimuth", "elevation"):  # of an encoder
        number = int(counts[counts.lastgroup])
        word = f"1/{2**number if counts.re is _BITS else number} turn"
    return known or _scaled(quantity, word.strip())


def _plainly_named(quantity: str, word: str) -> Unit | None:
    plain = word.lower().replace(" ", "").replace(".", "").replace("_", "").replace("º", "°").replace("µ", "μ")
    if word.strip() in ("Mm", "Dm", "DM"):  # megametres; data miles or decimetres
        return None
    known = UNITS[quantity].get(plain) or UNITS[quantity].get(_BY_SPELLING.get(plain, ""))
    return known or (_speed_named(plain) if quantity == "range_rate" else _prefixed(quantity, plain))


def _prefixed(quantity: str, plain: str) -> Unit | None:
    """A part or a multiple by tens of a metre, a second or an angle: dam, hectometres, ddeg, cgon."""
    for prefix, power in _PREFIXES.items():
        word = plain.removeprefix(prefix)
        base = UNITS[quantity].get(_BY_SPELLING.get(word, word)) if word != plain else None
        if base is not None and base.name in _WITH_PREFIXES and (power < 0 or base.name == "m"):  # hdeg: hundredths
            found = Unit(plain, base.multiply * 10.0 ** max(power, 0), base.divide * 10.0 ** max(-power, 0))
            return next((unit for unit in UNITS[quantity].values() if unit[1:] == found[1:]), found)
    return None


def _speed_named(plain: str) -> Unit | None:
    found = _OVER_TIME.fullmatch(plain)
    length = found and _plainly_named("range", found["length"] or found["short"])
    time = found and _plainly_named("time", found["time"] or found["inverse"])
    if not length or not time or time.name not in _OF_SPEEDS:
        return None
    factor = length.multiply / length.divide / _OF_SPEEDS[time.name]
    same = (unit for unit in _SPEEDS if math.isclose(unit.multiply / unit.divide, factor))
    return next(same, Unit(f"{length.name}/{time.name}", length.multiply, length.divide * _OF_SPEEDS[time.name]))


def _scaled(quantity: str, word: str) -> Unit | None:
    found = _FACTOR.fullmatch(word)
    unit = _plainly_named(quantity, found["unit"]) if found else None
    if found is None or unit is None:
        return None
    if found["power"]:
        factor = Fraction(10) ** int(found["power"])
    else:
        by = Fraction(found["by"] or 1)
        factor = Fraction(found["of"]) / by if by else Fraction(0)
    name = f"{word[: found.start('unit')].strip()} {unit.name}"
    return Unit(name, unit.multiply * factor.numerator, unit.divide * factor.denominator) if factor else None


def si_unit(quantity: str) -> Unit:
    """The SI unit of `quantity` (one of QUANTITIES)."""
    return next(iter(UNITS[quantity].values()))
