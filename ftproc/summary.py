"""What a user wants to know at a glance: how much was edited, what noise was found, whether to trust the result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftproc import consistency
from ftproc.methods.estimate import Estimate
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, FloatArray, MeasurementLog, Trajectory

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
    return {
        "rows": len(log),
        "rows_in_file": log.rows_in_file,
        "rows_without_time": len(log.rows_without_time),
        "first_row_without_time": log.rows_without_time[0] if log.rows_without_time else None,
        "rows_out_of_order": log.rows_out_of_order,
        "duplicate_times": log.duplicate_times,
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
        },
        "nis_mean": float(np.nanmean(run.nis)) if np.isfinite(run.nis).any() else None,
        "components_used_mean": float(used.sum() / max(int(used.any(1).sum()), 1)),
        "hardly_observable": [] if absent else consistency.blind_stretches(log.time_s, best_sigma[:, :3]),
        "reacquired": len(estimate.reacquired),
        "editing_settled": estimate.settled,
        "slow_noise": estimate.slow_noise,
        "correction_largest_m": float(np.linalg.norm(correction[:, :3], axis=1).max()) if len(correction) else 0.0,
        "correction_outside_training": outside,
    }


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
    """A dozen lines for the terminal."""
    s, settings = trajectory.metadata["summary"], trajectory.metadata["settings"]
    way = "smoothed" if settings["smooth"] else "filtered"
    lines = [f"{trajectory.metadata['log']}: {s['rows']} rows, {s['duration_s']:.6g} s, {way} by "
             f"{trajectory.metadata['method']} ({settings['editing']} editing)"]  # fmt: skip
    lines += _oddities(s)
    header = ("", "good", "isolated", "patch", "missing", "longest patch", "noise (1 sigma)", "sigmas")
    rows = [header, *(_row(name, c, s["components"][name]) for c, name in enumerate(COMPONENTS))]
    widths = [max(len(r[i]) for r in rows) for i in range(len(header))]
    for r in rows:
        cells = (v.rjust(w) for v, w in zip(r[1:], widths[1:], strict=True))
        lines.append("  ".join(["  " + r[0].ljust(widths[0]), *cells]))
    jerk = s["jerk_psd_m2ps5"]
    lines.append(f"  jerk density {jerk['median']:.3g} m2/s5 (from {jerk['lowest']:.2g} to {jerk['highest']:.2g})")
    if s["nis_mean"] is not None:
        lines.append(f"  NIS {s['nis_mean']:.2f} on average, {s['components_used_mean']:.2f} expected")
    lines += _remarks(s)
    return "\n".join(lines)


def _row(name: str, c: int, part: Mapping[str, Any]) -> tuple[str, ...]:
    noise = part[f"noise_{UNITS[c]}"]
    spoken = "-" if noise is None else f"{noise:.3g} m" if c == 0 else f"{1e3 * noise:.3g} mrad"
    counts = (str(part[k]) for k in ("good", "isolated", "patch", "missing"))
    return (name, *counts, f"{part['longest_patch_s']:.3g} s", spoken, part["verdict"])


def _oddities(s: Mapping[str, Any]) -> list[str]:
    found = []
    if s["rows_without_time"]:
        found.append(f"{s['rows_without_time']} rows have no time (first: row {s['first_row_without_time']})")
    if s["rows_out_of_order"]:
        found.append(f"{s['rows_out_of_order']} rows out of time order, sorted")
    if s["duplicate_times"]:
        found.append(f"{s['duplicate_times']} rows share the time of the row before")
    if s["gaps"]:
        found.append(f"{s['gaps']} gaps, the longest {s['longest_gap_s']:.4g} s")
    return [f"  {line}" for line in found]


def _remarks(s: Mapping[str, Any]) -> list[str]:
    remarks = []
    if s["not_observable"]:
        names = " and ".join(s["not_observable"])
        remarks.append(f"{names} missing throughout: position and velocity are not observable and left empty")
    correlation = max(part["noise_correlation"] for part in s["components"].values())
    if correlation > 0:
        remarks.append(
            f"the noise is correlated from sample to sample (up to {correlation:.2f}); the sigmas allow for it"
        )
    for name, part in s["components"].items():
        vague = part["prediction_vagueness"]
        if vague is not None and vague > consistency.VAGUE:
            remarks.append(
                f"the {name} gate can hardly fire: predictions are {vague:.0f} times vaguer than readings, so only far "
                "larger outliers are noticed"
            )
    for blind in s["hardly_observable"]:
        when = f"from {blind['from_s']:.6g} to {blind['to_s']:.6g} s"
        remarks.append(f"{when} the position is hardly observable: 1 sigma up to {blind['sigma_m']:.3g} m")
    if s["slow_noise"]:
        remarks.append("the noise is correlated so slowly that it passes for motion: the sigmas are too small")
    if s["editing_settled"] is False:
        remarks.append("the outlier decisions did not settle: look at the flagged stretches")
    if s["reacquired"]:
        remarks.append(f"the track was taken up anew {s['reacquired']} times (lost, or a gap too long to bridge)")
    if s["correction_lost_by_smoothing"]:
        remarks.append("the model corrects the filter only: what was smoothed is not corrected")
    if s["correction_largest_m"] > 0:
        remarks.append(
            f"network correction up to {s['correction_largest_m']:.3g} m; "
            f"{100 * s['correction_outside_training']:.1f} % of samples outside its training got none"
        )
    return [f"  {line}" for line in remarks]
