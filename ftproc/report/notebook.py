"""A trajectory in a notebook: its summary, and a small picture of its track, which needs no library and no script."""

from __future__ import annotations

import html

import numpy as np

from ftproc.derived.quantities import axes_of_north
from ftproc.quality import summary
from ftproc.records import FloatArray, Trajectory
from ftproc.report import style
from ftproc.report.thinning import Timeline

WIDTH, HEIGHT, MARGIN = 280, 210, 14  # CSS pixels
COLUMNS = 300  # intervals of time, in each of which the extremes are drawn


def as_html(trajectory: Trajectory) -> str:
    """An element for a notebook."""
    known = "summary" in trajectory.metadata and "components" in trajectory.metadata["summary"]
    text = html.escape(summary.text(trajectory.metadata) if known else repr(trajectory))
    return (
        '<div style="display: flex; flex-wrap: wrap; gap: 16px; align-items: flex-start">'
        f'{picture(trajectory)}<pre style="margin: 0; overflow-x: auto">{text}</pre></div>'
    )


def picture(trajectory: Trajectory) -> str:
    """The track over the ground as SVG, equal scales; empty without positions."""
    north = axes_of_north(trajectory.metadata)
    across, up = (0, 1) if north is None else north[::-1]
    position = trajectory.state[:, [across, up]]
    if not np.isfinite(position).all(1).any():
        return ""
    timeline = Timeline.of(trajectory.time_s, COLUMNS)
    rows = timeline.extremes(*position.T)
    drawn = np.stack([timeline.broken(rows, axis)[1] for axis in position.T], 1)  # NaN where it is broken
    known = position[np.isfinite(position).all(1)]
    low, size = known.min(0), float(np.ptp(known, axis=0).max()) or 1.0
    scale = min(WIDTH, HEIGHT) - 2 * MARGIN
    spare = (np.array([WIDTH, HEIGHT]) - scale * np.ptp(known, axis=0) / size) / 2
    x, y = ((drawn - low) * scale / size + spare).T
    first, last = ((known[k] - low) * scale / size + spare for k in (0, -1))
    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="track over the '
        f'ground, {size:.3g} m wide"><rect width="100%" height="100%" fill="white" stroke="{style.GRID}"/>'
        f'<path d="{_path(x, HEIGHT - y)}" fill="none" stroke="{style.BLUE}" stroke-width="1.5"/>'
        f'<circle cx="{first[0]:.1f}" cy="{HEIGHT - first[1]:.1f}" r="4" fill="{style.BLACK}"/>'
        f'<rect x="{last[0] - 3.5:.1f}" y="{HEIGHT - last[1] - 3.5:.1f}" width="7" height="7" fill="{style.BLACK}"/>'
        f'<text x="6" y="{HEIGHT - 6}" font-size="11" font-family="sans-serif" fill="{style.AXIS}">{size:,.3g} m; '
        "circle: start</text></svg>"
    )


def _path(x: FloatArray, y: FloatArray) -> str:
    """Commands of a line that is broken where a point is missing."""
    parts, pen = [], "M"
    for a, b in zip(x, y, strict=True):
        if not (np.isfinite(a) and np.isfinite(b)):
            pen = "M"
            continue
        parts.append(f"{pen}{a:.1f},{b:.1f}")
        pen = "L"
    return " ".join(parts)
