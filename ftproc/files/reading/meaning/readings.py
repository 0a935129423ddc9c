"""Cells of a range, an azimuth or an elevation -> numbers in one unit: words and numbers that mean "no reading", units
in the cells, degrees, minutes and seconds in one column or three."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.files.reading.meaning.numbers import Origin, as_text, not_a_number, numbers, parsed, without_text
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import UNITS, unit_named
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

#: Words that mean "no reading" and are reported, beside those that every program writes.
WORDS = (
    *("*", "**", "***", "****", "*****", "******", "-", "--", "---", "----", "-----", ".", "..", "...", "?", "??"),
    *("nil", "NIL", "missing", "MISSING", "invalid", "INVALID", "void", "lost", "LOST", "no data", "NO DATA", "nodata"),
    *("NODATA", "\\N", "n.a.", "N.A.", "x", "X", "blank", "BLANK", "no track", "NO TRACK", "unknown", "dropout"),
)
#: Numbers that mean "no reading" where they stand out.
_NINES = tuple(10.0**digits - 10.0**-k for digits in range(2, 8) for k in range(4))
NUMBERS = tuple(sign * value for value in (*_NINES, 32768.0, 1e10, 1e20, 1e30, 1e35, 1e37) for sign in (1, -1))

_FAR = 20.0  # typical steps from the neighbours, for a number that stands out among others
_DMS = (
    r"^(?P<sign>[+-]?)(?P<deg>\d{1,3})\s*[°ºd:\- ]\s*(?P<min>\d{1,2})\s*(?:['’′m:\- ]\s*"
    r"(?:(?P<sec>\d{1,2}(?:[.,]\d*)?)\s*(?:\"|''|”|″|s)?)?)?$"
)
_WITH_UNIT = r"^(?P<number>[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[A-Za-z°º]+)$"
_MOST_TURN = 720.0  # deg


class Readings(NamedTuple):
    """values: (n,) in the unit of `column`, NaN where missing. notes: what was done to the cells.
    undecided: one of NUMBERS is left, which may stand out among more rows."""

    values: FloatArray
    column: Column
    notes: tuple[str, ...] = ()
    undecided: bool = False


def read(columns: Sequence[pa.ChunkedArray], origin: Origin, described: Column) -> Readings:
    """The readings of one quantity. Raises InputError for the first cell that is no finite number."""
    if len(columns) > 1:
        degrees, minutes, seconds = (numbers(column, origin) for column in columns)
        sign = np.where(np.signbit(degrees), -1.0, 1.0)
        return Readings(_joined(sign, np.abs(degrees), minutes, seconds), _in_degrees(described))
    (column,) = columns
    words: tuple[str, ...] = ()
    if without_text(column) is None:
        text = as_text(column)
        if parsed(text, origin.decimal_comma) is None:
            text, words = _without_words(text, described)
            column = text
            if parsed(text, origin.decimal_comma) is None:
                found = _degrees(text, origin, described) or _with_units(text, origin, described)
                if found is None:
                    raise origin.first_bad_cell(text, not_a_number(text, origin.decimal_comma))
                return found._replace(notes=(*words, *found.notes))
    values = numbers(column, origin)
    if described.notation in ("dms", "ddmmss", "dddmmss", "dmmss") and described.quantity != "range":
        return Readings(_from_digits(values), _in_degrees(described), words)
    values, sentinels = without_sentinels(values, described)
    low, high = (float(end.reduce(values)) for end in (np.fmin, np.fmax)) if len(values) else (0.0, 0.0)
    undecided = any(bool((values == number).any()) for number in NUMBERS if low <= number <= high)
    return Readings(values, described, (*words, *sentinels), undecided)


def without_sentinels(values: FloatArray, described: Column) -> tuple[FloatArray, tuple[str, ...]]:
    """(n,) values without the numbers that mean "no reading", and a note on each such number."""
    notes: list[str] = []
    while (number := _sentinel(values, described.quantity)) is not None:
        found = values == number
        count = int(np.count_nonzero(found))
        values = np.where(found, np.nan, values)
        times = "once" if count == 1 else f"{count} times"
        notes.append(f'"{described.name}" is {number:.10g} {times}, which is taken for a missing reading')
    return values, tuple(notes)


def _sentinel(values: FloatArray, quantity: str) -> float | None:
    """The first of NUMBERS that stands out, or None."""
    if not len(values):
        return None
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
    for number in NUMBERS:
        if low <= number <= high:
            found = values == number
            if found.any() and _stands_out(values, found, number, quantity == "range" and number < 0):
                return number
    return None


def _stands_out(values: FloatArray, found: np.ndarray, number: float, impossible: bool) -> bool:
    """Whether a number is far from the other values, or at least from those beside it each time."""
    rest = values[~found & np.isfinite(values)]
    if not rest.size:
        return False
    if impossible and not (rest < 0).any():
        return True
    if np.count_nonzero(found) < 2:
        return False
    low, high = np.quantile(rest, [0.01, 0.99])
    gap = max(number - high, low - number)
    if gap > max(2 * (high - low), 1e-3 * abs(number)):
        return True
    steps = np.abs(np.diff(rest))
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    places = np.flatnonzero(~found & np.isfinite(values))
    before = places[np.maximum(np.searchsorted(places, np.flatnonzero(found)) - 1, 0)]
    return bool(np.median(np.abs(values[before] - number)) > max(_FAR * typical, 1e-3 * abs(number)))


def _without_words(text: pa.ChunkedArray, described: Column) -> tuple[pa.ChunkedArray, tuple[str, ...]]:
    import pyarrow as pa
    import pyarrow.compute as pc

    said = pc.is_in(text, pa.array(WORDS, text.type))
    count = int(pc.sum(said).as_py() or 0)
    if not count or count == len(text) - text.null_count:
        return text, ()
    words = sorted(set(pc.unique(pc.filter(text, said)).to_pylist()))
    quoted = " and ".join(f'"{word}"' for word in words)
    times = "once" if count == 1 else f"{count} times"
    note = f'"{described.name}" is {quoted} {times}, which is taken for a missing reading'
    return pc.if_else(said, None, text), (note,)


def _in_degrees(described: Column) -> Column:
    return described._replace(unit=UNITS["azimuth"]["deg"], unit_in_name=True, notation="dms")


def _joined(sign: FloatArray, degrees: FloatArray, minutes: FloatArray, seconds: FloatArray) -> FloatArray:
    return sign * (degrees + (minutes + seconds / 60.0) / 60.0)


def _degrees(text: pa.ChunkedArray, origin: Origin, described: Column) -> Readings | None:
    """The angles of a column of degrees, minutes and perhaps seconds; None if it is none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if described.quantity == "range":
        return None
    fields = pc.extract_regex(text, pattern=_DMS)
    if fields.null_count > text.null_count:
        return None

    def part(name: str) -> FloatArray:
        cells = pc.replace_substring(pc.struct_field(fields, name), ",", ".")
        present = numbers(pc.if_else(pc.equal(cells, ""), None, cells).cast(pa.float64()), origin)
        return np.where(np.isfinite(degrees), np.nan_to_num(present), np.nan) if name != "deg" else present

    degrees = part("deg")
    sign = np.where(np.array([cell == "-" for cell in pc.struct_field(fields, "sign").to_pylist()]), -1.0, 1.0)
    minutes, seconds = part("min"), part("sec")
    wrong = (minutes >= 60) | (seconds >= 60) | (degrees > _MOST_TURN)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise origin.bad_cell(row, str(text[row]), "an angle in degrees, minutes and seconds")
    return Readings(_joined(sign, degrees, minutes, seconds), _in_degrees(described))


def _with_units(text: pa.ChunkedArray, origin: Origin, described: Column) -> Readings | None:
    """The readings of a column in which the unit stands in every cell; None if it is none."""
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=_WITH_UNIT)
    if fields.null_count > text.null_count:
        return None
    written = [word for word in pc.unique(pc.struct_field(fields, "unit")).to_pylist() if word]
    units = {unit_named(described.quantity, word) for word in written}
    unit = units.pop() if len(units) == 1 else None
    if unit is None:
        return None
    cells = pc.replace_substring(pc.struct_field(fields, "number"), ",", ".")
    values = numbers(pc.if_else(pc.equal(cells, ""), None, cells).cast(pa.float64()), origin)
    return Readings(values, described._replace(unit=unit, unit_in_name=True))


def _from_digits(values: FloatArray) -> FloatArray:
    """(n,) degrees of numbers whose digits are degrees, minutes and seconds: 1234506.7, or 123.45067."""
    sign: FloatArray = np.sign(values)
    size: FloatArray = np.abs(values)
    if size.size and np.nanmax(size) < 1000:
        size = size * 1e4
    size = np.round(size, 6)
    seconds: FloatArray = size % 100
    return _joined(sign, np.floor(size / 1e4), np.floor(size / 100) % 100, seconds)
