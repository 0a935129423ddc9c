"""The ensemble and particle filters of Shao et al. 2020 on a log: no editing but their own, noise and jerk from the
log as for the other recursive filters."""

from __future__ import annotations

import warnings

import numpy as np

from ftproc.core.comparators import ensemble_run, particles
from ftproc.core.filtering.records import FilterRun
from ftproc.errors import FtprocWarning
from ftproc.methods import preparing
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.parameters import Parameter
from ftproc.order_statistics import median
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

STATES = 9
JITTER_PARAMETERS = (
    Parameter("jitter", "spread of resampled members, in Silverman's widths", str(particles.JITTER), 0, 10),
)
GATED_PARAMETERS = (
    *JITTER_PARAMETERS,
    Parameter(
        "gate", "share of good readings that pass; the paper's gate is 0.75", str(particles.GATE), 0.01, 1 - 1e-9
    ),
)
CHAINS_PARAMETERS = (Parameter("moves", "of each Markov chain", str(particles.MOVES), 1, 1000, True),)
FEWEST_PER_STATE = 10  # members, for their covariance to mean something
LONGEST_PATCH_SAMPLES = 14.5  # after so long without a reading used, the track counts as lost
# Microseconds per row, as measured: to begin with, for each member, and for each pair of them.
COST_US = {"enkf": (220, 0.4, 0.0), "enpf": (430, 0.9, 0.0), "enpf-chi2": (430, 0.9, 0.0), "renpf": (770, 1.8, 0.045)}
FAR_SIGMAS = 3.0  # a component further off is to blame for a refused reading
WORTH_SAYING_S, TOO_LONG_S = 30.0, 3600.0


def estimate(readings: Readings, settings: FilterSettings, method: str) -> Estimate:
    """Filter a log by `enkf`, `enpf`, `enpf-chi2` or `renpf`, with settings.particles members.

    Warns (FtprocWarning) of work that takes long and of too few members. Raises ValueError when the work would take
    more than an hour.
    """
    _warn(method, len(readings.time_s), settings.particles)
    model, starts = preparing.prepare(readings, settings)
    longest = settings.max_patch_s
    if longest is None:
        interval = median(np.diff(readings.time_s)) if len(readings.time_s) > 1 else 0.0
        longest = LONGEST_PATCH_SAMPLES * interval
    tuned = {name: int(value) if name == "moves" else value for name, value in settings.parameters}
    how = ensemble_run.Settings(method, settings.particles, longest, np.random.default_rng(settings.seed), tuned)
    run, made = ensemble_run.filter_log(readings.unedited(), model, starts, how)
    label = preparing.labels(_kept(run), readings.measurement)
    return Estimate(run, label, model, None, preparing.re_initialized(made))


def _kept(run: FilterRun) -> FloatArray:
    """(n, 3) zero for outliers. These filters refuse a reading as a whole; to blame are its components that are far
    off, or all when only together they are."""
    refused = np.isfinite(run.innovation) & (run.weight <= 0)
    far = refused & (np.abs(run.innovation) > FAR_SIGMAS * run.innovation_sigma)
    blamed = np.where(far.any(1, keepdims=True), far, refused)
    return np.where(blamed, 0.0, 1.0)


def expected_seconds(method: str, rows: int, members: int) -> float:
    """About how long a log of so many rows takes on an ordinary machine."""
    first, each, pair = COST_US[method]
    return 1e-6 * rows * (first + each * members + pair * members**2)


def _warn(method: str, rows: int, members: int) -> None:
    if members < FEWEST_PER_STATE * STATES:
        enough = FEWEST_PER_STATE * STATES
        text = f"{method}: {members} particles are few for {STATES} states; {enough} or more are trustworthy"
        warnings.warn(text, FtprocWarning, stacklevel=2)
    seconds = expected_seconds(method, rows, members)
    if seconds < WORTH_SAYING_S:
        return
    if seconds > TOO_LONG_S:
        raise ValueError(
            f"{rows} rows would take {method} about {seconds / 3600:.1f} hours with {members} particles; cut or thin "
            "the log, or use --method ukf"
        )
    spoken = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} minutes"
    warnings.warn(f"{method}: {rows} rows will take about {spoken}", FtprocWarning, stacklevel=2)
