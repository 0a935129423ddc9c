"""What is said beside a table of its units and conventions: in columns of units, and in the lines above it, about which
the user is asked where the program would take them otherwise."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ftproc.errors import InputError, quoted
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import parts, wording
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.numbers import as_text, parsed
from ftproc.files.reading.meaning.preamble import GROUPS
from ftproc.files.reading.meaning.questions import answer, counts_frames, refuse_frames
from ftproc.files.units import unit_named
from ftproc.files.words import ALIASES, COUNTS, DEPRESSIONS, QUANTITIES
from ftproc.order_statistics import quantile
from ftproc.settings import Station

_OF_UNITS, _VALUE = ("units", "unit", "uom", "einheit", "unité"), ("value", "val")  # how names of columns end
#: Words of what readings are multiplied by or what is added to them, and a number that changes something.
_SCALES = r"\b(?:scale|factor|multipl\w+|divid\w+|offset)\b[^,;|]{0,25}?"
_BY, _RANGE = r"(?!0*1?(?:\.0*)?(?![\d.]))(?<![\d.])\d", r"\b(?:range|distance)s?\b[^,;|]{0,25}?"
#: What a line above the table may say -> the quantity that it is about, what that means, and the options that say it.
_CONVENTIONS = (
    (r"two[- ]?way|round[- ]?trip|there and back|\b2\s?R\b|hin-? und (?:her|rück)|aller[- ]?retour|andata e ritorno"
     r"|ida y vuelta|往返", "range", "ranges there and back", "--units 'range=0.5 m' (half of each)"),
    (r"(?:ranges?|distances?|entfernungen|strecken)\s+(?:(?:are|is|sind)\s+)?(?:horizontal\b(?! angle)|reduced to)"
     r"|horizontal(?:ly)?[ _-]?(?:ranges?|distan\w+|entfernung)|\b(?:as|are|:) ground ranges\b",
     "range", "horizontal distances", "--columns range=none, or divide them by the cosine of the elevation"),
    (f"{_RANGE}{_SCALES}{_BY}|{_SCALES}{_RANGE}{_BY}",
     "range", "a factor or an offset", "--units 'range=10 m' (what one is worth), or the bias in a --config FILE"),
    (r"zenith(?:al)?[ -](?:distance|angle)", "elevation", "angles from the zenith", "--elevation-from zenith"),
    (rf"(?:elev\w*|\bel|angles?)\b[^,;|]{{0,30}}?(?:{wording.DOWNWARD})",
     "elevation", "angles below the horizontal", "so by naming the column Depression"),
    (r"south is zero|(?:zero at|counted from) (?:the )?south\b|(?:\baz\w*|bearings?|richtung\w*)\b[^;|]{0,40}?"
     r"(?:(?:from|\bzero(?: is)?(?: at| in|\s*[:=])?|\bab|\bvon|depuis(?: le)?|desde el)\s*(?:the )?"
     r"(?:south|süd(?:en)?|sud|sur|S)\b|\bS(?:outh)?\s*=\s*0\b)",
     "azimuth", "azimuths from south", "--config FILE with from = \"north\" and zero_deg = 180 under [azimuth] in it"),
)  # fmt: skip

#: Words of lines that say what one count is worth; the worth of one, or of many.
_OF_COUNTS = re.compile(
    r"\b(?:lsbs?|scal(?:e factor|ed|ing)|counts?|ticks?)\b|\bscale\b(?=\D{0,20}0?\.\d)", re.IGNORECASE
)
_MANY = re.compile(
    r"\b(?P<many>\d+)\s*(?:counts?|ticks?|lsbs?)\s*(?:=|:|per\b|is\b|are\b|make\b|to\b|in\s+(?=an?\b|one\b))\s*"
    r"(?:an?\s+|one\s+)?(?P<number>[\d.]*)\s*(?P<unit>°|[^\W\d]\w*)",
    re.IGNORECASE,
)
_ONE = re.compile(r"(?<![\w.])(?P<worth>\.?\d[\d.eE/^*+-]*\s*(?:[^\W\d]\w*|°))(?!\s*[=:])")
_STEP = 0.02  # of a turn, at most, from row to row, in counts of an encoder
_COUNTDOWN = re.compile(
    r"(?:t|time)(?:to|till|until|before)\w+|(?:t|time)(?:minus|remaining|left)|countdown|remainingtime|tgo|ttg"
)
_LONGEST_LINE = 300  # characters
_NUMBER = r"(\d{1,7}(?:[.,]\d{1,9})?)"
_SAMPLED = r"(?:frame|sampl\w*|update|data|output|logging|recording|measurement|acquisition|scan|image|abtast|bild)"
#: How many frames there are in a second, or what one takes.
_RATES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_NUMBER}\s*(?:fps\b|(?:frame|sample|point|record|reading|image|scan)s?\s*(?:/|per|a)\s*s(?:ec(?:ond)?)?\b)",
        rf"(?:\bfs|\brate|{_SAMPLED}[\s_-]*(?:rate|frequency|frequenz)?)[^\d\n]{{0,5}}{_NUMBER}\s*hz\b",
        rf"(?:\bfps|\bfs|{_SAMPLED}[\s_-]*(?:rate|frequency|frequenz))\s*[:=,;]\s*{_NUMBER}\s*$",
    )
)
_INTERVAL = re.compile(
    rf"(?:\bdt|delta[\s_]?t|Δt|\bts|(?:{_SAMPLED}|time)[\s_-]*(?:interval\w*|period|step|spacing)|\bevery)"
    rf"\s*(?:[:=,;]|is|of)?\s*{_NUMBER}\s*([^\W\d]*)\s*(?:$|[,;)])",
    re.IGNORECASE,
)


def by_counts(header: TableHeader) -> tuple[TableHeader, int, str] | None:
    """The header, the column whose name says that it counts days of the year or parts of a day, and its unit; or, with
    a note, one of frames or samples, by the rate that its name or a line above the table states. None of other tables.
    Raises InputError for several rates, and for a time that counts down."""
    apart = [taken_apart(name) for name in header.names]
    of_days = {k: "d" for k, name in enumerate(apart) if parts.is_day_of_year(name) and _goes_on(header, k, 0.0)}
    of_day = {k: unit or "d" for k, name in enumerate(apart) if (unit := parts.unit_of_day(name)) is not None}
    alone = {k: unit for k, name in enumerate(apart) if (unit := parts.unit_alone(name))}
    growing = ({k: unit for k, unit in each.items() if _goes_on(header, k, 0.0)} for each in (of_day, alone))
    for counted in (of_days, *growing):
        if len(counted) == 1:
            return header, *counted.popitem()
    counting = [k for k, name in enumerate(apart) if counts_frames(name) and _goes_on(header, k)]
    readings = any(name.means(quantity) for name in apart for quantity in QUANTITIES[1:])
    if readings:
        _refuse_countdown(header)
    if not readings or not counting:
        return None
    index = next((k for k in counting if {"frame", "frames", "sample", "samples"} & {*apart[k].words}), counting[0])
    lines = (*(line for line in header.above if len(line) <= _LONGEST_LINE), header.names[index])
    stated = {unit: line.strip() for line in lines for unit in _frames_of(line)}
    if not stated:
        return None
    if len(stated) > 1:
        refuse_frames(header.source, header.names, index, [*stated])
    ((unit, line),) = stated.items()
    return header.noting(f'"{header.names[index]}" is the time in steps of {unit}, by "{line[:80]}"'), index, unit


def _refuse_countdown(header: TableHeader) -> None:
    for k, name in enumerate(header.names):
        if _COUNTDOWN.fullmatch(taken_apart(name).stem) and _goes_on(header, k, 0.0, -1.0):
            raise InputError(
                f'{header.source}: column "{name}" counts down to an event, and a time counts up. Write minus its '
                "numbers (10 s before the event are -10) and name it time_s."
            )


def _frames_of(line: str) -> list[str]:
    """What a frame takes by a line, such as 1/25 s."""
    rates = [f"1/{found[1].replace(',', '.')} s" for pattern in _RATES for found in pattern.finditer(line)]
    steps = [f"{found[1].replace(',', '.')} {found[2] or 's'}" for found in _INTERVAL.finditer(line)]
    return [unit for unit in dict.fromkeys(rates + steps) if unit_named("time", unit)]


def _goes_on(header: TableHeader, index: int, whole: float = 1.0, sign: float = 1.0) -> bool:
    """Whether a column holds numbers that grow from row to row, or fall for sign -1, and whole ones unless `whole` is
    zero."""
    values = parsed(as_text(header.load([], [index]).column(0)), header.decimal_comma)
    grow = values is not None and len(values) > 1 and bool((sign * np.diff(values) > 0).all())
    return grow and values is not None and not (whole and (values % whole).any())


def with_units_beside(header: TableHeader) -> TableHeader:
    """The header with the units that columns of their own state: `Range unit` beside `Range`. Raises InputError where
    such a column names several."""
    about = {index: base for index, name in enumerate(header.names) if (base := _before(name, _OF_UNITS)) is not None}
    plain = [name.lower() if (base := _before(name, _VALUE)) is None else base for name in header.names]
    units = list(header.units) or [""] * len(header.names)
    for index, base in about.items():
        fits = [k for k, name in enumerate(plain) if k != index and name == base]
        if len(fits) != 1 or not base:
            continue
        cells = {cell.strip() for cell in as_text(header.load([], [index]).column(0)).unique().to_pylist() if cell}
        known = {cell for cell in cells if any(unit_named(quantity, cell) for quantity in QUANTITIES)}
        if len(known) > 1:
            raise InputError(
                f'{header.source}: column "{header.names[index]}" names several units, {" and ".join(sorted(known))}; '
                f'one is understood. Convert "{header.names[fits[0]]}" to one of them.'
            )
        if known and known == cells and not units[fits[0]]:
            units[fits[0]] = known.pop()
    if bits := _of_encoders(header, units):
        header = header.noting(f"the azimuth turns at {2**bits}, so its counts are those of an encoder of {bits} bits")
    return replace(header, units=units) if any(units) else header


def _of_encoders(header: TableHeader, units: list[str]) -> int:
    """The bits of the encoder whose counts an azimuth is, by the number at which it turns; 0 of others. They become the
    unit of both angles in counts."""
    apart = [taken_apart(*each) for each in zip(header.names, units, strict=True)]
    words = [re.findall(r"[^\W\d_]+", name.text.lower()) for name in apart]
    bare = [k for k, name in enumerate(apart) if not name.unit and not COUNTS.isdisjoint(words[k])]
    mine = {q: [k for k in bare if not set(ALIASES[q]).isdisjoint(words[k])] for q in QUANTITIES[2:]}
    if len(mine["azimuth"]) != 1 or len(mine["elevation"]) > 1:
        return 0
    counts = parsed(as_text(header.load([], mine["azimuth"]).column(0)), header.decimal_comma)
    counts = np.zeros(0) if counts is None else counts[np.isfinite(counts)]
    if not counts.size or (counts % 1).any() or not 2**7 <= counts.max() < 2**32 or counts.min() < 0:
        return 0
    bits = int(counts.max()).bit_length()
    steps = np.abs(np.diff(counts))
    upper = float(np.mean(counts >= 2 ** (bits - 1)))
    if not _STEP < upper < 1 - _STEP or quantile(steps, 0.9) > _STEP * 2**bits or steps.max() < (1 - _STEP) * 2**bits:
        return 0
    for k in (*mine["azimuth"], *mine["elevation"]):
        units[k] = f"{bits} bit"
    return bits


def _before(name: str, endings: Sequence[str]) -> str | None:
    """What stands before one of the endings in a name, in small letters; None without one."""
    small = name.lower()
    ending = next((ending for ending in endings if small.endswith(ending)), None)
    return None if ending is None else small[: -len(ending)].rstrip(" ._/-")


def refuse_unheard(header: TableHeader, station: Station, stated: Mapping[str, str]) -> None:
    """Ask where a line above the table says a convention, or the worth of a count, that nothing else has settled.
    stated: the units that the user has named."""
    _refuse_counts(header, stated)
    names = [taken_apart(name) for name in header.names]
    settled = {
        "range": "range" in stated or not any(name.means("range") for name in names),
        "elevation": station.elevation_from is not None
        or any(name.is_zenith() or wording.key_of(name.text, "elevation", name.stem) in DEPRESSIONS for name in names),
        "azimuth": station.azimuth_from is not None or station.azimuth_zero_rad != 0.0,
    }
    for pattern, quantity, what, say in _CONVENTIONS:
        if settled[quantity]:
            continue
        mine = [(k, name.text) for k, name in enumerate(names) if name.means(quantity)]
        mine = mine or [(k, name.text) for k, name in enumerate(names) if {*name.words} & {*ALIASES[quantity]}]
        line = next((line for line in header.above if re.search(pattern, line, re.IGNORECASE)), "").strip()[:80]
        where = f'a line above the table, "{line}",' if line else ""
        if quantity != "elevation":  # whose names are heard
            named = next((text for _, text in mine if re.search(pattern, text, re.IGNORECASE)), "")
            where = where or (f'the name of column "{named}"' if named else "")
        if where:
            if quantity == "range":
                say = say if say.startswith("--columns") else f"{answer(header.names, {'range': mine[0][0]})} {say}"
            otherwise = {"range": "--units range=m", "elevation": "--elevation-from horizon",
                         "azimuth": "--azimuth-from north"}[quantity]  # fmt: skip
            raise InputError(
                f"{header.source}: {where} speaks of {what}. If these are such, say {say}; if not, {otherwise}."
            )


def _refuse_counts(header: TableHeader, stated: Mapping[str, str]) -> None:
    """Ask where a line above the table says what one count is worth, and columns of whole numbers without a unit may
    hold such counts. stated: the units that the user has named."""
    apart = [taken_apart(*each) for each in zip(header.names, header.units or [""] * len(header.names), strict=True)]
    bare = {k: name for k, name in enumerate(apart) if not name.unit}
    for line in header.above:
        worth = _worth(line)
        words = {taken_apart(word).stem for word in re.split(r"\W+", line)}
        fits = [q for q in QUANTITIES if worth and unit_named(q, worth)]
        fits = [q for q in fits if any(len(word) > 1 and word in (*ALIASES[q], *GROUPS[q]) for word in words)] or fits
        mine = {q: k for q in fits if q not in stated for k, name in bare.items() if name.means(q)}
        if mine and all(_are_whole(header, k) for k in mine.values()):
            hold = " and ".join(f'"{header.names[k]}"' for k in mine.values()) + " hold" + "s" * (len(mine) == 1)
            unit = re.sub(r"^[\d./]+\s*", "", worth)
            counts, plain = (quoted(",".join(f"{q}={each}" for q in mine)) for each in (worth, unit))
            raise InputError(
                f'{header.source}: a line above the table, "{line.strip()[:80]}", says what a count is worth. If '
                f"{hold} such counts, say --units {counts}; if not, --units {plain}."
            )


def _worth(line: str) -> str:
    """What one count is worth by a line, such as 0.1 m or 360/65536 deg; "" of other lines."""
    if len(line) > _LONGEST_LINE or not _OF_COUNTS.search(line):
        return ""
    if (many := _MANY.search(line)) and int(many["many"]) > 1:
        return f"{many['number'] or 1}/{many['many']} {many['unit']}"
    if re.search(r"\b(?!1\b)\d+\s*(?:counts?|ticks?)\b", line):  # how many there are
        return ""
    each = (one["worth"] for one in _ONE.finditer(_OF_COUNTS.sub("", line)))
    return next((worth for worth in each if any(unit_named(q, worth) for q in QUANTITIES)), "")


def _are_whole(header: TableHeader, index: int) -> bool:
    values = parsed(as_text(header.load([], [index]).column(0)), header.decimal_comma)
    return values is not None and bool((np.round(values) == values)[np.isfinite(values)].all())
