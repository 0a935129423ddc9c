"""The summary of a fused flight as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ftproc.derived import impact
from ftproc.fusion.estimation.constants import NAMES, WORDS
from ftproc.quality import next_steps, verdict
from ftproc.quality.summary import counted, line, motion

COMPONENT_HEADER = ("station", "component", "good", "rejected", "missing", "noise (1 sigma)")
BIAS_HEADER = ("station", "bias", "estimate", "1 sigma", "before", "")
_UNIT = {"m": (1.0, "m"), "rad": (1e3, "mrad"), "s": (1e3, "ms"), "mps": (1.0, "m/s"), "scale": (100.0, "%")}


def text(metadata: Mapping[str, Any]) -> str:
    """The summary in the metadata of a fused trajectory, at most a screen of a terminal for a few stations."""
    s, way = metadata["summary"], "smoothed" if metadata["settings"]["smooth"] else "filtered"
    size = f"{counted(len(s['stations']), 'station')}, {s['readings']} readings, {s['duration_s']:.6g} s"
    lines = [f"{metadata['log']}: {size}, fused and {way}"]
    lines += _table([COMPONENT_HEADER, *component_rows(s)])
    lines += _table([BIAS_HEADER, *bias_rows(s)])
    jerk = s["jerk_psd_m2ps5"]
    named = [("jerk", f"PSD {jerk['median']:.3g} m2/s5 (from {jerk['lowest']:.3g} to {jerk['highest']:.3g})")]
    named += [("motion", motion(s))] if s.get("motion") else []
    named += [(s["impact"]["kind"], impact.in_words(s["impact"]))] if s.get("impact") else []
    named += [("note", note) for note in s["notes"]]
    level, reasons = verdict.level_of(s["trust"]), s["trust"]["reasons"]
    if len(reasons) < 2:
        named.append(("verdict", verdict.sentence(s["trust"])))
        named += [("", s["trust"]["not_shown"])] if level == verdict.CONSISTENT else []
    else:
        named += [("verdict", f"{level}:"), *(("", f"- {reason}") for reason in reasons)]
    for first, *more in map(next_steps.in_words, s["trust"].get("next_steps", [])[:1]):
        named += [("next", first), *(("", each) for each in more)]
    return "\n".join([*lines, *(line(name, what) for name, what in named)])


def component_rows(s: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """A row for each component of each station, under COMPONENT_HEADER."""
    found = []
    for station, part in s["stations"].items():
        for k, (component, figures) in enumerate(part["components"].items()):
            unit = next(key.removeprefix("noise_") for key in figures if key.startswith("noise_"))
            counts = (str(figures[key]) for key in ("good", "rejected", "missing"))
            found.append((station if k == 0 else "", component, *counts, amount(figures[f"noise_{unit}"], unit)))
    return found


def bias_rows(s: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """A row for each parameter that was not known beforehand, under BIAS_HEADER."""
    found = []
    for station, part in s["stations"].items():
        for k, (name, each) in enumerate(part["biases"].items()):
            unit = name.rpartition("_")[2]
            figures = (amount(each[key], unit) for key in ("estimate", "sigma", "prior_sigma"))
            remark = "" if each["observable"] else "not observable"
            found.append((station if k == 0 else "", WORDS[NAMES.index(name)], *figures, remark))
    return found


def amount(value: float, unit: str) -> str:
    """A number in m, mrad or ms."""
    scale, word = _UNIT[unit]
    return f"{scale * value:.3g} {word}"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    if len(rows) < 2:
        return []
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    left = 2
    return [
        "  "
        + "  ".join(
            v.ljust(w) if i < left else v.rjust(w) for i, (v, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
