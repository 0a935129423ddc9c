"""The metadata of a trajectory: everything needed to compute it again."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc import __version__
from ftproc.files.conventions import CONVENTION, in_words
from ftproc.files.writing.trajectories import plain
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    from ftproc.correction.model import Model
    from ftproc.methods.registry import Method
    from ftproc.quality.statistics import RunStatistics

_LATEST = 11  # digits of SOURCE_DATE_EPOCH
#: The metadata that decide on a result.
DECISIVE = (
    "version", "versions", "command", "options", "method", "log", "log_sha256", "model_sha256", "stations",
    "decisions",
)  # fmt: skip


def describe(
    log: MeasurementLog,
    method: Method,
    settings: FilterSettings,
    statistics: RunStatistics,
    model: Model | None,
    summary: Mapping[str, Any],
) -> dict[str, Any]:
    """The metadata of a trajectory (JSON-serialisable) with its summary. The jerk profile is the last item; a log that
    was filtered in segments has none: it would be as long as the log."""
    from ftproc.correction.model_file import sha256

    noise = statistics.model
    sigma = np.sqrt(noise.reading_variance)
    jerk = None if statistics.parts > 1 else jerk_profile(noise.jerk, noise.knot_s, noise.motion.acts)
    return {
        **begun(),
        "method": method.name,
        "segments": statistics.parts,
        "sees": method.sees(settings),
        "log": log.name,
        "log_sha256": log.sha256 or None,
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
            **({"height": settings.height} if settings.height is not None else {}),
            "gain_form": settings.gain_form,
            "site": settings.site,
            "geoid_m": settings.geoid_m,
            "ecef": settings.ecef,
            "derived": settings.derived,
            "noise_specified": settings.noise is not None and None not in settings.noise,
            **({"particles": settings.particles, "seed": settings.seed} if method.random else {}),
            **({"parameters": dict(settings.parameters)} if settings.parameters else {}),
            "jerk_specified": settings.jerk_psd_m2ps5 is not None,
            "jerk_psd_m2ps5": settings.jerk_psd_m2ps5,
            "noise_range_m": float(sigma[0]),
            "noise_azimuth_rad": float(sigma[1]),
            "noise_elevation_rad": float(sigma[2]),
            "noise_correlation": [float(r) for r in noise.correlation(statistics.interval_s)],
        },
        "motion": summary.get("motion"),
        "motion_gain": summary.get("motion_gain"),
        "model_sha256": None if model is None else sha256(model),
        "summary": dict(summary),
        "jerk_profile": jerk,
    }


def begun() -> dict[str, Any]:
    """The metadata with which those of every run begin. The command line fills in `command`, `options` and
    `recipe_sha256`."""
    libraries = {name: str(sys.modules[name].__version__) for name in ("numpy", "pyarrow") if name in sys.modules}
    return {
        "program": "ftproc",
        "version": __version__,
        "versions": {"python": platform.python_version(), **libraries},
        "date_utc": date_utc(),
        "command": None,
        "options": {},
        "recipe_sha256": None,
        "decisions": None,
    }


def completed(metadata: Mapping[str, Any], known: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """The metadata with what the command line knows. before: of the run that is run again, whose date stays where
    nothing else differs."""
    found = {**metadata, **known}
    if before and not differing(found, before):
        found["date_utc"] = before["date_utc"]
    return found


def differing(metadata: Mapping[str, Any], before: Mapping[str, Any]) -> list[str]:
    """The names of the metadata that decide on a result and are not the same in two runs."""
    return [name for name in DECISIVE if plain(metadata.get(name)) != plain(before.get(name))]


def date_utc() -> str:
    """The date of this run, without the time of day, so that the same command gives the same bytes. Where
    SOURCE_DATE_EPOCH is set, that date, by the convention of reproducible builds."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    known = stated.isdecimal() and len(stated) <= _LATEST
    now = datetime.fromtimestamp(int(stated), UTC) if known else datetime.now(UTC)
    return f"{now:%Y-%m-%d}"


def jerk_profile(jerk: FloatArray, knot_s: float, along: bool = False) -> dict[str, Any] | None:
    """The process noise along a log, jerk (k, 3) each for knot_s seconds; None of a method that has none. along:
    whether its first axis goes along the path."""
    if not np.isfinite(jerk).all():
        return None
    return {
        "psd_m2ps5": [float(q) for q in jerk[:, 1]],
        "vertical_ratio": float(jerk[0, 2] / jerk[0, 1]),
        **({"along_ratio": float(jerk[0, 0] / jerk[0, 1])} if along else {}),
        "knot_s": float(knot_s) if len(jerk) > 1 else None,
    }
