"""Gaps that are too long to follow: one track, about curves from both sides."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.smoother import PATHS, smooth_log
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.core.model.motion import isotropic
from ftproc.methods.bridging import bridged

SIGMA = np.array([0.01, 1e-4, 1e-4])
DT, N, JERK = 0.1, 1500, 1.0


def walker(seed=0):
    """(n,) s, (n, 3) m and readings of somebody who walks to and fro, a hundred metres away."""
    time_s = DT * np.arange(N)
    place = np.stack([60 + 20 * np.sin(time_s / 7), 80 - 25 * np.cos(time_s / 11), 2 + np.sin(time_s / 5)], 1)
    z = from_cartesian(place) + SIGMA * np.random.default_rng(seed).standard_normal((N, 3))
    z[:, 1] = wrap(z[:, 1])
    return time_s, place, z


def with_gap(components, begin=600, end=900, seed=0):
    """The log, its model, its starts, and the truth."""
    time_s, place, z = walker(seed)
    z[begin:end, components] = np.nan
    log = Observations(time_s, z, np.isfinite(z).astype(float))
    model = Model(SIGMA**2, np.tile(isotropic(JERK), (15, 1)), 10.0)
    return log, model, find_starts(log, SIGMA**2, JERK), place


@pytest.mark.parametrize("components", [[0], [1], [2], [0, 2], [0, 1, 2]])
def test_the_track_in_a_gap_is_inside_its_sigmas(components):
    log, model, starts, place = with_gap(components)
    assert len(starts) == 2
    found = bridged(log, model, starts)
    assert found.starts == starts[:1]
    smoothed = found.smoothed(smooth_log(found.log, found.model, found.starts, PATHS))
    off = np.abs(smoothed.state[:, :3] - place)
    assert (off < 5 * smoothed.sigma[:, :3]).all()
    assert off.max() < 25
    alone = np.abs(smooth_log(log, model, starts).state[:, :3] - place)
    assert off.max() < 0.5 * alone.max()


@pytest.mark.parametrize("components", [[0], [1]])
def test_the_filter_does_not_run_away_where_one_component_is_missing(components):
    log, model, starts, place = with_gap(components)
    found = bridged(log, model, starts)
    run = found.filtered(forward.filter_log(found.log, found.model, found.starts))
    off = np.abs(run.state[100:, :3] - place[100:])
    assert (off < 5 * run.sigma[100:, :3]).all()
    assert off.max() < 25


def test_a_log_without_such_a_gap_stays_as_it_is():
    log, model, starts, _ = with_gap([0], 600, 605)
    found = bridged(log, model, starts)
    assert found.log is log
    assert found.model is model
    assert found.starts == starts
    run = forward.filter_log(log, model, starts)
    assert found.filtered(run) is run


def test_readings_of_a_curve_are_no_readings():
    """They have no weight and no innovation; rejected readings have that of what was measured."""
    log, model, starts, _ = with_gap([0])
    rejected = log._replace(measurement=log.measurement.copy())
    rejected.measurement[700, 0] = 500.0
    found = bridged(rejected, model, starts)
    run = found.filtered(forward.filter_log(found.log, found.model, found.starts))
    assert (run.weight[600:900, 0] == 0).all()
    assert np.isfinite(run.innovation[600:900, 0]).tolist() == [k == 700 for k in range(600, 900)]
    assert run.innovation[700, 0] == pytest.approx(500 - np.linalg.norm(run.predicted[700, :3]), abs=1)
    assert found.read.sum() == 300
    smoothed = found.smoothed(smooth_log(found.log, found.model, found.starts))
    assert np.isfinite(smoothed.residual[600:900, 0]).tolist() == [k == 700 for k in range(600, 900)]
    assert smoothed.residual[700, 0] == pytest.approx(500 - np.linalg.norm(smoothed.state[700, :3]), abs=1)


def test_what_no_other_part_of_the_log_tells_is_not_bridged():
    """The component was seen for moments only: nothing shows how far its curve may be off."""
    log, model, starts, _ = with_gap([0], 20, 1480)
    assert len(starts) == 2
    found = bridged(log, model, starts)
    assert found.starts == starts
    assert not found.read.any()


def test_the_sense_of_the_azimuth_does_not_matter_at_its_cut():
    """The same log turned by 130 degrees, so that the gap lies over the cut."""
    log, model, *_ = with_gap([1])
    tracks = []
    for turn in (0.0, 2.27):
        z = log.measurement.copy()
        z[:, 1] = wrap(z[:, 1] + turn)
        turned = log._replace(measurement=z)
        found = bridged(turned, model, find_starts(turned, SIGMA**2, JERK))
        state = smooth_log(found.log, found.model, found.starts).state[:, :3]
        cosine, sine = np.cos(turn), np.sin(turn)
        tracks.append(state @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))
    np.testing.assert_allclose(tracks[0], tracks[1], atol=1e-6)


def test_readings_at_the_edge_of_a_gap_that_belong_to_it_are_rejected():
    """Two readings after it, eighty metres off, that were taken for good."""
    log, _, _, place = with_gap([0])
    log.measurement[900:902, 0] -= 80.0
    model = Model(SIGMA**2, np.tile(isotropic(JERK), (15, 1)), 10.0)
    found = bridged(log, model, find_starts(log, SIGMA**2, JERK))
    assert (found.log.weight[900:902] == [0, 1, 1]).all()
    smoothed = found.smoothed(smooth_log(found.log, found.model, found.starts, PATHS))
    off = np.abs(smoothed.state[:, :3] - place)
    assert (off < 5 * smoothed.sigma[:, :3]).all()
    assert off.max() < 25


def test_the_jerk_that_a_lost_track_asked_for_is_forgotten():
    log, model, starts, _ = with_gap([0])
    wild = model._replace(jerk=model.jerk.copy())
    wild.jerk[6:9] *= 1e6
    found = bridged(log, wild, starts)
    np.testing.assert_array_equal(found.model.jerk, model.jerk)
