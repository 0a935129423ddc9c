"""The clock of a trajectory: UTC beside the seconds, where the log's clock is known."""

from __future__ import annotations

from dataclasses import replace

from ftproc.files import leap_seconds
from ftproc.files.moments import NO_ZONE
from ftproc.files.writing import tables
from ftproc.records import MeasurementLog, Trajectory

COLUMN = "time_utc"


def stamped(trajectory: Trajectory, log: MeasurementLog) -> Trajectory:
    """The trajectory with the column `time_utc` (microseconds, UTC) if its log's clock and zone are known, else
    unchanged.

    Raises UsageError if a kept column already has the name.
    """
    if not log.epoch or not len(log) or NO_ZONE in log.understood.get("doubts", ()):
        return trajectory
    import pyarrow as pa

    moments = leap_seconds.utc(log.epoch, trajectory.time_s, float(log.time_s[0]))
    column = pa.table({COLUMN: pa.array(moments, pa.timestamp("us", "UTC"))})
    extra = column if trajectory.extra is None else tables.with_extra(trajectory.extra, column)
    return replace(trajectory, extra=extra)
