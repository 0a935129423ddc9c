"""Trajectories in, for `score` and for reports."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError
from ftproc.files import layout, remote
from ftproc.files.layout import OUTLIER, POSITION, Target
from ftproc.files.reading import columns, tables
from ftproc.files.reading.header import OpenTable
from ftproc.records import FlagArray, FloatArray, Trajectory

_HIGHEST_FLAG = 3


def read(source: tables.Source) -> Trajectory:
    """Read a trajectory of ours, or any table with time_s, x_m, y_m, z_m; what else it lacks is NaN, flags are 0.

    source: as for `logs.read`. Rows are put in time order. Columns that are not a trajectory's come in
    `extra`.
    Raises InputError for a missing column or time, a cell that is no finite number, or an unreadable file.
    """
    opened = tables.open_table(source)
    known = [name for name in layout.TRAJECTORY if name in opened.names or name in ("time_s", *POSITION)]
    others = [name for name in opened.names if name not in layout.TRAJECTORY]
    found, extra = columns.load(opened, known, others)
    columns.require_present(opened, found["time_s"], "time_s")
    order = np.argsort(found["time_s"], kind="stable")
    rows = found.get("row", np.arange(len(order), dtype=np.float64))

    def group(names: Sequence[str]) -> FloatArray:
        absent = np.full(len(order), np.nan)
        return np.column_stack([found.get(name, absent) for name in names])[order]

    return Trajectory(
        name=opened.source,
        row=np.nan_to_num(rows, nan=-1.0).astype(np.int64)[order],
        time_s=found["time_s"][order],
        measurement=group(layout.MEASUREMENT),
        state=group(layout.STATE),
        sigma=group(layout.SIGMA),
        outlier=_flags(opened, found, len(order))[order],
        nis=group(("nis",))[:, 0],
        correction=group(layout.CORRECTION),
        metadata=_metadata(source, opened),
        extra=extra.take(order) if others else None,
    )


def _flags(opened: OpenTable, found: Mapping[str, FloatArray], length: int) -> FlagArray:
    outlier = np.zeros((length, len(OUTLIER)), np.uint8)
    for index, name in enumerate(OUTLIER):
        if name in found:
            outlier[:, index] = columns.flags(opened, found[name], name, _HIGHEST_FLAG)
    return outlier


def _metadata(source: tables.Source, opened: OpenTable) -> dict[str, Any]:
    """From the Parquet file or the CSV's sidecar; empty where there is none or it is of another make."""
    text = opened.metadata.get(layout.METADATA_KEY, b"")
    beside = layout.sidecar(source) if isinstance(source, str | Path) else None
    try:
        if beside is not None:
            text = _bytes(beside)
        found = json.loads(text)
    except (OSError, ValueError, InputError):
        return {}
    return found if isinstance(found, dict) else {}


def _bytes(source: Target) -> bytes:
    path = remote.local(source)
    if path is not None:
        return path.read_bytes()
    with tempfile.TemporaryDirectory() as directory:
        return remote.fetch(str(source), Path(directory)).read_bytes()
