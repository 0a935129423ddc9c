"""The metadata of a trajectory: everything needed to reproduce it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc import __version__
from ftproc.files.conventions import CONVENTION, in_words
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    from ftproc.correction.model import Model
    from ftproc.methods.registry import Method
    from ftproc.quality.statistics import RunStatistics


def describe(
    log: MeasurementLog,
    method: Method,
    settings: FilterSettings,
    statistics: RunStatistics,
    model: Model | None,
    summary: Mapping[str, Any],
) -> dict[str, Any]:
    """The metadata of a trajectory (JSON-serialisable) with its summary, without the jerk profile of a log that was
    filtered in segments: it would be as long as the log."""
    from ftproc.correction.model_file import sha256

    sigma = np.sqrt(statistics.model.reading_variance)
    return {
        "program": "ftproc",
        "version": __version__,
        "method": method.name,
        "segments": statistics.parts,
        "sees": method.sees(settings),
        "log": log.name,
        "frame": log.frame,
        "convention": CONVENTION[log.frame],
        "station": {
            **asdict(log.station),
            "elevation_from": log.station.elevation_from or "horizon",
            "in_words": in_words(log.station),
        },
        "epoch": log.epoch,
        "understood": dict(log.understood),
        "settings": {
            "editing": method.editing(settings),
            "smooth": settings.smooth,
            **({"lag_s": settings.lag_s} if method.editing(settings) == "live" else {}),
            "gate": settings.gate,
            "max_patch_s": settings.max_patch_s,
            "motion": settings.motion,
            "gain_form": settings.gain_form,
            "site": settings.site,
            "geoid_m": settings.geoid_m,
            "ecef": settings.ecef,
            "derived": settings.derived,
            "noise_specified": settings.noise is not None and None not in settings.noise,
            **({"particles": settings.particles, "seed": settings.seed} if method.random else {}),
            **({"parameters": dict(settings.parameters)} if settings.parameters else {}),
            "jerk_specified": settings.jerk_psd_m2ps5 is not None,
            "noise_range_m": float(sigma[0]),
            "noise_azimuth_rad": float(sigma[1]),
            "noise_elevation_rad": float(sigma[2]),
            "noise_correlation": [float(r) for r in statistics.model.correlation(statistics.interval_s)],
            **_motion(statistics),
        },
        "motion": summary.get("motion"),
        "motion_gain": summary.get("motion_gain"),
        "model_sha256": None if model is None else sha256(model),
        "summary": dict(summary),
    }


def _motion(statistics: RunStatistics) -> dict[str, Any]:
    """The jerk PSD of a method that has one, unless its profile would fill the file."""
    jerk = statistics.model.jerk
    if not np.isfinite(jerk).all() or (statistics.parts > 1 and len(jerk) > 1):
        return {"jerk_psd_m2ps5": None, "jerk_vertical_ratio": None, "jerk_knot_s": None}
    return {
        "jerk_psd_m2ps5": [float(q) for q in jerk[:, 1]],
        "jerk_vertical_ratio": float(jerk[0, 2] / jerk[0, 1]),
        **({"jerk_along_ratio": float(jerk[0, 0] / jerk[0, 1])} if statistics.model.motion.acts else {}),
        "jerk_knot_s": float(statistics.model.knot_s) if len(jerk) > 1 else None,
    }
