"""Where a body that falls comes down, or how high it gets, with its ellipse: for summary, score and report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ftproc.core.filtering.records import Model, Start
from ftproc.core.impact import APOGEE, IMPACT, Predicted, falls_to_zero, heights, predict, vertical
from ftproc.core.model.earth import place_at
from ftproc.derived.quantities import axes_of_north
from ftproc.records import FloatArray, Truth

PROBABILITY = 0.95  # of the ellipse


def figures(found: Predicted, last_s: float, metadata: Mapping[str, Any]) -> dict[str, Any]:
    """The same for the summary, JSON-serialisable; units are in the names. last_s: of the last reading. metadata: of
    the trajectory, as far as axes and site stand in it. The direction of the long axis is that of a track."""
    north = axes_of_north(metadata)
    axes = (0, 1) if north is None else north
    variance, turned = np.linalg.eigh(found.covariance[np.ix_(axes, axes)])
    minor, major = np.sqrt(np.maximum(variance, 0.0)).tolist()
    direction = math.degrees(math.atan2(turned[1, 1], turned[0, 1])) % 180.0
    times = math.sqrt(-2 * math.log(1 - PROBABILITY))
    x, y, z = found.state[:3].tolist()
    up = vertical(found.state)
    return {
        "kind": found.kind,
        "time_s": last_s + found.after_s,
        "sigma_time_s": found.time_sigma_s,
        "after_last_reading_s": found.after_s,
        "x_m": x,
        "y_m": y,
        "z_m": z,
        "speed_mps": float(np.sqrt(found.state[3:6] @ found.state[3:6])),
        **({} if found.kind == IMPACT else {"sigma_height_m": float(np.sqrt(up @ found.covariance @ up))}),
        "ground": found.ground.what.replace("station", "origin" if metadata.get("stations") else "station"),
        "ground_above_station_m": found.ground.height_m,
        "covariance_xy_m2": found.covariance[:2, :2].tolist(),
        "sigma_major_m": major,
        "sigma_minor_m": minor,
        "probability": PROBABILITY,
        "semi_major_m": times * major,
        "semi_minor_m": times * minor,
        "major_axis_from_x_deg" if north is None else "major_axis_deg": direction,
        **_on_earth(found.state, north, metadata),
    }


def _on_earth(state: FloatArray, north: tuple[int, int] | None, metadata: Mapping[str, Any]) -> dict[str, float]:
    """Latitude and longitude, where the site is known."""
    site = metadata.get("settings", {}).get("site")
    if site is None or north is None:
        return {}
    latitude, longitude, _ = place_at(tuple(site), state[[north[1], north[0], 2]])
    return {"lat_deg": latitude, "lon_deg": longitude}


def in_words(s: Mapping[str, Any]) -> str:
    """The line of the summary."""
    axis = "major_axis_deg" if "major_axis_deg" in s else "major_axis_from_x_deg"
    where = f"x {s['x_m']:,.1f} m, y {s['y_m']:,.1f} m"
    if s["kind"] == APOGEE:
        where += f", z {s['z_m']:,.1f} m (1 sigma {s['sigma_height_m']:.3g} m)"
    else:
        where += f" at {s['ground']}"
    return (
        f"predicted at {where}, {s['after_last_reading_s']:.3g} s after the last reading (1 sigma "
        f"{s['sigma_time_s']:.2g} s); {100 * s['probability']:.0f} % ellipse {s['semi_major_m']:.3g} by "
        f"{s['semi_minor_m']:.3g} m, long axis {s[axis]:.0f} deg from {'north' if axis == 'major_axis_deg' else 'x'}"
    )


def of_flight(
    last: Start | None, model: Model | None, lowest_m: float, last_s: float, metadata: Mapping[str, Any]
) -> dict[str, Any]:
    """What the summary says of the end of a flight, under `impact`; nothing where nothing is predicted."""
    found = None if last is None or model is None else predict(last, model, lowest_m)
    return {} if found is None else {"impact": figures(found, last_s, metadata)}


def against(s: Mapping[str, Any], truth: Truth | None) -> dict[str, Any]:
    """The prediction of a summary, and by how much the truth misses it, in m and in sigmas of the ellipse; without
    these where the truth does not come to the ground."""
    kept = ("kind", "time_s", "x_m", "y_m", "semi_major_m", "semi_minor_m")
    known = {name: s[name] for name in kept}
    if truth is None or s["kind"] != IMPACT:
        return known
    start_s = float(s["time_s"] - s["after_last_reading_s"])
    later = (truth.time_s > start_s) & np.isfinite(truth.position_m).all(1)
    time_s, position = truth.time_s[later], truth.position_m[later]
    hit_s = falls_to_zero(time_s, heights(position) - s["ground_above_station_m"])
    if hit_s is None:
        return known
    miss = np.array([np.interp(hit_s, time_s, position[:, k]) - s[name] for k, name in enumerate(("x_m", "y_m"))])
    sigmas = math.sqrt(float(miss @ np.linalg.solve(np.array(s["covariance_xy_m2"]), miss)))
    return {**known, "miss_m": float(np.hypot(*miss)), "miss_s": hit_s - float(s["time_s"]), "miss_in_sigmas": sigmas}
