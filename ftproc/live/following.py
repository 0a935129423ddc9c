"""A log that still grows: its rows are taken as they come, and what is published leaves at once."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError, UsageError
from ftproc.live.columns import Reader
from ftproc.live.growing import LINES, Say, Stop, blocks
from ftproc.live.live import Live
from ftproc.records import FloatArray, IntArray, Trajectory, joined

AT_ONCE_S = 0.1  # that a push of some rows may take, about, so that a stop is heard between two
LATE = 100  # rows that came too late, after which it is said


def follow(source: str, recipe: Recipe, track: Live, stop: Stop, say: Say) -> Iterator[Trajectory]:
    """The rows that are published while a log grows: a file, which has no end, or `-` for standard input. Ends at the
    end of the input, when a stop is asked for, or at a row that is not understood. Whatever ends it, the rows before it
    are published first. say: takes a sentence for the user. Raises InputError for a log, or a row, that is not
    understood, and when no row came."""
    if recipe.station.refraction is not None:
        raise UsageError("--follow corrects no refraction, which needs the ranges around each reading; leave it out.")
    reader, taken, used, fault = Reader(source, recipe, say), 0, 0, None
    pushing = _Pushing(source, track, stop, say)
    try:
        for block in blocks(source, stop, say):
            readings, fault = reader.read(block)
            timed = np.flatnonzero(np.isfinite(readings[:, 0]))
            if parts := pushing.push(readings[timed], taken + timed):
                yield joined(parts)
            taken, used = taken + len(readings), used + len(timed)
            if fault is not None:
                break
        else:
            reader.finish()
            if not used:
                fault = InputError(f"{source}: no row has a time, so nothing is written; fill the times in.")
            elif used < taken:
                say(f"{source}: {taken - used} rows have no time, and are left out.")
    except InputError as error:
        fault = error
    if len(found := track.finish()):
        yield found
    if fault is not None:
        raise fault


class _Pushing:
    """Pushes rows, as few at once as keep a stop from waiting for long; what is published does not depend on it."""

    def __init__(self, source: str, track: Live, stop: Stop, say: Say) -> None:
        self._source, self._track, self._stop, self._say = source, track, stop, say
        self._count, self._said = 1, False

    def push(self, readings: FloatArray, numbers: IntArray) -> list[Trajectory]:
        """The parts that are published, none of them empty; readings (n, 4), numbers (n,) of their rows."""
        found, low = [], 0
        while low < len(readings) and not self._stop.overdue:
            began_s, high = time.monotonic(), low + self._count
            time_s, range_m, azimuth_rad, elevation_rad = readings[low:high].T
            part = self._track.push(time_s, range_m, azimuth_rad, elevation_rad, numbers[low:high])
            found += [part] if len(part) else []
            slow = time.monotonic() - began_s > AT_ONCE_S
            self._count = max(self._count // 2, 1) if slow else min(2 * self._count, LINES)
            low = high
        if low < len(readings):
            self._say(f"{self._source}: stopped before {len(readings) - low} rows that had been read were used.")
        self._say_late()
        return found

    def _say_late(self) -> None:
        """Say it when many rows come too late: one time that is far too large makes all after it late."""
        if self._track.late >= LATE and not self._said:
            self._said = True
            self._say(
                f"{self._source}: {LATE} rows came too late to be used: the time of a row before them is "
                f"{self._track.newest_s:g} s. If that is wrong, correct it, and follow the log again."
            )
