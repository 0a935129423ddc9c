"""The name of a column taken apart: `RNG_KM`, `Az (deg)`, `slantRange/yd`, `CAT048.I040.RHO.val` -> stem and unit."""

from __future__ import annotations

import functools
import itertools
import re
import unicodedata
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ftproc.files.limits import LONGEST_NAME
from ftproc.files.units import unit_named
from ftproc.files.words import (
    ALIASES,
    BESIDE_A_UNIT,
    EITHER_ANGLE,
    NOT_UNITS,
    OF_TIMES,
    ONLY_BY_UNIT,
    OTHER_THINGS,
    QUALIFIERS,
    QUANTITIES,
    TRUE,
    TURNED,
    WEAK_ALIASES,
    ZENITH_ALIASES,
    plain_letters,
)

#: Opening and closing brackets, and what may stand before them. The patterns take time by the length of a name.
_OPENING, _CLOSING = ("(", "[", "{", "<"), (")", "]", "}", ">")
_BEFORE = " \t\n\r_.,:/-"
_LAST = re.compile(r"(.*\S)(?:\s*/\s*|\s+in\s+|\s*,\s*|[\s_.-]+)(\S+)", re.IGNORECASE)
_OVER_ALL = re.compile(r"(.*\S)(?:\s*/\s*|\s+in\s+|\s*,\s*)((?:[x*·]\s*)?\.?\d.*)", re.IGNORECASE)  # Range in 100 m
_SUPERSCRIPT = re.compile(r"(?<=10)[⁻⁺]?[⁰¹²³⁴-⁹]+")
_LIMITS_OF_VALUES = re.compile(  # 0-360
    r"(?:±|\+/?-)\s*\d[\d.]*|(?:[-+]|(?<![\d.]))\d+(?:\.\d+)*\.?\s*(?:-|–|to|\.\.+|…)\s*[-+]?\d[\d.]*"
)
#: A factor, or words of one, beside the unit in brackets.
_COUNTS = re.compile(
    r"^\W*(?:x\s*\.?)?\d|[x×*/·]\s*\.?\d|\b(?:lsbs?|counts?|ticks?|scaled?|factor|times"
    r"|(?:ten|hundred|thousand|million)(?:th)?s?)\b",
    re.IGNORECASE,
)
_FUNCTION = re.compile(r"(?:sin|cos|tan|log|ln|sqrt)\s*\(", re.IGNORECASE)
_INITIALS = re.compile(r"(?<![\w.])([^\W\d_])\. ?([^\W\d_])\.(?!\w)")  # z. d.
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_EASTERN, _LONGEST_UNIT = "\u2e80", 4  # letters from here on stand before a unit without a blank; of its letters
_NOT_WORDS = re.compile(r"(?:[^\w°]|_)+")
_OF_FRAMES = re.compile(r"(\d+(?:\.\d+)?)\s*(?:fps|frames?(?:\s*/\s*s| per second)?)", re.IGNORECASE)
_NUMBERED = re.compile(r"^\d+\s*[:=)]\s*(?=[^\W\d])")  # the number of a column before its name
#: Names that are nothing but how a time is written: hh:mm:ss.sss, min:sec, hhmmssddmmyy.
_CLOCK_FACE = re.compile(
    r"(?:yy|yyyy|mm|dd|ddd|doy)*(?:hh?mm?s{1,2}|hhmms{2}[sfm]+|hours?min(?:utes)?sec(?:onds)?)(?:dd|mm|yy|yyyy)*"
    r"|min(?:utes)?sec(?:onds)?|mmss[sf]*"
)
_SECONDS, _COUNTED_FROM = ("seconds", "secs", "sec"), frozenset(("of", "since", "after", "from"))
_OF_QUANTITIES = frozenset(itertools.chain(*ALIASES.values()))
_TIMES, _OF_UTC = ("time", "timestamp", "stamp", "t"), ("utc", "gmt")  # and what may stand behind them
_VALUE = re.compile(r"[._/](val|value)$", re.IGNORECASE)  # how decoders end the path of a value
_DAYS = re.compile(r"[\s_.([-](mjd|jd|doy|excel)[)\]]?", re.IGNORECASE)  # the count of days in a name

