"""Trajectories out, with the metadata that are needed to compute them again."""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ftproc.errors import encodable
from ftproc.files import arrow, layout, remote
from ftproc.files.layout import METADATA_KEY, Target, sidecar
from ftproc.files.writing import atomic, csvtext, maps, tables
from ftproc.long_records import joined
from ftproc.records import Trajectory

if TYPE_CHECKING:
    import pyarrow as pa

#: A list of numbers over several lines, such as a jerk profile; no string of JSON has the end of a line in it.
_NUMBERS = re.compile(r"(?<=\[)\n[\d.eE+,\s-]+(?=\])")


def to_table(trajectory: Trajectory, without: Sequence[str] = ()) -> pa.Table:
    """One Arrow row per time: `row` int64, `outlier_*` uint8, the rest float64 (NaN where not estimated).

    The columns of `trajectory.extra` follow, with their own types; the metadata are JSON under the key `ftproc`.
    without: columns to leave out. Raises UsageError if an extra column has the name of one of `layout.TRAJECTORY`.
    """
    arrays = {name: array for name, array in _columns(trajectory).items() if name not in without}
    table = tables.with_extra(arrow.table(arrays), trajectory.extra)
    return _described(table).replace_schema_metadata({METADATA_KEY: to_json(trajectory.metadata, indent=None)})


def as_csv(trajectory: Trajectory, with_header: bool) -> bytes:
    """The text of a CSV file, without its metadata: quick where the rows are few, as those of a stream."""
    columns, extra = _columns(trajectory), trajectory.extra
    if not with_header and len(trajectory) <= csvtext.FEW:
        added = [] if extra is None else [arrow.to_numbers(column) for column in extra.columns]
        numbers = [each for each in added if each is not None]
        if len(numbers) == len(added):
            return csvtext.few_rows([*columns.values(), *numbers])
    return b"".join(csvtext.pieces(tables.with_extra(arrow.table(columns), extra), with_header))


def as_json_lines(trajectory: Trajectory) -> bytes:
    """An object a row, without the metadata; null for what is not estimated."""
    columns = {name: column.tolist() for name, column in _columns(trajectory).items()}
    if trajectory.extra is not None:
        columns |= trajectory.extra.to_pydict()
    rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    return b"".join(json.dumps(plain(row)).encode() + b"\n" for row in rows)


def _columns(trajectory: Trajectory) -> dict[str, Any]:
    """The columns (n,) that every trajectory has."""
    groups: tuple[tuple[Sequence[str], Any], ...] = (
        (layout.MEASUREMENT, trajectory.measurement),
        (layout.STATE, trajectory.state),
        (layout.SIGMA, trajectory.sigma),
        (layout.MEASUREMENT_SIGMA, trajectory.measurement_sigma),
        (layout.OUTLIER, np.asarray(trajectory.outlier, np.uint8)),
        (("nis",), trajectory.nis[:, np.newaxis]),
        (layout.CORRECTION, trajectory.correction),
    )
    arrays: dict[str, Any] = {"row": np.asarray(trajectory.row, np.int64), "time_s": trajectory.time_s}
    for names, group in groups:
        arrays.update(zip(names, np.ascontiguousarray(group.T), strict=True))
    return arrays


def _described(table: pa.Table) -> pa.Table:
    """The table with the unit and the meaning of each column in the metadata of its field."""
    import pyarrow as pa

    fields = [field.with_metadata(layout.described(field.name) or field.metadata) for field in table.schema]
    return pa.Table.from_arrays(table.columns, schema=pa.schema(fields))


def write(trajectory: Trajectory, target: Target, without: Sequence[str] = ()) -> None:
    """Write a file of a kind that `layout` names, or CSV on standard output for `-`, complete or not at all.

    without: columns to leave out. The metadata of a CSV file or a map go into its `sidecar`. The same trajectory gives
    the same bytes. Raises OutputError; BrokenPipeError if standard output is closed; UsageError as `to_table` and
    `maps.check`.
    """
    if sidecar(target) is None:
        tables.write_table(to_table(trajectory, without), target)
        return
    map_kind = layout.map_kind(target)
    drawn = maps.as_bytes(trajectory, map_kind) if map_kind else b""
    with with_sidecar(target) as (stream, text):
        if map_kind:
            stream.write(drawn)
        else:
            tables.write_stream(to_table(trajectory, without), stream, tables.kind_of(target))
        text.write(to_json(trajectory.metadata, indent=2) + b"\n")


def write_parts(parts: Iterable[Trajectory], metadata: Callable[[], Mapping[str, Any]], target: Target) -> None:
    """Write a trajectory that comes in stretches, with one of them in memory at a time; raises as `write`.

    metadata: called after the last stretch. Feather and maps, whose metadata or bounds are at the start of the file,
    are built in memory; so is standard output, which gets nothing of a failed run.
    """
    stretches = iter(parts)
    first = list(itertools.islice(stretches, 2))
    if len(first) == 1 or not _can_stream(first[0], target):
        whole = joined([*first, *stretches])
        write(replace(whole, metadata={**whole.metadata, **metadata()}), target)
        return
    with with_sidecar(target) as (stream, text):
        with tables.growing(stream, tables.kind_of(target)) as file:
            for stretch in itertools.chain(first, stretches):
                file.append(to_table(stretch).replace_schema_metadata(None))
            complete = {**first[0].metadata, **metadata()}
            file.add_metadata({METADATA_KEY: to_json(complete, indent=None)})
        text.write(to_json(complete, indent=2) + b"\n")


def _can_stream(stretch: Trajectory, target: Target) -> bool:
    """Whether the file can grow. Extra columns must be float64 or times: a growing Parquet file has no Arrow types."""
    import pyarrow as pa

    plain = stretch.extra is None or all(
        pa.types.is_float64(kind) or pa.types.is_timestamp(kind) for kind in stretch.extra.schema.types
    )
    return plain and layout.map_kind(target) is None and str(target) != "-" and tables.can_grow(tables.kind_of(target))


@contextlib.contextmanager
def with_sidecar(target: Target) -> Iterator[tuple[BinaryIO, BinaryIO]]:
    """Streams of a file and of its metadata, which appear one after the other when both are on the disk; of a file that
    holds its own, nothing becomes of the second stream.

    A process that waits for a new file finds its metadata too, which appear first. Of a file that is replaced they
    appear last: a kill in between never leaves them beside an older file, which would then pass for finished.
    """
    near, beside = remote.local(target), sidecar(target)
    if beside is None:
        with atomic.replacing(target) as stream:
            yield stream, io.BytesIO()
    elif near is not None and near.is_file():
        with atomic.replacing(beside) as text, atomic.replacing(target) as stream:
            yield stream, text
            _sync(text)
    else:
        with atomic.replacing(target) as stream, atomic.replacing(beside) as text:
            yield stream, text
            _sync(stream)


def _sync(stream: BinaryIO) -> None:
    if stream.seekable():  # not a pipe
        atomic.sync(stream)


def to_json(metadata: Mapping[str, Any], indent: int | None) -> bytes:
    text = json.dumps(plain(metadata), indent=indent, ensure_ascii=False, allow_nan=False)
    return _NUMBERS.sub(lambda found: re.sub(r"\s+", " ", found[0]), text).encode()


def plain(value: Any) -> Any:
    """numpy values, tuples, paths and names -> JSON types; NaN and infinity, which JSON lacks, -> null."""
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Path | str):
        return encodable(str(value))
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {encodable(str(key)): plain(item) for key, item in value.items()}
    return value
