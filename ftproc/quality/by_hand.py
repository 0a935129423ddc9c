"""What decisions by hand have done: their labels, and how many readings each line decides on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ftproc.core.model.frames import wrap
from ftproc.files.decisions import as_dict
from ftproc.records import ACCEPTED, GOOD, REJECTED, ByHand, Diagnostics, FlagArray, FloatArray, Lines

FEW_LINES = 3  # that are named


def labelled(label: FlagArray, by_hand: ByHand | None, channel: str = "") -> FlagArray:
    """Labels (n, 3), or those of a channel (n,), with those of the readings decided by hand. A method with an editor of
    its own may not use what is accepted: such readings keep its label."""
    if by_hand is None:
        return label
    flags = by_hand.of(channel) if channel else by_hand.flags
    accepted = (flags == ACCEPTED) & (label == GOOD)
    found: FlagArray = np.where(flags == REJECTED, REJECTED, np.where(accepted, ACCEPTED, label)).astype(np.uint8)
    return found


def with_rejected(shown: Diagnostics, label: FlagArray, cleaned: FloatArray, variance: FloatArray) -> Diagnostics:
    """Residuals with those of the readings rejected by hand, about the estimate, which has not used them. cleaned
    (n, 3) m, rad, rad; variance (n, 3) of it and of the noise together."""
    rejected = label == REJECTED
    if not rejected.any():
        return shown
    off = shown.reading - cleaned
    off[:, 1] = wrap(off[:, 1])
    residual = np.where(rejected, off, shown.residual)
    sigma = np.where(rejected, np.sqrt(variance), shown.residual_sigma)
    return replace(shown, residual=residual, residual_sigma=sigma)


class Effects:
    """Of the lines of decisions on a log, or on those of several stations, to which its parts are added."""

    def __init__(self, decisions: Lines | None, gate: float) -> None:
        self.decisions, self.gate = decisions, gate
        self.counts = {} if decisions is None else {line.number: np.zeros(2, int) for line in decisions.lines}

    def add(self, by_hand: ByHand | None, residual: FloatArray, sigma: FloatArray) -> None:
        """Add the decisions on a part, with its residuals (n, k) and their sigmas, of the first k channels."""
        if by_hand is None:
            return
        with np.errstate(invalid="ignore"):
            inside = np.abs(residual) <= self.gate * sigma
        lines, decided = by_hand.decisions.lines, by_hand.line[:, : residual.shape[1]]
        both = [np.bincount(each.ravel(), minlength=len(lines) + 1) for each in (decided, decided * inside)]
        for line, counts in zip(lines, np.transpose(both)[1:], strict=True):
            self.counts[line.number] += counts

    def metadata(self) -> dict[str, Any]:
        """The file and each line, with how many readings it decides on, and how many of these lie inside the gate about
        the estimate; empty without decisions."""
        if self.decisions is None:
            return {}
        lines = []
        for line in self.decisions.lines:
            readings, inside = self.counts[line.number].tolist()
            lines.append({**as_dict(line), "readings": readings, "inside_gate": inside})
        return {"decisions": {"file": self.decisions.name, "sha256": self.decisions.sha256, "lines": lines}}

    def summary(self) -> dict[str, Any]:
        """The same in total, for the verdict. contradicted: lines whose accepted readings lie outside the gate, and how
        many; idle: lines that decide on no reading."""
        if self.decisions is None:
            return {}
        lines = self.metadata()["decisions"]["lines"]
        bad, good = ([line for line in lines if line["use"] == use] for use in ("bad", "good"))
        outside = {line["line"]: line["readings"] - line["inside_gate"] for line in good}
        found = {
            "file": self.decisions.name,
            "rejected": sum(line["readings"] for line in bad),
            "rejected_inside_gate": sum(line["inside_gate"] for line in bad),
            "accepted": sum(line["readings"] for line in good),
            "contradicted": [{"line": line, "readings": count} for line, count in outside.items() if count],
            "idle": [line["line"] for line in (*bad, *good) if not line["readings"]],
        }
        return {"by_hand": found}


def in_words(s: Mapping[str, Any]) -> Iterator[str]:
    """What the decisions in a summary have done."""
    found = s.get("by_hand")
    if not found:
        return
    agree = found["rejected_inside_gate"]
    but = f" ({agree} of them agree with the estimate)" if agree else ""
    yield f"by hand, {found['file']}: {found['rejected']} readings rejected{but}, {found['accepted']} accepted"
    if found["idle"]:
        more = f" and {len(found['idle']) - FEW_LINES} more" if len(found["idle"]) > FEW_LINES else ""
        named = ", ".join(map(str, found["idle"][:FEW_LINES]))
        yield f"{found['file']}, line {named}{more}: no reading is decided on"


def contradicted(s: Mapping[str, Any]) -> Iterator[str]:
    """Lines whose accepted readings the rest of the log contradicts."""
    found = s.get("by_hand") or {"contradicted": []}
    for each in found["contradicted"][:FEW_LINES]:
        yield f"{found['file']}, line {each['line']}: {each['readings']} readings accepted by hand are outside the gate"
