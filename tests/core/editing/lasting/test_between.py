"""Patches that were followed, between the runs that were rejected at their ends."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.editing.lasting import between, search
from ftproc.core.editing.lasting.between import MOST, Between, between_jumps, between_runs, together, trimmed
from ftproc.core.editing.lasting.curves import Curve
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import Scene
from ftproc.simulation import simulate
from tests.core.editing.lasting.scenes import N, scene
from tests.trust import hard

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)
SCREENS = "leaves_curves", "may_leave_curves"
PATCHES = "isolated=0.01:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01"


def found_in(some, jumps=None):
    """What may have been followed between rejected runs where there is a jump of all components at each sample, or at
    these."""
    ways = ((0,), (1,), (2,))
    return together(between_runs(some, [Jump(9.0, k, 0, ways) for k in (range(N) if jumps is None else jumps)], 2))


def test_a_patch_may_lie_between_two_rejected_runs_of_a_component():
    assert found_in(scene((0, 50, 54), (0, 90, 95))) == [[Between(0, 50, 54, 90, 95)]]
    assert found_in(scene((0, 50, 54), (1, 90, 95))) == []
    assert found_in(scene((0, 50, 52), (0, 90, 95))) == []  # two readings are no run
    assert found_in(scene((0, 50, 80), (0, 90, 95))) == []  # less was accepted between them than rejected


def test_the_component_jumps_at_one_of_its_ends_at_least():
    runs = scene((0, 50, 54), (0, 90, 95))
    assert [len(found_in(runs, jumps=[k])) for k in (47, 48, 56, 57, 70, 88, 97, 98)] == [0, 1, 1, 0, 0, 1, 1, 0]


def test_runs_of_several_components_that_coincide_are_weighed_together():
    one, other = Between(0, 50, 54, 90, 95), Between(2, 52, 58, 88, 92)
    found = found_in(scene((0, 50, 54), (0, 90, 95), (2, 52, 58), (2, 88, 92)))
    assert found == [[one], [other], [one, other]]


def test_its_runs_are_patches_of_their_own():
    runs = Between(1, 50, 54, 80, 95).runs()
    assert [each[:3] for each in runs] == [(1, 50, 54), (1, 80, 95)]
    assert [len(each.size) for each in runs] == [1, 3]


def test_of_many_runs_the_nearest_are_weighed():
    runs = [(0, k, k + 3) for k in range(10, 190, 15)]
    found = found_in(scene(*runs))
    assert len(found) == MOST
    assert all(each.end - each.begin == 18 for (each,) in found)


def test_a_patch_may_lie_between_two_jumps_of_a_component():
    all_seen = np.ones((N, 3), bool)
    jumps = [Jump(9.0, 60, 0, ((0,), (3,))), Jump(8.0, 100, 0, ((1,),)), Jump(7.0, 120, 0, ((0, 1),))]
    assert between_jumps(jumps, jumps[2:], 2, all_seen) == [Between(0, 58, 62, 118, 122)]
    assert between_jumps(jumps, jumps[1:2], 2, all_seen) == []
    assert between_jumps(jumps, jumps[2:], 2, all_seen & (abs(np.arange(N)[:, None] - 90) > 10)) == []


def test_it_goes_from_the_largest_jump_in_the_first_run_to_that_in_the_last():
    one = Between(0, 50, 54, 90, 95)
    jumps = [Jump(9.0, 92, 0, ((0,), (3,))), Jump(8.0, 51, 0, ((1,),)), Jump(7.0, 91, 0, ((0,),))]
    assert one.at_jumps(jumps) == one._replace(end=92)


def test_a_curve_ends_with_its_readings_that_are_used():
    weight = scene((0, 50, 54), (0, 88, 95)).log.weight
    curves = [Curve(0, 50, 95, (1.0, 2.0)), Curve(0, 51, 53, (1.0,))]
    assert trimmed(curves, weight) == [Curve(0, 54, 88, (0.0, 0.0)), curves[1]]


@pytest.mark.compiled
@pytest.mark.parametrize(("name", "seed"), [("sine", 0), ("mirror", 2)])
def test_a_patch_that_a_short_memory_follows_is_found(name, seed):
    """An elevation that swings by 170 sigmas for 47 s at 5 Hz, of an aircraft whose filter follows such a motion; and a
    mirror's."""
    dirty = hard.make(name, seed).simulated
    bad = dirty.truth.outlier[:, 2] > 0
    found = two_pass.edit(dirty.log.time_s, dirty.log.measurement, UNKNOWN)
    assert found.weight[bad, 2].mean() < 0.02
    assert found.weight[~bad, 2].mean() > 0.99


