"""Logs in: a file, standard input or a table -> a checked `MeasurementLog`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.options import ABSENT, Condition, Extract, parse_columns, parse_units, parse_where
from ftproc.files.reading import computed, converting, further, large, proposal, understanding
from ftproc.files.reading.clocks import fractions, restarts
from ftproc.files.reading.clocks.clock import Clock
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.standards import choosing
from ftproc.files.reading.meaning import apart, carried, rows, schema, several, statements
from ftproc.files.reading.meaning.values import deciding, faces, plausibility, stamps
from ftproc.files.words import QUANTITIES
from ftproc.records import FloatArray, IntArray, MeasurementLog
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

Found = Mapping[str, schema.Column]


class _Plan(NamedTuple):
    """What is read of a table, and how. others: positions of the columns that are kept beside. notes: on what its
    values have shown. beside: range rates, heights and strengths of the signal. open: what may be such."""

    header: TableHeader
    found: Found
    station: Station
    conditions: tuple[Condition, ...] = ()
    others: tuple[int, ...] = ()
    extract: Extract = Extract()
    notes: tuple[str, ...] = ()
    beside: tuple[further.Further, ...] = ()
    open: tuple[str, ...] = ()

    def positions(self) -> list[int]:
        """Of the columns of all quantities, in their order."""
        return [index for column in self.found.values() for index in column.positions]


@np.errstate(over="ignore", invalid="ignore")  # a reading may be 1e308: what overflows is beyond all limits too
def read(
    source: tables.Source,
    *,
    units: str | Mapping[str, str] | None = None,
    columns: str | Mapping[str, str] | None = None,
    azimuth_from: str | None = None,
    keep_columns: bool = False,
    station: Station | None = None,
    extract: Extract | None = None,
) -> MeasurementLog:
    """Read and check one log; angles become rad, lengths m, times s, rows come in time order.

    source: path of a file of a kind that `formats.tables` lists, `-` for text on standard input, a pyarrow Table or a
    pandas DataFrame.
    units: such as `{"range": "km"}` or `"range=km,azimuth=deg"`, for columns whose name states no unit.
    columns: such as `{"time": "T0"}` or `"time=T0,range=RNG"`, also numbers from 1; `none` for a quantity that the
    file lacks.
    azimuth_from: `x` (A = atan2(y, x), the default) or `north`, which makes the frame `north-east-up`.
    keep_columns: carry the file's other columns through as `extra`.
    station: what else is known of the instrument, see `conventions`.
    extract: which of several targets, conditions on rows, widths of columns, whether the strength of the signal too.

    Rows are counted from 0 without the header, in messages as in `row`; empty lines do not count. Rows without a time
    are listed and left out. Readings of any size stay in: editing judges outliers, such as a negative range.
    Timestamps become seconds since 00:00 UTC of the day of the earliest one.

    Raises InputError for a file that cannot be read or is no log, or whose meaning is open (the message has the option
    that settles it); UsageError for options that are not understood.
    """
    station, extract = station or Station(), extract or Extract()
    if azimuth_from is not None:
        station = replace(station, azimuth_from=azimuth_from)
    conventions.check(station)
    unit_of, column_of = parse_units(units), parse_columns(columns)
    header = tables.read_header(source, extract.widths)
    choosing.refuse_open(header, {**unit_of, **column_of})
    header = statements.with_units_beside(header)
    statements.refuse_unheard(header, station, unit_of)
    column_of = {**header.stated.columns, **column_of}
    station = replace(station, azimuth_from=station.azimuth_from or header.stated.azimuth_from or None)
    column_of = {**(parted := carried.columns(header, column_of)), **column_of}
    propose = proposal.by_values(header)
    if "time" not in column_of and not schema.has_time(header.names, header.units):
        index = proposal.the_moments(header, range(len(header.names)))
        if index is None and "time" not in unit_of and (counts := statements.by_counts(header)):
            header, index, unit_of["time"] = counts
        column_of = column_of if index is None else {**column_of, "time": str(index + 1)}
    found = schema.resolve(header.source, header.names, unit_of, column_of, header.units, propose)
    found |= {quantity: found[quantity]._replace(why=carried.WHY) for quantity in parted}
    beside = further.find(header, found, unit_of, column_of, extract.signal)
    plan = _Plan(header, found, station, _conditions(header, extract), extract=extract, beside=beside)
    if keep_columns:
        gone = {*plan.positions(), *further.published(beside, found)}
        plan = plan._replace(others=tuple(index for index in range(len(header.names)) if index not in gone))
        _check_others(header, plan.others)
    whole = plan.others or plan.conditions or beside or header.stated.target or header.stated.station
    if not whole and station.refraction is None:  # refraction needs ranges of other blocks
        log = _in_blocks(plan)
        if log is not None:
            return _of_target(log, extract)
    return _of_target(_at_once(plan), extract)


def _of_target(log: MeasurementLog, extract: Extract) -> MeasurementLog:
    """The log with the target that was picked among how it was understood."""
    picked = extract.target if "=" in extract.target else ""
    return replace(log, understood={**log.understood, "target": picked}) if picked else log


def _conditions(header: TableHeader, extract: Extract) -> tuple[Condition, ...]:
    if extract.target in ("", ABSENT):
        return extract.where
    if "=" not in extract.target:
        rows.position(header.source, header.names, extract.target, "--target")
        raise InputError(
            f"{header.source}: --target {extract.target} is for a trajectory of each; name one value of it."
        )
    return (*extract.where, *parse_where(extract.target))


def _in_blocks(plan: _Plan) -> MeasurementLog | None:
    """The log of a large file; None if the file is small or must be read at once, see `large`."""
    header = plan.header
    blocks = header.blocks(plan.positions())
    if blocks is None:
        return None
    clocks: list[Clock] = []

    def convert(table: pa.Table) -> tuple[dict[str, FloatArray], str]:
        converted = converting.converted(header, plan.found, table.columns)
        clock = converted.clock
        if (
            converted.notes
            or converted.undecided
            or converted.found != plan.found
            or (clocks and clock.words != clocks[0].words)
        ):
            raise InputError("only the whole file shows what its cells mean")
        clocks[:] = clocks or [clock._replace(time_s=clock.time_s[:0])]
        return converted.quantities, clock.epoch

    station = understanding.as_named(plan.station, plan.found)
    spooled = large.read(header.source, blocks, convert, station)
    if spooled is None:
        return None
    log, sample = spooled
    try:
        judged = converting.judged(header.source, sample, plan.found, clocks[0], plan.station)
    except InputError:  # the whole file shows whether this comes of several targets
        return None
    if judged.found != plan.found:
        return _in_blocks(plan._replace(found=judged.found))
    timed = large.readings(sample)[~np.isnan(sample["time"])]
    times = sample["time"][~np.isnan(sample["time"])]
    if several.alternate(timed) or log.duplicate_times > len(log) / 3 or stamps.coarse(times) is not None:
        return None  # only the whole file shows what these are
    _refuse_apart(plan, log, QUANTITIES[1:])
    return _explained(plan, log, clocks[0]._replace(epoch=log.epoch), (), judged, timed)


def _at_once(plan: _Plan) -> MeasurementLog:
    header, found = plan.header, plan.found
    chosen, wanted = _loaded(plan), plan.positions()
    table = header.load(wanted, [*chosen[len(wanted) :], *plan.others])
    if not table.num_rows:
        raise InputError(f"{header.source}: there are column names but no rows.")
    table, zeros = fractions.restored(header, found["time"], table)
    kept, notes = _kept(plan, table, chosen)
    choosing.refuse_several(header, plan.extract, kept)
    converted = converting.converted(header, found, table.columns if kept is None else table.take(kept).columns)
    one_target = bool(plan.extract.target or header.stated.target)
    try:
        judged = converting.judged(header.source, *converted[:3], plan.station, header.is_of_a_standard)
    except InputError:  # rows of several targets have no motion that tells the units
        log = _in_time_order(header.source, converted.quantities, None)
        if not one_target:
            several.refuse(header, found, log, kept)
        _refuse_apart(plan, log, [q for q in QUANTITIES[1:] if q not in found or found[q].unit_is_stated])
        raise
    packed = {q: column for q, column in judged.found.items() if column.notation != converted.found[q].notation}
    if packed:  # their cells are read again
        return _at_once(plan._replace(found={**found, **packed}, notes=judged.doubts))
    quantities = converting.in_other_units(converted.quantities, converted.found, judged.found)
    over = faces.over_the_zenith(quantities, judged.found, plan.station)
    quantities["time"], spread = stamps.spread(quantities)
    stamps.refuse_one(header, found["time"], quantities["time"])
    extra = table.select(list(range(len(chosen), table.num_columns))) if plan.others else None
    log = _in_time_order(header.source, quantities, extra if kept is None or extra is None else extra.take(kept))
    if kept is not None:
        gone = tuple(int(kept[row]) for row in log.rows_without_time)
        log = replace(log, row=kept[log.row], rows_without_time=gone, rows_in_file=table.num_rows)
    if plan.beside:
        beside, left_out = further.in_known_units(plan.beside, header, log)
        plan = plan._replace(beside=beside, open=left_out)
        log = replace(log, **further.of_rows(plan.beside, header, log.row))
    plan = plan._replace(found=judged.found)
    if not one_target:
        several.refuse(header, judged.found, log)
    _refuse_apart(plan, log, QUANTITIES[1:])
    clock = converted.clock
    notes = (*header.stated.notes, *notes, *zeros, *converted.notes, *clock.notes, *spread, *over)
    if judged.found["time"].unit != converted.found["time"].unit:
        clock = clock._replace(words=f"numbers in {judged.found['time'].unit.name}, by the motion")
    explained = _explained(plan, replace(log, epoch=clock.epoch), clock, notes, judged)
    return computed.checked(conventions.apply(explained, explained.station))


def _loaded(plan: _Plan) -> list[int]:
    """Positions of the columns of the quantities, and of the conditions that name others."""
    found = plan.positions()
    for condition in plan.conditions:
        index = rows.position(plan.header.source, plan.header.names, condition.column, "--where or --target")
        if index not in found:
            found.append(index)
    return found


def _kept(plan: _Plan, table: pa.Table, chosen: list[int]) -> tuple[IntArray | None, tuple[str, ...]]:
    """The rows that meet the conditions, None for all, and a note on those that do not."""
    if not plan.conditions:
        return None, ()
    header = plan.header
    kept = np.flatnonzero(mask := rows.meeting(header, plan.conditions, table, chosen))
    wanted = " and ".join(str(condition) for condition in plan.conditions)
    if not kept.size:
        raise InputError(f"{header.source}: no row meets {wanted}; check the column and the value.")
    out = f"{len(mask) - len(kept)} of {len(mask)} rows are left out, which do not meet {wanted}"
    return kept.astype(np.int64), (out,)


def _explained(
    plan: _Plan, log: MeasurementLog, clock: Clock, notes: Iterable[str], judged: deciding.Open,
    sample: FloatArray | None = None,
) -> MeasurementLog:  # fmt: skip
    """The log with its station, and with remarks on how it was understood."""
    station = understanding.as_named(plan.station, plan.found)
    values = log.measurement if sample is None else sample
    beside = {each.position for each in plan.beside}
    known = plan.header.is_of_a_standard or (log.heights is not None and "elevation" not in plan.found)
    names = [] if known else [name for index, name in enumerate(plan.header.names) if index not in beside]
    remarks = schema.remarks(names, plan.found, bool(clock.epoch))
    words = (*notes, *plan.notes, *judged.doubts, *plan.open, *plausibility.doubts(values, station))
    axis = understanding.knows_axis(plan.station, plan.found)
    understood = understanding.describe(plan.header, plan.found, clock, station, words, axis, plan.beside)
    understood["assumed"] = [*judged.conditions, *understanding.assumed_of(plan.found), *restarts.assumed(log)]
    sha256 = plan.header.sha256()
    return replace(log, remarks=(*remarks, *words), understood=understood, station=station, sha256=sha256)


def _check_others(header: TableHeader, others: Iterable[int]) -> None:
    counts = Counter(header.names[position] for position in others)
    for name, count in counts.items():
        if count > 1:
            raise InputError(
                f'{header.source}: column "{name}" is there twice, so both cannot be kept; rename one, '
                "or leave --keep-columns out."
            )


def _refuse_apart(plan: _Plan, log: MeasurementLog, known: Sequence[str]) -> None:
    """Refuse rows that the user says to be of one target, where they cannot be."""
    if plan.extract.target == ABSENT:
        apart.refuse(log, known)


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
