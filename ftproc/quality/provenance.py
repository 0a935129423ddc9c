"""Everything needed to make a trajectory again, as its file keeps it."""

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
    from ftproc.quality.statistics import Tally


def describe(
    log: MeasurementLog,
    method: Method,
    settings: FilterSettings,
    tally: Tally,
    model: Model | None,
    summary: Mapping[str, Any],
) -> dict[str, Any]:
    """The metadata of a trajectory (JSON-serialisable), its summary among them. The jerk profile of a log that was
    filtered in segments is not: it would be as long as the log."""
    from ftproc.correction.model_file import sha256

    sigma = np.sqrt(tally.model.reading_variance)
    return {
        "program": "ftproc",
        "version": __version__,
        "method": method.name,
        "segments": tally.parts,
        "sees": method.sees(settings),
        "log": log.name,
        "frame": log.frame,
        "convention": CONVENTION[log.frame],
        "station": {**asdict(log.station), "in_words": in_words(log.station)},
        "epoch": log.epoch,
        "settings": {
            "editing": method.editing(settings),
            "smooth": settings.smooth,
            "gate": settings.gate,
            "max_patch_s": settings.max_patch_s,
            "gain_form": settings.gain_form,
            "site": settings.site,
            "geoid_m": settings.geoid_m,
            "ecef": settings.ecef,
            "noise_given": settings.noise is not None and None not in settings.noise,
            **({"particles": settings.particles, "seed": settings.seed} if method.random else {}),
            "jerk_given": settings.jerk_psd_m2ps5 is not None,
            "noise_range_m": float(sigma[0]),
            "noise_azimuth_rad": float(sigma[1]),
            "noise_elevation_rad": float(sigma[2]),
            "noise_correlation": [float(r) for r in tally.model.correlation],
            **_motion(tally),
        },
        "model_sha256": None if model is None else sha256(model),
        "summary": dict(summary),
    }


def _motion(tally: Tally) -> dict[str, Any]:
    """The jerk densities, of a profile that does not fill the file, and of a method that has any."""
    jerk = tally.model.jerk
    if not np.isfinite(jerk).all() or (tally.parts > 1 and len(jerk) > 1):
        return {"jerk_psd_m2ps5": None, "jerk_vertical_ratio": None, "jerk_knot_s": None}
    return {
        "jerk_psd_m2ps5": [float(q) for q in jerk[:, 0]],
        "jerk_vertical_ratio": float(jerk[0, 5] / jerk[0, 0]),
        "jerk_knot_s": float(tally.model.knot_s) if len(jerk) > 1 else None,
    }
