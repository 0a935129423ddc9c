"""Logs too large for the memory: read block by block into unnamed temporary files, which are mapped."""

from __future__ import annotations

import contextlib
import errno
import tempfile
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ftproc.core import threads
from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.reading.formats.content import Changed
from ftproc.files.reading.formats.header import Blocks
from ftproc.records import COMPONENTS, FloatArray, IntArray, MeasurementLog
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

_DENSE_ROWS = 5000  # at the beginning, of which none is left out
_SAMPLE_ROWS = 100_000  # for checks of the whole log, such as its units

#: A block -> its quantities in SI units, and the instant of its time zero (or "").
Convert = Callable[["pa.Table"], tuple[dict[str, FloatArray], str]]


class Spooled(NamedTuple):
    """log: its arrays are mapped from disk. sample: quantities of some of its rows in SI units, as they were read."""

    log: MeasurementLog
    sample: dict[str, FloatArray]


def read(source: str, blocks: Blocks, convert: Convert, station: Station) -> Spooled | None:
    """The log in the convention of `station`, or None if it must be read at once: its rows are out of time order, or a
    fault needs the whole file for its message. Raises InputError if the disk of the temporary files is full, or the
    file changed while it was read."""
    with _Spool() as spool:
        return _into(spool, source, blocks, convert, station)


def readings(quantities: Mapping[str, FloatArray]) -> FloatArray:
    """(n, 3) range, azimuth, elevation; NaN where a quantity is absent."""
    absent = np.full(len(quantities["time"]), np.nan)
    return np.column_stack([quantities.get(component, absent) for component in COMPONENTS])


def _into(spool: _Spool, source: str, blocks: Blocks, convert: Convert, station: Station) -> Spooled | None:
    every = 1 + blocks.rows // _SAMPLE_ROWS
    sampled: list[dict[str, FloatArray]] = []
    times = _Times()
    try:
        for table in threads.ahead(blocks.tables):
            quantities, epoch = convert(table)
            quantities["time"] = times.continued(quantities["time"], epoch)
            spool.add(conventions.apply(_timed(source, quantities), station), len(table))
            dense = 0 if sampled else _DENSE_ROWS
            sampled.append({q: np.r_[values[:dense], values[dense::every]] for q, values in quantities.items()})
    except Changed:
        raise
    except (InputError, _OutOfOrder):
        return None
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise
        folder = tempfile.gettempdir()
        if error.errno == errno.EFBIG:
            raise InputError(
                f"{source}: a log of this size needs temporary files larger than the system allows here (ulimit -f); "
                "raise the limit, or split the log."
            ) from error
        raise InputError(
            f"{source}: a log of this size needs temporary files in {folder}, which is full; make room there, or name "
            "another directory with TMPDIR."
        ) from error
    if not spool.has_readings:
        return None
    time_s, measurement, row = spool.arrays()
    log = MeasurementLog(
        source, time_s, measurement, row, conventions.frame(station), spool.rows_in_file,
        tuple(spool.without_time), duplicate_times=times.duplicates, station=station, epoch=times.epoch,
    )  # fmt: skip
    return Spooled(log, {name: np.concatenate([each[name] for each in sampled]) for name in sampled[0]})


def _timed(source: str, quantities: Mapping[str, FloatArray]) -> MeasurementLog:
    """The rows that have a time."""
    time_s, measurement = quantities["time"], readings(quantities)
    row = np.flatnonzero(~np.isnan(time_s))
    if len(row) < len(time_s):
        time_s, measurement = time_s[row], measurement[row]
    return MeasurementLog(source, time_s, measurement, row)


class _OutOfOrder(Exception):
    pass


class _Times:
    """The times of one log, which must not decrease from block to block."""

    def __init__(self) -> None:
        self.epoch, self.last_s, self.duplicates = "", -np.inf, 0

    def continued(self, time_s: FloatArray, epoch: str) -> FloatArray:
        """Times of the next block, which count from `epoch`, counted from the epoch of the first block."""
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
    """Growing temporary files without a name. Arrays mapped from them stay valid when they are closed."""

    def __init__(self) -> None:
        super().__init__()
        self.files: list[IO[bytes]] = [self.enter_context(tempfile.TemporaryFile()) for _ in range(3)]  # noqa: SIM115 (closed by the stack)
        self.rows, self.rows_in_file, self.has_readings = 0, 0, False
        self.without_time: list[int] = []

    def add(self, block: MeasurementLog, rows: int) -> None:
        """The next `rows` rows of the file; `block` has those with a time."""
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
        self.has_readings = self.has_readings or not bool(np.isnan(block.measurement).all())

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
