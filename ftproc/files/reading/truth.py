"""Reference trajectories: the truth that `train` learns from and `score` compares with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ftproc.files.layout import ACCELERATION, OUTLIER, POSITION, VELOCITY
from ftproc.files.reading import columns, tables
from ftproc.files.reading.header import OpenTable
from ftproc.records import FlagArray, FloatArray, IntArray, Truth


def read(source: tables.Source) -> Truth:
    """Read a truth: `time_s` and x_m, y_m, z_m; velocity, acceleration and `outlier_*` where there are any.

    source: as for `logs.read`. Rows are put in time order; other columns are ignored. An `outlier_*` column
    that is not there while another is counts as 0. Timestamps become seconds as in a log of the same day.
    Raises InputError for a missing column, a cell that is missing or no finite number, or an unreadable file.
    """
    opened = tables.open_table(source)
    flag_names = [name for name in OUTLIER if name in opened.names]
    needed = ["time_s", *POSITION, *_whole_group(opened, VELOCITY), *_whole_group(opened, ACCELERATION)]
    found, _ = columns.load(opened, [*needed, *flag_names])
    for name in needed:
        columns.require_present(opened, found[name], name)
    order = np.argsort(found["time_s"], kind="stable")
    return Truth(
        name=opened.source,
        time_s=found["time_s"][order],
        position_m=_stacked(found, POSITION, order),
        velocity_mps=_stacked(found, VELOCITY, order) if VELOCITY[0] in found else None,
        acceleration_mps2=_stacked(found, ACCELERATION, order) if ACCELERATION[0] in found else None,
        outlier=_flags(opened, found, order) if flag_names else None,
    )


def _whole_group(opened: OpenTable, names: Sequence[str]) -> Sequence[str]:
    """All three axes when the file has any of them: one that is missing is then missed by its name."""
    return names if any(name in opened.names for name in names) else ()


def _stacked(found: Mapping[str, FloatArray], names: Sequence[str], order: IntArray) -> FloatArray:
    return np.column_stack([found[name] for name in names])[order]


def _flags(opened: OpenTable, found: Mapping[str, FloatArray], order: IntArray) -> FlagArray:
    outlier = np.zeros((len(order), len(OUTLIER)), np.uint8)
    for index, name in enumerate(OUTLIER):
        if name in found:
            outlier[:, index] = columns.flags(opened, found[name], name, highest=255)
    return outlier[order]
