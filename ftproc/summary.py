"""What a user wants to know at a glance: how much was edited, what noise was found, whether to trust the result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc import consistency, trust
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, FloatArray, MeasurementLog, Trajectory

if TYPE_CHECKING:
    from ftproc.methods.estimate import Estimate

UNITS = ("m", "rad", "rad")
GAP_INTERVALS = 3.0  # median intervals that make a gap


def summarise(
    log: MeasurementLog, estimate: Estimate, absent: list[int], correction: FloatArray, outside: float
) -> dict[str, Any]:
    """The figures of the summary, JSON-serialisable; units are in the names."""
    label, run = estimate.label, estimate.run
    best_sigma = (run if estimate.smoothed is None else estimate.smoothed).sigma
    used = run.weight > 0
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled = np.where(used, run.innovation / run.innovation_sigma, np.nan)
    interval = np.diff(log.time_s)
    typical = float(np.median(interval)) if len(interval) else 0.0
    gaps = interval[interval > GAP_INTERVALS * typical] if typical > 0 else interval[:0]
    components: dict[str, Any] = {}
    for c, name in enumerate(COMPONENTS):
        noise = float(np.sqrt(estimate.model.reading_variance[c]))
        seen = used[:, c] & (c not in absent)
        components[name] = {
            "good": int((label[:, c] == GOOD).sum()),
            "isolated": int((label[:, c] == ISOLATED).sum()),
            "patch": int((label[:, c] == PATCH).sum()),
            "missing": int((label[:, c] == MISSING).sum()),
            "longest_patch_s": _longest_patch(log.time_s, label[:, c]),
            f"noise_{UNITS[c]}": noise if c not in absent else None,
            "noise_correlation": float(estimate.model.correlation[c]),
            "prediction_vagueness": consistency.vagueness(run.innovation_sigma[:, c], seen, noise),
            **consistency.scatter(np.where(seen, scaled[:, c], np.nan)),
        }
    levels = estimate.model.jerk[:, [0, 3, 5]].mean(1)
    modelled = bool(np.isfinite(levels).all())
    figures = {
        "rows": len(log),
        "rows_in_file": log.rows_in_file,
        "rows_without_time": len(log.rows_without_time),
        "first_row_without_time": log.rows_without_time[0] if log.rows_without_time else None,
        "rows_out_of_order": log.rows_out_of_order,
        "duplicate_times": log.duplicate_times,
        "remarks": list(log.remarks),
        "duration_s": float(log.time_s[-1] - log.time_s[0]),
        "interval_s": typical,
        "gaps": len(gaps),
        "longest_gap_s": float(gaps.max()) if len(gaps) else 0.0,
        "components": components,
        "not_observable": [COMPONENTS[c] for c in absent],
        "jerk_psd_m2ps5": {
            "lowest": float(levels.min()),
            "median": float(np.median(levels)),
            "highest": float(levels.max()),
        }
        if modelled
        else None,
        "nis_mean": float(np.nanmean(run.nis)) if np.isfinite(run.nis).any() else None,
        "components_used_mean": float(used.sum() / max(int(used.any(1).sum()), 1)),
        "hardly_observable": [] if absent else consistency.blind_stretches(log.time_s, best_sigma[:, :3]),
        "reacquired": len(estimate.reacquired),
        "editing_settled": estimate.settled,
        "slow_noise": estimate.slow_noise,
        "correction_largest_m": float(np.linalg.norm(correction[:, :3], axis=1).max()) if len(correction) else 0.0,
        "correction_outside_training": outside,
    }
    return figures | {"trust": trust.verdict(trust.remarks(figures))}


def _longest_patch(time_s: FloatArray, label: Any) -> float:
    """Duration in s of the longest patch of one component; missing readings inside do not end it."""
    seen = np.flatnonzero(label != MISSING)
    inside = np.r_[False, label[seen] == PATCH, False]
    edges = np.flatnonzero(inside[1:] != inside[:-1]).reshape(-1, 2)
    return float((time_s[seen[edges[:, 1] - 1]] - time_s[seen[edges[:, 0]]]).max(initial=0.0))


def as_dict(trajectory: Trajectory) -> dict[str, Any]:
    """The summary with the log's name and the method in front."""
    metadata = trajectory.metadata
    return {"log": metadata["log"], "method": metadata["method"], **metadata["summary"]}


