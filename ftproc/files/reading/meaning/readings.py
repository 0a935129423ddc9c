"""Cells of a range, an azimuth or an elevation -> numbers in one unit: words and numbers that mean "no reading", units
in the cells, degrees, minutes and seconds in one column or three."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.files import arrow
from ftproc.files.reading.meaning import carried
from ftproc.files.reading.meaning.numbers import (
    Origin,
    as_text,
    finite,
    loosely,
    not_a_number,
    numbers,
    parsed,
    without_text,
)
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.reading.meaning.values import angles
from ftproc.files.units import UNITS, si_unit, unit_named
from ftproc.files.words import DEPRESSIONS
from ftproc.order_statistics import median, quantile
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

#: Words that mean "no reading" and are reported, beside those that every program writes; and marks without letters.
WORDS = (
    "nil", "NIL", "missing", "MISSING", "invalid", "INVALID", "void", "lost", "LOST", "no data", "NO DATA", "nodata",
    "NODATA", "\\N", "n.a.", "N.A.", "x", "X", "blank", "BLANK", "no track", "NO TRACK", "unknown", "dropout", "n/d",
    "N/D", "drop", "DROP", "bad", "BAD", "error", "ERROR", "out", "nan(ind)", "-nan(ind)", "нет", "нет данных", "无",
    "無", "#DIV/0!", "#VALUE!", "#REF!", "#NUM!", "#NAME?", "#NULL!", "<null>", "<NULL>", "(null)", "[]", "nan%",
)  # fmt: skip
_MARKS = r"^[-*?./_#]+$"
_A_WORD = r"^[^\d\s][^\d]{0,11}$"  # that stands repeatedly for a number
#: Numbers that mean "no reading" where they stand out.
_NINES = tuple(10.0**digits - 10.0**-k for digits in range(2, 8) for k in range(4))
_LIMITS = (
    *(32767.0, 32768.0, 65535.0, 1e10, 1e20, 1e30, 1e35, 1e37, 1e38, 1e99, 9.99e37, 9.99e99, 9.9e37, 9.96921e36),
    *(9.969209968386869e36, 3.402823e38, 3.4028235e38, 3.4028234663852886e38, 1.79769313486231e308),
)
_NO_RANGE = (0.0, -1.0)
NUMBERS = (*(sign * value for value in (*_NINES, *_LIMITS) for sign in (1, -1)), *_NO_RANGE)

_FEWEST = 10  # values among which one stands out
_FAR = 20.0  # typical steps from the neighbours, for a number that stands out among others
_WITH_UNIT = r"^(?P<number>[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[A-Za-z°º]+)$"
_MOST_WORDS = 3  # that stand for missing numbers in one column


class Readings(NamedTuple):
    """values: (n,) in the unit of `column`, NaN where missing. notes: what was done to the cells."""

    values: FloatArray
    column: Column
    notes: tuple[str, ...] = ()


def read(columns: Sequence[pa.ChunkedArray], origin: Origin, described: Column) -> Readings:
    """The readings of one quantity. Raises InputError for the first cell that is no finite number."""
    if "added" in described.roles:
        return _turned([numbers(column, origin) for column in columns], described)
    if len(columns) > 1 and described.quantity == "range":
        return _summed([numbers(column, origin) for column in columns], described)
    if len(columns) > 1:
        degrees, minutes, *seconds = (numbers(column, origin) for column in columns)
        carried.refuse_others(origin.source, described, degrees, minutes)
        sign = np.where(np.signbit(degrees), -1.0, 1.0)
        rest = seconds[0] if seconds else np.zeros(len(minutes))
        return Readings(angles.joined(sign, np.abs(degrees), minutes, rest), _in_degrees(described))
    (column,) = columns
    words: tuple[str, ...] = ()
    if without_text(column) is None:
        text = as_text(column)
        if parsed(text, origin.decimal_comma) is None:
            text, words = _without_words(text, described)
            column = text
            if parsed(text, origin.decimal_comma) is None:
                found = (
                    _hundreds(text, described)
                    or _in_words(text, origin, described)
                    or _with_units(text, origin, described)
                )
                if found is None:
                    raise origin.first_bad_cell(text, not_a_number(text, origin.decimal_comma))
                return found._replace(notes=(*words, *found.notes))
    values = loosely(column, origin)
    endless = np.isinf(values)
    if 1 < np.count_nonzero(endless) < len(values) / 2:
        words += (f'"{described.name}" is infinite {endless.sum()} times, which is taken for a missing reading',)
        values = np.where(endless, np.nan, values)
    values = finite(values, origin)
    if described.key in DEPRESSIONS:
        values = -values
        words += (f'"{described.name}" counts downwards and is turned round',)
    unpacked = angles.unpacked(values, described.notation, described.name, described.quantity)
    if unpacked is not None:
        return Readings(unpacked, _in_degrees(described), words)
    return Readings(values, described, words)


def _in_words(text: pa.ChunkedArray, origin: Origin, described: Column) -> Readings | None:
    """The angles of a column of degrees, minutes and perhaps seconds, or of quadrants; None if it is none."""
    if described.quantity == "range":
        return None
    values = angles.in_quadrants(text, origin) if described.quantity == "azimuth" else None
    values = angles.sexagesimal(text, origin) if values is None else values
    return None if values is None else Readings(values, _in_degrees(described))


def _turned(each: Sequence[FloatArray], described: Column) -> Readings:
    """Azimuths from north: those from the carrier's head and its heading, or from magnetic north and the variation."""
    stated = [unit_named("azimuth", word) for word in described.written]
    units = [unit or next(filter(None, stated), described.unit) for unit in stated]
    known = any(stated)
    if units[0] == units[1] and not known:
        return Readings(each[0] + each[1], described)
    total = units[0].to_si(each[0]) + units[1].to_si(each[1])
    return Readings(total, described._replace(unit=UNITS["azimuth"]["rad"], unit_in_name=True))


