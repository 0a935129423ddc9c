"""Several methods on one flight: a line per method, the most accurate first. Methods that use later readings form a
separate group, because they are not comparable with those that do not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ftproc.records import COMPONENTS, EDITED, PAST, WHOLE
from ftproc.scoring.figures import Score

_HEADER = ("", "RMSE m", "mean m", "95 % m", "largest m", "v m/s", "in 3 sigma", "no estimate", "found %", "false %")
_NOTE = "RMSE, mean, 95 %, largest: position error; v: velocity RMSE; found: of all outliers; false: of good readings"


def applies(scores: Sequence[Score]) -> bool:
    """Whether these are different methods compared with one truth."""
    known = all(s.method and s.sees and s.rmse_3d_m is not None for s in scores)
    return known and len({s.truth for s in scores}) == 1 and len({_name(s) for s in scores}) > 1


def table(scores: Sequence[Score]) -> str:
    """Lines grouped by the readings that the methods use, sorted by position RMSE; ends with a newline."""
    groups: dict[str, list[Score]] = {}
    for score in sorted(scores, key=_error):
        groups.setdefault(str(score.sees), []).append(score)
    rows = {sees: [_row(score) for score in group] for sees, group in groups.items()}
    everything = [_HEADER, *(row for group in rows.values() for row in group)]
    widths = [max(len(row[i]) for row in everything) for i in range(len(_HEADER))]
    lines = [_line(_HEADER, widths)]
    for sees in sorted(rows, key=_rank):
        lines += [f"from {sees}", *(_line(row, widths) for row in rows[sees])]
    return "\n".join([*lines, _NOTE]) + "\n"


def _rank(sees: str) -> tuple[int, str]:
    known = (PAST, EDITED, WHOLE)
    return (known.index(sees) if sees in known else len(known), sees)


def _error(score: Score) -> float:
    error = score.rmse_3d_m
    return error if error is not None and math.isfinite(error) else math.inf


def _name(score: Score) -> str:
    return f"{score.method}{' --smooth' if score.smoothed else ''}"


def _row(score: Score) -> tuple[str, ...]:
    lengths = (score.rmse_3d_m, score.rmse_seed_m, score.p95_error_m, score.max_error_m, score.rmse_v_mps)
    inside = score.in_3sigma
    found, false = _flags(score)
    return (
        f"  {_name(score)}",
        *(_number(value) for value in lengths),
        _number(inside),
        str(score.without_estimate),
        _number(found),
        _number(false),
    )


def _flags(score: Score) -> tuple[float | None, float | None]:
    """Percentages of outliers found and of good readings flagged, over the three components."""
    if score.outliers is None:
        return None, None
    parts = [score.outliers[name] for name in COMPONENTS]
    bad = sum(p.true_positives + p.false_negatives for p in parts)
    good = sum(p.false_positives + p.true_negatives for p in parts)
    found = 100 * sum(p.true_positives for p in parts) / bad if bad else None
    return found, 100 * sum(p.false_positives for p in parts) / good if good else None


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"


def _line(cells: tuple[str, ...], widths: list[int]) -> str:
    numbers = "".join("  " + cell.rjust(width) for cell, width in zip(cells[1:], widths[1:], strict=True))
    return (cells[0].ljust(widths[0]) + numbers).rstrip()
