"""Sigmas that allow for other understandings of a log than the one that was chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from ftproc.core.editing.lasting.faults import Shift, allowing
from ftproc.core.filtering.records import FilterRun
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.model import kinematics
from ftproc.core.model.frames import line_of_sight_axes
from ftproc.records import FloatArray

Run = TypeVar("Run", FilterRun, SmootherRun)

HALFWAY = 0.5  # of the distance to where another understanding puts the target is added to the sigmas
APART, BESIDE = 0.1, 0.5  # of the largest such distance, from which tracks part; and of the rows that are nearby then


def reaching(run: Run, away: FloatArray, rows: int) -> Run:
    """A run with sigmas that reach HALFWAY to where another understanding puts the target, away (n, 9) from it. rows:
    up to the last reading; what follows is extrapolated."""
    from scipy.ndimage import maximum_filter1d

    far = np.linalg.norm(away[:rows, :3], axis=1)
    width = 1 + int(BESIDE * (far > APART * far.max()).sum())

    def reach(of: FloatArray) -> FloatArray:
        nearby = maximum_filter1d(np.abs(of[:rows]), width, axis=0)
        return HALFWAY * np.concatenate([nearby, np.abs(of[rows:])])

    return off_by(run, away, reach)


def off_by(run: Run, away: FloatArray, reach: Callable[[FloatArray], FloatArray] = np.abs) -> Run:
    """A run with sigmas that allow for an error away (n, 9) of 1 sigma. reach: how far it goes."""
    sigma, los_sigma = np.hypot(run.sigma, reach(away)), run.los_sigma.copy()
    sight = line_of_sight_axes(run.state[:, :3])
    for lines in (slice(0, 3), slice(3, 6)):
        along = np.einsum("kij,kj->ki", sight, away[:, lines])
        los_sigma[:, lines] = np.hypot(los_sigma[:, lines], reach(along))
    path_sigma = kinematics.widened(run.state, run.path_sigma, run.sigma, sigma)
    return run._replace(sigma=sigma, los_sigma=los_sigma, path_sigma=path_sigma)


def worse_of(run: Run, other: Run) -> Run:
    """A run with sigmas that are the larger of its own and of another's."""
    names = ("sigma", "los_sigma", "path_sigma")
    return run._replace(**{name: np.maximum(getattr(run, name), getattr(other, name)) for name in names})


def widened(run: Run, shifts: Sequence[Shift]) -> Run:
    """A run with sigmas that allow for the uncertain sizes of the shifts that were taken out of its readings."""
    sigma, los_sigma = allowing(run.state, run.sigma, run.los_sigma, shifts)
    return run._replace(sigma=sigma, los_sigma=los_sigma)
