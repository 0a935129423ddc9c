"""Logs in: a file, standard input or a table -> a checked `MeasurementLog`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.options import parse_columns, parse_units
from ftproc.files.reading import large, plausibility, schema
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.numbers import Origin, numbers
from ftproc.files.reading.times import seconds
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

Found = Mapping[str, schema.Column]


def read(
    source: tables.Source,
    *,
    units: str | Mapping[str, str] | None = None,
    columns: str | Mapping[str, str] | None = None,
    azimuth_from: str | None = None,
    keep_columns: bool = False,
    station: Station | None = None,
) -> MeasurementLog:
    """Read and check one log; angles become rad, lengths m, times s, rows come in time order.

    source: path of a .csv, .csv.gz, .parquet or .feather file, `-` for CSV on standard input, a pyarrow Table or a
    pandas DataFrame.
    units: such as `{"range": "km"}` or `"range=km,azimuth=deg"`, for columns whose name states no unit.
    columns: such as `{"time": "T0"}` or `"time=T0,range=RNG"`; `none` for a quantity that the file lacks.
    azimuth_from: `x` (A = atan2(y, x), the default) or `north`, which makes the frame `north-east-up`.
    keep_columns: carry the file's other columns through as `extra`.
    station: what else is known of the instrument, see `conventions`.

    Rows are counted from 0 without the header, in messages as in `row`; empty lines do not count. Rows without a time
    are listed and left out. Readings of any size stay in: editing judges outliers, such as a negative range.
    Timestamps become seconds since 00:00 UTC of the day of the earliest one.

    Raises InputError for a file that cannot be read or is no log, UsageError for options that are not understood.
    """
    station = station or Station()
    if azimuth_from is not None:
        station = replace(station, azimuth_from=azimuth_from)
    conventions.check(station)
    unit_of, column_of = parse_units(units), parse_columns(columns)
    header = tables.read_header(source)
    found = schema.resolve(header.source, header.names, unit_of, column_of)
    wanted = [column.position for column in found.values()]
    others = [place for place in range(len(header.names)) if keep_columns and place not in wanted]
    _check_others(header, others)
    if not others and station.refraction is None:  # refraction needs ranges of other blocks
        log = _in_blocks(header, found, station)
        if log is not None:
            return log
    return _at_once(header, found, station, others)


def _in_blocks(header: TableHeader, found: Found, station: Station) -> MeasurementLog | None:
    """The log of a large file; None if the file is small or must be read at once, see `large`."""
    blocks = header.blocks([column.position for column in found.values()])
    if blocks is None:
        return None
    spooled = large.read(header.source, blocks, partial(_converted, header, found), station)
    if spooled is None:
        return None
    log, sample = spooled
    plausibility.check_units(header.source, sample, found, station.elevation_from)
    readings = large.readings(sample)[~np.isnan(sample["time"])]
    return replace(log, remarks=_remarks(header, found, log.epoch, readings, station))


def _at_once(header: TableHeader, found: Found, station: Station, others: list[int]) -> MeasurementLog:
    wanted = [column.position for column in found.values()]
    table = header.load(wanted, others)
    if table.num_rows == 0:
        raise InputError(f"{header.source}: there are column names but no rows.")
    quantities, epoch = _converted(header, found, table)
    plausibility.check_units(header.source, quantities, found, station.elevation_from)
    extra = table.select(list(range(len(wanted), table.num_columns))) if others else None
    log = _in_time_order(header.source, quantities, extra)
    log = replace(log, epoch=epoch, remarks=_remarks(header, found, epoch, log.measurement, station))
    return conventions.apply(log, station)


def _remarks(header: TableHeader, found: Found, epoch: str, readings: FloatArray, station: Station) -> tuple[str, ...]:
    return (*schema.remarks(header.names, found, bool(epoch)), *plausibility.doubts(readings, station))


def _check_others(header: TableHeader, others: list[int]) -> None:
    counts = Counter(header.names[position] for position in others)
    for name, count in counts.items():
        if count > 1:
            raise InputError(
                f'{header.source}: column "{name}" is there twice, so both cannot be kept; rename one, '
                "or leave --keep-columns out."
            )


def _converted(header: TableHeader, found: Found, table: pa.Table) -> tuple[dict[str, FloatArray], str]:
    """The quantities in SI units, and the instant of time zero (or "")."""
    quantities, epoch = {}, ""
    for index, (quantity, column) in enumerate(found.items()):
        article = "an" if quantity in ("azimuth", "elevation") else "a"
        timestamp = " or an ISO-8601 timestamp" if quantity == "time" else ""
        expected = f"{article} {quantity} in {column.unit.name}{timestamp}"
        origin = Origin(header.source, column.name, expected, header.decimal_comma)
        if quantity == "time":
            quantities[quantity], epoch = seconds(table.column(index), origin, column.unit.to_si)
        else:
            quantities[quantity] = column.unit.to_si(numbers(table.column(index), origin))
    return quantities, epoch


def _in_time_order(source: str, quantities: Mapping[str, FloatArray], extra: pa.Table | None) -> MeasurementLog:
    time, measurement = quantities["time"], large.readings(quantities)
    timed = np.flatnonzero(~np.isnan(time))
    if not timed.size:
        raise InputError(f"{source}: no row has a time, so there is nothing to process; fill the times in.")
    if np.isnan(measurement[timed]).all():
        raise InputError(
            f"{source}: no row has a range, azimuth or elevation, so there is nothing to process; check the columns."
        )
    late = int(np.count_nonzero(time[timed] < np.maximum.accumulate(time[timed])))
    row = timed[np.argsort(time[timed], kind="stable")] if late else timed
    everything = len(row) == len(time) and not late
    return MeasurementLog(
        name=source,
        time_s=np.array(time[row]),
        measurement=measurement if everything else measurement[row],
        row=row.astype(np.int64),
        rows_in_file=len(time),
        rows_without_time=tuple(np.flatnonzero(np.isnan(time)).tolist()),
        rows_out_of_order=late,
        duplicate_times=int(np.count_nonzero(time[row][1:] == time[row][:-1])),
        extra=extra if extra is None or everything else extra.take(row),
    )
