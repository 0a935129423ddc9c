"""Which column may be which, of a log whose names do not say so: tried on the log, for a question and not for a guess.

A choice is proposed only where it gives a target that moves like one, and no other choice does nearly as well.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.reading import converting
from ftproc.files.reading.clocks import notations
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import carried, schema
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.numbers import as_text, parsed, without_text, without_unit
from ftproc.files.reading.meaning.questions import Proposal, Propose, answer, named
from ftproc.files.reading.meaning.values import motion, plausibility
from ftproc.files.units import UNITS, Unit
from ftproc.files.words import NOT_UNITS, OTHER_THINGS, QUANTITIES
from ftproc.order_statistics import median
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_UNNAMED = ("", "index", "__index_level_0__", "Unnamed: 0")
_OTHERS = OTHER_THINGS.union(("spd", "crs", "cse", "vel", "gs", "tas", "ias"))  # of speeds and courses
_COUNTERS = ("", *"nik", *("no", "nr", "num", "number", "row", "index", "idx", "id", "sample", "count", "seq", "frame"))
_ROWS = 2000
_MOST_COLUMNS, _MOST_TRIED, _SHOWN = 60, 7, 8
_RISES = 0.98  # of the steps of a time are forward
_CLEARLY = 10.0  # times likelier than any other choice
_STRAIGHT, _LEAST_TURN_RAD = 0.3, 0.03  # a path that no wrong choice gives, seen from a side
_TURNED_RAD, _GONE = 0.09, 0.05  # or a path that is bent, of which angles and range change so much
_NOISE_RAD, _MOST_NOISE_RAD = 1e-6, 0.02  # of the angles of an instrument
_SPEED_MPS = (0.3, 75_000.0)
_UPRIGHT_RAD = 1.65  # beyond any elevation
_FAR = 400.0  # a number that is no angle
_UNITS = {"range": (("m", 1.0), ("km", 0.5), ("nmi", 0.2)), "angle": (("deg", 1.0), ("rad", 1.0), ("gon", 0.3))}


class _Try(NamedTuple):
    """odds: how likely a choice of columns is. columns: of the quantities."""

    odds: float
    columns: Mapping[str, int]


def by_values(header: TableHeader) -> Propose:
    """How columns of a table are proposed."""
    return partial(_proposed, header)


def the_moments(header: TableHeader, free: Sequence[int]) -> int | None:
    """The column of timestamps or durations among those that have no name, as pandas writes its index; or None."""
    indices = [index for index in free if header.names[index] in _UNNAMED]
    table = header.load([], indices) if indices else None
    found = [index for k, index in enumerate(indices) if table is not None and _are_moments(table.column(k))]
    return found[0] if len(found) == 1 else None


def _are_moments(column: pa.ChunkedArray) -> bool:
    import pyarrow as pa

    if pa.types.is_temporal(column.type):
        return True
    return without_text(column) is None and bool(notations.matching(as_text(column), notations.STAMPS))


def _proposed(header: TableHeader, free: Sequence[int], found: Mapping[str, Sequence[int]]) -> Proposal:
    """found: the columns that are known, of each quantity."""
    indices = list(free)[:_MOST_COLUMNS]
    if not indices:
        return Proposal()
    if "time" in found and len(found) > 1:
        return _of_angles(header, indices, found)
    table = header.load([], indices).slice(0, _ROWS)
    cells = {index: table.column(k) for k, index in enumerate(indices)}
    numbers = {index: values for index, column in cells.items() if (values := _values(column, header)) is not None}
    joined = carried.joined(numbers)
    rough = {index: _roughness(cells[index], numbers.get(index)) for index in indices}
    shown = sorted(sorted(indices, key=rough.__getitem__)[:_SHOWN])
    seen = "; ".join(_shown(header, index, cells[index], numbers.get(index)) for index in shown)
    seen += f"; and {len(free) - len(shown)} more, which change less smoothly" if len(free) > len(shown) else ""
    cells = {index: cells[index] for index in cells if index in numbers or not {index - 1, index - 2} & {*joined}}
    times = [tuple(found["time"])] if "time" in found else list(_times(header, cells, numbers))
    if "time" not in found and found:  # only the time is sought
        only = [index for index in times if len(index) == 1]
        return Proposal(answer(header.names, {"time": only[0][0]}) if len(only) == 1 else "", seen)
    best = _best(header, times, numbers)
    if best is None:
        return Proposal(seen=seen)
    time, columns = best
    clock = "+".join(named(header.names[index], index) for index in time)
    return Proposal(answer(header.names, columns, "" if "time" in found else clock, joined), seen)


def _of_angles(header: TableHeader, free: Sequence[int], found: Mapping[str, Sequence[int]]) -> Proposal:
    """The angles that are wanting among columns whose names say nothing."""
    indices, free = free, [index for index in free if not _says_something(header.names[index])]
    if not free:
        return Proposal()
    known = {q: positions[0] for q, positions in found.items() if q != "time" and len(positions) == 1}
    wide = [*dict.fromkeys([*(index + k for index in free for k in range(3) if index + k in indices), *known.values()])]
    cells = dict(zip(wide, header.load([], wide).slice(0, _ROWS).columns, strict=True))
    numbers = {index: values for index, column in cells.items() if (values := _values(column, header)) is not None}
    joined = carried.joined(numbers)
    idle = [index for index in free if not _varies(cells[index], numbers.get(index))]
    wanted = [quantity for quantity in QUANTITIES[2:] if quantity not in found]
    unnamed = [index for index in free if index in numbers and index not in idle]
    unnamed = sorted(unnamed, key=lambda index: _bends(numbers[index]))[:_MOST_TRIED]
    if "range" not in known or len(known) < len(found) - 1 or not set(known.values()) <= set(numbers):
        return Proposal(idle=idle)
    fixed = {quantity: numbers[index] for quantity, index in known.items()}
    clock = _clock(header, tuple(found["time"]))
    choice = _likeliest(clock, fixed, {index: numbers[index] for index in unnamed}, [wanted])
    columns = {quantity: choice[quantity] for quantity in wanted} if choice else {}
    return Proposal(answer(header.names, columns, "", joined), "", columns, idle)


def _bends(values: FloatArray) -> float:
    """How unevenly numbers go on, as a share of all that they take; those of readings do so least."""
    known = values[np.isfinite(values)]
    return median(np.abs(np.diff(known, 2))) / np.ptp(known) if len(known) > 2 and np.ptp(known) > 0 else math.inf


def _roughness(column: pa.ChunkedArray, values: FloatArray | None) -> float:
    """The same, of text too."""
    return _bends(values) if values is not None else 0.0 if len(column.unique()) > 1 else math.inf


def _varies(column: pa.ChunkedArray, values: FloatArray | None) -> bool:
    if values is None:
        return len(column.unique()) > 1
    return bool(np.ptp(values[np.isfinite(values)]) > 0 and not (values[1:] == values[:-1] + 1).all())


def _says_something(name: str) -> bool:
    """Whether a name, or its unit, is that of a quantity or of something else."""
    apart = taken_apart(name)
    of_another = apart.unit and not apart.is_in_a_unit_of("azimuth") and any(map(apart.is_in_a_unit_of, QUANTITIES))
    return _is_other(name) or bool(of_another) or bool({apart.stem, *apart.words} & NOT_UNITS)


def _times(
    header: TableHeader, cells: Mapping[int, pa.ChunkedArray], numbers: Mapping[int, FloatArray]
) -> Iterator[tuple[int, ...]]:
    """Columns that may be the time: of text alone or two together, or of numbers that go forward and do not count."""
    texts = [index for index in cells if index not in numbers][:4]
    stamps = [(index,) for index in texts]
    written = [each for each in [*itertools.permutations(texts, 2), *stamps] if _goes(_clock(header, each))]
    yield from written
    forward = [index for index, values in numbers.items() if _goes(values) and not _is_other(header.names[index])]
    steady = [index for index in forward if (numbers[index][1:] == numbers[index][:-1] + 1).all()]
    spare = len(forward) > 1 or bool(written)
    counters = [index for index in steady if spare or header.names[index].lower().strip("#. ") in _COUNTERS]
    yield from ((index,) for index in forward if index not in counters)


def _goes(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return len(known) > 1 and float(np.ptp(known)) > 0 and bool(np.mean(known[1:] >= known[:-1]) > _RISES)


def _clock(header: TableHeader, indices: Sequence[int]) -> FloatArray:
    """(n,) the times of columns in s; empty if they are none."""
    other = next(index for index in range(len(header.names) + 1) if index not in indices)
    say = {"time": "+".join(str(index + 1) for index in indices), "range": str(other + 1)}
    try:
        column = schema.resolve(header.source, header.names, {}, say, header.units)["time"]
        table = header.load([], list(indices)).slice(0, _ROWS)
        return converting.converted(header, {"time": column}, table.columns).clock.time_s
    except InputError:
        return np.zeros(0)


def _best(
    header: TableHeader, times: Sequence[tuple[int, ...]], numbers: Mapping[int, FloatArray]
) -> tuple[tuple[int, ...], Mapping[str, int]] | None:
    """The time and the columns that make a target which moves like one, if no other choice nearly does."""
    for time in times[:3]:
        clock = _clock(header, time)
        varied = [
            index for index, values in numbers.items()
            if index not in time and np.ptp(values[np.isfinite(values)]) > 0 and not _is_other(header.names[index])
            and not (values[1:] == values[:-1] + 1).all()
        ]  # fmt: skip
        varied = sorted(varied, key=lambda index: _bends(numbers[index]))[:_MOST_TRIED]
        kinds = [QUANTITIES[1:]] if len(varied) > 2 else [QUANTITIES[1:3], QUANTITIES[2:]]
        choice = _likeliest(clock, {}, {index: numbers[index] for index in varied}, kinds)
        if choice is not None:
            return time, choice
    return None


def _likeliest(
    clock: FloatArray, fixed: Mapping[str, FloatArray], free: Mapping[int, FloatArray], kinds: Sequence[Sequence[str]]
) -> Mapping[str, int] | None:
    """The columns of quantities that make a target which moves like one, if no other choice nearly does. fixed: the
    readings that are known. free: of columns. kinds: the quantities that are sought together."""
    tries = [
        each
        for kind in kinds
        for indices in itertools.permutations(free, len(kind))
        for each in _tries(clock, fixed, dict(zip(kind, indices, strict=True)), free)
    ]
    tries.sort(key=lambda each: -each.odds)
    if tries and all(each.odds * _CLEARLY < tries[0].odds for each in tries if each.columns != tries[0].columns):
        return tries[0].columns
    return None


def _is_other(name: str) -> bool:
    """Whether a name says that the column is something else."""
    apart = taken_apart(name)
    return apart.foreign or not {apart.stem, *apart.words}.isdisjoint(_OTHERS)


def _tries(
    clock: FloatArray, fixed: Mapping[str, FloatArray], columns: Mapping[str, int], values: Mapping[int, FloatArray]
) -> Iterator[_Try]:  # fmt: skip
    """A choice of columns, in each of the common units in which the target moves like one."""
    either = {**fixed, **{quantity: values[index] for quantity, index in columns.items()}}
    readings = {quantity: either[quantity] for quantity in QUANTITIES if quantity in either}
    if len(clock) != len(next(iter(readings.values()))):
        return
    raw = {"time": clock, **readings}
    moved = motion.of(raw, {q: next(iter(UNITS[q].values())) for q in raw})
    angles = {q: UNITS[q]["rad"] for q in readings if q != "range"}
    sizes = plausibility.sizes_in(readings, angles)
    for (angle, a), (length, b) in itertools.product(_UNITS["angle"], _UNITS["range"]):
        if moved is None or not all(_fits(q, UNITS[q][angle], sizes[q]) for q in angles):
            continue
        names = {"time": "s", "range": length, "azimuth": angle, "elevation": angle}
        way = motion.Way(tuple(UNITS[q][names[q]] if q in raw else None for q in QUANTITIES))
        if _is_a_target(moved, way):
            yield _Try(moved.likelihood(way) * a * b, columns)


def _fits(quantity: str, unit: Unit, sizes: plausibility.Sizes) -> bool:
    upright = quantity == "azimuth" or sizes.most * unit.multiply / unit.divide < _UPRIGHT_RAD
    return upright and plausibility.fits(quantity, unit, sizes, False)


def _is_a_target(moved: motion.Motion, way: motion.Way) -> bool:
    """Whether something moves so: at a speed of things that move, with the noise of an instrument, straight or at least
    not as numbers would do that are something else."""
    noises, turn = moved.noises(way), moved.turn(way)
    if max(noises) > _MOST_NOISE_RAD or turn < _LEAST_TURN_RAD:
        return False
    if way.units[1] is None:
        return min(noises) > _NOISE_RAD and turn > _TURNED_RAD
    speed, bent = moved.speed(way), moved.bent(way)
    if speed is None or not _SPEED_MPS[0] < speed < _SPEED_MPS[1] or bent is None:
        return False
    if bent < _STRAIGHT:
        return way.units[3] is not None or moved.distance() > _FAR
    return way.units[3] is not None and min(noises) > _NOISE_RAD and turn > _TURNED_RAD and moved.gone() > _GONE


def _values(column: pa.ChunkedArray, header: TableHeader) -> FloatArray | None:
    """The numbers of a column; None of others."""
    values = without_text(column)
    if values is None:
        values = parsed(without_unit(as_text(column)), header.decimal_comma)
    return None if values is None or not np.isfinite(values).any() else values


def _shown(header: TableHeader, index: int, column: pa.ChunkedArray, values: FloatArray | None) -> str:
    """A column by its number, its cells in two rows, its limits, and what these allow."""
    name = "" if header.names[index] in ("", str(index + 1)) else f' "{header.names[index]}"'
    cells = " and ".join(str(cell) for cell in as_text(column.slice(0, 2)).to_pylist())
    if values is None:
        return f"{index + 1}{name}: {cells[:60]}"
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    possible = [] if low == high or _is_other(header.names[index]) else list(_possible(low, high))
    return f"{index + 1}{name}: {cells[:60]}, from {low:.6g} to {high:.6g}{' (' * bool(possible)}" \
           f"{' or '.join(possible)}{')' * bool(possible)}"  # fmt: skip


def _possible(low: float, high: float) -> Iterator[str]:
    if low > 0:
        yield "range"
    if low >= -180 and high <= 400:
        yield "azimuth"
    if (low >= -90 and high <= 90) or (low >= 0 and high <= 2 * math.pi):
        yield "elevation"