#: Units of other quantities.
_FOREIGN = frozenset(
    [
        *("m/s", "mps", "km/h", "kmh", "kph", "kt", "kts", "kn", "knots", "ft/s", "fps", "deg/s", "dps", "rad/s"),
        *("mrad/s", "hz", "khz", "mhz", "ghz", "db", "dbm", "v", "mv", "w", "k", "c", "degc", "°c", "degf", "hpa"),
        *("mbar", "pa", "ohm", "ohms", "ω", "ma", "amp", "amps"),
        *("%", "counts", "count", "raw", "m/s2", "m/s^2", "g", "ppm", "fl", "fpm", "ft/min", "nm/h", "rpm", "°/s"),
    ]
)
#: Words in brackets that are notations of a time or an angle.
_OF_CLOCKS = ("utc", "gps", "gpst", "gmt", "ut", "z", "zulu")
NOTATIONS = frozenset(
    [
        *(*_OF_CLOCKS, "utcg", "tai", "hms", "hhmmss", "dms", "ddmmss", "dddmmss", "dmmss", "degmin", "degminsec"),
        *("t", "true"),  # from true north
    ]
)

#: Words beside that of the zenith.
_VERTICAL = QUALIFIERS.union(ALIASES["elevation"], *WEAK_ALIASES.values()) - {"e", "alt", "altitude"}
_OF_SURVEYORS = frozenset((*WEAK_ALIASES["azimuth"], "v", "vz", *ZENITH_ALIASES)) - {"z"}  # whose unit g is the gon

_ALSO = {"degmin": "ddmm", "degminsec": "ddmmss", "utcg": "utc"}  # in other words; UTC in the Gregorian calendar
#: How else it is written that azimuths count clockwise from north.
EAST_OF_NORTH = re.compile(r"\+?\s*(?:E|east) (?:of|from) (?:due |true )?N(?:orth)?\b", re.IGNORECASE)
_SENSES = TRUE.union(*(words for words, _, _ in TURNED.values()))  # in brackets: from where bearings count
_SHORT = _SENSES.union(ZENITH_ALIASES)  # before a point that parts no path


class Name(NamedTuple):
    """text: as in the file. stem: small letters and digits. words: of the stem. unit: as written, or "".

    notation: one of NOTATIONS, or "". foreign: the unit is not that of a time, length or angle.
    """

    text: str
    stem: str
    words: tuple[str, ...]
    unit: str = ""
    notation: str = ""
    foreign: bool = False

    def means(self, quantity: str) -> int:
        """0: not this quantity; 1: by one of its names; 2: by a name that other things have too."""
        known = self.stem in ALIASES[quantity] or self.stem in WEAK_ALIASES[quantity]
        needs_unit = self.unit or (self.stem if known else self.core()) in ONLY_BY_UNIT
        if self.foreign or (needs_unit and not self.is_in_a_unit_of(quantity)):
            return 0
        for rank, aliases in ((1, ALIASES), (2, WEAK_ALIASES)):
            if self.stem in aliases[quantity]:
                return rank
        core = self.core()
        other = core != self.stem and core in (*ALIASES[quantity], *WEAK_ALIASES[quantity])
        return 2 if other or (quantity == "time" and (self._is_of_a_time() or self._is_a_clock_face())) else 0

    def _is_of_a_time(self) -> bool:
        """Whether it is a time with words that say whose it is, or from when it counts."""
        times = [word for word in self.words if word in _TIMES]
        if not times and not _COUNTED_FROM.isdisjoint(self.words):  # seconds since launch
            times = [word for word in self.words if word in _SECONDS]
        return len(times) == 1 < len(self.words) and OF_TIMES.issuperset({*self.words} - {*times})

    def _is_a_clock_face(self) -> bool:
        """Whether it is nothing but how a time is written."""
        return _CLOCK_FACE.fullmatch(self.stem) is not None and (not self.stem.startswith("mmss") or ":" in self.text)

    def core(self) -> str:
        """The stem without words that say nothing about the quantity, such as `radar1`."""
        idle = BESIDE_A_UNIT if self.unit else QUALIFIERS
        words = [word for word in self.words if word.rstrip("0123456789") not in idle]
        if not _OF_QUANTITIES.isdisjoint(words):  # such as theta_az
            words = [word for word in words if word not in EITHER_ANGLE]
        return "".join(word for k, word in enumerate(words) if not (k and word in _OF_UTC)).rstrip("0123456789")

    def is_zenith(self) -> bool:
        """Whether it names zenith angles."""
        alone = self.stem not in ONLY_BY_UNIT or self.is_in_a_unit_of("elevation")
        marked = [word for word in self.words if word in ZENITH_ALIASES and len(word) > 2]
        among = bool(marked) and _VERTICAL.issuperset({*self.words} - {*marked})
        return not self.foreign and alone and (among or bool({self.stem, self.core()} & set(ZENITH_ALIASES)))

    def is_in_a_unit_of(self, quantity: str) -> bool:
        """Whether its unit, or a notation of degrees, is one of the quantity."""
        packed = "dd" in self.notation and quantity in QUANTITIES[2:]
        return packed or bool(self.unit and unit_named(quantity, self.unit))


