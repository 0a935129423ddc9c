"""Trajectories for the tests of the report."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ftproc import pipeline
from ftproc.records import Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate

HOSTILE = "<script>alert(1)</script>.csv"


@cache
def flight() -> Simulation:
    """Outliers of all kinds, missing readings, a gap."""
    return simulate("manoeuvre", seed=3, duration_s=40.0)


@cache
def filtered(smooth: bool = False) -> Trajectory:
    return pipeline.filter_log(flight().log, FilterSettings(smooth=smooth))


@cache
def angles_only() -> Trajectory:
    z = flight().log.measurement.copy()
    z[:, 0] = np.nan
    return pipeline.filter_log(replace(flight().log, measurement=z))


@cache
def one_row() -> Trajectory:
    log = flight().log
    return pipeline.filter_log(
        replace(log, time_s=log.time_s[:1], measurement=log.measurement[:1], row=log.row[:1])
    )  # fmt: skip


@cache
def position_only() -> Trajectory:
    """A table of another program, as `score` reads it."""
    made, nothing = filtered(), np.full((len(filtered()), 6), np.nan)
    state = np.where(np.arange(9) < 3, made.state, np.nan)
    return replace(
        made, state=state, sigma=np.full(state.shape, np.nan), measurement_sigma=nothing[:, :3], correction=nothing,
        nis=np.full(len(made), np.nan), metadata={},
        measurement=np.full((len(made), 3), np.nan), outlier=np.zeros_like(made.outlier), diagnostics=None,
    )  # fmt: skip


@cache
def hostile() -> Trajectory:
    """Every name and word that a file can hold tries to run."""
    made = filtered()
    words = {"log": HOSTILE, "method": "</script><img src=x onerror=alert(2)>", "frame": '"><svg onload=alert(3)>'}
    settings = {**made.metadata["settings"], "<b onclick=alert(4)>key": "&lt;<!--</style>"}
    return replace(made, name=HOSTILE, metadata={**made.metadata, **words, "settings": settings})
