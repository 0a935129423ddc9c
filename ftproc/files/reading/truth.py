"""Reference trajectories in: the truth, for `train` and `score`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ftproc.errors import InputError, row_named
from ftproc.files.layout import ACCELERATION, OUTLIER, POSITION, VELOCITY
from ftproc.files.reading import columns, positions
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import readings
from ftproc.records import FloatArray, IntArray, Truth

_FEWEST = 24  # rows by which a number is judged


class Frame(NamedTuple):
    """Where the frame of a trajectory stands: latitude deg, longitude deg, height m; and whether x is north."""

    site: tuple[float, float, float]
    north: bool


def read(source: tables.Source, frame: Frame | None = None) -> Truth:
    """Read a truth: `time_s` and x_m, y_m, z_m; velocity, acceleration and `outlier_*` where present. Or the time and
    latitude, longitude and height, which are brought into the frame of a trajectory.

    source: as for `logs.read`. Rows are put in time order; other columns are ignored. An absent `outlier_*` column
    counts as 0 if another is present. Timestamps become seconds as in a log of the same day.
    Raises InputError for a missing column, a cell that is missing (also -9999 and such) or no finite number, or an
    unreadable file.
    """
    header = tables.read_header(source)
    if positions.is_geodetic(header):
        return _on_the_earth(source, header.source, frame)
    flag_names = [name for name in OUTLIER if name in header.names]
    speeds = VELOCITY if columns.has_velocities(header) else ()
    needed = ["time_s", *POSITION, *speeds, *_whole_group(header, ACCELERATION)]
    found, _ = columns.load(header, [*needed, *flag_names])
    for name in needed:
        columns.require_present(header, found[name], name)
        if name != "time_s":
            _refuse_sentinel(header, found[name], name)
    order = np.argsort(found["time_s"], kind="stable")
    return Truth(
        name=header.source,
        time_s=found["time_s"][order],
        position_m=_stacked(found, POSITION, order),
        velocity_mps=_stacked(found, VELOCITY, order) if VELOCITY[0] in found else None,
        acceleration_mps2=_stacked(found, ACCELERATION, order) if ACCELERATION[0] in found else None,
        outlier=columns.outlier_flags(header, found, highest=255)[order] if flag_names else None,
    )


def _on_the_earth(source: tables.Source, name: str, frame: Frame | None) -> Truth:
    if frame is None:
        raise InputError(
            f"{name}: it has latitudes and longitudes, and no site is known; say --site LAT,LON,HEIGHT of the station."
        )
    found = positions.read(source)
    known = np.isfinite(found.place).all(1)
    place = positions.local(found.place[known], frame.site)
    return Truth(name, found.time_s[known], place[:, [1, 0, 2]] if frame.north else place)


def _refuse_sentinel(header: TableHeader, column: FloatArray, name: str) -> None:
    """Raise InputError for a number such as -9999 that stands out."""
    number = readings.sentinel(column) if len(column) >= _FEWEST else None
    if number is not None:
        raise InputError(
            f'{header.source}: {row_named(int(np.argmax(column == number)))}, column "{name}": {number:.10g} stands '
            "far from the values beside it and means a missing one. Delete such rows."
        )


def _whole_group(header: TableHeader, names: Sequence[str]) -> Sequence[str]:
    """All three axes if the file has any of them, so that a message names a missing one."""
    return names if any(name in header.names for name in names) else ()


def _stacked(found: Mapping[str, FloatArray], names: Sequence[str], order: IntArray) -> FloatArray:
    return np.column_stack([found[name] for name in names])[order]
