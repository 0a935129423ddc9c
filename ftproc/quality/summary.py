"""The summary of a run as a dictionary and as text: what was edited, the noise found, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ftproc.derived import impact
from ftproc.files.moments import Moments
from ftproc.quality import next_steps, verdict


def as_dict(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """The summary in a trajectory's metadata, with the log's name and the method in front."""
    return {"log": metadata["log"], "method": metadata["method"], **metadata["summary"]}


def text(metadata: Mapping[str, Any]) -> str:
    """The summary in a trajectory's metadata as plain text, at most a screen of a terminal."""
    s, settings = metadata["summary"], metadata["settings"]
    way = "smoothed" if settings["smooth"] else "filtered"
    lag = f", {settings['lag_s']:g} s of lag" if settings["editing"] == "live" else ""
    begins = Moments.of_summary(s).begins
    since = f" from {begins}" if begins else ""
    lines = [f"{metadata['log']}: {counted(s['rows'], 'row')}, {s['duration_s']:.6g} s{since}, {way} by "
             f"{metadata['method']} ({settings['editing']} editing{lag})"]  # fmt: skip
    lines += _table(s["components"])
    named = [*facts(s), *(("note", text) for text in notes(s))]
    level, reasons = verdict.level_of(s["trust"]), s["trust"]["reasons"]
    if len(reasons) < 2:
        named.append(("verdict", verdict.sentence(s["trust"])))
        named += [("", s["trust"]["not_shown"])] if level == verdict.CONSISTENT else []
    else:
        named += [("verdict", f"{level}:"), *(("", f"- {reason}") for reason in reasons)]
    named += _next(s, metadata)
    return "\n".join([*lines, *(line(name, what) for name, what in named)])


def _next(s: Mapping[str, Any], metadata: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What would be better: the first of the next steps, or the smoother."""
    steps = s["trust"].get("next_steps")
    if steps:
        first, *more = next_steps.in_words(steps[0])
        return [("next", first), *(("", each) for each in more)]
    smooth = s["median_sigma_smoothed_m"]
    if smooth is None:
        return []
    command = f"{metadata['command']} --smooth" if metadata["command"] else "smooth=True"
    return [("better", f"1 sigma of {smooth:.3g} m, not {s['median_sigma_m']:.3g} m (median of positions): {command}")]


def counted(number: int, what: str) -> str:
    """1 row, 2 rows."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def line(name: str, what: str) -> str:
    """A named line of the text."""
    return f"  {name:{_NAME}}  {what}"


HEADER = ("", "good", "isolated", "patch", "missing", "outliers", "longest patch", "noise (1 sigma)", "sigmas")
_NAME = len("elevation")
_NOISE = {"noise_m": ("m", 1.0), "noise_rad": ("mrad", 1e3), "noise_mps": ("m/s", 1.0)}


def _table(components: Mapping[str, Any]) -> list[str]:
    rows = [HEADER, *(component_cells(name, part) for name, part in components.items())]
    widths = [max(len(r[i]) for r in rows) for i in range(len(HEADER))]
    return [
        "  ".join(["  " + r[0].ljust(widths[0]), *(v.rjust(w) for v, w in zip(r[1:], widths[1:], strict=True))])
        for r in rows
    ]


def component_cells(name: str, part: Mapping[str, Any]) -> tuple[str, ...]:
    """One component's line of the table, under HEADER."""
    unit, factor, noise = next((*each, part[key]) for key, each in _NOISE.items() if key in part)
    sigma = "-" if noise is None else f"{factor * noise:.3g} {unit}"
    counts = (str(part[k]) for k in ("good", "isolated", "patch", "missing"))
    share = f"{100 * verdict.outlier_share(part):.2f} %"
    return (name, *counts, share, f"{part['longest_patch_s']:.3g} s", sigma, part["verdict"])


def facts(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and text of the lines about the log and the process noise."""
    found = [("gaps", f"{s['gaps']}, the longest {s['longest_gap_s']:.4g} s" if s["gaps"] else "none")]
    found += [("rows", text) for text in _rows(s)]
    jerk = s["jerk_psd_m2ps5"]
    if jerk is not None:
        found.append(("jerk", f"PSD {jerk['median']:.3g} m2/s5 (from {jerk['lowest']:.3g} to {jerk['highest']:.3g})"))
    if s.get("motion"):
        found.append(("motion", motion(s)))
    if s.get("impact"):
        found.append((s["impact"]["kind"], impact.in_words(s["impact"])))
    return found


def motion(s: Mapping[str, Any]) -> str:
    """The model of motion, and how much more likely than white jerk it, or its best rival, is."""
    some = "" if s["motion_share"] == 1 else f" in {100 * s['motion_share']:.0f} % of the rows"
    if s.get("abrupt_changes_s"):
        moments = Moments.of_summary(s)
        some += ", which changes abruptly at " + verdict.listed([moments.words(each) for each in s["abrupt_changes_s"]])
    if s["motion_gain"] == 0:
        return f"{s['motion']}{some}"
    rival = "white jerk" if s["motion"] != "white jerk" else "any other motion"
    return f"{s['motion']}{some} (log-likelihood {abs(s['motion_gain']):,.0f} above that of {rival})"


def innovations(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and text of the line about the size of the innovations."""
    if s["nis_mean"] is None:
        return []
    return [("NIS", f"{s['nis_mean']:.2f} on average, {s['components_used_mean']:.2f} expected")]


def notes(s: Mapping[str, Any]) -> list[str]:
    """The remarks on a run that are not the reasons of its verdict."""
    return [remark.text for remark in verdict.remarks(s) if remark.text not in s["trust"]["reasons"]]


def _rows(s: Mapping[str, Any]) -> list[str]:
    """How the columns were understood, and which rows had no time, came out of order or shared a time."""
    found = list(s["remarks"])
    if s["rows_without_time"]:
        have = "has" if s["rows_without_time"] == 1 else "have"
        lost = counted(s["rows_without_time"], "row")
        found.append(f"{lost} {have} no time (first: row {s['first_row_without_time']})")
    if s["rows_out_of_order"]:
        found.append(f"{counted(s['rows_out_of_order'], 'row')} out of time order, sorted")
    if s.get("rows_without_estimate"):
        found.append(f"{counted(s['rows_without_estimate'], 'row')} without an estimate: no track was confirmed yet")
    if s["duplicate_times"]:
        share = "shares" if s["duplicate_times"] == 1 else "share"
        at_once = s.get("at_once") and not s.get("plots_at_once")
        merged = "; those of one time are taken as one reading, their mean" if at_once else ""
        found.append(f"{counted(s['duplicate_times'], 'row')} {share} the time of the row before{merged}")
    if s.get("plots_at_once"):
        are = "is a further plot" if s["plots_at_once"] == 1 else "are further plots"
        found.append(f"{counted(s['plots_at_once'], 'row')} {are} of the same turn, taken as one reading, their mean")
    return found
