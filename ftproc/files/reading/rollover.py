"""Clocks that begin again: seconds of the day at midnight, seconds of the GPS week at its end.

Sorted by time, the part after midnight would come before the other, and a wrong trajectory with it: so it is asked
about. A single backward glitch, or a file whose rows are merely out of order, is not one.
"""

from __future__ import annotations

import numpy as np

from ftproc.errors import InputError
from ftproc.files.reading.cells import Origin
from ftproc.files.reading.csvtext import row_named
from ftproc.records import FloatArray

#: Periods of clocks in s, and what is reached when they are over.
_PERIODS = {86400.0: "midnight", 604800.0: "the end of the GPS week"}
_LONGEST_GAP_S = 600.0  # across the turn
_ROWS_AFTER = 20  # of which most must stay below: else it was a glitch


def refuse(origin: Origin, time_s: FloatArray) -> None:
    """Raise InputError when (n,) times in s, in file order and NaN where missing, pass such a turn."""
    row = np.flatnonzero(~np.isnan(time_s))
    time = time_s[row]
    for period, what in _PERIODS.items():
        for k in _turns(time, period):
            raise InputError(
                f'{origin.source}: {row_named(int(row[k]))}, column "{origin.column}": the time falls from '
                f"{time[k - 1]:.10g} s to {time[k]:.10g} s, which looks like {what}. If so, add {period:.0f} s to the "
                "times from this row on, or give timestamps with their date; if the rows are only out of order, sort "
                "them by time."
            )


def _turns(time: FloatArray, period: float) -> list[int]:
    """The first samples after a turn, or none when there are falls that are none."""
    if not len(time) or time.min() < 0 or time.max() > period:
        return []
    falls = np.flatnonzero(np.diff(time) < -period / 2) + 1
    turns = [int(k) for k in falls if _is_turn(time, int(k), period)]
    return turns if len(turns) == len(falls) else []


def _is_turn(time: FloatArray, k: int, period: float) -> bool:
    after = time[k : k + _ROWS_AFTER]
    stays = np.count_nonzero(after < time[k - 1] - period / 2) > len(after) / 2
    return bool(stays and 0 <= time[k] + period - time[k - 1] <= _LONGEST_GAP_S)
