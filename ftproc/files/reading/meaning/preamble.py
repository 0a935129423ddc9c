"""Units that lines above a table state: `Range unit: ft`, `# Units: time=s, range=ft`, `# range [mm], Hz [deg]`."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence

from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.units import unit_named
from ftproc.files.words import QUANTITIES

_UNIT = re.compile(r"\b(?:units?|einheit(?:en)?|unité?s?|unidad(?:es)?)\b(?:\s+(?:of|for|von|de))?", re.IGNORECASE)
_FACTOR = r"(?:(?:[x×*·]\s*)?\.?\d[\d.eE/^*+-]*\s*(?:[x×*·]\s*)?)?"  # before a unit: 0.1 m, 1/256 nmi
_NAME, _STATED = r"(?P<name>[^\W\d_][\w &/]*?)", r"[^\s=:;,|()\[\]]+"
_PAIRS = (  # the first that finds any
    re.compile(rf"{_NAME}\s*(?:[=:;,|\t(\[]+|\b(?:in|is|are)\b)\s*(?P<unit>{_FACTOR}{_STATED})"),
    re.compile(rf"{_NAME}\s+(?P<unit>{_STATED})"),
)
_IN_BRACKETS = re.compile(rf"{_NAME}\s*[\[(](?P<unit>[^\])]{{1,20}})[\])]")
_IN_UNITS_OF = re.compile(r"\bin units of\b", re.IGNORECASE)
_ALL = re.compile(r"^(?:all|the)\s+", re.IGNORECASE)
_IN = re.compile(  # ranges in feet; az, el in 0.01 deg
    r"(?P<name>[^\W\d_][\w &/,]*?)\s+(?:(?:is|are)\s+)?(?:given |expressed |written )?in\s+"
    rf"(?P<unit>{_FACTOR}[^\W\d_]+(?: miles)?)",
    re.IGNORECASE,
)
_SEVERAL = 2  # names with units in brackets in one line, which needs no word for units
_MOST_SPREAD = 12  # columns over a row of fewer units
_MOST_LINES, _LONGEST = 200, 300  # that are searched: above the table, and characters of one
#: Words for several columns -> their quantities.
_GROUPED: Mapping[str, Sequence[str]] = {
    **dict.fromkeys(("angle", "angles", "winkel"), QUANTITIES[2:]),
    **dict.fromkeys(("distance", "distances", "length", "lengths", "ranges"), QUANTITIES[1:2]),
    "times": QUANTITIES[:1],
}
#: The same by quantity.
GROUPS = {q: tuple(word for word, mine in _GROUPED.items() if q in (mine, *mine)) for q in QUANTITIES}
_RULE = re.compile(r"(?<!\S)[-=_]{3,}(?!\S)")
_ENUMERATED = re.compile(r"[\s#%;*]*+(?:columns?|col|fields?)?[\s.]*+#?(\d++)\s*+[:=.)-]\s*([^\W\d].*)", re.IGNORECASE)


def units_stated(above: Sequence[str], names: Sequence[str]) -> list[str]:
    """The unit of each column that the lines above the table state, "" where none; nothing if they state none."""
    apart = [taken_apart(name) for name in names]
    short = [line for line in above[-_MOST_LINES:] if len(line) <= _LONGEST]
    stated = {quantity: unit for line in short for quantity, unit in _pairs(line).items()}
    listed = next((units for line in short if (units := _listed(line, len(names)))), [""] * len(names))
    units = [
        "" if name.unit or name.notation else unit or _of(name, stated)
        for name, unit in zip(apart, listed, strict=True)
    ]
    return units if any(units) else []


def _pairs(line: str) -> dict[str, str]:
    """The quantities of a line and their units as written."""
    line = _IN_UNITS_OF.sub("in", line)
    if not _UNIT.search(line):
        found = _found(_IN_BRACKETS, line)
        return found if len(found) >= _SEVERAL else _found(_IN, line)
    return next(filter(None, (_found(pattern, _UNIT.sub(" ", line)) for pattern in _PAIRS)), {})


def _listed(line: str, columns: int) -> list[str]:
    """The units of all columns in their order, `Units: s, yd, deg, deg`; nothing of other lines."""
    _, word, behind = line.partition(found[0]) if (found := _UNIT.search(line)) else ("", "", "")
    units = re.split(r"\s*[,;|\t]\s*|\s+", behind.strip(" :=\t")) if word else []
    right = len(units) == columns and all(any(unit_named(q, unit) for q in QUANTITIES) for unit in units)
    return units if right else []


def _found(pattern: re.Pattern[str], line: str) -> dict[str, str]:
    return {
        quantity: pair["unit"]
        for pair in pattern.finditer(line)
        for word in re.split(r",?\s+and\s+|\s*[&/,]\s*", pair["name"])
        for name in (taken_apart(_ALL.sub("", word)),)
        for quantity in _GROUPED.get(name.stem, filter(name.means, QUANTITIES))
        if unit_named(quantity, pair["unit"])
    }


def _of(name: Name, stated: Mapping[str, str]) -> str:
    return next((unit for quantity, unit in stated.items() if name.means(quantity)), "")


def enumerated(above: Sequence[str], width: int) -> list[str] | None:
    """The names of columns that lines above the table number: `Column 2: range (m)`."""
    found = {int(match[1]): match[2].strip() for line in above if (match := _ENUMERATED.fullmatch(line))}
    return [found[k] for k in range(1, width + 1)] if sorted(found) == list(range(1, width + 1)) else None


def are_units(cells: Sequence[str]) -> bool:
    """Whether most cells are names of units."""
    words = [cell.strip("()[]{} ") for cell in cells]
    present = [word for word in words if word.strip("-")]
    known = sum(any(unit_named(quantity, word) is not None for quantity in QUANTITIES) for word in present)
    brackets = sum(bool(re.fullmatch(r"[(\[].*[)\]]", cell)) for cell in cells)
    return bool(present) and 2 * max(known, brackets) >= len(present)


def spread(units: Sequence[str], names: Sequence[str]) -> list[str]:
    """A row of fewer units than columns: each by the column whose unit it must be, with their order kept; "" where they
    leave it open; nothing where they fit in no way."""
    apart, words = [taken_apart(name) for name in names[:_MOST_SPREAD]], [unit.strip("()[]{} ") for unit in units]
    meant = [[quantity for quantity in QUANTITIES if name.means(quantity)] for name in apart]
    fits = [[not mine or any(unit_named(q, word) for q in mine) for mine in meant] for word in words]
    chosen = itertools.combinations(range(len(names)), len(words)) if len(apart) == len(names) else ()
    ways = [dict(zip(ks, units, strict=True)) for ks in chosen if all(fit[k] for fit, k in zip(fits, ks, strict=True))]
    each = ({way.get(k, "") for way in ways} for k in range(len(names)))
    return [mine.pop() if len(mine) == 1 else "" for mine in each] if ways else []


def ruled(lines: Sequence[str], first: int) -> list[int]:
    """The widths of columns of which each has a rule of its own above the rows, which begin with line `first`; nothing
    without such rules."""
    groups = next((found for line in lines[:first] if len(found := list(_RULE.finditer(line))) > 2), [])
    ends = [each.end() for each in groups][:-1]
    return [*(high - low for low, high in itertools.pairwise([0, *ends])), max(map(len, lines))] if ends else []
