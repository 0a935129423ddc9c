"""Trajectories out, with everything needed to make them again beside the numbers; and in, for `score`."""

from __future__ import annotations

import itertools
import json
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..errors import InputError
from ..records import COMPONENTS, FlagArray, FloatArray, Trajectory, joined
from . import arrow, atomic, columns, maps, remote, schema, tables, writing
from .atomic import Target
from .columns import ACCELERATION, OUTLIER, POSITION, VELOCITY
from .opened import OpenTable

if TYPE_CHECKING:
    import pyarrow as pa

MEASUREMENT = tuple(schema.CANONICAL[component] for component in COMPONENTS)
STATE = (*POSITION, *VELOCITY, *ACCELERATION)
SIGMA = tuple(f"sigma_{name}" for name in (*POSITION, *VELOCITY))
CORRECTION = tuple(f"correction_{name}" for name in (*POSITION, *VELOCITY))

#: Every column a trajectory always has, in the order in which it is written.
COLUMNS = ("row", "time_s", *MEASUREMENT, *STATE, *SIGMA, *OUTLIER, "nis", *CORRECTION)

#: What the name of a trajectory file may end in.
SUFFIXES = (*tables.SUFFIXES, *maps.SUFFIXES)

#: Key of the metadata in a Parquet file.
METADATA_KEY = b"ftproc"
_HIGHEST_FLAG = 3


def to_table(trajectory: Trajectory) -> pa.Table:
    """One Arrow row per time: `row` int64, `outlier_*` uint8, the rest float64 (NaN where not estimated).

    The columns of `trajectory.extra` follow, with their own types; the metadata is JSON under the key
    `ftproc`.
    Raises UsageError when an extra column has the name of one of COLUMNS.
    """
    groups: tuple[tuple[Sequence[str], Any], ...] = (
        (MEASUREMENT, trajectory.measurement),
        (STATE, trajectory.state),
        (SIGMA, trajectory.sigma),
        (OUTLIER, np.asarray(trajectory.outlier, np.uint8)),
        (("nis",), trajectory.nis[:, np.newaxis]),
        (CORRECTION, trajectory.correction),
    )
    arrays: dict[str, Any] = {"row": np.asarray(trajectory.row, np.int64), "time_s": trajectory.time_s}
    for names, group in groups:
        arrays.update(zip(names, np.ascontiguousarray(group.T), strict=True))
    table = writing.with_extra(arrow.table(arrays), trajectory.extra)
    return table.replace_schema_metadata({METADATA_KEY: _to_json(trajectory.metadata, indent=None)})


def write(trajectory: Trajectory, target: Target) -> None:
    """Write a file of one of SUFFIXES, or CSV on standard output for `-`, whole or not at all.

    Beside a CSV file or a map goes its metadata, see `sidecar`. The same trajectory gives the same bytes.
    Raises OutputError; BrokenPipeError when standard output is closed; UsageError as `to_table` and `maps.check`.
    """
    beside = sidecar(target)
    if beside is None:
        writing.write_table(to_table(trajectory), target)
        return
    drawn = maps.kind_of(target)
    whole = maps.as_bytes(trajectory, drawn) if drawn else b""
    with atomic.replacing(target) as stream:
        if drawn:
            stream.write(whole)
        else:
            writing.write_stream(to_table(trajectory), stream, writing.kind_of(target))
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
        with writing.growing(stream, writing.kind_of(target)) as file:
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
    return plain and maps.kind_of(target) is None and str(target) != "-" and writing.can_grow(writing.kind_of(target))


def _write_beside(beside: Target, stream: BinaryIO, metadata: Mapping[str, Any]) -> None:
    """The sidecar is in place before the file it belongs to: whoever waits for the file finds both."""
    _sync_if_file(stream)
    with atomic.replacing(beside) as text:
        text.write(_to_json(metadata, indent=2) + b"\n")


def kind_of(path: Path) -> str | None:
    """The one of SUFFIXES that `path` ends in, whatever its case, or None."""
    return tables.kind_of(path) or maps.kind_of(path)


def sidecar(target: Target) -> Target | None:
    """`out.json` for `out.csv`, `out.kml` and such; None for Parquet, Feather and `-`, which need or have none."""
    path = Path(target)
    kind = None if str(target) == "-" else kind_of(path)
    if kind in (None, ".parquet", ".feather"):
        return None
    if remote.is_uri(target):
        return str(target)[: -len(str(kind))] + ".json"
    return path.with_name(path.name[: -len(str(kind))] + ".json")


def read(source: tables.Source) -> Trajectory:
    """Read what `write` wrote, or any table with time_s, x_m, y_m, z_m; what else it lacks is NaN, flags 0.

    source: as for `logs.read`. Rows are put in time order. Columns that are not a trajectory's come in
    `extra`.
    Raises InputError for a missing column or time, a cell that is no finite number, or an unreadable file.
    """
    opened = tables.open_table(source)
    known = [name for name in COLUMNS if name in opened.names or name in ("time_s", *POSITION)]
    others = [name for name in opened.names if name not in COLUMNS]
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
        measurement=group(MEASUREMENT),
        state=group(STATE),
        sigma=group(SIGMA),
        outlier=_flags(opened, found, len(order))[order],
        nis=group(("nis",))[:, 0],
        correction=group(CORRECTION),
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
    text = opened.metadata.get(METADATA_KEY, b"")
    beside = sidecar(source) if isinstance(source, str | Path) else None
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
