"""The further columns of a trajectory: positions on the earth, derived quantities, UTC."""

from __future__ import annotations

from dataclasses import replace

from ftproc.derived.quantities import Derived
from ftproc.files import arrow
from ftproc.files.writing import clock, geodesy, tables
from ftproc.records import MeasurementLog, Trajectory
from ftproc.settings import FilterSettings


def with_columns(trajectory: Trajectory, settings: FilterSettings, log: MeasurementLog) -> Trajectory:
    """The trajectory of a log with all columns that the settings ask for, and UTC where the log's clock is known.

    Raises InputError as `geodesy.check_axes`, UsageError if a kept column has the name of one
    of them, or a library is missing.
    """
    geodesy.check_axes(log, settings)
    located = geodesy.located(trajectory, settings)
    return clock.stamped(with_derived(located, settings), log)


def with_derived(trajectory: Trajectory, settings: FilterSettings) -> Trajectory:
    """The trajectory with the columns of `Derived`, if the settings ask for them. Positions on the earth must be there
    already: with them the vertical is that below the target. Raises UsageError as `with_columns`."""
    if not settings.derived:
        return trajectory
    known = trajectory.metadata.get("settings") or {}  # of a stretch of a log nothing stands there yet
    stated = {**trajectory.metadata, "settings": {**known, "site": settings.site}}
    columns = arrow.table(Derived.of(replace(trajectory, metadata=stated)).columns())
    extra = columns if trajectory.extra is None else tables.with_extra(trajectory.extra, columns)
    return replace(trajectory, extra=extra)