@functools.lru_cache(maxsize=4096)
def taken_apart(text: str, unit: str = "") -> Name:
    """A name, and the cell under it in a row of units (which wins)."""
    if max(len(text), len(unit)) > LONGEST_NAME:
        return Name(text, "", ())
    plain = compatible(text).strip().strip("\"'#%;!:").strip()
    plain = _INITIALS.sub(r"\1\2", EAST_OF_NORTH.sub("", _VALUE.sub("", _NUMBERED.sub("", plain))))
    if _is_a_clock(plain) or _FUNCTION.match(plain):
        return Name(text, _squeezed(plain), (_squeezed(plain),), foreign=not _is_a_clock(plain))
    *_, days = None, *_DAYS.finditer(plain)
    plain = days[1] + plain[days.end() :] if days else plain
    found, notation, foreign = "", "", False
    opening = plain.rfind(_OPENING[_CLOSING.index(plain[-1])]) if plain.endswith(_CLOSING) else -1
    if opening >= 0:
        before, inside = plain[:opening].rstrip(_BEFORE), plain[opening + 1 : -1].strip()
        known, squeezed = _unit_inside(inside), _squeezed(inside)
        if known:
            plain, found = before, known
        elif frames := _OF_FRAMES.fullmatch(inside):
            plain, notation = before, f"{frames[1]}fps"
        elif squeezed in NOTATIONS or "hh" in squeezed or "dd" in squeezed or "yy" in squeezed or _is_a_clock(inside):
            plain, notation = before, _ALSO.get(squeezed, squeezed)
        elif squeezed == "g" and not _OF_SURVEYORS.isdisjoint(_words(before)[1]):
            plain, found = before, "gon"
        elif inside.lower() in _FOREIGN:
            plain, foreign = before, True
        elif squeezed in ZENITH_ALIASES or plain_letters(inside).strip(". ") in _SENSES:
            plain = f"{before} {inside.strip('. ')}"
        elif inside:
            plain, found = before, inside
    elif not _is_name(plain):
        plain, found, foreign = _suffix(plain)
        if found in NOTATIONS:
            found, notation = "", found
    if unit:
        inside = compatible(unit).strip().strip("()[]{}<>").strip()
        foreign = inside.lower() in _FOREIGN
        squeezed = _squeezed(inside)
        if _is_unit(inside):
            found = inside
        elif squeezed in NOTATIONS or "hh" in squeezed or "dd" in squeezed:
            notation = squeezed
        elif inside.strip("-"):
            found = found or ("" if foreign else inside)
    stem, words = _words(plain)
    return Name(text, stem, words, found, notation, foreign)


def units_unknown(apart: Sequence[Name], free: Sequence[int], quantity: str) -> Iterator[tuple[int, str]]:
    """Column and unit, where a name of the quantity has a unit that is none of its units."""
    weak = {alias for alias in WEAK_ALIASES[quantity] if len(alias) > 2}.difference(ONLY_BY_UNIT)
    others = OTHER_THINGS.union(QUALIFIERS, _OF_QUANTITIES)
    for index, name in ((index, apart[index]) for index in free):
        height = quantity == "elevation" and unit_named("height", name.unit)
        if name.foreign or height or NOT_UNITS & {*name.words, name.unit.lower()} or name.means(quantity):
            continue
        long = len(name.stem) > 1 or any(unit_named(quantity, word) for word in name.unit.split())
        if name.unit and ((name.stem in ALIASES[quantity] and long) or name.stem in weak):
            yield index, name.unit
        elif not name.unit and len(name.words) > 1 and name.words[-1].isalpha():
            before, last = name._replace(words=name.words[:-1]), name.words[-1]
            if last not in others and before.core() in weak.union(ALIASES[quantity]):
                yield index, last


def compatible(text: str) -> str:
    """Letters and digits without their forms; exponents of ten stay exponents."""
    with_powers = _SUPERSCRIPT.sub(lambda power: f"^{power[0]}", text.replace("º", "°"))
    return unicodedata.normalize("NFKC", with_powers).replace("\u2212", "-")


