"""Scores as text: a table for people, JSON or CSV for programs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence
from pathlib import PurePath
from typing import Any

from ftproc.errors import UsageError, encodable
from ftproc.files.writing.csvtext import no_formula
from ftproc.files.writing.trajectories import plain
from ftproc.scoring import comparison
from ftproc.scoring.figures import Score

TABLE_WIDTH = 100

_LABELS = {
    "method": "method",
    "samples": "samples",
    "matched": "  with truth at the same time",
    "interpolated": "  with truth interpolated",
    "unmatched": "  without truth",
    "without_estimate": "  without estimate",
    "average_gradient.range_m": "average gradient R (m)",
    "average_gradient.azimuth_rad": "average gradient A (rad)",
    "average_gradient.elevation_rad": "average gradient E (rad)",
    "truth_average_gradient.range_m": "  of the truth, R (m)",
    "truth_average_gradient.azimuth_rad": "  of the truth, A (rad)",
    "truth_average_gradient.elevation_rad": "  of the truth, E (rad)",
    "rmse_seed_m": "mean position error (m)",
    "rmse_3d_m": "position RMSE (m)",
    "rmse_x_m": "  x",
    "rmse_y_m": "  y",
    "rmse_z_m": "  z",
    "rmse_v_mps": "velocity RMSE (m/s)",
    "rmse_vx_mps": "  vx",
    "rmse_vy_mps": "  vy",
    "rmse_vz_mps": "  vz",
    "rmse_a_mps2": "acceleration RMSE (m/s2)",
    "rmse_ax_mps2": "  ax",
    "rmse_ay_mps2": "  ay",
    "rmse_az_mps2": "  az",
    "rmse_range_m": "cleaned range RMSE (m)",
    "rmse_azimuth_rad": "cleaned azimuth RMSE (rad)",
    "rmse_elevation_rad": "cleaned elevation RMSE (rad)",
    "max_error_m": "largest position error (m)",
    "p95_error_m": "  95 % below",
    "p99_error_m": "  99 % below",
} | {
    f"{key}.bias_and_sigma": label
    for key, label in (
        ("path.position_along_m", "position along: bias, sigma (m)"),
        ("path.position_across_m", "  across, to the right"),
        ("path.position_vertical_m", "  vertical"),
        ("path.velocity_along_mps", "velocity along: bias, sigma (m/s)"),
        ("path.velocity_across_mps", "  across, to the right"),
        ("path.velocity_vertical_mps", "  vertical"),
        ("channels.range_m", "range: bias, sigma (m)"),
        ("channels.azimuth_rad", "azimuth: bias, sigma (rad)"),
        ("channels.elevation_rad", "elevation: bias, sigma (rad)"),
    )
} | {
    f"{quantity}.{key}": label.format(quantity)
    for quantity in ("position", "velocity", "acceleration", "cleaned")
    for key, label in (
        ("share_in_3_sigma", "{} inside 3 sigma"), ("largest", "  largest error / sigma"),
        ("nees_and_bounds", "  NEES (bounds)"),
    )
} | {"sigma_verdict": "the sigmas are"} | {
    f"impact.{key}": label
    for key, label in (
        ("kind", "predicted"), ("time_s", "  time (s)"), ("x_m", "  x (m)"), ("y_m", "  y (m)"),
        ("semi_major_m", "  semi-major axis (m)"), ("semi_minor_m", "  semi-minor axis (m)"),
        ("miss_m", "  miss (m)"), ("miss_s", "  miss (s)"), ("miss_in_sigmas", "  miss / sigma"),
    )
} | {
    f"outliers.{component}.{key}": f"{component} outliers, precision" if key == "precision" else f"  {label}"
    for component in ("range", "azimuth", "elevation")
    for key, label in (
        ("precision", ""), ("recall", "recall"), ("f1", "F1"), ("false_alarm_rate", "false alarm rate"),
    )
}  # fmt: skip


def render(scores: Sequence[Score], format: str = "table") -> str:
    """The scores in the order given, as `table`, `json` or `csv`; ends with a newline.

    json: one score is one object, several are a list. Keys as in `Score`, nested; what needs a truth is
    absent without one; what could not be computed is null. csv: one line per score, keys joined by dots,
    same names; empty where unknown. table: one column per score, in blocks that fit a terminal of 100
    columns; for several methods compared with one truth, one line per method, see `comparison`.

    Raises UsageError for another format, and when there is no score.
    """
    if format not in FORMATS:
        raise UsageError(f'There is no score format "{format}"; choose one of {", ".join(FORMATS)}.')
    if not scores:
        raise UsageError("There is nothing to score; name at least one trajectory.")
    return encodable(FORMATS[format](scores))


def _json(scores: Sequence[Score]) -> str:
    found = [score.as_dict() for score in scores]
    return json.dumps(plain(found[0] if len(found) == 1 else found), indent=2, allow_nan=False) + "\n"


def _csv(scores: Sequence[Score]) -> str:
    rows = [_flat(score.as_dict()) for score in scores]
    names = list(dict.fromkeys(name for row in sorted(rows, key=len, reverse=True) for name in row))
    out = io.StringIO()
    writer = csv.DictWriter(out, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: no_formula(v) if isinstance(v, str) else v for k, v in row.items()} for row in rows)
    return out.getvalue()


def _flat(nested: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in nested.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[prefix + name] = value
    return flat


def _table(scores: Sequence[Score]) -> str:
    return comparison.table(scores) if comparison.applies(scores) else _columns(scores)


def _columns(scores: Sequence[Score]) -> str:
    """One column per score, in blocks of TABLE_WIDTH."""
    columns = [_with_pairs(_flat(score.as_dict())) for score in scores]
    if len(scores) > 1:  # side by side; in JSON the axes are named
        columns = [
            {**each, "sigma_verdict": str(each.get("sigma_verdict") or "-").split(" in ")[0]} for each in columns
        ]
    keys = [key for key in _LABELS if any(key in column for column in columns)]
    heads = _headings([score.trajectory for score in scores])
    label_width = max(len(_LABELS[key]) for key in keys)
    cells = [[_cell(column.get(key, "")) for key in keys] for column in columns]
    widths = [max(len(text) for text in (head, *column)) for head, column in zip(heads, cells, strict=True)]
    blocks = []
    for block in _blocks(widths, TABLE_WIDTH - label_width):
        lines = [" " * label_width + "".join("  " + heads[i].rjust(widths[i]) for i in block)]
        for row, key in enumerate(keys):
            values = "".join("  " + cells[i][row].rjust(widths[i]) for i in block)
            lines.append(_LABELS[key].ljust(label_width) + values)
        blocks.append("\n".join(line.rstrip() for line in lines) + "\n")
    return "\n".join(blocks)


def _with_pairs(column: dict[str, Any]) -> dict[str, Any]:
    """With figures that are read together in one cell."""
    for key in [key for key in column if key.endswith(".nees")]:
        q = key.removesuffix(".nees")
        at, low, high = (column[f"{q}.{name}"] for name in ("largest_sigma_time_s", "nees_low", "nees_high"))
        column[f"{q}.largest"] = f"{column[f'{q}.largest_sigma']:.3g} at {at:.7g} s"
        column[f"{q}.nees_and_bounds"] = f"{column[key]:.3g} ({low:.2g} to {high:.2g})"
    for key in [key for key in column if key.endswith(".bias")]:
        name = key.removesuffix(".bias")
        column[f"{name}.bias_and_sigma"] = f"{column[key]:.2g}, {column[f'{name}.sigma']:.3g}"
    return column


def _blocks(widths: list[int], room: int) -> list[list[int]]:
    """Column numbers, split into runs whose widths fit the room; each run has at least one."""
    blocks: list[list[int]] = [[]]
    used = 0
    for i, width in enumerate(widths):
        if blocks[-1] and used + width + 2 > room:
            blocks.append([])
            used = 0
        blocks[-1].append(i)
        used += width + 2
    return blocks


def _headings(names: list[str]) -> list[str]:
    """File names without folders and endings where these differ; of long ones the end."""
    short = [PurePath(name).name for name in names]
    for ending in (".gz", ".parquet", ".csv", ".trajectory"):
        short = [name.removesuffix(ending) for name in short]
    chosen = short if len(set(short)) == len(set(names)) else names
    return [name if len(name) <= 40 else "…" + name[-39:] for name in chosen]


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


FORMATS: dict[str, Callable[[Sequence[Score]], str]] = {"table": _table, "json": _json, "csv": _csv}
