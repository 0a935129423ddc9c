"""Trajectories out, with everything needed to make them again beside the numbers."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ftproc.files import arrow, layout
from ftproc.files.layout import METADATA_KEY, Target, sidecar
from ftproc.files.writing import atomic, maps, tables
from ftproc.records import Trajectory, joined

if TYPE_CHECKING:
    import pyarrow as pa


def to_table(trajectory: Trajectory) -> pa.Table:
    """One Arrow row per time: `row` int64, `outlier_*` uint8, the rest float64 (NaN where not estimated).

    The columns of `trajectory.extra` follow, with their own types; the metadata is JSON under the key
    `ftproc`.
    Raises UsageError when an extra column has the name of one of `layout.TRAJECTORY`.
    """
    groups: tuple[tuple[Sequence[str], Any], ...] = (
        (layout.MEASUREMENT, trajectory.measurement),
        (layout.STATE, trajectory.state),
        (layout.SIGMA, trajectory.sigma),
        (layout.OUTLIER, np.asarray(trajectory.outlier, np.uint8)),
        (("nis",), trajectory.nis[:, np.newaxis]),
        (layout.CORRECTION, trajectory.correction),
    )
    arrays: dict[str, Any] = {"row": np.asarray(trajectory.row, np.int64), "time_s": trajectory.time_s}
    for names, group in groups:
        arrays.update(zip(names, np.ascontiguousarray(group.T), strict=True))
    table = tables.with_extra(arrow.table(arrays), trajectory.extra)
    return table.replace_schema_metadata({METADATA_KEY: _to_json(trajectory.metadata, indent=None)})


def write(trajectory: Trajectory, target: Target) -> None:
    """Write a file of a kind that `layout` names, or CSV on standard output for `-`, whole or not at all.

    Beside a CSV file or a map goes its metadata, see `sidecar`. The same trajectory gives the same bytes.
    Raises OutputError; BrokenPipeError when standard output is closed; UsageError as `to_table` and `maps.check`.
    """
    beside = sidecar(target)
    if beside is None:
        tables.write_table(to_table(trajectory), target)
        return
    drawn = layout.map_kind(target)
    whole = maps.as_bytes(trajectory, drawn) if drawn else b""
    with atomic.replacing(target) as stream:
        if drawn:
            stream.write(whole)
        else:
            tables.write_stream(to_table(trajectory), stream, tables.kind_of(target))
        _write_beside(beside, stream, trajectory.metadata)


def write_parts(parts: Iterable[Trajectory], metadata: Callable[[], Mapping[str, Any]], target: Target) -> None:
    """Write a trajectory that comes in stretches, holding one of them in memory; raises as `write`.

    metadata: is asked for when the last stretch has come. Feather and maps, which have their metadata or their bounds
    in front, are put together in memory, and so is standard output: nothing of a failed run goes there.
    """
    stretches = iter(parts)
    begun = list(itertools.islice(stretches, 2))
    if len(begun) == 1 or not _streamed(begun[0], target):
        whole = joined([*begun, *stretches])
        write(replace(whole, metadata={**whole.metadata, **metadata()}), target)
        return
    beside, known = sidecar(target), begun[0].metadata
    with atomic.replacing(target) as stream:
        with tables.growing(stream, tables.kind_of(target)) as file:
            for stretch in itertools.chain(begun, stretches):
                file.add(to_table(stretch).replace_schema_metadata(None))
            told = {**known, **metadata()}
            file.tell({METADATA_KEY: _to_json(told, indent=None)})
        if beside is not None:
            _write_beside(beside, stream, told)


def _streamed(stretch: Trajectory, target: Target) -> bool:
    """Whether a file can grow; further columns must be of numbers, as other types are told in front."""
    import pyarrow as pa

    plain = stretch.extra is None or all(pa.types.is_float64(kind) for kind in stretch.extra.schema.types)
    return plain and layout.map_kind(target) is None and str(target) != "-" and tables.can_grow(tables.kind_of(target))


def _write_beside(beside: Target, stream: BinaryIO, metadata: Mapping[str, Any]) -> None:
    """The sidecar is in place before the file it belongs to: whoever waits for the file finds both."""
    _sync_if_file(stream)
    with atomic.replacing(beside) as text:
        text.write(_to_json(metadata, indent=2) + b"\n")


def _to_json(metadata: Mapping[str, Any], indent: int | None) -> bytes:
    return json.dumps(_plain(metadata), indent=indent, ensure_ascii=False, allow_nan=False).encode()


def _plain(value: Any) -> Any:
    """numpy values, tuples and paths -> what JSON has; NaN and infinity -> null, which JSON has not."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def _sync_if_file(stream: BinaryIO) -> None:
    if stream.seekable():
        atomic.sync(stream)
