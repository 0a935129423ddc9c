"""Trajectories in, for `score` and reports."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError, quoted
from ftproc.files import layout, remote
from ftproc.files.layout import POSITION, Target
from ftproc.files.reading import columns
from ftproc.files.reading.formats import content, tables
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.standards.choosing import shown
from ftproc.records import ACCEPTED, FloatArray, Trajectory

_MOST_METADATA = 16 << 20  # bytes


def read(source: tables.Source) -> Trajectory:
    """Read a trajectory file, or any table with time_s, x_m, y_m, z_m; absent columns become NaN, absent flags 0.

    source: as for `logs.read`. Rows are put in time order. Columns that are not a trajectory's come in `extra`.
    Raises InputError for a missing column or time, a cell that is no finite number, or an unreadable file.
    """
    header = tables.read_header(source)
    if set(layout.MEASUREMENT) & set(header.names) and not set(POSITION) & set(header.names):
        raise InputError(f"{header.source}: this is a log, no trajectory: ftproc filter {quoted(header.source)}.")
    beside = metadata(source, header)
    if isinstance(several := beside.get("targets"), dict):
        raise InputError(
            f"{header.source}: this has the trajectories of {len(several)} targets ({shown(list(several))}). "
            "Filter the log with --target COLUMN=VALUE for one, or with -o DIRECTORY/ for a file of each."
        )
    known = [name for name in layout.TRAJECTORY if name in header.names or name in ("time_s", *POSITION)]
    others = [name for name in header.names if name not in layout.TRAJECTORY]
    found, extra = columns.load(header, known, others)
    columns.require_present(header, found["time_s"], "time_s")
    order = np.argsort(found["time_s"], kind="stable")
    rows = found.get("row", np.arange(len(order), dtype=np.float64))

    def group(names: Sequence[str]) -> FloatArray:
        absent = np.full(len(order), np.nan)
        return np.column_stack([found.get(name, absent) for name in names])[order]

    return Trajectory(
        name=header.source,
        row=np.nan_to_num(rows, nan=-1.0).astype(np.int64)[order],
        time_s=found["time_s"][order],
        measurement=group(layout.MEASUREMENT),
        state=group(layout.STATE),
        sigma=group(layout.SIGMA),
        measurement_sigma=group(layout.MEASUREMENT_SIGMA),
        outlier=columns.outlier_flags(header, found, highest=ACCEPTED)[order],
        nis=group(("nis",))[:, 0],
        correction=group(layout.CORRECTION),
        metadata=beside,
        extra=extra.take(order) if others else None,
    )


def metadata(source: tables.Source, header: TableHeader | None = None) -> dict[str, Any]:
    """The metadata of a trajectory, from the file itself or its sidecar; empty if there are none or another program
    wrote them. header: of the file, where it is open already."""
    beside = layout.sidecar(source) if isinstance(source, str | Path) else None
    try:
        if beside is not None:
            text = _bytes(beside)
        else:
            text = (header or tables.read_header(source)).metadata.get(layout.METADATA_KEY, b"")
        found = json.loads(text)
    except (OSError, ValueError, RecursionError, InputError):
        return {}
    return found if isinstance(found, dict) else {}


def _bytes(source: Target) -> bytes:
    path = remote.local(source)
    if path is not None:
        return content.read(str(path), path, limit=_MOST_METADATA)
    with tempfile.TemporaryDirectory() as directory:
        copy = remote.fetch(str(source), Path(directory)).path
        return content.read(str(source), copy, limit=_MOST_METADATA)