def _unit_inside(text: str) -> str:
    """The unit in brackets, perhaps among other words; a factor that is not plain makes it none."""
    if _is_unit(text) or _COUNTS.search(_LIMITS_OF_VALUES.sub("", text)):
        return text if _is_unit(text) else ""
    return next((part for part in re.split(r"[\s,;]+", text) if _is_unit(part)), "")


def _is_a_clock(text: str) -> bool:
    """Whether it is how a time is written: mm:ss.s, hhmmss.ss."""
    face = _squeezed(text)
    digits = face.startswith("hh") and re.fullmatch(r"[A-Za-z.]+", text) is not None
    return (":" in text or digits) and _CLOCK_FACE.fullmatch(face) is not None


def _squeezed(text: str) -> str:
    """A notation such as `hh:mm:ss.sss` as hhmmss."""
    return re.sub(r"s{2,}$", "ss", re.sub(r"[^a-z]", "", text.lower()))


def _is_unit(word: str) -> bool:
    return any(unit_named(quantity, word) is not None for quantity in QUANTITIES)


def _is_name(text: str) -> bool:
    """Whether the whole text is a name without a unit: `sec`, `gps_sec`, `epoch`."""
    key = _NOT_WORDS.sub("", re.split(r"[./]", text.lower())[-1])
    if key in ("ts", "azm") and text.lower() != key:  # t_s is a time in s, TS a time stamp; AZ_M holds minutes
        return False
    return any(key in table[quantity] for table in (ALIASES, WEAK_ALIASES) for quantity in QUANTITIES)


def _suffix(text: str) -> tuple[str, str, bool]:
    """Name, unit and whether it is foreign, of a name that may end in its unit: `az_deg`, `elDeg`, `Az°`."""
    if text.endswith(("°", "º")):
        return text[:-1], "deg", False
    scaled = _OVER_ALL.fullmatch(text)
    if scaled and _is_unit(scaled[2]):
        return scaled[1], scaled[2], False
    found = _LAST.fullmatch(text)
    if found and found[1].lower().endswith((" of", "_of")):  # seconds of day
        return text, "", False
    if found and found[2].lower() in _FOREIGN and found[2].lower() not in ("raw", "v", "c", "k", "g", "w", "hz"):
        return found[1], "", True
    if found:
        longer = _LAST.fullmatch(found[1])
        pair = f"{longer[2]} {found[2]}" if longer else ""
        if longer and len(found[2]) > 1 and _is_unit(pair) and not _is_unit(found[2] + found[2]):
            return _without_in(longer[1]), pair, False
        if _is_unit(found[2]):
            return _without_in(found[1]), found[2], False
    if found and found[2].lower() in NOTATIONS.difference(_OF_CLOCKS):
        return found[1], found[2].lower(), False
    for k in range(max(1, len(text) - _LONGEST_UNIT), len(text)):  # 斜距km
        if text[k - 1] > _EASTERN and _is_unit(text[k:]) and _is_name(text[:k]):
            return text[:k], text[k:], False
    parts = _CAMEL.split(text)
    if len(parts) > 1 and len(parts[-1]) > 1 and _is_unit(parts[-1]):
        return "".join(parts[:-1]), parts[-1], False
    return text, "", False


def _without_in(text: str) -> str:
    return re.sub(r"(?<!\s)\s+in$", "", text, flags=re.IGNORECASE)


def _words(text: str) -> tuple[str, tuple[str, ...]]:
    """Stem and words of the last part of a path such as `CAT048.I040.RHO`; `Rel. Bearing` is none."""
    text = re.sub(r"(?<!\w)(\w+)\.\s+", lambda of: of[1] + " " if plain_letters(of[1]) in _SHORT else of[0], text)
    context, _, last = text.rpartition("/") if "/" in text else text.rpartition(".")
    parts = _NOT_WORDS.split(last.lower())
    around = set(_NOT_WORDS.split(context.lower())) - {""}
    letter = len(last) == 1 and not around <= QUALIFIERS  # such as Mode 3/A
    if letter or not re.search(r"[^\W\d_]", last) or all(part in QUALIFIERS for part in parts if part):  # Az.Angle
        last = text
    words = tuple(word for word in _NOT_WORDS.split(plain_letters(_CAMEL.sub(" ", last))) if word)
    if len(words) > 1 and words[0].isdigit():  # such as 048_040_RHO
        digits = [k for k, word in enumerate(words) if word.isdigit()]
        words = words[next((k for k in range(len(words)) if k not in digits), 0) :]
    return "".join(words), words
