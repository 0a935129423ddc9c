"""The figures by name."""

from __future__ import annotations

from collections.abc import Callable

from ftproc.report.drawing import Drawn
from ftproc.report.readings import readings, residuals
from ftproc.report.timeplots import correction, errors, motion, nis, sigmas
from ftproc.report.track import ground, track
from ftproc.report.view import View

FIGURES: dict[str, Callable[[View], Drawn]] = {
    "track": track,
    "ground": ground,
    "readings": readings,
    "residuals": residuals,
    "nis": nis,
    "sigmas": sigmas,
    "motion": motion,
    "correction": correction,
}

#: Only with a truth.
ERRORS = errors
