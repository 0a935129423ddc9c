"""Two runs on one log: where their trajectories differ, by how many sigmas, and which decisions changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.records import COMPONENTS, FloatArray, IntArray, Trajectory

DIFFERS = 1.0  # sigmas: less is within what either run says of itself
JOINED = 5  # rows: stretches that are closer are one
MOST_LISTED = 12
DECISIONS = ("good", "isolated", "patch", "missing", "rejected by hand", "accepted by hand")


@dataclass(frozen=True)
class Stretch:
    """Rows in a row whose positions differ by more than DIFFERS sigmas. largest_m, largest_sigmas: in it."""

    from_s: float
    to_s: float
    rows: int
    largest_m: float
    largest_sigmas: float


@dataclass(frozen=True)
class Change:
    """Readings of a component in a row on which the first run decided one way, the second another."""

    component: str
    from_s: float
    to_s: float
    readings: int
    first: str
    second: str


@dataclass(frozen=True)
class Difference:
    """Of a second trajectory from a first one, over the rows that both have.

    rows: in both. only_first, only_second: rows of one alone. median_m, largest_m, median_sigmas, largest_sigmas: of
    the position; sigmas are the larger ones of the two, on the axis that differs most. stretches, changes: all of them
    in the order of time. settings: by name, those of the two runs that are not the same.
    """

    first: str
    second: str
    rows: int
    only_first: int
    only_second: int
    median_m: float
    largest_m: float
    largest_time_s: float
    median_sigmas: float
    largest_sigmas: float
    stretches: tuple[Stretch, ...]
    changes: tuple[Change, ...]
    settings: dict[str, tuple[Any, Any]]

    def as_dict(self) -> dict[str, Any]:
        """JSON-serialisable."""
        return asdict(self)


def compare(first: Trajectory, second: Trajectory) -> Difference | None:
    """Rows are those of one log where both name the same one, else those with equal times. None without any in both,
    and where both are of known logs of different content."""
    logs = {each.metadata.get("log_sha256") for each in (first, second)}
    a, b = _rows_in_both(first, second)
    if not len(a) or (None not in logs and len(logs) > 1):
        return None
    time_s, gap = first.time_s[a], second.state[b, :3] - first.state[a, :3]
    length = np.sqrt((gap**2).sum(1))
    sigma = np.fmax(first.sigma[a, :3], second.sigma[b, :3])
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.abs(gap) / sigma
    sigmas = np.where(np.isfinite(ratio).all(1), ratio.max(1), np.nan)
    known = np.isfinite(length)
    farthest = int(np.where(known, length, -1.0).argmax())
    stretches = [
        Stretch(float(time_s[i]), float(time_s[j]), j - i + 1, float(np.nanmax(length[i : j + 1])),
                float(np.nanmax(sigmas[i : j + 1])))
        for i, j in _runs(sigmas > DIFFERS, JOINED)
    ]  # fmt: skip
    return Difference(
        first.name, second.name, len(a), len(first) - len(a), len(second) - len(b), _median(length),
        float(length[farthest]) if known.any() else np.nan, float(time_s[farthest]), _median(sigmas),
        float(np.nanmax(sigmas)) if np.isfinite(sigmas).any() else np.nan, tuple(stretches),
        tuple(_changes(time_s, first.outlier[a], second.outlier[b])), _settings(first.metadata, second.metadata),
    )  # fmt: skip


def text(difference: Difference) -> str:
    """The difference for people; ends with a newline."""
    d = difference
    lines = [f"{d.second} against {d.first}: {d.rows:,} rows in both"]
    if d.only_first or d.only_second:
        lines[0] += f", {d.only_first:,} and {d.only_second:,} in one alone"
    lines.append(
        f"  position   differs by {d.median_m:.3g} m in the median, at most {d.largest_m:.3g} m at "
        f"{d.largest_time_s:,.7g} s"
    )
    if np.isfinite(d.largest_sigmas):
        lines[-1] += f"; {d.median_sigmas:.2g} and {d.largest_sigmas:.3g} sigmas"
    for stretch in _longest(d.stretches, lambda each: each.largest_sigmas):
        lines.append(
            f"  differs    {stretch.from_s:,.7g} s to {stretch.to_s:,.7g} s ({stretch.rows:,} rows): up to "
            f"{stretch.largest_m:.3g} m, {stretch.largest_sigmas:.3g} sigmas"
        )
    lines += _cut("differs", len(d.stretches))
    if not d.stretches:
        lines.append(f"  differs    nowhere by more than {DIFFERS:g} sigma")
    for change in _longest(d.changes, lambda each: each.readings):
        until = "" if change.readings == 1 else f" to {change.to_s:,.7g} s"
        when = f"{change.from_s:,.7g} s{until} ({change.readings:,})"
        lines.append(f"  decisions  {change.component} {when}: {change.first}, then {change.second}")
    lines += _cut("decisions", len(d.changes))
    if not d.changes:
        lines.append("  decisions  the same")
    lines += [
        f"  settings   {name}: {_said(first)}, then {_said(second)}" for name, (first, second) in d.settings.items()
    ]
    return "\n".join(lines) + "\n"


def _said(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _longest(each: tuple[Any, ...], size: Any) -> list[Any]:
    """The largest MOST_LISTED, in the order of time."""
    chosen = sorted(each, key=size, reverse=True)[:MOST_LISTED]
    return sorted(chosen, key=lambda one: one.from_s)


def _cut(what: str, count: int) -> list[str]:
    return [f"  {what:<9}  and {count - MOST_LISTED:,} smaller ones"] if count > MOST_LISTED else []


def _rows_in_both(first: Trajectory, second: Trajectory) -> tuple[IntArray, IntArray]:
    """The numbers of the rows, in the order of time."""
    log = first.metadata.get("log")
    unique = all(len(np.unique(each.row)) == len(each) and (each.row >= 0).all() for each in (first, second))
    if log is not None and log == second.metadata.get("log") and unique:
        _, a, b = np.intersect1d(first.row, second.row, return_indices=True)
    else:
        _, a, b = np.intersect1d(first.time_s, second.time_s, return_indices=True)
    order = np.argsort(a, kind="stable")
    return a[order], b[order]


def _runs(inside: NDArray[np.bool_], joined: int = 0) -> list[tuple[int, int]]:
    """First and last of each run of True; those with at most so many others in between are one."""
    rows = np.flatnonzero(inside)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > 1 + joined)
    return list(zip(rows[np.r_[0, breaks + 1]].tolist(), rows[np.r_[breaks, len(rows) - 1]].tolist(), strict=True))


def _changes(time_s: FloatArray, first: NDArray[np.uint8], second: NDArray[np.uint8]) -> list[Change]:
    found = []
    for c, name in enumerate(COMPONENTS):
        kind = len(DECISIONS) * first[:, c].astype(int) + second[:, c]
        for each in np.unique(kind[first[:, c] != second[:, c]]):
            was, now = divmod(int(each), len(DECISIONS))
            for i, j in _runs(kind == each):
                change = Change(name, float(time_s[i]), float(time_s[j]), j - i + 1, DECISIONS[was], DECISIONS[now])
                found.append(change)
    return sorted(found, key=lambda each: (each.from_s, COMPONENTS.index(each.component)))


def _settings(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Those that differ and can be read: no lists; and the method."""
    a, b = ({"method": m.get("method"), **_mapping(m.get("settings"))} for m in (first, second))
    names = [name for name in a if name in b and a[name] != b[name]]
    return {n: (a[n], b[n]) for n in names if not isinstance(a[n], list | dict) and not isinstance(b[n], list | dict)}


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _median(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan
