"""Several targets in one log: rows that alternate between tracks, and the column that tells these apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import InputError, quoted
from ftproc.files.reading.clocks import restarts
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import names, rows, schema
from ftproc.order_statistics import medians
from ftproc.records import COMPONENTS, FloatArray, IntArray, MeasurementLog

_LAGS = 8  # rows before, among which the one before of the same target is sought
_FAR = 10.0  # times the distance to the nearest of these, for a jump from one target to another
_SHARE = 0.2  # of the rows that jump, when targets alternate
_LARGEST = 1e15  # of a reading
_FEWEST = 24  # rows, for a judgement
_MOST = 20_000  # rows that are read, in four stretches
MOST_TARGETS = 500
_MOST_COLUMNS = 100  # that are searched
_AGREE = 0.8  # of the jumps fall on changes of the column that tells targets apart

_GOOD = ("ok", "good", "valid", "gut", "true", "locked", "lock", "normal", "pass", "passed")  # cells of good readings

#: Words in the names of columns that number targets.
WORDS = frozenset(
    (
        "track", "trk", "target", "tgt", "trn", "tid", "trackno", "trackid", "tracknum", "tracknumber",
        "targetid", "targetno", "object", "objectid", "obj", "id", "code", "icao", "icao24", "callsign",
        "squawk", "beacon", "ssr", "mode3a", "acid", "acaddr", "address", "aircraft", "tail", "reg", "flight",
        "vehicle", "ship", "mmsi",
    )
)  # fmt: skip


class Column(NamedTuple):
    """A column that tells targets apart, and the values that do, as text."""

    name: str
    values: tuple[str, ...]


def refuse(
    header: TableHeader, found: Mapping[str, schema.Column], log: MeasurementLog, kept: IntArray | None = None
) -> None:
    """Raise InputError, a question, if a log in SI units and in time order holds several targets. kept: the rows of the
    file among which its rows count; None: in the file."""
    used = {index for column in found.values() for index in column.positions}
    free = [index for index, name in enumerate(header.names) if index not in used and header.names.count(name) == 1]
    mixed = alternate(log.measurement)
    if not mixed:
        free = [index for index in free if numbers_targets(header.names[index])]
    row = log.row if kept is None else kept[log.row]
    column = column_of(log.measurement, _cells(header, free[:_MOST_COLUMNS], row)) if free else None
    if column is not None:
        good = [value for value in column.values if value.lower() in _GOOD]
        if good and not numbers_targets(column.name):
            others = ", ".join(value for value in column.values if value not in good)
            raise InputError(
                f'{header.source}: the rows that column "{column.name}" calls {good[0]} are of another track than the '
                f"others ({others}). Say --where {quoted(f'{column.name}={good[0]}')} to use only these, or --target "
                "none to use all of them."
            )
        first, count = column.values[0], len(column.values)
        shown = ", ".join(column.values[:6]) + (", ..." if count > 6 else "")
        raise InputError(
            f'{header.source}: column "{column.name}" tells {count} targets apart ({shown}), whose rows alternate. '
            f"Say --target {quoted(f'{column.name}={first}')} for one, --target {quoted(column.name)} for a "
            "trajectory of each, or --target none if it is one target after all."
        )
    if mixed and (back := restarts.sessions(log)):
        raise InputError(
            f"{header.source}: the time {back}, and the rows from there on are on another track at the same times, as "
            "in several sessions behind each other. Split the file there; if it is one session, write times that go on."
        )
    if mixed:
        split = threshold(log.measurement)
        if split is None:
            cure = "Split the file"
        else:
            mine = found[COMPONENTS[split[0]]]
            value = split[1] * mine.unit.divide / mine.unit.multiply
            below, above = (quoted(f"{mine.name}{test}{value:.6g}") for test in "<>")
            cure = f"Say --where {below} or --where {above}"
        raise InputError(
            f"{header.source}: the rows alternate between two tracks, and no column tells the targets apart. {cure}, "
            "or --target none if it is one target after all."
        )


def question(source: str, columns: Sequence[str]) -> str:
    """The same of rows that are not all there yet. columns: names of the log's."""
    names = [name for name in columns if numbers_targets(name)]
    which = f"Say --target {quoted(names[0])} for a track of each, or" if names else "Send each on its own, or say"
    return f"{source}: the rows alternate between tracks. {which} --target none if it is one target after all."


def numbers_targets(name: str) -> bool:
    """Whether the name of a column is one of those that number targets."""
    apart = names.taken_apart(name)
    return apart.stem in WORDS or bool(WORDS & set(apart.words))


def _cells(header: TableHeader, indices: list[int], row: IntArray) -> dict[str, NDArray[np.str_]]:
    table = header.load([], indices)
    return {header.names[index]: rows.cells(table.column(k))[row] for k, index in enumerate(indices)}


def alternate(measurement: FloatArray) -> bool:
    """Whether rows (n, 3) in time order (range, azimuth in rad, elevation; NaN where missing) alternate between tracks
    that each go on smoothly, in more than one component."""
    jump = _jumps(measurement)
    return bool(jump.size >= _FEWEST and np.mean(jump) >= _SHARE)


