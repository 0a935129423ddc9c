"""Alternative hypotheses, where a patch may have been followed."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import alternatives, outlier_chain
from ftproc.core.editing.alternatives import Neighbourhood
from ftproc.core.work import Work
from tests.core.tracks import matched

RATES = np.tile(np.array(outlier_chain.START_RATES), (3, 1))


def followed(component=0, begin=190, end=215, flank=8, sigmas=12.0):
    """A flight with a patch, and decisions that keep it and reject the good readings on both sides."""
    a = matched(4, 400, q=0.5)
    z = a.z.copy()
    z[begin:end, component] += sigmas * np.sqrt(a.model.noise_variance[component])
    wrong, right = a.weight.copy(), a.weight.copy()
    wrong[begin - flank : begin, component] = 0.0
    wrong[end : end + flank, component] = 0.0
    right[begin:end, component] = 0.0
    log = Neighbourhood(a.time, z, np.isfinite(z), a.model, RATES, 4.0)
    return log, wrong, right


@pytest.mark.parametrize("component", range(3))
def test_patch_that_was_followed_is_given_up(component):
    log, wrong, right = followed(component)
    found = alternatives.try_alternatives(log, wrong, alternatives.Search(Work(len(wrong))))
    np.testing.assert_array_equal(found[190:215, component], 0.0)
    assert (found == right).mean() > 0.998


@pytest.mark.compiled
@pytest.mark.parametrize("component", range(3))
def test_far_patch_beside_other_outliers_is_given_up(component):
    """What stands between the decisions and the alternative: isolated outliers among the good readings that were
    rejected, and a patch of unrelated ones next to them."""
    log, wrong, right = followed(component, begin=190, end=215, flank=25, sigmas=150.0)
    noise = np.sqrt(log.model.noise_variance[component])
    for outlier in (170, 178, 221, 233):
        log.measurement[outlier, component] += 60 * noise
        right[outlier, component] = wrong[outlier, component] = 0.0
    log.measurement[240:250, component] += noise * np.array([70, -40, 55, -80, 30, 90, -60, 45, -75, 65])
    right[240:250, component] = wrong[240:250, component] = 0.0
    found = alternatives.try_alternatives(log, wrong, alternatives.Search(Work(len(wrong))))
    np.testing.assert_array_equal(found[165:255, component], right[165:255, component])


def test_accepted_runs_are_tried_once():
    log, wrong, _ = followed()
    search = alternatives.Search(Work(len(wrong)))
    (again,) = alternatives.accepted_runs(log.time_s, wrong, log.possible)
    edges = alternatives._edges(wrong, log.possible)
    search.tried = {again, *edges}
    np.testing.assert_array_equal(alternatives.try_alternatives(log, wrong, search), wrong)
    search.tried = {again._replace(end=again.end - 1), *edges}
    assert (alternatives.try_alternatives(log, wrong, search) != wrong).any()
    assert again in search.tried


def test_the_searches_in_a_log_end_when_its_work_is_done(monkeypatch):
    log, wrong, _ = followed()
    work = Work(len(wrong))
    before, search = work.left, alternatives.Search(work)
    alternatives.try_alternatives(log, wrong, search)
    assert before - 150 * len(wrong) < work.left < before
    assert not search.unexamined
    monkeypatch.setattr(alternatives, "MOST", 0)
    many = alternatives.Search(work)
    alternatives.try_alternatives(log, wrong, many)
    runs = set(alternatives.accepted_runs(log.time_s, wrong, log.possible))
    assert runs <= many.unexamined <= search.tried
    monkeypatch.undo()
    work.left = 0
    another = alternatives.Search(work)
    np.testing.assert_array_equal(alternatives.try_alternatives(log, wrong, another), wrong)
    assert another.unexamined == {*runs, *alternatives._edges(wrong, log.possible)}
    assert not another.tried


def test_the_worst_go_first_and_take_no_good_ones_with_them():
    log, _, right = followed(0)
    all_in = right.copy()
    log.measurement[100, 0] += 30 * np.sqrt(log.model.noise_variance[0])
    steps = alternatives._without_the_worst(log, all_in)
    assert steps[1].weight[100, 0] == 0.0
    assert steps[1].weight[95:106, 0].sum() == 10
    right[100, 0] = 0.0
    np.testing.assert_array_equal(steps[-1].weight, right)


@pytest.mark.parametrize("component", range(3))
def test_hole_is_filled_from_its_edges_and_not_with_the_patch(component):
    log, wrong, right = followed(component, sigmas=40.0)
    steps = alternatives._filled(log, wrong, component, slice(182, 223))
    assert (steps[0].weight[182:223, component] == 0).all()
    amounts = [step.weight[:, component].sum() for step in steps]
    assert amounts == sorted(amounts)
    np.testing.assert_array_equal(steps[-1].weight[190:215, component], 0.0)
    assert (steps[-1].weight == right).mean() > 0.998


@pytest.mark.compiled
@pytest.mark.parametrize("component", range(3))
def test_right_decisions_stay(component):
    log, _, right = followed(component)
    np.testing.assert_array_equal(
        alternatives.try_alternatives(log, right, alternatives.Search(Work(len(right)))), right
    )
    two = right.copy()  # good readings between two real patches are no patch
    two[225:235, component] = 0.0
    log.measurement[225:235, component] += 20 * np.sqrt(log.model.noise_variance[component])
    np.testing.assert_array_equal(alternatives.try_alternatives(log, two, alternatives.Search(Work(len(two)))), two)


def test_accepted_runs_lie_between_two_rejected_runs():
    weight = np.ones((60, 3))
    possible = np.ones((60, 3), bool)
    weight[10:14, 1] = weight[20:23, 1] = 0.0
    weight[30:32, 1] = 0.0  # too short to be a patch
    weight[50:55, 2] = 0.0  # no second run
    possible[16, 1] = False
    weight[4:8, 2] = 0.0
    time = 0.1 * np.arange(60)
    assert alternatives.accepted_runs(time, weight, possible) == [
        (1, 0, 0, 10, 14),
        (1, 10, 14, 20, 23),
        (1, 20, 23, 60, 60),
        (2, 0, 0, 4, 8),
        (2, 4, 8, 50, 55),
        (2, 50, 55, 60, 60),
    ]


def test_accepted_runs_end_at_gaps():
    weight = np.ones((60, 3))
    weight[20:24, 0] = 0.0
    time = 0.1 * np.arange(60)
    time[30:] += 2.0
    assert alternatives.accepted_runs(time, weight, weight > -1) == [(0, 0, 0, 20, 24), (0, 20, 24, 30, 30)]
    time[22:] += 2.0  # within the rejected run it ends nothing
    assert alternatives.accepted_runs(time, weight, weight > -1) == [(0, 0, 0, 20, 24), (0, 20, 24, 30, 30)]


def test_far_apart_runs_have_no_island_between_them():
    weight = np.ones((200, 3))
    weight[60:64, 0] = weight[64 + alternatives.LONGEST + 1 : 120, 0] = 0.0
    assert alternatives.accepted_runs(0.1 * np.arange(200), weight, np.ones((200, 3), bool)) == []


def test_neighbourhood_that_says_too_little_is_left():
    log, wrong, _ = followed()
    log.measurement[:, 2] = np.nan
    log = log._replace(possible=np.isfinite(log.measurement))
    wrong = wrong * log.possible
    np.testing.assert_array_equal(
        alternatives.try_alternatives(log, wrong, alternatives.Search(Work(len(wrong)))), wrong
    )


def test_hole_is_filled_also_where_the_track_is_known_worse_than_the_noise():
    """At long intervals even the readings at its edges are predicted several times worse than they are measured."""
    a = matched(4, 80, dt=4.0, q=5.0)
    hole = slice(30, 50)
    weight = a.weight.copy()
    weight[hole, 0] = 0.0
    log = Neighbourhood(a.time, a.z, np.isfinite(a.z), a.model, RATES, 4.0)
    first, smoothed = alternatives._step(log, weight)
    assert smoothed.residual_variance[hole, 0].min() > (2 * alternatives.SURE) ** 2 * a.model.noise_variance[0]
    steps = alternatives._filled(log, weight, 0, hole)
    np.testing.assert_array_equal(steps[0].weight, first.weight)
    assert steps[-1].weight[hole, 0].sum() >= 18


def test_no_shorter_patch_is_tried_beside_a_run_that_a_longer_one_does_not_make_likely(monkeypatch):
    """Far off the track, the run is no better without its neighbours, however few or many they are."""
    log, _, right = followed(sigmas=100.0)
    tried, step = [], alternatives._step
    monkeypatch.setattr(alternatives, "_step", lambda *of: tried.append(1) or step(*of))
    steps = alternatives._beside(log, right, alternatives.AcceptedRun(0, 190, 190, 215, 215))
    assert max(steps, key=lambda each: each.likelihood) is steps[0]
    assert len(tried) == 3  # as decided, and the longest on either side
