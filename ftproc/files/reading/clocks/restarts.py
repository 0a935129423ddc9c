"""Times of a clock that restarts while the target goes on: seconds that count to 60, counters of 16 or 32 bits."""

from __future__ import annotations

import bisect
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import row_named
from ftproc.files.units import UNITS, Unit
from ftproc.order_statistics import quantile
from ftproc.records import COMPONENTS, FloatArray, IntArray, MeasurementLog

_ROUND = {60.0: "each minute", 3600.0: "each hour"}  # s
_BITS, _USUAL_BITS = range(8, 41), (16, 32)  # of counters in the unit of the column; in ms or us
_STEPS = 20  # of the usual ones in a period, at least
_LONGER = 2.0  # times a long step, for one over a restart
_ROWS = 24  # from one session to the next
_MANY = 0.02  # of the rows; fewer are edited as outliers if their times are wrong
_FURTHER = 3.0  # times a long way from row to row, for that over a restart


def unwrapped(quantities: Mapping[str, FloatArray], unit: Unit) -> tuple[FloatArray, tuple[str, ...]]:
    """(n,) times that go on where their clock restarts, and a note; the times as they are where nothing proves it.

    quantities: (n,) in SI units, in file order. unit: of the times in the file. A restart is proven by a period that
    makes the step over it as long as others, each time, and by readings that go on over it as from row to row.
    """
    time_s = quantities["time"]
    row = np.flatnonzero(np.isfinite(time_s))
    known = time_s[row]
    step = np.diff(known)
    if (step >= 0).all() or not (step > 0).any():
        return time_s, ()
    long = quantile(step[step > 0], 0.95)
    for period, what in _periods(unit):
        least = -period / 2 if known.min() < 0 else 0.0
        falls = np.flatnonzero(step < -period / 2)
        within = least <= known.min() and known.max() < least + period and period > _STEPS * long
        if within and len(falls) and (step[falls] + period <= _LONGER * long).all() and _go_on(quantities, row, falls):
            turns = np.zeros(len(known))
            turns[falls + 1] = period
            whole = np.array(time_s)
            whole[row] = known + np.cumsum(turns)
            first, times = row_named(int(row[falls[0] + 1])), f"{len(falls)} times, first" if len(falls) > 1 else "once"
            added = f"{period * unit.divide / unit.multiply:.10g}"
            return whole, (f"the clock restarts {what}, {times} at {first}: {added} is added from there on",)
    return time_s, ()


def _periods(unit: Unit) -> Iterator[tuple[float, str]]:
    """The periods of clocks that restart, in s, and when they do."""
    yield from _ROUND.items()
    for each, bits in ((unit, _BITS), *((UNITS["time"][name], _USUAL_BITS) for name in ("ms", "us"))):
        yield from ((2.0**k * each.multiply / each.divide, f"as a counter of {k} bits does") for k in bits)


def sessions(log: MeasurementLog) -> str:
    """Where the time of a log starts again after many rows, as a clause; "" if it does not."""
    order = np.argsort(log.row, kind="stable")
    time_s, row = log.time_s[order], log.row[order]
    falls = np.flatnonzero(np.diff(time_s) < 0)
    if not len(falls) or len(time_s) < _ROWS * len(falls):
        return ""
    at = falls[0]
    return f"goes back from {time_s[at]:.10g} s to {time_s[at + 1]:.10g} s at {row_named(int(row[at + 1]))}"


def assumed(log: MeasurementLog) -> list[str]:
    """The condition of a log of which many rows would have to move to be in time order, unless the readings change less
    from row to row in that order than in that of the file."""
    if not log.rows_out_of_order:
        return []
    order = np.argsort(log.row, kind="stable")
    in_file = log.measurement[order]
    in_order: list[float] = []  # the longest row of times that do not decrease has as many
    for time in log.time_s[order].tolist():
        k = bisect.bisect(in_order, time)
        in_order[k : k + 1] = [time]
    share = 1 - len(in_order) / len(order)
    if share <= _MANY:
        return []
    used = np.flatnonzero(np.isfinite(in_file).any(0)).tolist()
    shorter = sum(_way(log.measurement[:, k], k) < _way(in_file[:, k], k) for k in used)
    if shorter > len(used) / 2:
        return []
    return [f"the times are right, by which {100 * share:.0f} % of the rows are out of order"]


def _way(values: FloatArray, component: int) -> float:
    """How far (n,) readings go from row to row, in all."""
    step = np.diff(values[np.isfinite(values)])
    return float(np.abs((step + np.pi) % (2 * np.pi) - np.pi if component == 1 else step).sum())


def _go_on(quantities: Mapping[str, FloatArray], row: IntArray, falls: NDArray[np.intp]) -> bool:
    """Whether most readings are no further from the row before, in the rows after the falls, than elsewhere."""
    alike: list[bool] = []
    for component in COMPONENTS:
        way = np.abs(np.diff(quantities[component][row])) if component in quantities else np.zeros(0)
        over = way[falls] if len(way) else way
        over = over[np.isfinite(over)]
        if len(over):
            alike += (over <= _FURTHER * quantile(way[np.isfinite(way)], 0.9)).tolist()
    return bool(alike) and float(np.mean(alike)) > 0.5
