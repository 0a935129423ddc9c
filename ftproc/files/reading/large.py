"""Logs too large to be held in memory: read block by block into unnamed temporary files, of which stretches are mapped
as they are needed."""

from __future__ import annotations

import contextlib
import errno
import tempfile
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.reading.header import Blocks
from ftproc.records import COMPONENTS, FloatArray, IntArray, MeasurementLog
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

SAMPLE_ROWS = 100_000  # for what is judged by the whole of a log, such as its units

#: A block's quantities in SI units, and the midnight that its times count from (or "").
Convert = Callable[["pa.Table"], tuple[dict[str, FloatArray], str]]


class Sampled(NamedTuple):
    """A log whose arrays lie on a disk, and some of its rows: quantities as they were read, and the log of them."""

    log: MeasurementLog
    quantities: dict[str, FloatArray]
    sample: MeasurementLog


def read(source: str, blocks: Blocks, convert: Convert, station: Station) -> Sampled | None:
    """The log, or None where it must be read as a whole: its rows are not in time order, or something is wrong with
    it that only the whole of it can name. Raises InputError when there is no room for the temporary files."""
    with _Spool() as spool:
        return _into(spool, source, blocks, convert, station)


def _into(spool: _Spool, source: str, blocks: Blocks, convert: Convert, station: Station) -> Sampled | None:
    every = 1 + blocks.rows // SAMPLE_ROWS
    sampled: list[dict[str, FloatArray]] = []
    times = _Times()
    try:
        for table in blocks.tables:
            quantities, epoch = convert(table)
            quantities["time"] = times.continued(quantities["time"], epoch)
            spool.add(conventions.apply(_timed(source, quantities), station), len(table))
            sampled.append({name: values[::every].copy() for name, values in quantities.items()})
    except (InputError, _OutOfOrder):
        return None
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise
        place = tempfile.gettempdir()
        raise InputError(
            f"{source}: so large a log is read by way of {place}, which is full; make room there, or name another "
            "directory with TMPDIR."
        ) from error
    if not spool.read_something:
        return None
    time_s, measurement, row = spool.arrays()
    log = MeasurementLog(
        source, time_s, measurement, row, rows_in_file=spool.rows_in_file,
        rows_without_time=tuple(spool.without_time), duplicate_times=times.duplicates, epoch=times.epoch,
    )  # fmt: skip
    some = {name: np.concatenate([each[name] for each in sampled]) for name in sampled[0]}
    return Sampled(log, some, _timed(source, some))


def _timed(source: str, quantities: Mapping[str, FloatArray]) -> MeasurementLog:
    """The rows that have a time."""
    time_s = quantities["time"]
    row = np.flatnonzero(~np.isnan(time_s))
    columns = [quantities.get(component, np.full(len(time_s), np.nan)) for component in COMPONENTS]
    measurement = np.column_stack(columns)
    if len(row) < len(time_s):
        time_s, measurement = time_s[row], measurement[row]
    return MeasurementLog(source, time_s, measurement, row)


class _OutOfOrder(Exception):
    pass


class _Times:
    """The times of one log, which must not fall from block to block."""

    def __init__(self) -> None:
        self.epoch, self.last_s, self.duplicates = "", -np.inf, 0

    def continued(self, time_s: FloatArray, epoch: str) -> FloatArray:
        """Times of the next block, counted as those of the first; `epoch` is what they count from."""
        if self.last_s == -np.inf:
            self.epoch = epoch
        if bool(epoch) != bool(self.epoch):
            raise _OutOfOrder
        if epoch:
            time_s = time_s + (datetime.fromisoformat(epoch) - datetime.fromisoformat(self.epoch)).total_seconds()
        known = time_s[~np.isnan(time_s)]
        if known.size:
            before = np.r_[self.last_s, known[:-1]]
            if (known < before).any():
                raise _OutOfOrder
            self.duplicates += int(np.count_nonzero(known == before))
            self.last_s = float(known[-1])
        return time_s


class _Spool(contextlib.ExitStack):
    """Temporary files without a name, that grow. What was mapped of them outlives them."""

    def __init__(self) -> None:
        super().__init__()
        self.files: list[IO[bytes]] = [self.enter_context(tempfile.TemporaryFile()) for _ in range(3)]  # noqa: SIM115 (it is one)
        self.rows, self.rows_in_file, self.read_something = 0, 0, False
        self.without_time: list[int] = []

    def add(self, block: MeasurementLog, rows: int) -> None:
        """The next `rows` of the file, of which `block` has those with a time."""
        for file, values in zip(
            self.files, (block.time_s, block.measurement, block.row + self.rows_in_file), strict=True
        ):
            file.write(np.ascontiguousarray(values).data)
        if len(block) < rows:
            absent = np.ones(rows, bool)
            absent[block.row] = False
            self.without_time += (np.flatnonzero(absent) + self.rows_in_file).tolist()
        self.rows += len(block)
        self.rows_in_file += rows
        self.read_something = self.read_something or not bool(np.isnan(block.measurement).all())

    def arrays(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """Times (n,), readings (n, 3) and row numbers (n,), mapped."""
        for file in self.files:
            file.flush()
        shapes: tuple[tuple[Any, tuple[int, ...]], ...] = (
            (np.float64, (self.rows,)), (np.float64, (self.rows, 3)), (np.int64, (self.rows,)),
        )  # fmt: skip
        time_s, measurement, row = (
            np.memmap(file, kind, "r", shape=shape) for file, (kind, shape) in zip(self.files, shapes, strict=True)
        )
        return time_s, measurement, row