def _summed(lengths: Sequence[FloatArray], described: Column) -> Readings:
    """Ranges of which one column holds the whole km, another the m beyond."""
    units = [unit_named("range", word) or described.unit for word in described.written]
    total = np.sum([unit.to_si(values) for unit, values in zip(units, lengths, strict=True)], axis=0)
    return Readings(total, described._replace(unit=UNITS["range"]["m"], unit_in_name=True))


def without_sentinels(found: Mapping[str, Readings]) -> dict[str, Readings]:
    """The readings of all quantities without the numbers that mean "no reading", and a note on each such number. One
    that does in one quantity does so too in the others in the same row."""
    values = {quantity: each.values for quantity, each in found.items()}
    notes = {quantity: list(each.notes) for quantity, each in found.items()}
    gone: dict[tuple[str, float], np.ndarray] = {}
    for quantity in found:
        while (number := sentinel(values[quantity], quantity)) is not None:
            samples = values[quantity] == number
            for other in found:
                mine = samples & (values[other] == number)
                values[other] = np.where(mine, np.nan, values[other])
                gone[other, number] = gone.get((other, number), False) | mine
    for (quantity, number), samples in gone.items():
        count = int(np.count_nonzero(samples))
        times = "once" if count == 1 else f"{count} times"
        name = found[quantity].column.name
        if count:
            notes[quantity].append(f'"{name}" is {number:.10g} {times}, which is taken for a missing reading')
    return {q: Readings(values[q], each.column, tuple(notes[q])) for q, each in found.items()}


def undecided(found: Mapping[str, Readings]) -> bool:
    """Whether one of NUMBERS is left, which may stand out among more rows."""
    return any(_candidates(each.values, quantity) for quantity, each in found.items())


def _candidates(values: FloatArray, quantity: str) -> list[float]:
    """Those of NUMBERS that are among the values."""
    if not len(values):
        return []
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
    sought = [n for n in NUMBERS if low <= n <= high and (quantity == "range" or n not in _NO_RANGE)]
    return [number for number in sought if (values == number).any()]


def sentinel(values: FloatArray, quantity: str = "") -> float | None:
    """The first of NUMBERS that stands out, or None. Among _FEWEST values once is enough: how often it comes later must
    not change what a row is."""
    for number in _candidates(values, quantity):
        found, impossible = values == number, quantity == "range" and number < -1
        enough = impossible or len(values) >= _FEWEST or np.count_nonzero(found) > 1
        if enough and _stands_out(values, found, number, impossible):
            return number
    return None


