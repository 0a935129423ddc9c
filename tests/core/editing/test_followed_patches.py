"""Patches that were followed as if they were motion: those without a jump, and starts that follow each reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.editing import alternatives
from ftproc.core.editing.alternatives import AcceptedRun
from ftproc.core.identification.likelihood import FIRST_MEMORIES, first_jerk
from ftproc.core.identification.scales import scales_of
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.core.tracks import matched

pytestmark = pytest.mark.compiled

SMOOTH = FilterSettings(smooth=True)


def flown(seed, times=1.0):
    """A manoeuvring flight at 10 Hz, with every range so many times as long; the summary and the RMSE m."""
    flight = simulate("manoeuvre", seed=seed, dt_s=0.1, duration_s=60)
    log = replace(flight.log, measurement=flight.log.measurement * [times, 1.0, 1.0])
    found = pipeline.filter_log(log, SMOOTH)
    off = found.state[:, :3] - flight.truth.position_m
    return found.metadata["summary"], float(np.sqrt((off**2).sum(1).mean()))


@pytest.mark.parametrize("times", [1.0, 1 + 1e-12, 1 + 2e-12])
def test_a_start_that_follows_each_reading_has_a_rival(times):
    """Outliers that screening has missed asked for a filter without memory, and the last digits decided on all."""
    assert flown(9, times)[1] < 1.5


@pytest.mark.parametrize(("seed", "most_m"), [(6, 2.0), (11, 2.5), (22, 0.7)])
def test_a_patch_with_one_edge_is_found(seed, most_m):
    assert flown(seed)[1] < most_m


def test_memories_that_are_too_short_are_left_out():
    a = matched(1, 200, dt=0.2, q=3.0)
    noise, scales = a.model.noise_variance, scales_of(a.log, a.model.noise_variance)
    jerk = first_jerk(a.log, noise, shortest=12.0)
    assert jerk in [pytest.approx(scales.jerk_psd(m * scales.interval_s)) for m in FIRST_MEMORIES if m >= 12.0]


def test_edges_are_rejected_runs_and_ends():
    weight, possible = np.ones((40, 3)), np.ones((40, 3), bool)
    possible[:, 2] = False
    weight[10:15, 0] = 0.0
    found = alternatives._edges(weight, possible)
    assert found == [
        AcceptedRun(0, 0, 0, 0, 0), AcceptedRun(0, 10, 10, 15, 15), AcceptedRun(0, 40, 40, 40, 40),
        AcceptedRun(1, 0, 0, 0, 0), AcceptedRun(1, 40, 40, 40, 40),
    ]  # fmt: skip