def text(trajectory: Trajectory) -> str:
    """At most a screen for the terminal, in plain text."""
    s, settings = trajectory.metadata["summary"], trajectory.metadata["settings"]
    way = "smoothed" if settings["smooth"] else "filtered"
    lines = [f"{trajectory.metadata['log']}: {counted(s['rows'], 'row')}, {s['duration_s']:.6g} s, {way} by "
             f"{trajectory.metadata['method']} ({settings['editing']} editing)"]  # fmt: skip
    lines += _table(s["components"])
    told = facts(s)
    reasons = s["trust"]["reasons"]
    told += [("note", text) for text in notes(s)]
    if len(reasons) < 2:
        told.append(("verdict", trust.sentence(s["trust"])))
    else:
        told += [("verdict", f"{trust.opening(s['trust'])}:"), *(("", f"- {reason}") for reason in reasons)]
    return "\n".join([*lines, *(line(name, what) for name, what in told)])


def counted(number: int, what: str) -> str:
    """1 row, 2 rows."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def line(name: str, what: str) -> str:
    """A named line of the text."""
    return f"  {name:{_NAME}}  {what}"


HEADER = ("", "good", "isolated", "patch", "missing", "outliers", "longest patch", "noise (1 sigma)", "sigmas")
_NAME = len("elevation")


def _table(components: Mapping[str, Any]) -> list[str]:
    rows = [HEADER, *(component_cells(name, components[name]) for name in COMPONENTS)]
    widths = [max(len(r[i]) for r in rows) for i in range(len(HEADER))]
    return [
        "  ".join(["  " + r[0].ljust(widths[0]), *(v.rjust(w) for v, w in zip(r[1:], widths[1:], strict=True))])
        for r in rows
    ]


def component_cells(name: str, part: Mapping[str, Any]) -> tuple[str, ...]:
    """One component's line of the table, under HEADER."""
    c = COMPONENTS.index(name)
    noise = part[f"noise_{UNITS[c]}"]
    spoken = "-" if noise is None else f"{noise:.3g} m" if c == 0 else f"{1e3 * noise:.3g} mrad"
    counts = (str(part[k]) for k in ("good", "isolated", "patch", "missing"))
    share = f"{100 * trust.outlier_share(part):.2f} %"
    return (name, *counts, share, f"{part['longest_patch_s']:.3g} s", spoken, part["verdict"])


def facts(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What there is to say of every run: name and text."""
    found = [("gaps", f"{s['gaps']}, the longest {s['longest_gap_s']:.4g} s" if s["gaps"] else "none")]
    found += [("rows", line) for line in _oddities(s)]
    jerk = s["jerk_psd_m2ps5"]
    if jerk is not None:
        found.append(
            ("jerk", f"density {jerk['median']:.3g} m2/s5 (from {jerk['lowest']:.3g} to {jerk['highest']:.3g})")
        )
    if s["nis_mean"] is not None:
        found.append(("NIS", f"{s['nis_mean']:.2f} on average, {s['components_used_mean']:.2f} expected"))
    return found


def notes(s: Mapping[str, Any]) -> list[str]:
    """The remarks on a run that are not the reasons of its verdict."""
    return [remark.text for remark in trust.remarks(s) if remark.text not in s["trust"]["reasons"]]


def _oddities(s: Mapping[str, Any]) -> list[str]:
    """What was odd about the rows of the log, and how its columns were understood."""
    found = list(s["remarks"])
    if s["rows_without_time"]:
        have = "has" if s["rows_without_time"] == 1 else "have"
        lost = counted(s["rows_without_time"], "row")
        found.append(f"{lost} {have} no time (first: row {s['first_row_without_time']})")
    if s["rows_out_of_order"]:
        found.append(f"{counted(s['rows_out_of_order'], 'row')} out of time order, sorted")
    if s["duplicate_times"]:
        share = "shares" if s["duplicate_times"] == 1 else "share"
        found.append(f"{counted(s['duplicate_times'], 'row')} {share} the time of the row before")
    return found
