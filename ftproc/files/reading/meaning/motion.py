"""Units that nobody stated, judged by the motion: which of them make the target fly, the rate that of an instrument and
the noise that of its angles. One that is ten times likelier than all others is taken; else the user is asked."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import InputError
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import UNITS, Unit
from ftproc.files.words import QUANTITIES
from ftproc.order_statistics import median
from ftproc.records import FloatArray

_MOST_ROWS = 1000  # that are looked at
_FEWEST = 24
_BLOCKS = 24
_LARGER = 3.0  # times the step from row to row is the way of a target that moves
_CLEARLY = 10.0  # times likelier than any other
_STILL = 3.0  # times likelier must SI be than any other, to be taken without a word
_HIGHEST_ORDER = 5  # of the differences by which noise is judged

#: How likely a unit is where a name states none.
_PRIORS = {
    "time": dict.fromkeys(("s", "ms"), 1.0) | {"us": 0.3, "ns": 0.1, "min": 0.03, "h": 0.03, "d": 0.03},
    "range": {"m": 1.0, "km": 0.3, "ft": 0.1, "nmi": 0.1, "kft": 0.05, "kyd": 0.05, "mm": 0.03, "cm": 0.01},
    "angle": {"rad": 1.0, "deg": 0.05},
}
#: How likely a value is up to each limit, and beyond the last.
_STEP_S = (
    (2e-4, 1e-3),
    (9e-4, 0.01),
    (2.1e-3, 0.05),
    (4.9e-3, 0.3),
    (2.6, 1.0),
    (13, 0.3),
    (60, 0.02),
    (math.inf, 2e-3),
)
_SPEED = ((0.01, 1e-3), (0.05, 3e-3), (0.3, 0.01), (2, 0.1), (1000, 1.0), (3000, 0.1), (9000, 0.03), (12e3, 1e-4),
          (math.inf, 1e-6))  # fmt: skip
_RANGE_M = ((1, 1e-3), (20, 0.03), (400, 0.3), (5e5, 1.0), (5e6, 0.05), (math.inf, 1e-3))
_NOISE_RAD = ((5e-3, 1.0), (0.01, 0.3), (0.03, 0.02), (math.inf, 2e-3))


class _Sample(NamedTuple):
    """Some rows, in the units of the file: times (n,) and readings (n, 3); NaN in absent columns."""

    time: FloatArray
    readings: FloatArray


class _Choice(NamedTuple):
    """A unit for each quantity (None where absent), and how likely all of them are together."""

    units: Mapping[str, Unit]
    odds: float


def judged(
    source: str, quantities: Mapping[str, FloatArray], found: Mapping[str, Column], bare_time: bool
) -> dict[str, Column]:
    """The columns with the units decided that nobody stated. Raises InputError, a question, where several are likely.

    quantities: (n,) in SI units as `found` says. bare_time: the times are numbers of which nothing states the unit.
    """
    bare = [q for q in QUANTITIES[1:] if q in found and not found[q].unit_is_stated]
    angles = [q for q in bare if q != "range"]
    if any(found[quantity].unit.name != "rad" for quantity in angles):  # settled by the values alone
        angles = []
    open_ones = [*(["time"] if bare_time else []), *(["range"] if "range" in bare else []), *angles]
    samples = _samples(quantities, found) if open_ones else None
    if samples is None:
        return dict(found)
    choices = sorted(_choices(*samples, found, open_ones), key=lambda choice: -choice.odds)
    best = choices[0]
    standing = next(c for c in choices if all(c.units[q] == next(iter(UNITS[q].values())) for q in open_ones))
    rest = max((choice.odds for choice in choices if choice is not standing), default=0.0)
    if not best.odds or standing.odds >= _STILL * rest:
        return dict(found) | {q: found[q]._replace(unit=standing.units[q]) for q in open_ones}
    likely = [choice for choice in choices if choice.odds * _CLEARLY > best.odds]
    if len(likely) == 1:
        return dict(found) | {q: found[q]._replace(unit=best.units[q]) for q in open_ones}
    raise _question(source, found, likely, standing)


def _samples(quantities: Mapping[str, FloatArray], found: Mapping[str, Column]) -> tuple[_Sample, _Sample] | None:
    """The first rows with all that the log has, and such rows of the whole log, in time order; None for too few."""
    rows = np.flatnonzero(np.logical_and.reduce([np.isfinite(values) for values in quantities.values()]))
    if len(rows) < _FEWEST:
        return None
    return _in_file_units(quantities, found, rows[:_MOST_ROWS]), _in_file_units(
        quantities, found, rows[:: 1 + len(rows) // _MOST_ROWS]
    )


def _in_file_units(
    quantities: Mapping[str, FloatArray], found: Mapping[str, Column], rows: NDArray[np.intp]
) -> _Sample:  # fmt: skip
    rows = rows[np.argsort(quantities["time"][rows], kind="stable")]
    raw = {q: quantities[q][rows] * column.unit.divide / column.unit.multiply for q, column in found.items()}
    parts = [raw.get(quantity, np.full(len(rows), np.nan)) for quantity in QUANTITIES]
    return _Sample(parts[0], np.column_stack(parts[1:]))


def _choices(near: _Sample, far: _Sample, found: Mapping[str, Column], open_ones: Sequence[str]) -> list[_Choice]:
    ways: list[list[tuple[dict[str, Unit], float]]] = []
    for kind, members in (("time", ["time"]), ("range", ["range"]), ("angle", ["azimuth", "elevation"])):
        mine = [quantity for quantity in members if quantity in open_ones]
        if mine:
            priors = _PRIORS[kind].items()
            ways.append([({q: UNITS[q][name] for q in mine}, prior) for name, prior in priors])
    fixed = {quantity: column.unit for quantity, column in found.items()}
    choices, likelihood = [], _likelihoods(near, far)
    for way in itertools.product(*ways):
        units = fixed | {quantity: unit for each, _ in way for quantity, unit in each.items()}
        choices.append(_Choice(units, math.prod(prior for _, prior in way) * likelihood(units)))
    return choices


def _likelihoods(near: _Sample, far: _Sample) -> Callable[[Mapping[str, Unit]], float]:
    """How likely the rate, the speed, the distance and the noise of the angles are, by the units; each is found once
    for all choices that agree in the units it depends on."""

    @cache
    def rate(unit: Unit) -> float:
        steps = np.diff(unit.to_si(near.time))
        steps = steps[steps > 0]
        return _at(_STEP_S, median(steps)) if len(steps) else 1.0

    @cache
    def placed(units: tuple[tuple[str, Unit], ...]) -> tuple[FloatArray, float]:
        si = _in_si(far, dict(units))
        return _positions(si), _at(_RANGE_M, median(np.abs(si[:, 0])))

    @cache
    def noise(k: int, unit: Unit) -> float:
        angle = unit.to_si(near.readings[:, k])
        return _at(_NOISE_RAD, _noise(np.unwrap(angle) if k == 1 else angle))

    def likelihood(units: Mapping[str, Unit]) -> float:
        odds = rate(units["time"])
        if "range" in units:
            position, distance = placed(tuple((q, units[q]) for q in QUANTITIES[1:] if q in units))
            speed = _speed(units["time"].to_si(far.time), position)
            odds *= distance * (1.0 if speed is None else _at(_SPEED, speed))
        for k in (1, 2):
            if QUANTITIES[1 + k] in units:
                odds *= noise(k, units[QUANTITIES[1 + k]])
        return odds

    return likelihood


def _in_si(sample: _Sample, units: Mapping[str, Unit]) -> FloatArray:
    columns = [(q, sample.readings[:, k]) for k, q in enumerate(QUANTITIES[1:])]
    return np.column_stack([units[q].to_si(values) if q in units else values for q, values in columns])


def _positions(si: FloatArray) -> FloatArray:
    """(n, 3) positions in m; along one line where an angle is absent."""
    r, a, e = np.nan_to_num(si).T
    return np.column_stack([r * np.cos(e) * np.cos(a), r * np.cos(e) * np.sin(a), r * np.sin(e)])


def _speed(time_s: FloatArray, position: FloatArray) -> float | None:
    """The usual speed, or None if the way is hidden in the noise."""
    count = min(_BLOCKS, len(time_s) // 5)
    size = len(time_s) // count
    middle = np.median(position[: count * size].reshape(count, size, 3), axis=1)
    moment = np.median(time_s[: count * size].reshape(count, size), axis=1)
    way = float(np.linalg.norm(np.ptp(middle, axis=0)))
    step = median(np.linalg.norm(np.diff(position, axis=0), axis=1))
    past = np.diff(moment) > 0
    if way < _LARGER * step or not past.any():
        return None
    return median(np.linalg.norm(np.diff(middle, axis=0), axis=1)[past] / np.diff(moment)[past])


def _noise(angle: FloatArray) -> float:
    """The standard deviation of the noise, by the differences of that order in which the motion shows least."""
    found = math.inf
    for order in range(2, _HIGHEST_ORDER + 1):
        size = median(np.abs(np.diff(angle, order))) * 1.4826
        found = min(found, size / math.sqrt(math.comb(2 * order, order)))
    return found


def _at(table: Sequence[tuple[float, float]], value: float) -> float:
    return next((odds for limit, odds in table if value <= limit), 0.0)


def _question(
    source: str, found: Mapping[str, Column], likely: Sequence[_Choice], standing: _Choice
) -> InputError:  # fmt: skip
    differing = [q for q in found if len({choice.units[q].name for choice in (*likely, standing)}) > 1]
    shown = dict.fromkeys(",".join(f"{q}={choice.units[q].name}" for q in differing) for choice in (*likely, standing))
    names = " and ".join(f'"{found[q].name}"' for q in differing)
    return InputError(
        f"{source}: no unit is stated for {names}, and the motion of the target does not tell which it is. "
        f"Say {' or '.join(f'--units {each}' for each in shown)}."
    )