@pytest.mark.compiled
def test_two_patches_with_flight_between_them_are_not_one_that_was_followed(monkeypatch):
    """A curve through all three explains more than motion does, but less than a patch at either end; and next to
    nothing where the process noise follows neither."""
    flight = simulate("manoeuvre", seed=261, duration_s=60.0, dt_s=0.1, outliers=PATCHES)

    def error_m():
        found = two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN).smoothed()
        return np.sqrt(((found.state[:, :3] - flight.truth.position_m) ** 2).sum(1).mean())

    assert error_m() < 1.0
    with monkeypatch.context() as without_the_runs:
        without_the_runs.setattr(Between, "runs", lambda self: [])
        assert error_m() < 1.0
        without_the_runs.setattr(search, "instead_of", lambda seen, found: None)
        without_the_runs.setattr(between, "moved", lambda *of: -np.inf)
        for screen in SCREENS:
            without_the_runs.setattr(between, screen, lambda *of: True)
        assert error_m() > 10.0
    for screen in SCREENS:
        monkeypatch.setattr(between, screen, lambda *of: True)
    assert error_m() < 1.0


@pytest.mark.compiled
def test_no_curves_are_weighed_where_nothing_was_followed(monkeypatch):
    """A flight of turns with rejected runs on either side of them, whose process noise is known to be larger there."""
    flight, weighed = simulate("manoeuvre", seed=101, duration_s=120.0, dt_s=0.1, outliers=PATCHES), between.weighed
    few, stretches, each = between.of_few_terms, list[object](), list[object]()
    monkeypatch.setattr(between, "agile", lambda seen: [])
    monkeypatch.setattr(between, "of_few_terms", lambda *of: stretches.append(0) or few(*of))
    monkeypatch.setattr(between, "weighed", lambda *of: each.append(0) or weighed(*of))

    def weighings():
        stretches.clear(), each.clear()
        two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
        assert stretches
        return len(each)

    assert weighings() == 0
    with monkeypatch.context() as without_its_own:
        without_its_own.setattr(Scene, "stretch", lambda scene, near: scene.part(near)._replace(own=None))
        assert weighings() >= 4
    for screen in SCREENS:
        monkeypatch.setattr(between, screen, lambda *of: True)
    assert weighings() > 6 * len(stretches)


@pytest.mark.compiled
@pytest.mark.parametrize("seed", [pytest.param(36, marks=pytest.mark.slow), 42])
def test_a_wave_that_leaves_nothing_where_it_begins_and_ends_is_found(seed):
    """An azimuth of a drone that swings for 52 s, and the range of a fighter, for 22 s: 206 and 66 m off, and
    consistent, where the process noise alone follows them."""
    dirty = hard.make("sine", seed).simulated
    bad = dirty.truth.outlier > 0
    found = two_pass.edit(dirty.log.time_s, dirty.log.measurement, UNKNOWN)
    assert found.weight[bad].mean() < 0.02
    assert found.weight[~bad].mean() > 0.98


@pytest.mark.compiled
def test_no_curves_of_many_terms_are_weighed_where_other_components_show_the_motion_too(monkeypatch):
    flight, stretches, each = simulate("manoeuvre-clean", seed=4, duration_s=60.0), list[object](), list[object]()
    many, weighed = between.of_many_terms, between.weighed
    monkeypatch.setattr(between, "of_many_terms", lambda *of: stretches.append(0) or many(*of))
    monkeypatch.setattr(between, "weighed", lambda *of: each.append(0) or weighed(*of))
    monkeypatch.setattr(between, "of_a_wave", lambda *of: None)
    two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    assert stretches
    assert not each
    monkeypatch.setattr(between, "others_as_usual", lambda *of: True)
    two_pass.edit(flight.log.time_s, flight.log.measurement, UNKNOWN)
    assert len(each) >= len(stretches) / 2


@pytest.mark.compiled
def test_a_patch_in_whose_gap_the_track_is_lost_is_not_left_out():
    """A rocket's azimuths of 28 s, whose ranges of the same time are off: without the azimuths it goes astray by 80 km,
    with them by 2 km."""
    rocket = hard.make("two", 0).simulated
    found = two_pass.edit(rocket.log.time_s, rocket.log.measurement, UNKNOWN).smoothed()
    assert np.abs(found.state[:, :3] - rocket.truth.position_m).max() < 5e3