def _jumps(measurement: FloatArray) -> NDArray[np.bool_]:
    """For rows from the ninth on: whether each jumps away from the row before, and both have one near them."""
    parts = [measurement] if len(measurement) <= _MOST else np.array_split(measurement, 4)
    found = [_jumps_in(part[: _MOST // (1 if len(parts) == 1 else 4)]) for part in parts]
    return np.concatenate(found) if found else np.zeros(0, bool)


def _jumps_in(z: FloatArray) -> NDArray[np.bool_]:
    present = np.isfinite(z)
    used = present.mean(0) > 0.5 if len(z) else np.zeros(3, bool)
    z = z[present[:, used].all(1)][:, used]
    if len(z) < _FEWEST + _LAGS or not used.any():
        return np.zeros(0, bool)
    azimuth = np.flatnonzero(np.flatnonzero(used) == 1)
    lags = range(1, _LAGS + 1)
    z = np.clip(z, -_LARGEST, _LARGEST)
    steps = np.stack([np.abs(_turned(z[_LAGS:] - z[_LAGS - lag : len(z) - lag], azimuth)) for lag in lags])
    scale = np.maximum(medians(steps.min(0)), 1e-12 + 1e-9 * medians(np.abs(z)))
    distance = (steps / scale).max(2)
    nearest = distance[1:].min(0)
    own = np.minimum(nearest, distance[0])
    far = distance[0] > _FAR * np.maximum(own, 1.0)
    components = (steps[0] > _FAR * scale).sum(1)
    before = np.r_[False, distance[0][1:] > _FAR * np.maximum(np.r_[own[:-1]], 1.0)] if len(own) > 1 else far
    found: NDArray[np.bool_] = far & before & (components >= min(2, z.shape[1]))
    return found


def _turned(step: FloatArray, azimuth: IntArray) -> FloatArray:
    """Steps (n, k), those of the azimuth within half a turn."""
    if azimuth.size:
        step[:, azimuth] = (step[:, azimuth] + np.pi) % (2 * np.pi) - np.pi
    return step


def column_of(measurement: FloatArray, columns: Mapping[str, NDArray[np.str_]]) -> Column | None:
    """The column by which the rows (n, 3), in time order, are distinguished; None if none does so.

    columns: their cells as text, row for row.
    """
    found: list[tuple[float, Column]] = []
    for name, cells in columns.items():
        values, code = np.unique(cells, return_inverse=True)
        if not 2 <= len(values) <= min(MOST_TARGETS, len(cells) // 3):
            continue
        score = _separates(measurement, code)
        if score > _AGREE:
            filled = tuple(str(value) for value in values if str(value))
            found.append((score, Column(name, filled)))
    return max(found, key=lambda pair: (round(pair[0], 2), -len(pair[1].values)))[1] if found else None


def _separates(z: FloatArray, code: IntArray) -> float:
    """The share of the changes of a code that are jumps, if the code changes back and forth; else 0."""
    present = np.isfinite(z)
    used = present.mean(0) > 0.5
    rows = present[:, used].all(1)
    z, code = np.clip(z[rows][:, used], -_LARGEST, _LARGEST), code[rows]
    changes = np.flatnonzero(np.diff(code))
    if not used.any() or len(changes) <= 2 * (len(np.unique(code)) - 1) or len(z) < _FEWEST:
        return 0.0
    azimuth = np.flatnonzero(np.flatnonzero(used) == 1)
    order = np.argsort(code, kind="stable")
    inside = np.abs(_turned(np.diff(z[order], axis=0), azimuth))[np.diff(code[order]) == 0]
    if not len(inside):
        return 0.0
    scale = np.maximum(medians(inside), 1e-12 + 1e-9 * medians(np.abs(z)))
    across = np.abs(_turned(np.diff(z, axis=0)[changes], azimuth))
    return float(np.mean((across > 4 * scale).sum(1) >= min(2, z.shape[1])))


def threshold(measurement: FloatArray) -> tuple[int, float] | None:
    """The component and the value between two tracks that never share a value of it, or None."""
    for component in (0, 2):  # the azimuth has no least value
        values = measurement[:, component]
        values = np.sort(values[np.isfinite(values)])
        if len(values) < _FEWEST:
            continue
        low, high = values[len(values) // 50], values[-1 - len(values) // 50]
        inner = values[(values >= low) & (values <= high)]
        gaps = np.diff(inner)
        index = int(np.argmax(gaps)) if len(gaps) else 0
        balanced = 0.2 * len(inner) < index + 1 < 0.8 * len(inner)
        if len(gaps) and balanced and gaps[index] > 0.2 * (high - low):
            value = float(inner[index] + inner[index + 1]) / 2
            below = measurement[:, component] < value
            if not alternate(measurement[below]) and not alternate(measurement[~below]):
                return component, value
    return None
