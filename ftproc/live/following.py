"""A log that still grows: its rows are taken as they come, and what is published leaves at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError, UsageError
from ftproc.live.columns import Reader
from ftproc.live.growing import Say, Stop, blocks
from ftproc.live.live import Live
from ftproc.records import Trajectory


def follow(source: str, recipe: Recipe, track: Live, stop: Stop, say: Say) -> Iterator[Trajectory]:
    """The rows that are published while a log grows: a file, which has no end, or `-` for standard input. Ends at the
    end of the input, when a stop is asked for, or at a row that is not understood. Whatever ends it, the rows before it
    are published first. say: takes a sentence for the user. Raises InputError for a log, or a row, that is not
    understood, and when no row came."""
    if recipe.station.refraction is not None:
        raise UsageError("--follow corrects no refraction, which needs the ranges around each reading; leave it out.")
    reader, taken, used, fault = Reader(source, recipe, say), 0, 0, None
    try:
        for block in blocks(source, stop, say):
            readings, fault = reader.read(block)
            timed = np.flatnonzero(np.isfinite(readings[:, 0]))
            time_s, range_m, azimuth_rad, elevation_rad = readings[timed].T
            if len(timed) and len(found := track.push(time_s, range_m, azimuth_rad, elevation_rad, taken + timed)):
                yield found
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