def _stands_out(values: FloatArray, found: np.ndarray, number: float, impossible: bool) -> bool:
    """Whether a number is far from the other values, or at least from those beside it each time. impossible: unless
    others are negative too."""
    rest = values[~found & np.isfinite(values)]
    if not rest.size:
        return False
    if impossible and not (rest < 0).any():
        return True
    low, high = (quantile(rest, share) for share in (0.01, 0.99))
    gap = max(number - high, low - number)
    if gap > max(2 * (high - low), 1e-3 * abs(number)):
        return True
    steps = np.abs(np.diff(rest))
    typical = median(steps[steps > 0]) if (steps > 0).any() else 0.0
    known = np.flatnonzero(~found & np.isfinite(values))
    before = known[np.maximum(np.searchsorted(known, np.flatnonzero(found)) - 1, 0)]
    return bool(median(np.abs(values[before] - number)) > max(_FAR * typical, 1e-3 * abs(number)))


def _without_words(text: pa.ChunkedArray, described: Column) -> tuple[pa.ChunkedArray, tuple[str, ...]]:
    """The cells without words that stand for a missing number: known ones, and any that stand there repeatedly."""
    import pyarrow as pa
    import pyarrow.compute as pc

    is_word = pc.or_(pc.is_in(text, pa.array(WORDS, text.type)), pc.match_substring_regex(text, _MARKS))
    counts = pc.value_counts(pc.filter(text, pc.match_substring_regex(text, _A_WORD))).to_pylist()
    often = [each["values"] for each in counts if each["counts"] > 1 and each["counts"] < len(text) / 2]
    if 0 < len(often) <= _MOST_WORDS:
        is_word = pc.or_(is_word, pc.is_in(text, pa.array(often, text.type)))
    count = int(pc.sum(is_word).as_py() or 0)
    if not count or count == len(text) - text.null_count:
        return text, ()
    words = sorted(set(pc.unique(pc.filter(text, is_word)).to_pylist()))
    quoted = " and ".join(f'"{word}"' for word in words)
    times = "once" if count == 1 else f"{count} times"
    note = f'"{described.name}" is {quoted} {times}, which is taken for a missing reading'
    return pc.if_else(is_word, None, text), (note,)


def _in_degrees(described: Column) -> Column:
    return described._replace(unit=UNITS["azimuth"]["deg"], unit_in_name=True, notation="dms")


def _hundreds(text: pa.ChunkedArray, described: Column) -> Readings | None:
    """The angles of a column of mils whose hundreds stand apart, as gunners write them: 12-45; None if it is none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=r"^(?P<sign>[+-]?)(?P<hundreds>\d{1,2})-(?P<rest>\d\d)$")
    if not described.unit.name.startswith("mil") or fields.null_count > text.null_count:
        return None
    digits = pc.binary_join_element_wise(*(pc.struct_field(fields, k) for k in range(3)), "")
    return Readings(arrow.to_numpy(digits.cast(pa.float64())), described)


def _with_units(text: pa.ChunkedArray, origin: Origin, described: Column) -> Readings | None:
    """The readings of a column in which the unit stands in every cell; None if it is none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=_WITH_UNIT)
    if fields.null_count > text.null_count:
        return None
    written = [word for word in pc.unique(pc.struct_field(fields, "unit")).to_pylist() if word]
    from_north = described.quantity == "azimuth" and written in (["T"], ["TN"])
    each = {word: unit_named(described.quantity, word) for word in written}
    units = set(each.values())
    unit = next(iter(units)) if len(units) == 1 else None
    if None in units and not from_north:
        return None
    cells = pc.replace_substring(pc.struct_field(fields, "number"), ",", ".")
    values = numbers(pc.if_else(pc.equal(cells, ""), None, cells).cast(pa.float64()), origin)
    if len(units) > 1:  # 613.6 m ... 1.2 km
        factor = {word: found.multiply / found.divide for word, found in each.items() if found}
        words = pc.struct_field(fields, "unit").to_pylist()
        values = values * np.array([factor.get(word, np.nan) for word in words])
        unit = si_unit(described.quantity)
    return Readings(values, described if unit is None else described._replace(unit=unit, unit_in_name=True))
